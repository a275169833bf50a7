"""The command line of a tool: a refusal is one line, and no output goes through a link.

    mark.py: argument --lab: invalid choice: 'trun' (choose from imu, turn); is turn meant?
"""
import argparse
import difflib
import errno
import os
import re
import secrets
import signal
from pathlib import Path
from typing import Any, Callable, Sequence, Union


class Parser(argparse.ArgumentParser):
    """Python's parser, but a refusal is one line, --job is refused, and a refused word comes with
    the one that is probably meant."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        # `&` in a script ignores SIGINT; a tool ends by it nevertheless, as a node does
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def parse_args(self, args=None, namespace=None):
        given, extra = self.parse_known_args(args, namespace)
        if extra:
            self.error(' '.join(['unrecognized arguments:', *extra]) if '-' in ''.join(
                word[:1] for word in extra) else '{}meant: {}'.format(surplus(extra), ', '.join(
                    'one {}; given: {}'.format(each.metavar or each.dest, getattr(given, each.dest))
                    for each in self._get_positional_actions()) or 'options alone'))
        return given

    def error(self, message: str):
        """End the program with status 2, and the reason."""
        typed, _, known = message.partition('invalid choice: ')[2].partition(' (choose from ')
        near = difflib.get_close_matches(typed, re.findall(r'[^\s,()]+', known), 1)
        self.exit(2, '{}: {}; {}\n'.format(
            self.prog, printable(message), 'is {} meant?'.format(near[0].strip("'")) if near else
            '--help tells more'))


def surplus(words: Sequence[str]) -> str:
    """Returns the begin of a refusal of these words, which are too many; '' without a word."""
    more = ' and {} more'.format(len(words) - 3) * (len(words) > 3)
    return ', '.join(words[:3]) + more + ': too much; ' if words else ''


def number_or_text(word: str) -> Union[float, str]:
    """Returns the number that was typed; any other text stays, and a Config refuses it."""
    try:
        return float(word)
    except ValueError:
        return word


def whole_number(most: int) -> Callable[[str], int]:
    """Returns the `type` of an argument that takes 1, 2, ... Larger than `most` is refused."""
    def read(word: str) -> int:
        # int() refuses thousands of digits with another text
        if not (word.isdecimal() and len(word) < 10 and 1 <= int(word) <= most):
            raise argparse.ArgumentTypeError(
                '{:.40} is not valid: a whole number from 1 to {}'.format(repr(word), most))
        return int(word)
    return read


def output_folder(path: Union[str, Path]) -> Path:
    """Make the folder for a tool's output if it is missing, and return it. ``OSError`` if it cannot
    be made, or if it is a link: a stranger's files may hold one."""
    folder = Path(str(path))
    if folder.is_symlink():
        raise OSError(errno.ELOOP, 'it is a link to another folder', str(folder))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def write_output(path: Union[str, Path], content: Union[str, bytes]) -> None:
    """Write a whole file: a new file beside it is renamed over it, so that an interruption leaves
    the old content. A link at `path` is replaced; the file to which it points stays as it is. A
    text is written as UTF-8. ``OSError`` if the file cannot be written."""
    path = Path(str(path))
    if isinstance(content, str):
        content = content.encode('utf-8', errors='backslashreplace')
    part = path.with_name('.{}.part'.format(secrets.token_hex(8)))
    try:
        with open(str(part), 'xb') as file:     # x: a new one, never an existing link
            file.write(content)
        os.replace(str(part), str(path))
    finally:
        part.unlink(missing_ok=True)    # it is there only after a failure


def reason(problem: BaseException) -> str:
    """The reason of a failure, in one line. If a file is the problem, its name comes first."""
    if isinstance(problem, OSError) and problem.filename is not None and problem.strerror:
        return '{}: {}'.format(problem.filename, problem.strerror)
    if isinstance(problem, FileNotFoundError):    # only the error of os.getcwd() has no name
        return 'the current folder was deleted: go to another one, such as cd ~'
    return ' '.join(str(problem).split())


def printable(text: str) -> str:
    """The text in one line. Characters that do not show are escaped: \\n, \\xfc."""
    # from U+DC80 on: a byte that is not UTF-8, as os.fsdecode() writes it
    return ''.join(char if char.isprintable() else '\\x{:02x}'.format(ord(char) - 0xdc00) if (
        '\udc80' <= char <= '\udcff') else char.encode('unicode_escape').decode() for char in text)
