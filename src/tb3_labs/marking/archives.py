"""Unpacks the zip file of a submission: which files of it, and which zip files are refused.

A zip file may be a bomb, or lead out of the folder that it is for.
"""
import os
import re
import stat
import zipfile
from datetime import datetime
from pathlib import Path
from typing import Optional

#: A submission has no more files than this, and no more bytes, when everything in it is unpacked.
MOST_FILES, MOST_BYTES = 5000, 200000000
#: Folders are no deeper than this.
DEEPEST = 50
#: Folders and files that are not unpacked, nor copied: nobody's work.
LEFT_OUT = re.compile(r'(^|/)(__MACOSX|\.git|\.svn|build|devel|install|logs|__pycache__|\.DS_Store|'
                      r'[^/]*\.bag)(/|$)', re.IGNORECASE)
#: This much is read at a time [bytes].
PIECE = 1 << 20
ENCRYPTED = 1       # a bit of a file's flags


class Refused(Exception):
    """A zip file is not unpacked; the text is the reason, one sentence."""


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


def unpack(path: Path, folder: Path, budget: Budget) -> None:
    """Unpack the zip file `path` into `folder`, which is made if need be.

    ``Refused`` if it is not a zip file, or one that is not unpacked. The sizes that it declares may
    be wrong: the bytes that come out are counted as well.
    """
    try:
        with zipfile.ZipFile(str(path)) as archive:
            files = [info for info in archive.infolist() if not info.filename.endswith('/')]
            wanted = [info for info in files if _path_of(info)]
            if any(info.flag_bits & ENCRYPTED for info in wanted):
                raise Refused('The zip file was not unpacked: it has a password.')
            budget.check(len(wanted), sum(info.file_size for info in wanted))
            for info in wanted:
                _unpack_file(archive, info, folder / _path_of(info), budget)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, ValueError,
            OSError) as problem:
        raise Refused('The zip file cannot be unpacked: {}.'.format(
            str(problem).rstrip('.') or type(problem).__name__)) from None


def newest_in(path: Path) -> Optional[datetime]:
    """When the newest file in a zip file was changed; None if that is not known."""
    try:
        with zipfile.ZipFile(str(path)) as archive:
            times = [info.date_time for info in archive.infolist() if not info.is_dir()
                     and _path_of(info)]
        return datetime(*max(times)) if times else None
    except (zipfile.BadZipFile, OSError, ValueError, Refused):
        return None


def _path_of(info):
    """Where this file is put, relative to the folder of the archive; '' if it is left out.

    ``Refused`` for a path that leads out of the folder. Windows writes \\ for /.
    """
    path = info.filename.replace('\\', '/')
    if path.count('/') > DEEPEST:
        raise Refused('The zip file was not unpacked: its folders are deeper than {}.'.format(
            DEEPEST))
    if path.startswith('/') or re.match('[A-Za-z]:', path) or '..' in path.split('/'):
        raise Refused('The zip file was not unpacked: its path {!r} leads out of it.'.format(
            info.filename[:80]))
    is_link = stat.S_ISLNK(info.external_attr >> 16)
    return '' if is_link or LEFT_OUT.search(path) else path


def _unpack_file(archive, info, target, budget):
    budget.take(1, 0)
    target.parent.mkdir(parents=True, exist_ok=True)
    with archive.open(info) as source, open(str(target), 'wb') as file:
        for piece in iter(lambda: source.read(PIECE), b''):
            budget.take(0, len(piece))
            file.write(piece)
    if (info.external_attr >> 16) & 0o100:
        os.chmod(str(target), 0o755)
