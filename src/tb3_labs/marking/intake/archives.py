"""Copies strangers' folders and zip files, within limits.

A hostile zip file may fill the disk, or write outside of its folder. Therefore submissions.py runs
this code in a process with limits.
"""
import hashlib
import os
import re
import shutil
import stat
import zipfile
import zlib
from pathlib import Path, PurePath
from typing import IO, Dict, List, Sequence, Tuple

from tb3_labs.command_line import printable

ZIP_SUFFIX = '.zip'
UNPACKED_SUFFIX = '.unpacked'       # ends the name of the folder with a zip file's content
# A submission is not judged if its copy exceeds one of these limits.
MAX_FILES = 5000
MAX_SUBMISSION_BYTES = 200 * 10 ** 6
MAX_FOLDER_DEPTH = 50
MAX_COPIED_BYTES = 20 * 10 ** 6     # a larger file is left out
MAX_SHOWN_PATH_LENGTH = 200
#: These folders and files are not a student's work. They are not copied.
IGNORED_PATHS = re.compile(
    r'(^|/)(__MACOSX|\.git|\.svn|__pycache__|\.DS_Store|site-packages|node_modules|'
    r'build|devel|install|logs|\.?venv|[^/]*\.bag)(/|$)', re.IGNORECASE)
#: A damaged zip file, or a zip file with a password, raises one of these errors.
ZIP_ERRORS = (zipfile.BadZipFile, EOFError, RuntimeError, ValueError, zlib.error, OSError)


class NotJudged(Exception):
    """A submission cannot be judged. The exception's text is a sentence with the reason."""

    def __init__(self, reason: str, advice: str = '') -> None:
        """`advice` is a sentence only for the instructor, or ''."""
        super().__init__(reason)
        self.advice = advice


def is_zip(name: str) -> bool:
    """Returns True if `name` is the name of a zip file."""
    return name.lower().endswith(ZIP_SUFFIX)


def files_in(folder: Path) -> List[Path]:
    """Returns the sorted paths of all files below `folder`. Links are left out."""
    return sorted(path for path in folder.rglob('*') if path.is_file() and not path.is_symlink())


def digest_of(folder: Path) -> str:
    """Returns a hash of the names and contents of all files below `folder`."""
    digest = hashlib.sha256()
    for path in files_in(folder):
        digest.update(f'{path.relative_to(folder)} {path.stat().st_size}\n'.encode(
            errors='surrogateescape'))
        digest.update(path.read_bytes())
    return digest.hexdigest()


def copy_submission(original_names: Dict[Path, str], folder: Path) -> List[str]:
    """Make `folder`, copy the files of a submission into it, and unpack the zip files there.
    Returns remarks on files that are left out.

    `original_names` is {file or folder: the file's name on the student's computer}. If several
    files have the same name, only the last of these files is copied. Raises ``NotJudged`` if a zip
    file cannot be unpacked, or if the submission is too large.
    """
    copy = SubmissionCopy(folder)
    files, remarks = _files_to_copy(original_names)
    for path, source in files.items():
        if is_zip(path.name):
            copy.unpack(source, path.with_name(path.stem + UNPACKED_SUFFIX))
            continue
        with open(str(source), 'rb') as opened:
            copy.add_file(opened, path, size=source.stat().st_size,
                          is_executable=os.access(str(source), os.X_OK))
    return remarks + copy.remarks()


def _files_to_copy(original_names):
    """Returns ({path in the copy: file to copy}, remarks on the files that are not copied)."""
    files, remarks = {}, []
    for upload, original_name in original_names.items():
        sources = {Path(original_name): upload}
        if upload.is_dir():
            sources, refused = submitted_files(upload)
            remarks += _omission_remarks('each is a link or a device', refused)
        for path, source in sources.items():
            if path in files:
                remarks.append(f'{printable(str(path))} was handed in again: '
                               f'{printable(upload.name)} counts.')
            files[path] = source
    return files, remarks


def submitted_files(folder: Path) -> Tuple[Dict[Path, Path], List[Path]]:
    """Returns ({path in `folder`: file to copy}, refused paths in `folder`), without IGNORED_PATHS.
    Links and devices are refused. A file with a second name (a hard link) is also refused, because
    the file may belong to another person. Raises ``OSError`` if a folder cannot be read."""
    files: Dict[Path, Path] = {}
    refused: List[Path] = []
    for root, folders, names in os.walk(str(folder), onerror=_raise):
        parent = Path(root).relative_to(folder)
        # os.walk() does not enter the folders that are removed from this list
        folders[:] = sorted(name for name in folders if not IGNORED_PATHS.search(name))
        refused += [parent / name for name in folders if Path(root, name).is_symlink()]
        for name in sorted(name for name in names if not IGNORED_PATHS.search(name)):
            status = Path(root, name).lstat()
            if stat.S_ISREG(status.st_mode) and status.st_nlink <= 1:
                files[parent / name] = Path(root, name)
            else:
                refused.append(parent / name)
    return files, refused


