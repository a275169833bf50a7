"""Unpacks strangers' zip files and lists strangers' folders, within limits.

A zip file may be made to fill the disk, and its paths may lead out of its folder. Therefore a
process with limits runs this code, see read_submission.py.
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
from typing import IO, Dict, Iterable, List, Pattern, Sequence, Tuple

from tb3_labs.command_line import printable

ZIP = '.zip'
#: An unpacked submission has at most MAX_FILES files and MAX_BYTES bytes.
MAX_FILES, MAX_BYTES = 5000, 200000000
#: The limits of a class's zip file are the limits of one submission, multiplied by this number.
SUBMISSIONS_PER_CLASS_ZIP = 50
#: Deeper folders are neither read nor unpacked.
DEEPEST = 50
#: These folders and files are not a student's work. They are neither unpacked nor copied.
IGNORED_PATHS = re.compile(
    r'(^|/)(__MACOSX|\.git|\.svn|__pycache__|\.DS_Store|site-packages|node_modules|'
    r'[^/]*\.bag)(/|$)', re.IGNORECASE)
#: Programs make folders with these names. Such folders are read if no other folder has the node.
GENERATED_FOLDERS = re.compile(r'(^|/)(build|devel|install|logs|\.?venv)(/|$)', re.IGNORECASE)
#: Files with these endings are a package's own files. They are written first.
OWN_ENDINGS = '.py', '.xml', '.msg', '.srv', '.action', ''
#: A damaged entry of a zip file raises one of these errors. The other entries can still be read.
ENTRY_ERRORS = zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, zlib.error
#: These errors come from the disk, and not from the name of a file.
DISK_ERRORS = errno.ENOSPC, errno.EDQUOT, errno.EIO
#: The reasons why an entry is left out.
DUPLICATE, LINK = 'the zip file has it twice, and the last one counts', 'each is a link'
BAD_NAME = 'no file here can have that name'
DAMAGED = 'the zip file is damaged there, or has a password'
#: A remark shows at most this many characters of a path.
MAX_SHOWN_PATH_LENGTH = 200


class NotJudged(Exception):
    """A submission or an archive cannot be judged. The text is the reason, a sentence."""


def is_zip(name: str) -> bool:
    """Does a file's name have the ending of a zip file?"""
    return name.lower().endswith(ZIP)


def files_in(folder: Path) -> List[Path]:
    """Returns the sorted paths of all files below `folder`, without links."""
    return sorted(path for path in folder.rglob('*') if path.is_file() and not path.is_symlink())


def digest(folder: Path) -> str:
    """Returns a hash of the names and contents of all files below `folder`."""
    whole = hashlib.sha256()
    for path in files_in(folder):
        whole.update(f'{path.relative_to(folder)} {path.stat().st_size}\n'.encode(
            errors='surrogateescape'))
        whole.update(path.read_bytes())
    return whole.hexdigest()


def submitted_files(folder: Path, ignored: Pattern[str] = GENERATED_FOLDERS
                    ) -> Tuple[List[Path], List[Path]]:
    """Returns (files to read, refused files and folders) below `folder`. Both lists lack
    the IGNORED_PATHS and the `ignored` folders.

    Links, devices, unreadable files and folders that are too deep are refused. A file with another
    name (a hard link) outside of `folder` is refused too, since it may be another person's file.
    """
    status: Dict[Path, os.stat_result] = {}
    refused: List[Path] = []
    for root, folders, names in os.walk(
            str(folder), onerror=lambda problem: refused.append(Path(problem.filename))):
        here = Path(root)
        folders[:] = sorted(name for name in folders
                            if not IGNORED_PATHS.search(name) and not ignored.search(name))
        refused += [here / name for name in folders if (here / name).is_symlink()]
        if len(here.parts) - len(folder.parts) >= DEEPEST:
            refused += [here / name for name in folders]
            folders.clear()
        for name in sorted(names):
            if not IGNORED_PATHS.search(name):
                try:
                    status[here / name] = (here / name).lstat()
                except OSError:         # the folder cannot be entered
                    refused.append(here / name)
    # if a file has more names (hard links) than were found here, one name is outside of `folder`
    names_here = Counter((found.st_dev, found.st_ino) for found in status.values())
    regular = {path: found for path, found in status.items() if stat.S_ISREG(found.st_mode)}
    files = [path for path, found in regular.items()
             if found.st_nlink <= names_here[found.st_dev, found.st_ino]
             and os.access(str(path), os.R_OK)]
    return files, refused + sorted(set(status) - set(files))


class UnpackLimits:
    """The number of files, and of bytes, that may still be written."""

    def __init__(self, submissions: int = 1) -> None:
        self._submissions = submissions
        self._files, self._bytes = submissions * MAX_FILES, submissions * MAX_BYTES
        #: A sentence on the exceeded limit; '' if no file exceeded a limit.
        self.exceeded = ''

    def spend(self, size: int) -> bool:
        """Count a file. Returns False if the file exceeds a limit. `size` is in bytes."""
        if self._files < 1:
            most = f'{self._submissions * MAX_FILES:g} files'
        elif self._bytes < size:
            most = f'{self._submissions * MAX_BYTES / 1e6:g} MB'
        else:
            self._files -= 1
            self._bytes -= size
            return True
        self.exceeded = f'More than {most}: not all of it was unpacked.'
        return False


