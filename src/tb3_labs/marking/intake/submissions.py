"""The submissions of a class: folders and zip files of learning platforms.

Moodle writes ``Ann Miller_12345_assignsubmission_file_`` (a folder), or the same with a file's name
behind it. Canvas writes ``millerann_12345_67890_lab2.zip``, with ``_LATE`` after the name of a
student who is late, and ``lab2-1.zip`` for a file that is handed in again. A name may be any bytes,
so each name is checked.

The files that were handed in are neither changed nor run. They are copied, or unpacked, once.
"""
import difflib
import hashlib
import os
import re
import shutil
import stat
import unicodedata
from collections import Counter
from pathlib import Path
from typing import Callable, Dict, Iterable, List, NamedTuple, Sequence, Tuple

from tb3_labs.command_line import printable
from tb3_labs.marking.intake.archives import (
    BAD_NAME, GENERATED_FOLDERS, IGNORED_PATHS, ZIP, NotJudged, UnpackLimits, is_zip,
    omission_remarks, shortened, submitted_files, unpack, write_file, writing_order)
from tb3_labs.marking.intake.packages import MANIFEST, name_in

MOODLE = re.compile(r'(?P<student>.+?)_(?P<number>\d+)_assignsubmission_[a-z]+_?(?P<file>.*)')
CANVAS = re.compile(
    r'(?P<student>[^_]+)(?P<late>_late)?_(?P<number>\d+)_(?P<upload>\d+)_(?P<file>.+)',
    re.IGNORECASE)
#: The number that Canvas adds to the name of a file that is handed in again.
CANVAS_REPETITION = re.compile(r'-(\d+)(?=\.\w+$)')
#: Names of folders and zip files in one student's work: of packages, in a package, of workspaces.
COURSE_FOLDER = re.compile(
    r'(ice|lab)[ _.-]?\d.*|src|scripts|nodes|msg|srv|launch|build|devel|.*_ws', re.IGNORECASE)
#: Names that the files of a student must not have: the folder of marks uses them, or Linux does.
RESERVED_NAMES = re.compile(r'|\..*|overview|.*\.marks', re.DOTALL)
#: A name is at most this long, so that an ending fits behind it [bytes]. Linux allows 255.
LONGEST_NAME = 180
#: A larger file is not copied, unless it is a zip file [bytes].
LARGEST_COPIED = 20000000
#: The endings of archives that are not unpacked within a submission.
ARCHIVE_ENDINGS = (ZIP, '.rar', '.7z', '.tar', '.gz', '.tgz', '.xz', '.bz2')


# -- names

def file_name(text: str) -> str:
    """Returns `text` as a printable name that a file can have; it changes only unusual names."""
    name = printable(text.strip()).replace('/', '_')
    if RESERVED_NAMES.fullmatch(name):
        name = f'_{name}_'
    data = name.encode()
    if len(data) > LONGEST_NAME:
        name = '{}-{}'.format(data[:LONGEST_NAME - 9].decode(errors='ignore'),
                              hashlib.sha256(data).hexdigest()[:8])
    return name


class PlatformName(NamedTuple):
    """The parts of the name that a learning platform gives to a file or a folder."""

    student: str
    number: str         # of the student; '' if the platform gives none
    file: str           # the student's own name of the file; '' for a folder
    late: bool = False


def read_name(name: str, is_folder: bool) -> PlatformName:
    """Returns the parts of the name of a file or a folder."""
    moodle, canvas = MOODLE.fullmatch(name), CANVAS.fullmatch(name)
    if moodle:
        return PlatformName(moodle['student'].strip(), moodle['number'], moodle['file'])
    if is_folder:
        return PlatformName(name, '', '')
    if canvas:
        return PlatformName(canvas['student'].strip(), canvas['number'],
                            CANVAS_REPETITION.sub('', canvas['file']), bool(canvas['late']))
    return PlatformName(name[:-len(ZIP)] if is_zip(name) else name, '', name)