def _raise(problem):
    raise problem


class SubmissionCopy:
    """The copy of a submission. The methods raise ``NotJudged`` if the copy exceeds a limit."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True)
        self._folder = folder
        self._file_count = 0
        self._byte_count = 0
        self._large_files: List[PurePath] = []
        self._links: List[PurePath] = []

    def add_file(self, source: IO[bytes], path: PurePath, size: int, is_executable: bool) -> None:
        """Write a file of `size` [bytes] to `path` in the copy, in place of an older file. A file
        with more than MAX_COPIED_BYTES is left out."""
        if size > MAX_COPIED_BYTES:
            self._large_files.append(path)
            return
        if len(path.parent.parts) > MAX_FOLDER_DEPTH:
            raise NotJudged(f'Its folders are deeper than {MAX_FOLDER_DEPTH}.')
        self._file_count += 1
        self._byte_count += size
        if self._file_count > MAX_FILES or self._byte_count > MAX_SUBMISSION_BYTES:
            raise NotJudged(f'It has more than {MAX_FILES} files, or more than '
                            f'{MAX_SUBMISSION_BYTES / 1e6:g} MB.')
        target = self._folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        with open(str(target), 'wb') as file:
            shutil.copyfileobj(source, file)
        target.chmod(0o755 if is_executable else 0o644)

    def unpack(self, file: Path, folder: PurePath) -> None:
        """Unpack a zip file into a folder of the copy. Raises ``NotJudged`` if the zip file is
        damaged, or if one of its paths leads out of the folder."""
        try:
            with zipfile.ZipFile(str(file)) as archive:
                for entry in archive.infolist():
                    self._add_entry(archive, entry, folder)
        except ZIP_ERRORS as error:
            # str(error) would show the student a path of the marking machine, but strerror does not
            reason = getattr(error, 'strerror', None) or str(error) or type(error).__name__
            raise NotJudged(f'The zip file {printable(file.name)} cannot be unpacked: '
                            f"{reason.rstrip('.')}.") from None

    def _add_entry(self, archive, entry, folder):
        entry.filename = entry.filename.replace('\\', '/')     # Windows may write backslashes
        path = _safe_path(entry.filename)
        if entry.is_dir() or IGNORED_PATHS.search(path):
            return
        unix_mode = entry.external_attr >> 16       # the upper 16 bits contain the mode
        if stat.S_ISLNK(unix_mode):
            self._links.append(folder / path)
            return
        # the size in the zip file can be trusted, because zipfile reads at most this size
        with archive.open(entry) as source:
            self.add_file(source, folder / path, size=entry.file_size,
                          is_executable=bool(unix_mode & stat.S_IXUSR))

    def remarks(self) -> List[str]:
        """Returns remarks on the files that were left out."""
        too_large = f'each is larger than {MAX_COPIED_BYTES / 1e6:g} MB'
        return (_omission_remarks(too_large, self._large_files)
                + _omission_remarks('each is a link', self._links))


def _safe_path(name):
    """Returns the path in the unpacked folder for the entry `name` of a zip file. Raises
    ``NotJudged`` if the path leads out of this folder."""
    parts = [part for part in name.split('/') if part not in ('', '.')]
    # the entry / alone is harmless, and is the first entry in the zip files of some services
    is_absolute = name.startswith('/') and bool(parts)
    has_drive = re.match('[A-Za-z]:/', name)
    if is_absolute or has_drive or '..' in parts:
        raise NotJudged(f'The zip file was not unpacked: its path {name[:80]!r} leads out of it.')
    return '/'.join(parts)


def short_list(names: Sequence[str], max_names: int = 6) -> str:
    """Returns a text with the first `max_names` names and the number of further names."""
    shown_names = ', '.join(names[:max_names])
    further_count = len(names) - max_names
    return f'{shown_names} and {further_count} more' if further_count > 0 else shown_names


def _omission_remarks(reason, paths):
    """Returns a list with one remark on the paths that are left out, or [] if there are none."""
    shown = [printable(path[:MAX_SHOWN_PATH_LENGTH]) for path in sorted(map(str, paths))]
    return [f'Left out, because {reason}: {short_list(shown, max_names=3)}.'] if shown else []
