"""The submissions as they come: folders and zip files, as learning platforms hand them out.

Moodle: ``Ann Miller_12345_assignsubmission_file_`` (a folder), or the same with a file's name
behind it. Canvas: ``millerann_12345_67890_lab2.zip``, with ``_LATE`` after the name of a late one,
and ``lab2-1.zip`` for a file that was handed in again. Names may be any bytes: each is checked.

The files that were handed in are neither changed nor run. They are copied, or unpacked, once,
within a budget of files and bytes, without links and devices. A zip file may be a bomb, or have
paths that lead out of it: reading.py does this in a process of its own.
"""
import difflib
import hashlib
import os
import re
import shutil
import stat
import zipfile
import zlib
from collections import Counter
from pathlib import Path
from typing import Callable, Dict, Iterable, List, NamedTuple, Tuple

from tb3_labs.command_line import printable
from tb3_labs.marking.intake.packages import NotJudged, shortened

MOODLE = re.compile(r'(?P<student>.+?)_(?P<number>\d+)_assignsubmission_[a-z]+_?(?P<file>.*)')
CANVAS = re.compile(r'(?P<student>[^_]+)(?:_late)?_(?P<number>\d+)_\d+_(?P<file>.+)',
                    re.IGNORECASE)
#: The number that Canvas adds to the name of a file that was handed in again.
AGAIN = re.compile(r'-\d+(?=\.\w+$)')
ZIP = '.zip'
#: A submission, unpacked, has at most MOST_FILES files and MOST_BYTES bytes.
MOST_FILES, MOST_BYTES = 5000, 200000000
#: The zip file of a class may hold as much as this number of submissions.
CLASS = 50
#: Folders are nested at most this deep.
DEEPEST = 50
#: Folders and files that are not a student's work: they are neither unpacked nor copied.
LEFT_OUT = re.compile(r'(^|/)(__MACOSX|\.git|\.svn|build|devel|install|logs|__pycache__|\.DS_Store|'
                      r'\.?venv|site-packages|node_modules|[^/]*\.bag)(/|$)', re.IGNORECASE)
#: Endings of a package's own files: the budget is for these first.
OWN_ENDINGS = '.py', '.xml', '.msg', '.srv', '.action', ''
#: Names that a student's file cannot have: the folder of marks uses them, or no file can have them.
TAKEN_NAMES = re.compile(r'|\..*|overview|.*\.marks', re.DOTALL)
#: A name is at most this long, so that an ending fits behind it [bytes]. Linux allows 255.
LONGEST_NAME = 180
#: Archives that are not unpacked; a zip file if it lies in another one.
OTHER_ARCHIVES = (ZIP, '.rar', '.7z', '.tar', '.gz', '.tgz', '.xz', '.bz2')
#: A larger file is not copied, unless it is an archive [bytes].
LARGEST = 20000000


# -- names

def is_zip(name: str) -> bool:
    return name.lower().endswith(ZIP)


def file_name(text: str) -> str:
    """A valid name of a file, which a line can show; most names stay."""
    name = printable(text.strip()).replace('/', '_')
    if TAKEN_NAMES.fullmatch(name):
        name = '_{}_'.format(name)
    data = name.encode()
    if len(data) > LONGEST_NAME:
        name = '{}-{}'.format(data[:LONGEST_NAME - 9].decode(errors='ignore'),
                              hashlib.sha256(data).hexdigest()[:8])
    return name


class HandedIn(NamedTuple):
    """The parts of a name on a platform: `number` of the student, and the student's own name of the
    `file`; '' if there is none."""

    student: str
    number: str
    file: str


def read_name(name: str, is_folder: bool) -> HandedIn:
    """The parts of the name of a file or a folder."""
    moodle, canvas = MOODLE.fullmatch(name), CANVAS.fullmatch(name)
    if moodle:
        return HandedIn(moodle['student'].strip(), moodle['number'], moodle['file'])
    if is_folder:
        return HandedIn(name, '', '')
    if canvas:
        return HandedIn(canvas['student'].strip(), canvas['number'],
                        AGAIN.sub('', canvas['file']))
    return HandedIn(name[:-len(ZIP)] if is_zip(name) else name, '', name)


def by_student(names: Dict[str, HandedIn]) -> Dict[str, List[str]]:
    """Returns the names of each student; `names`: name of a file or folder -> its parts.

    Several files of one student belong together. Two students of the same name are told apart by
    their numbers, or, without a number, by the whole names of their files. Each key is a valid
    name of a file.
    """
    groups: Dict[Tuple[str, str, str], List[str]] = {}
    for name, said in names.items():
        alone = '' if said.number else name
        groups.setdefault((file_name(said.student), said.number, alone), []).append(name)
    times = Counter(student for student, _, _ in groups)
    students: Dict[str, List[str]] = {}
    for (student, number, alone), together in groups.items():
        if times[student] > 1:
            student = file_name('{} ({})'.format(student, number or alone))
        while student in students:      # the names differed only in characters that do not show
            student += '_'
        students[student] = together
    return students


