"""Which files of an archive are unpacked, and which archives are refused.

A submission is a stranger's: its archive may be a bomb, or lead out of the folder it is for.
"""
import re
from typing import Iterable, NamedTuple

#: An archive has no more files than this, and no more bytes when it is unpacked.
MOST_FILES, MOST_BYTES = 5000, 200000000
#: Folders and files that are not unpacked: nobody's work.
LEFT_OUT = re.compile(r'(^|/)(__MACOSX|\.git|\.svn|build|devel|__pycache__|\.DS_Store|[^/]*\.bag)'
                      r'(/|$)', re.IGNORECASE)


class Refused(Exception):
    """An archive is not unpacked; the text is the reason, one sentence."""


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
    if path.startswith('/') or re.match('[A-Za-z]:', path) or '..' in path.split('/'):
        raise Refused('The zip file was not unpacked: its path {!r} leads out of it.'.format(
            entry.name[:80]))
    return '' if entry.is_link or LEFT_OUT.search(path) else path


def check(entries: Iterable[Entry]) -> None:
    """``Refused`` if an archive with these files is not unpacked at all."""
    wanted = [entry for entry in entries if path_in(entry)]
    if any(entry.is_encrypted for entry in wanted):
        raise Refused('The zip file was not unpacked: it has a password.')
    if len(wanted) > MOST_FILES:
        raise Refused('The zip file was not unpacked: it has {} files (up to {}).'.format(
            len(wanted), MOST_FILES))
    too_large(sum(entry.size for entry in wanted))


def too_large(size: int) -> None:
    """``Refused`` if this is more than an archive may hold [bytes]."""
    if size > MOST_BYTES:
        raise Refused('The zip file was not unpacked: it holds {:.0f} MB or more (up to {:.0f})'
                      '.'.format(size / 1e6, MOST_BYTES / 1e6))
