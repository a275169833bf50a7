"""Files of strangers: zip files are unpacked, folders are read, within a budget of files and bytes,
without links and devices.

A zip file may be a bomb, or have paths that lead out of it: read_submission.py does this in a
process of its own.
"""
import errno
import hashlib
import os
import re
import shutil
import stat
import zipfile
import zlib
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import IO, Dict, Iterable, List, Optional, Pattern, Sequence, Tuple

from tb3_labs.command_line import printable

ZIP = '.zip'
#: A submission, unpacked, has at most MOST_FILES files and MOST_BYTES bytes.
MOST_FILES, MOST_BYTES = 5000, 200000000
#: The zip file of a class may hold as much as this number of submissions.
CLASS = 50
#: Folders are nested at most this deep.
DEEPEST = 50
#: Folders and files that are not a student's work: they are neither unpacked nor copied.
NEVER = re.compile(r'(^|/)(__MACOSX|\.git|\.svn|__pycache__|\.DS_Store|site-packages|node_modules|'
                   r'[^/]*\.bag)(/|$)', re.IGNORECASE)
#: Folders of these names are usually made by programs: they are read if the node is nowhere else.
MADE = re.compile(r'(^|/)(build|devel|install|logs|\.?venv)(/|$)', re.IGNORECASE)
#: The first bytes of files that are called zip files, and what they are.
OTHERS = {b'7z\xbc\xaf': 'a 7z file', b'Rar!': 'a rar file', b'\x1f\x8b': 'a gz file',
          b'BZh': 'a bz2 file', b'\xfd7zXZ': 'an xz file', b'<': 'a page of the web',
          b'': 'no zip file'}
#: Endings of a package's own files, which are unpacked first.
OWN_ENDINGS = '.py', '.xml', '.msg', '.srv', '.action', ''
#: Endings of archives that are not unpacked. A zip file is not unpacked within a zip file.
OTHER_ARCHIVES = (ZIP, '.rar', '.7z', '.tar', '.gz', '.tgz', '.xz', '.bz2')
#: Errors of one entry of a zip file; the others may be read.
OF_AN_ENTRY = zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, zlib.error
#: Why a file is left out; a line quotes so much of its place.
TWICE, LINK = 'the zip file has it twice, and the last one counts', 'each is a link'
NO_NAME, LONGEST_SAID = 'no file here can have that name', 200
DAMAGED = 'the zip file is damaged there, or has a password'


class NotJudged(Exception):
    """A submission, or an archive, cannot be judged; the text is the reason, a sentence."""


def is_zip(name: str) -> bool:
    """Is a file of this name called a zip file?"""
    return name.lower().endswith(ZIP)


def files_in(folder: Path) -> List[Path]:
    """Returns the paths of all files below `folder`, in order, without links."""
    return sorted(path for path in folder.rglob('*') if path.is_file() and not path.is_symlink())


def digest(folder: Path) -> str:
    """Returns a hash of all files in the copy of a submission."""
    whole = hashlib.sha256()
    for path in files_in(folder):
        whole.update(f'{path.relative_to(folder)} {path.stat().st_size}\n'.encode(
            errors='surrogateescape'))
        whole.update(path.read_bytes())
    return whole.hexdigest()


def sort_out(folder: Path, skipped: Pattern[str] = MADE) -> Tuple[List[Path], List[Path]]:
    """(Files, others) below a folder, without NEVER and the files that are `skipped`.

    `others`: links, devices, folders that are too deep, and unreadable files. A file that
    has a second name outside of the folder (a hard link) is treated as a link: it may be another
    person's.
    """
    found: Dict[Path, os.stat_result] = {}
    others: List[Path] = []
    for root, folders, names in os.walk(
            str(folder), onerror=lambda problem: others.append(Path(problem.filename))):
        folders[:] = sorted(name for name in folders
                            if not NEVER.search(name) and not skipped.search(name))
        others += [path for path in map(Path(root).joinpath, folders) if path.is_symlink()]
        if len(Path(root).parts) - len(folder.parts) >= DEEPEST:
            others += [Path(root) / name for name in folders]
            folders.clear()
        for path in map(Path(root).joinpath, sorted(names)):
            if not NEVER.search(path.name):
                try:
                    found[path] = path.lstat()
                except OSError:         # the folder's names may be read, its files may not
                    others.append(path)
    names_of = Counter((about.st_dev, about.st_ino) for about in found.values())
    files = [path for path, about in found.items() if stat.S_ISREG(about.st_mode)
             and about.st_nlink <= names_of[about.st_dev, about.st_ino]
             and os.access(str(path), os.R_OK)]
    return files, others + sorted(set(found) - set(files))


class UnpackLimits:
    """The number of files and bytes that submissions may still have."""

    def __init__(self, submissions: int = 1) -> None:
        self._times = submissions
        self._files, self._bytes = submissions * MOST_FILES, submissions * MOST_BYTES
        #: A sentence if a file had no room; else ''.
        self.exceeded = ''

    def spend(self, size: int) -> bool:
        """Take room for a file of `size` [bytes]. Returns False if there is none."""
        for wanted, left, most, unit in ((1, self._files, MOST_FILES, 'files'),
                                         (size, self._bytes, MOST_BYTES / 1e6, 'MB')):
            if wanted > left:
                self.exceeded = 'More than {:g} {}: not all of it was unpacked.'.format(
                    self._times * most, unit)
                return False
        self._files, self._bytes = self._files - 1, self._bytes - size
        return True