def chosen(students: Iterable[str], wanted: Iterable[str]) -> List[str]:
    """The students that are wanted, in any case of letters; ``ValueError`` for an unknown name,
    with the names that are similar."""
    known = {student.lower(): student for student in students}
    for name in wanted:
        if name.lower() not in known:
            near = [key for key in known if name.lower() in key] or difflib.get_close_matches(
                name.lower(), known)
            raise ValueError('no submission is called {}; {}: {}'.format(
                name, 'near it' if near else 'these are',
                ', '.join(known[key] for key in (near or list(known))[:10])))
    return [known[name.lower()] for name in wanted]


# -- submissions

class Submission(NamedTuple):
    """The files and folders that one student handed in."""

    student: str
    files: Dict[Path, str]      # file or folder -> the student's own name of a file


def lay_out(handed_in: Dict[Path, str], folder: Path) -> Tuple[List[str], List[str]]:
    """Copy the files of a submission, unpacked, into `folder`, which is made. Returns (remarks on
    files that were left out, remarks on those that could not be copied or unpacked: the node may be
    in one).

    Zip files are unpacked unless there is a Python file: then they do not belong to the code.
    """
    folder.mkdir(parents=True)
    remarks: List[str] = []
    unread: List[str] = []
    budget = Budget()
    files = [found for path, name in handed_in.items()
             for found in (_files_in(path, remarks) if path.is_dir() else [(path, Path(name))])]
    zips = [found for found in files if is_zip(found[1].name)]
    for source, place in sorted(set(files) - set(zips), key=lambda found: _turn(
            str(found[1]), found[0].stat().st_size)):
        if budget.take(source.stat().st_size):
            target = folder / place
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(str(source), str(target))
            target.chmod(0o755 if os.access(str(source), os.X_OK) else 0o644)
    if any(place.suffix == '.py' for _, place in files):
        _say(remarks, 'it is a zip file beside Python code', [place for _, place in zips])
    else:
        for source, place in zips:
            try:
                unpack(source, folder / place.parent / (place.stem + '.unpacked'), budget)
            except NotJudged as reason:
                unread.append(str(reason))
        others = [path.name for path in sort_out(folder)[0]
                  if path.suffix.lower() in OTHER_ARCHIVES]
        unread += ['{} was not unpacked: only zip files are, and none in others.'.format(
            printable(name)) for name in others[:1]]
    return remarks, unread + [budget.exceeded] * bool(budget.exceeded)


def sort_out(folder: Path) -> Tuple[List[Path], List[Path]]:
    """(Files, others) below a folder, without those of LEFT_OUT.

    The others are links, devices, folders that are too deep, and what cannot be read. A file that
    has a second name outside of the folder (a hard link) counts as a link: it may be another
    person's.
    """
    found: Dict[Path, os.stat_result] = {}
    others: List[Path] = []
    for root, folders, names in os.walk(
            str(folder), onerror=lambda problem: others.append(Path(problem.filename))):
        folders[:] = sorted(name for name in folders if not LEFT_OUT.search(name))
        others += [path for path in map(Path(root).joinpath, folders) if path.is_symlink()]
        if len(Path(root).parts) - len(folder.parts) >= DEEPEST:
            others += [Path(root) / name for name in folders]
            folders.clear()
        for path in map(Path(root).joinpath, sorted(names)):
            if not LEFT_OUT.search(path.name):
                try:
                    found[path] = path.lstat()
                except OSError:         # the folder's names may be read, its files may not
                    others.append(path)
    names_of = Counter((about.st_dev, about.st_ino) for about in found.values())
    files = [path for path, about in found.items() if stat.S_ISREG(about.st_mode)
             and about.st_nlink <= names_of[about.st_dev, about.st_ino]
             and os.access(str(path), os.R_OK)]
    return files, others + sorted(set(found) - set(files))