def by_student(names: Dict[str, PlatformName]) -> Dict[str, List[str]]:
    """Returns student -> names of the student's files and folders. `names` has the parts of each.

    Several files of one student belong together. Two students of the same name get their numbers
    behind it. If they have no number, each file is a student, whose name gets the file's name
    behind it. Each student's name is a valid name of a file.
    """
    groups: Dict[Tuple[str, str, str], List[str]] = {}
    for name, parts in names.items():
        single = '' if parts.number else name
        groups.setdefault((file_name(parts.student), parts.number, single), []).append(name)
    times = Counter(student for student, _, _ in groups)
    students: Dict[str, List[str]] = {}
    for (student, number, single), together in groups.items():
        if times[student] > 1:
            student = file_name(f'{student} ({number or single})')
        while student in students:      # the names differed only in characters that do not show
            student += '_'
        students[student] = together
    return students


def students_named(students: Sequence[str], wanted: Iterable[str]) -> List[str]:
    """Returns the students of the wanted names. Upper and lower case are the same here, and so are
    the two ways in which Unicode writes a letter with an accent, if one student alone has the name.

    Raises ``ValueError`` with similar names if it is not clear who is wanted.
    """
    def folded(text: str) -> str:
        return unicodedata.normalize('NFC', text).casefold()
    found = []
    for name in wanted:
        same = [name] if name in students else [
            student for student in students if folded(student) == folded(name)]
        if len(same) != 1:
            near = [student for student in students if folded(name) in folded(student)]
            near = near or difflib.get_close_matches(name, students)
            raise ValueError('no submission is called {}; {}: {}'.format(
                name, 'near it' if near else 'these are', shortened(near or students, 10)))
        found += same
    return found


# -- submissions

class Submission(NamedTuple):
    """The files and folders that one student handed in."""

    student: str
    files: Dict[Path, str]      # file or folder -> the student's own name of a file
    number: str = ''            # of the student on the platform; '' if it gives none
    late: bool = False          # does the platform say so?


def submissions_in(folder: Path, print_line: Callable[[str], None]) -> List[Submission]:
    """Returns the Submissions in a folder, sorted by student, and prints which files it leaves out.

    Raises ``ValueError`` or ``OSError`` if there is nothing to mark.
    """
    names = {}
    for path in sorted(folder.iterdir()):
        if path.name.startswith('.') or IGNORED_PATHS.search(path.name):
            continue
        mode = path.lstat().st_mode
        parts = read_name(path.name, stat.S_ISDIR(mode))
        if stat.S_ISDIR(mode) or stat.S_ISREG(mode) and (parts.number or is_zip(path.name)):
            names[path.name] = parts
            continue
        kind = 'neither a folder nor a file'
        if stat.S_ISREG(mode):
            kind = 'neither a folder nor a zip file'
        elif stat.S_ISLNK(mode):        # it may lead to another student's work, or out of here
            kind = 'a link'
        print_line(f'left out, because it is {kind}: {path}')
    if not names:
        raise ValueError(f'there is no folder and no zip file in {folder}')
    return [Submission(student, {folder / name: names[name].file or name for name in together},
                       names[together[0]].number, any(names[name].late for name in together))
            for student, together in sorted(by_student(names).items())]


def without_wrapping(folder: Path) -> Path:
    """Returns the only folder in `folder` if it holds nothing but the folders and zip files of
    students; else `folder`. Many programs that make zip files put such a folder around all
    submissions."""
    inside = list(folder.iterdir())
    is_wrapped = len(inside) == 1 and inside[0].is_dir() and all(
        path.is_dir() or is_zip(path.name) for path in inside[0].iterdir())
    if is_wrapped and _is_one_submission(inside[0]):
        return folder
    return inside[0] if is_wrapped else folder


def _is_one_submission(folder):
    """Does a folder hold the packages of one student, or the content of a package or workspace?"""
    return any(not read_name(path.name, path.is_dir()).number and (
        COURSE_FOLDER.fullmatch(path.name) or name_in(path / MANIFEST)[0] == path.name)
        for path in folder.iterdir())