def unpack(path: Path, folder: Path, limits: UnpackLimits,
           skipped: Pattern[str] = MADE) -> List[str]:
    """Unpack the zip file `path` into `folder`, as far as the budget reaches; remarks on files that
    were left out.

    ``NotJudged`` if it is not a zip file, or must not be unpacked. No file becomes larger than the
    zip file declares: zipfile reads no further.
    """
    wanted: Dict[str, zipfile.ZipInfo] = {}
    left: Dict[str, List[str]] = {why: [] for why in (TWICE, LINK, NO_NAME, DAMAGED)}
    try:
        if not zipfile.is_zipfile(str(path)):
            raise zipfile.BadZipFile(_kind(path))
        with zipfile.ZipFile(str(path)) as archive:
            for info in archive.infolist():
                place = _place(info)
                if place == '/' or NEVER.search(place) or skipped.search(place):
                    pass
                elif stat.S_ISLNK(info.external_attr >> 16):
                    left[LINK].append(place)
                else:
                    if place in wanted and not place.endswith('/'):
                        left[TWICE].append(place)
                    wanted[place] = info        # every program uses the last entry
            folder.mkdir(parents=True, exist_ok=True)
            for place, info in sorted(wanted.items(), key=lambda item: budget_order(
                    item[0], item[1].file_size)):
                if limits.spend(info.file_size):
                    try:
                        with archive.open(info) as source:
                            if not write(None if place.endswith('/') else source,
                                         folder / place, info.external_attr >> 16 & 0o100):
                                left[NO_NAME].append(place)
                    except OF_AN_ENTRY:
                        left[DAMAGED].append(place)
                        with suppress(OSError):
                            (folder / place).unlink()       # a part of it
        if left[DAMAGED] and len(left[DAMAGED]) == sum(place[-1:] != '/' for place in wanted):
            raise zipfile.BadZipFile('it has a password, or all of it is damaged')
    except (*OF_AN_ENTRY, ValueError, OSError) as problem:
        raise NotJudged('The zip file cannot be unpacked: {}.'.format(
            getattr(problem, 'strerror', None) or str(problem).rstrip('.')
            or type(problem).__name__)) from None
    return [remark for why, places in left.items() for remark in left_out(why, places)]


def _kind(path):
    """The fault of a file that is called a zip file, a clause."""
    with open(str(path), 'rb') as file:
        data = file.read(512)
    if not data or data.startswith(b'PK'):
        return 'its end is missing, as if the upload was cut off' if data else 'it is empty'
    kind = 'a tar file' if data[257:262] == b'ustar' else next(
        kind for start, kind in OTHERS.items() if data.startswith(start))
    return f'it is {kind}, and only zip files are unpacked'


def _place(info):
    """The place of an archive's file; it ends in / for a folder. ``NotJudged`` if its path leads
    out of the folder. Windows writes \\ for /."""
    path = info.filename = info.filename.replace('\\', '/')
    parts = [part for part in path.split('/') if part not in ('', '.')]
    if len(parts) > DEEPEST + 1:
        raise NotJudged(f'The zip file was not unpacked: its folders are deeper than {DEEPEST}.')
    # some services begin their zip files with the folder /
    if parts and path.startswith('/') or re.match('[A-Za-z]:/', path) or '..' in parts:
        raise NotJudged(f'The zip file was not unpacked: its path {path[:80]!r} leads out of it.')
    return '/'.join(parts) + '/' * path.endswith('/')


# -- copies

def shortened(names: Sequence[str], most: int = 6) -> str:
    """The names in one line: at most so many, and how many are left out."""
    more = f' and {len(names) - most} more' if len(names) > most else ''
    return ', '.join(names[:most]) + more


def left_out(why: str, left: Iterable[object]) -> List[str]:
    """A remark that these files were left out, if there are any."""
    places = [printable(place[:LONGEST_SAID]) for place in sorted(map(str, left))]
    return [f'Left out, because {why}: {shortened(places, 3)}.'] if places else []


def budget_order(place: str, size: int) -> Tuple[bool, bool, int, int, str]:
    """A key by which files take their part of the budget: a package's own files first."""
    return (bool(MADE.search(place)), os.path.splitext(place)[1].lower() not in OWN_ENDINGS,
            place.count('/'), size, place)


def write(source: Optional[IO[bytes]], target: Path, executable: int) -> bool:
    """Write a new file, or a folder if `source` is None. Returns False if none can have its name.
    """
    try:
        (target.parent if source else target).mkdir(parents=True, exist_ok=True)
        file = open(str(target), 'xb') if source else None
    except OSError as problem:
        if problem.errno in (errno.ENOSPC, errno.EDQUOT, errno.EIO):
            raise
        return False
    if source and file:
        with file:
            shutil.copyfileobj(source, file)
        target.chmod(0o755 if executable else 0o644)
    return True
