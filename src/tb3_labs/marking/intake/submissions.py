"""Finds and copies the submissions of a class: folders and zip files of a learning platform.

Moodle writes ``Ann Miller_12345_assignsubmission_file_`` (a folder), or adds the name of a file to
it. Canvas writes ``millerann_12345_67890_lab2.zip``. It adds ``_LATE`` to the name of a student who
is late, and writes ``lab2-1.zip`` for a file that is handed in again. A name may be any bytes, so
each name is checked.

The files that were handed in are neither changed nor run. Each file is copied or unpacked once.
"""
import difflib
import hashlib
import os
import re
import shutil
import stat
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
#: The names of a student's packages and workspaces, and of the folders in them.
COURSE_FOLDER = re.compile(
    r'(ice|lab)[ _.-]?\d.*|src|scripts|nodes|msg|srv|launch|build|devel|.*_ws', re.IGNORECASE)
#: A student's files get other names than these, which the folder of marks or Linux uses.
RESERVED_NAMES = re.compile(r'|\..*|overview|.*\.marks', re.DOTALL)
#: The longest name [bytes]. Linux allows 255 bytes, which leaves space for an ending.
MAX_NAME_LENGTH = 180
#: A larger file is not copied, unless it is a zip file [bytes].
MAX_COPIED_BYTES = 20000000
#: The endings of archives. If the copy has a file with such an ending, this file was not unpacked.
ARCHIVE_ENDINGS = (ZIP, '.rar', '.7z', '.tar', '.gz', '.tgz', '.xz', '.bz2')


def file_name(text: str) -> str:
    """Returns a printable name that a file can have; usually `text` itself."""
    name = printable(text.strip()).replace('/', '_')
    if RESERVED_NAMES.fullmatch(name):
        name = f'_{name}_'
    data = name.encode()
    if len(data) > MAX_NAME_LENGTH:
        name = '{}-{}'.format(data[:MAX_NAME_LENGTH - 9].decode(errors='ignore'),
                              hashlib.sha256(data).hexdigest()[:8])
    return name