def unpack(path: Path, folder: Path, limits: UnpackLimits,
           ignored: Pattern[str] = GENERATED_FOLDERS) -> List[str]:
    """Unpack the zip file `path` into `folder` until the limits are reached. Returns remarks on the
    files that are left out.

    Raises ``NotJudged`` if `path` is not a zip file, or has a path that is not safe. The zip file
    declares each file's size, and zipfile reads no further than this size.
    """
    left_out: Dict[str, List[str]] = {why: [] for why in (DUPLICATE, LINK, BAD_NAME, DAMAGED)}
    try:
        if not zipfile.is_zipfile(str(path)):
            raise zipfile.BadZipFile(_why_not_zip(path))
        with zipfile.ZipFile(str(path)) as archive:
            entries = _wanted_entries(archive, ignored, left_out)
            folder.mkdir(parents=True, exist_ok=True)
            _write_entries(archive, entries, folder, limits, left_out)
        files = [entry_path for entry_path in entries if not entry_path.endswith('/')]
        if files and len(left_out[DAMAGED]) == len(files):
            raise zipfile.BadZipFile('it has a password, or all of it is damaged')
    except (*ENTRY_ERRORS, ValueError, OSError) as problem:
        why = getattr(problem, 'strerror', None) or str(problem).rstrip('.')
        raise NotJudged('The zip file cannot be unpacked: {}.'.format(
            why or type(problem).__name__)) from None
    return [remark for why, paths in left_out.items() for remark in omission_remarks(why, paths)]


def _why_not_zip(path):
    with open(str(path), 'rb') as file:
        begin = file.read(2)
    if not begin:
        return 'it is empty'
    if begin == b'PK':
        return 'its end is missing, as if the upload was cut off'
    return 'it is no zip file, and only zip files are unpacked'


def _wanted_entries(archive, ignored, left_out):
    """Returns path -> entry to write. Links and duplicates are added to `left_out`."""
    wanted = {}
    for info in archive.infolist():
        info.filename = info.filename.replace('\\', '/')     # Windows may write backslashes
        entry_path = _safe_path(info.filename)
        if entry_path == '/' or IGNORED_PATHS.search(entry_path) or ignored.search(entry_path):
            continue
        if stat.S_ISLNK(info.external_attr >> 16):
            left_out[LINK].append(entry_path)
            continue
        if entry_path in wanted and not entry_path.endswith('/'):
            left_out[DUPLICATE].append(entry_path)
        wanted[entry_path] = info        # other programs use the last entry too
    return wanted


def _write_entries(archive, entries, folder, limits, left_out):
    """Write the entries below `folder`. Paths that cannot be written are added to `left_out`."""
    for entry_path, info in sorted(
            entries.items(), key=lambda item: writing_order(item[0], item[1].file_size)):
        if not limits.spend(info.file_size):
            continue
        target = folder / entry_path
        if entry_path.endswith('/'):
            with suppress(OSError):     # each file in this folder gets a remark
                target.mkdir(parents=True, exist_ok=True)
            continue
        is_executable = bool(info.external_attr >> 16 & 0o100)
        try:
            with archive.open(info) as source:
                if not write_file(source, target, is_executable):
                    left_out[BAD_NAME].append(entry_path)
        except ENTRY_ERRORS:
            left_out[DAMAGED].append(entry_path)
            with suppress(OSError):
                target.unlink()     # an incomplete file


def _safe_path(name):
    """Returns an entry's path in the unpacked folder. The path of a folder ends in /. Raises
    ``NotJudged`` if the path leads out of the unpacked folder, or is too deep."""
    parts = [part for part in name.split('/') if part not in ('', '.')]
    if len(parts) > DEEPEST + 1:
        raise NotJudged(f'The zip file was not unpacked: its folders are deeper than {DEEPEST}.')
    # some services begin their zip files with the folder /
    is_absolute = name.startswith('/') and bool(parts)
    has_drive = re.match('[A-Za-z]:/', name) is not None
    if is_absolute or has_drive or '..' in parts:
        raise NotJudged(f'The zip file was not unpacked: its path {name[:80]!r} leads out of it.')
    path = '/'.join(parts)
    return path + '/' if name.endswith('/') else path


def write_file(source: IO[bytes], target: Path, is_executable: bool) -> bool:
    """Write a new file, and make its folder. Returns False if no file here can have this name."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        file = open(str(target), 'xb')
    except OSError as problem:
        if problem.errno in DISK_ERRORS:
            raise
        return False
    with file:
        shutil.copyfileobj(source, file)
    target.chmod(0o755 if is_executable else 0o644)
    return True


def writing_order(path: str, size: int) -> Tuple[bool, bool, int, int, str]:
    """Returns a key that sorts a package's own files first, because a limit may end the writing.
    `size` is in bytes."""
    return (bool(GENERATED_FOLDERS.search(path)),
            os.path.splitext(path)[1].lower() not in OWN_ENDINGS, path.count('/'), size, path)


def shortened(names: Sequence[str], most: int = 6) -> str:
    """Returns a line with at most `most` names, and the number of the other names."""
    more = f' and {len(names) - most} more' if len(names) > most else ''
    return ', '.join(names[:most]) + more


def omission_remarks(why: str, paths: Iterable[object]) -> List[str]:
    """Returns a list with one remark, that these paths are left out; [] if there are no paths."""
    shown = [printable(path[:MAX_SHOWN_PATH_LENGTH]) for path in sorted(map(str, paths))]
    return [f'Left out, because {why}: {shortened(shown, 3)}.'] if shown else []
