"""Names and texts of strangers, before this package uses or shows them.

A file system, the master and a program of a submission take any bytes as a name: quotes, line ends,
escape sequences of a terminal, characters that turn the direction of writing.
"""
import hashlib
import keyword
import re

#: What ROS allows as the name of a package, a type, a field. `\\w` knows more letters than these.
NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]*')
#: Names of files that a folder of marks has itself, or that no file can have.
TAKEN = re.compile(r'|\..*|overview|.*\.marks', re.DOTALL)
#: A name is no longer than this, so that an ending fits behind it [bytes; Linux takes 255].
LONGEST = 180


def is_name(text: str) -> bool:
    """Does ROS allow this as the name of a package, a type or a field, and Python too?"""
    return bool(NAME.fullmatch(text)) and not keyword.iskeyword(text)


def is_type(text: str) -> bool:
    """Is this the name of a type, such as ``lab2/MouseController``?"""
    return len(text.split('/')) == 2 and all(map(is_name, text.split('/')))


def printable(text: str) -> str:
    """The text in one line, in which every character shows; the others are escaped: \\n, \\xfc."""
    return ''.join(char if char.isprintable() else _escaped(char) for char in text)


def _escaped(char: str) -> str:
    if '\udc80' <= char <= '\udcff':    # a byte that is not UTF-8, as os.fsdecode() writes it
        return '\\x{:02x}'.format(ord(char) - 0xdc00)
    return char.encode('unicode_escape').decode()


def file_name(text: str) -> str:
    """A name that a file can have, and a line can show; most names stay as they are."""
    name = printable(text.strip()).replace('/', '_')
    if TAKEN.fullmatch(name):
        name = '_{}_'.format(name)
    data = name.encode()
    if len(data) > LONGEST:
        name = '{}-{}'.format(data[:LONGEST - 9].decode(errors='ignore'),
                              hashlib.sha256(data).hexdigest()[:8])
    return name