class PlatformName(NamedTuple):
    """The parts of a name that a learning platform gave to a file or a folder."""

    student: str
    number: str         # the student's number on the platform; '' if the name has none
    file: str           # the file's name on the student's computer; '' for a folder
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
    """Returns student -> names of the student's files and folders. `names` maps these names to
    their parts.

    Files with the same name of a student and the same number belong to one student. A file without
    a number belongs to a student of its own. If several students have the same name, the number, or
    else the file's name, is added to each name. Each student's name is a valid name of a file.
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
        while student in students:      # the names differed only in invisible characters
            student += '_'
        students[student] = together
    return students


def check_names(wanted: Iterable[str], students: Sequence[str]) -> None:
    """Raises ``ValueError`` if a `wanted` name is not a student's name. The text of the error has
    similar names."""
    for name in wanted:
        if name not in students:
            near = difflib.get_close_matches(name, students)
            raise ValueError('no submission is called {}; {}: {}'.format(
                name, 'near it' if near else 'these are', shortened(near or students, 10)))


class Submission(NamedTuple):
    """The files and folders that one student handed in."""

    student: str
    files: Dict[Path, str]      # file or folder -> the file's name on the student's computer
    number: str = ''            # the student's number on the platform; '' if there is none
    late: bool = False          # does the platform say that the submission is late?


def submissions_in(folder: Path, print_line: Callable[[str], None]) -> List[Submission]:
    """Returns the Submissions in a folder, sorted by student. Prints a line on each file that is
    left out. Raises ``ValueError`` or ``OSError`` if there is no submission."""
    names = {}
    for path in sorted(folder.iterdir()):
        if path.name.startswith('.') or IGNORED_PATHS.search(path.name):
            continue
        mode = path.lstat().st_mode
        parts = read_name(path.name, stat.S_ISDIR(mode))
        is_wanted_file = stat.S_ISREG(mode) and bool(parts.number or is_zip(path.name))
        if stat.S_ISDIR(mode) or is_wanted_file:
            names[path.name] = parts
            continue
        kind = 'neither a folder nor a file'
        if stat.S_ISREG(mode):
            kind = 'neither a folder nor a zip file'
        elif stat.S_ISLNK(mode):        # a link may lead to another student's work
            kind = 'a link'
        print_line(f'left out, because it is {kind}: {path}')
    if not names:
        raise ValueError(f'there is no folder and no zip file in {folder}')
    return [Submission(student, {folder / name: names[name].file or name for name in together},
                       names[together[0]].number, any(names[name].late for name in together))
            for student, together in sorted(by_student(names).items())]


def without_wrapping(folder: Path) -> Path:
    """Returns the folder that a zip program put around all submissions, or else `folder` itself."""
    inside = list(folder.iterdir())
    has_one_folder = len(inside) == 1 and inside[0].is_dir()
    if not has_one_folder or _is_one_submission(inside[0]):
        return folder
    is_wrapping = all(path.is_dir() or is_zip(path.name) for path in inside[0].iterdir())
    return inside[0] if is_wrapping else folder


def _is_one_submission(folder):
    """Is a folder one student's package or workspace, or a folder of the student's packages?"""
    unnumbered = [path for path in folder.iterdir()
                  if not read_name(path.name, path.is_dir()).number]
    return any(COURSE_FOLDER.fullmatch(path.name) or name_in(path / MANIFEST)[0] == path.name
               for path in unnumbered)


# -- the copy of a submission

def copy_submission(handed_in: Dict[Path, str], folder: Path,
                    has_node: Callable[[], bool]) -> Tuple[List[str], List[str]]:
    """Make `folder`, copy the files of a submission into it, and unpack the zip files there.

    Returns (remarks on files that are left out, remarks on archives that are not unpacked).

    ``has_node()`` tries to find the node in the copy. Zip files beside the node are not unpacked,
    since such files do not belong to the code. GENERATED_FOLDERS are copied only if the node is
    nowhere else.
    """
    remarks = _copy(handed_in, folder, has_node, GENERATED_FOLDERS)
    if not has_node():
        shutil.rmtree(str(folder))
        remarks = _copy(handed_in, folder, has_node, IGNORED_PATHS)
    return remarks


def _copy(handed_in, folder, has_node, ignored):
    folder.mkdir(parents=True)
    limits = UnpackLimits()
    not_unpacked, bad_names = [], []
    files, remarks = _files_to_copy(handed_in, ignored)
    zips = [path for path in files if is_zip(path.name)]
    sizes = {path: files[path].stat().st_size for path in files if not is_zip(path.name)}
    for path in sorted(sizes, key=lambda path: writing_order(str(path), sizes[path])):
        if limits.spend(sizes[path]):
            with open(str(files[path]), 'rb') as source:
                is_executable = os.access(str(files[path]), os.X_OK)
                if not write_file(source, folder / path, is_executable):
                    bad_names.append(path)
    remarks += omission_remarks(BAD_NAME, bad_names)
    if zips and has_node():
        remarks += omission_remarks('it is a zip file beside the node', zips)
        zips = []
    for path in zips:
        target = folder / path.parent / (path.stem + '.unpacked')
        while target.exists():        # names may differ only in their endings
            target = target.with_name(target.name + '_')
        try:
            remarks += unpack(files[path], target, limits, ignored)
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
    """Returns ({path in the copy: file to copy}, remarks on the files that are not copied)."""
    files, platform_names, remarks = {}, {}, []
    for handed, own_name in sorted(handed_in.items(), key=lambda item: _upload_order(item[0].name)):
        sources = {Path(own_name): handed}
        if handed.is_dir():
            sources = _files_of_folder(handed, remarks, ignored)
        for path, source in sources.items():
            if path in files:
                remarks.append('{} was handed in again: {} counts, not {}.'.format(
                    *map(printable, (str(path), handed.name, platform_names[path]))))
            files[path], platform_names[path] = source, handed.name
    return files, remarks


def _files_of_folder(folder, remarks, ignored):
    """Returns {path below the folder: file to copy}. The other files get a line in `remarks`."""
    files, refused = submitted_files(folder, ignored)
    large = {path for path in files
             if path.stat().st_size > MAX_COPIED_BYTES and not is_zip(path.name)}
    for why, paths in (
            ('each is a link, a device, too deep, or may not be read', refused),
            (f'each is larger than {MAX_COPIED_BYTES / 1e6:g} MB', large)):
        remarks += omission_remarks(why, [path.relative_to(folder) for path in paths])
    return {path.relative_to(folder): path for path in files if path not in large}


def _upload_order(name):
    """Returns a key that sorts a student's files by the numbers of Canvas, the latest file last."""
    canvas, repetition = CANVAS.fullmatch(name), CANVAS_REPETITION.search(name)
    return (int(repetition.group(1)) if repetition else 0,
            int(canvas['upload']) if canvas else 0, name)
