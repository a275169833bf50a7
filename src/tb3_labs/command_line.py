"""Reads the command lines of tools and writes their output files."""
import argparse
import errno
import secrets
import signal
from pathlib import Path
from typing import Any, Union


class Parser(argparse.ArgumentParser):
    """A parser that refuses abbreviated options and reports a wrong argument in one line."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, **options)
        # without this, a tool in the background of a script ignores SIGINT
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def error(self, message: str):
        """Print the reason and end the program with status 2."""
        self.exit(2, f'{self.prog}: {printable(message)}; --help tells more\n')


def number_or_text(word: str) -> Union[float, str]:
    """Returns `word` as a number, or the unchanged `word`, which a Config then refuses."""
    try:
        return float(word)
    except ValueError:
        return word


def output_folder(path: Union[str, Path]) -> Path:
    """Make the folder for a tool's output if it is missing. Returns its Path. Raises ``OSError`` if
    the folder cannot be made, or if it is a link, because a link may lead to any other folder."""
    folder = Path(path)
    if folder.is_symlink():
        raise OSError(errno.ELOOP, 'it is a link to another folder', str(folder))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def write_output(path: Union[str, Path], content: Union[str, bytes]) -> None:
    """Write a whole file, with text as UTF-8. Raises ``OSError`` if the file cannot be written. If
    the program is interrupted, the old file stays. A link is replaced, and its target is not."""
    path = Path(path)
    if isinstance(content, str):
        content = content.encode('utf-8', errors='backslashreplace')
    new_file = path.with_name(f'.{secrets.token_hex(8)}.part')
    try:
        with new_file.open('xb') as file:    # mode x fails if the file exists
            file.write(content)
        new_file.replace(path)
    finally:
        new_file.unlink(missing_ok=True)    # after a failure the new file still exists


def error_text(error: BaseException) -> str:
    """Returns an exception's text in one line, with the file's name if it is known."""
    if isinstance(error, OSError) and error.filename is not None and error.strerror:
        return f'{error.filename}: {error.strerror}'
    if isinstance(error, FileNotFoundError):    # the error of os.getcwd() names no file
        return 'the current folder was deleted: go to another one, such as cd ~'
    return ' '.join(str(error).split())


def printable(text: str) -> str:
    """Returns the text in one line. A character that cannot be printed is escaped, such as \\n."""
    def escaped(char: str) -> str:
        if '\udc80' <= char <= '\udcff':    # os.fsdecode() made `char` from an invalid byte
            return f'\\x{ord(char) - 0xdc00:02x}'
        return char if char.isprintable() else char.encode('unicode_escape').decode()
    return ''.join(map(escaped, text))