# -- the copy of a submission

def copy_submission(handed_in: Dict[Path, str], folder: Path,
                    has_node: Callable[[], bool]) -> Tuple[List[str], List[str]]:
    """Copy the files of a submission into `folder`, which is made, and unpack its zip files.

    Returns (remarks on files that are left out, remarks on archives that are not unpacked). If no
    node is found, it may be in such an archive.

    If ``has_node()`` finds the node beside the zip files, they are not unpacked: then they do not
    belong to the code. GENERATED_FOLDERS are copied only if the node is nowhere else.
    """
    remarks = _copy(handed_in, folder, has_node, GENERATED_FOLDERS)
    if not has_node():
        shutil.rmtree(str(folder))
        remarks = _copy(handed_in, folder, has_node, IGNORED_PATHS)
    return remarks


def _copy(handed_in, folder, has_node, ignored):
    folder.mkdir(parents=True)
    limits, not_unpacked = UnpackLimits(), []
    files, remarks = _files_to_copy(handed_in, ignored)
    zips = [place for place in files if is_zip(place.name)]
    bad_names = []
    others = [place for place in files if not is_zip(place.name)]
    for place in sorted(others, key=lambda place: writing_order(
            str(place), files[place].stat().st_size)):
        path = files[place]
        if limits.spend(path.stat().st_size):
            with open(str(path), 'rb') as source:
                if not write_file(source, folder / place, os.access(str(path), os.X_OK)):
                    bad_names.append(place)
    remarks += omission_remarks(BAD_NAME, bad_names)
    if zips and has_node():
        remarks += omission_remarks('it is a zip file beside the node', zips)
        zips = []
    for place in zips:
        target = folder / place.parent / (place.stem + '.unpacked')
        while target.exists():        # two names may differ in their endings alone
            target = target.with_name(target.name + '_')
        try:
            remarks += unpack(files[place], target, limits, ignored)
        except NotJudged as reason:
            not_unpacked.append(str(reason))
    archives = [path for path in submitted_files(folder, IGNORED_PATHS)[0]
                if path.suffix.lower() in ARCHIVE_ENDINGS]
    if archives:
        not_unpacked.append(f'{printable(archives[0].name)} was not unpacked: only zip files are, '
                            'and none in others.')
    if limits.exceeded:
        not_unpacked.append(limits.exceeded)
    return remarks, not_unpacked


def _files_to_copy(handed_in, ignored):
    """Returns ({path in the copy: file to copy}, remarks on other files)."""
    files, platform_names, remarks = {}, {}, []
    for path, own_name in sorted(handed_in.items(), key=lambda item: _upload_order(item[0].name)):
        sources = {Path(own_name): path}
        if path.is_dir():
            sources = _files_of_folder(path, remarks, ignored)
        for place, source in sources.items():
            if place in files:
                remarks.append('{} was handed in again: {} counts, not {}.'.format(
                    *map(printable, (str(place), path.name, platform_names[place]))))
            files[place], platform_names[place] = source, path.name
    return files, remarks


def _files_of_folder(folder, remarks, ignored):
    """Returns {path below the folder: file to copy}. The other files are added to `remarks`."""
    files, refused = submitted_files(folder, ignored)
    large = {path for path in files
             if path.stat().st_size > LARGEST_COPIED and not is_zip(path.name)}
    for why, paths in (
            ('each is a link, a device, too deep, or may not be read', refused),
            (f'each is larger than {LARGEST_COPIED / 1e6:g} MB', large)):
        remarks += omission_remarks(why, [path.relative_to(folder) for path in paths])
    return {path.relative_to(folder): path for path in files if path not in large}


def _upload_order(name):
    """Returns a key that sorts the latest file of a student last: Canvas numbers its files."""
    canvas, repetition = CANVAS.fullmatch(name), CANVAS_REPETITION.search(name)
    return (int(repetition.group(1)) if repetition else 0,
            int(canvas['upload']) if canvas else 0, name)
