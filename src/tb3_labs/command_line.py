"""The command lines and the output files of tools. A wrong argument gives one line of text."""
import argparse
import errno
import os
import secrets
import signal
from pathlib import Path
from typing import Any, Union


class Parser(argparse.ArgumentParser):
    """Python's parser. A wrong argument gives one line, and --job does not mean --jobs."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        # a script's background job ignores SIGINT, but SIGINT must end a tool
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def error(self, message: str):
        """End the program with status 2, and the reason."""
        self.exit(2, f'{self.prog}: {printable(message)}; --help tells more\n')


def number_or_text(word: str) -> Union[float, str]:
    """Returns the number in `word`. Without a number, returns `word`, which a Config refuses."""
    try:
        return float(word)
    except ValueError:
        return word


def output_folder(path: Union[str, Path]) -> Path:
    """Returns the folder for a tool's output. A missing folder is made. ``OSError`` if the folder
    cannot be made, or if it is a link, because a student's files may have links."""
    folder = Path(str(path))
    if folder.is_symlink():
        raise OSError(errno.ELOOP, 'it is a link to another folder', str(folder))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def write_output(path: Union[str, Path], content: Union[str, bytes]) -> None:
    """Write a whole file. ``OSError`` if the file cannot be written. A text is written as UTF-8.

    The content goes into a new file, which is then renamed to `path`. So an interruption keeps the
    old file. If `path` is a link, the link is replaced, and its target stays the same.
    """
    path = Path(str(path))
    if isinstance(content, str):
        content = content.encode('utf-8', errors='backslashreplace')
    part = path.with_name(f'.{secrets.token_hex(8)}.part')
    try:
        with open(str(part), 'xb') as file:     # x: fails if the file, or a link, exists
            file.write(content)
        os.replace(str(part), str(path))
    finally:
        part.unlink(missing_ok=True)    # the part exists only after a failure


def failure_text(problem: BaseException) -> str:
    """Returns the reason for a failure in one line, also with the file's name if it is known."""
    if isinstance(problem, OSError) and problem.filename is not None and problem.strerror:
        return f'{problem.filename}: {problem.strerror}'
    if isinstance(problem, FileNotFoundError):    # only the error of os.getcwd() has no file name
        return 'the current folder was deleted: go to another one, such as cd ~'
    return ' '.join(str(problem).split())


def printable(text: str) -> str:
    """Returns the text in one line. Characters that are not printable are escaped, such as \\n."""
    def escaped(char: str) -> str:
        if '\udc80' <= char <= '\udcff':    # os.fsdecode() gives this for a byte that is not UTF-8
            return f'\\x{ord(char) - 0xdc00:02x}'
        return char if char.isprintable() else char.encode('unicode_escape').decode()
    return ''.join(map(escaped, text))