def submissions_in(folder: Path, tell: Callable[[str], None]) -> List[Submission]:
    """The Submissions in a folder, sorted by name; ``tell(line)`` is told which files are left out.

    ``ValueError`` or ``OSError`` if there is nothing to mark.
    """
    names = {}
    for path in sorted(folder.iterdir()):
        if path.name.startswith('.') or LEFT_OUT.search(path.name):
            continue
        mode = path.lstat().st_mode
        said = read_name(path.name, stat.S_ISDIR(mode))
        if stat.S_ISDIR(mode) or stat.S_ISREG(mode) and (said.number or is_zip(path.name)):
            names[path.name] = said
            continue
        why = 'neither a folder nor a {}'.format('zip file' if stat.S_ISREG(mode) else 'file')
        # a link may lead to another student's work, or out of here
        tell('left out, because it is {}: {}'.format(
            'a link' if stat.S_ISLNK(mode) else why, path))
    if not names:
        raise ValueError('there is no folder and no zip file in {}'.format(folder))
    return [Submission(student, {folder / name: names[name].file or name for name in together})
            for student, together in sorted(by_student(names).items())]


def without_wrapping(folder: Path) -> Path:
    """The only folder in `folder` if it holds only folders and zip files, else `folder`: many
    programs that make zip files put such a folder around all others."""
    inside = list(folder.iterdir())
    is_wrapped = len(inside) == 1 and inside[0].is_dir() and all(
        path.is_dir() or is_zip(path.name) for path in inside[0].iterdir())
    return inside[0] if is_wrapped else folder


def _files_in(folder, remarks):
    """The (path, place in the copy) of each file to copy below a folder; others are said."""
    files, others = sort_out(folder)
    large = [path for path in files if path.stat().st_size > LARGEST and not is_zip(path.name)]
    _say(remarks, 'each is a link, a device, too deep, or may not be read',
         [path.relative_to(folder) for path in others])
    _say(remarks, 'each is larger than {:g} MB'.format(LARGEST / 1e6),
         [path.relative_to(folder) for path in large])
    return [(path, path.relative_to(folder)) for path in files if path not in set(large)]


def _say(remarks, why, left):
    """Remark that these files were left out."""
    if left:
        remarks.append('Left out, because {}: {}.'.format(why, shortened(
            [printable(str(place)) for place in sorted(left)], 3)))


def _turn(place, size):
    """A key by which files take their part of the budget: a package's own files first."""
    return Path(place).suffix.lower() not in OWN_ENDINGS, place.count('/'), size, place


# -- zip files

class Budget:
    """The number of files and bytes that submissions may still have."""

    def __init__(self, submissions: int = 1) -> None:
        self._times = submissions
        self._files, self._bytes = submissions * MOST_FILES, submissions * MOST_BYTES
        #: A sentence once a file had no room; else ''.
        self.exceeded = ''

    def take(self, size: int) -> bool:
        """Take room for a file of `size` [bytes]. Returns False if there is none."""
        for wanted, left, most, unit in ((1, self._files, MOST_FILES, 'files'),
                                         (size, self._bytes, MOST_BYTES / 1e6, 'MB')):
            if wanted > left:
                self.exceeded = 'More than {:g} {}: not all of it was unpacked.'.format(
                    self._times * most, unit)
                return False
        self._files, self._bytes = self._files - 1, self._bytes - size
        return True


def unpack(path: Path, folder: Path, budget: Budget) -> None:
    """Unpack the zip file `path` into `folder`, as far as the budget reaches.

    ``NotJudged`` if it is not a zip file, or must not be unpacked. No file becomes larger than the
    zip file declares: zipfile reads no further.
    """
    try:
        with zipfile.ZipFile(str(path)) as archive:
            wanted = [info for info in archive.infolist() if _is_wanted(info)]
            if any(info.flag_bits & 1 for info in wanted):      # the bit for a password
                raise NotJudged('The zip file was not unpacked: it has a password.')
            for info in sorted(wanted, key=lambda info: _turn(info.filename, info.file_size)):
                if budget.take(info.file_size):
                    target = archive.extract(info, str(folder))
                    if not info.is_dir():
                        os.chmod(target, 0o755 if (info.external_attr >> 16) & 0o100 else 0o644)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, ValueError,
            zlib.error, OSError) as problem:
        raise NotJudged('The zip file cannot be unpacked: {}.'.format(
            str(problem).rstrip('.') or type(problem).__name__)) from None


def _is_wanted(info):
    """Is this file of an archive unpacked? ``NotJudged`` if its path leads out of the folder.
    Windows writes \\ for /."""
    path = info.filename = info.filename.replace('\\', '/')
    if path.count('/') > DEEPEST:
        raise NotJudged('The zip file was not unpacked: its folders are deeper than {}.'.format(
            DEEPEST))
    if path.startswith('/') or re.match('[A-Za-z]:', path) or '..' in path.split('/'):
        raise NotJudged('The zip file was not unpacked: its path {!r} leads out of it.'.format(
            path[:80]))
    return not stat.S_ISLNK(info.external_attr >> 16) and not LEFT_OUT.search(path)
