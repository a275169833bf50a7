"""Which files of an archive are unpacked, and which archives are refused.

A submission is a stranger's: its archive may be a bomb, or lead out of the folder it is for.
"""
import re
from typing import Iterable, NamedTuple

#: A submission has no more files than this, and no more bytes, when everything in it is unpacked.
MOST_FILES, MOST_BYTES = 5000, 200000000
#: Folders are no deeper than this.
DEEPEST = 50
#: Folders and files that are not unpacked: nobody's work.
LEFT_OUT = re.compile(r'(^|/)(__MACOSX|\.git|\.svn|build|devel|__pycache__|\.DS_Store|[^/]*\.bag)'
                      r'(/|$)', re.IGNORECASE)


class Refused(Exception):
    """An archive is not unpacked; the text is the reason, one sentence."""


class Budget:
    """The room that is left for one submission, whatever number of archives it comes in."""

    def __init__(self) -> None:
        self.files, self.bytes = MOST_FILES, MOST_BYTES

    def take(self, files: int, size: int) -> None:
        """Take room for files of this size together [bytes]; ``Refused`` if there is less."""
        self.check(files, size)
        self.files, self.bytes = self.files - files, self.bytes - size

    def check(self, files: int, size: int) -> None:
        """``Refused`` if there is less room."""
        for wanted, left, most, unit in ((files, self.files, MOST_FILES, 'files'),
                                         (size, self.bytes, MOST_BYTES / 1e6, 'MB')):
            if wanted > left:
                raise Refused('More than {:g} {}: not all of it was unpacked.'.format(most, unit))


class Entry(NamedTuple):
    """One file of an archive."""

    name: str
    size: int                   # unpacked [bytes]
    is_link: bool = False
    is_encrypted: bool = False


def path_in(entry: Entry) -> str:
    """Where this file is put, relative to the folder of the archive; '' if it is left out.

    ``Refused`` for a path that leads out of the folder. Windows writes \\ for /.
    """
    path = entry.name.replace('\\', '/')
    if path.count('/') > DEEPEST:
        raise Refused('The zip file was not unpacked: its folders are deeper than {}.'.format(
            DEEPEST))
    if path.startswith('/') or re.match('[A-Za-z]:', path) or '..' in path.split('/'):
        raise Refused('The zip file was not unpacked: its path {!r} leads out of it.'.format(
            entry.name[:80]))
    return '' if entry.is_link or LEFT_OUT.search(path) else path


def check(entries: Iterable[Entry], budget: Budget) -> None:
    """``Refused`` if an archive with these files is not unpacked at all."""
    wanted = [entry for entry in entries if path_in(entry)]
    if any(entry.is_encrypted for entry in wanted):
        raise Refused('The zip file was not unpacked: it has a password.')
    budget.check(len(wanted), sum(entry.size for entry in wanted))
