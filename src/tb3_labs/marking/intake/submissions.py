"""The submissions of a class: folders and zip files of learning platforms.

Moodle: ``Ann Miller_12345_assignsubmission_file_`` (a folder), or the same with a file's name
behind it. Canvas: ``millerann_12345_67890_lab2.zip``, with ``_LATE`` after the name of a late one,
and ``lab2-1.zip`` for a file that was handed in again. Names may be any bytes: each is checked.

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
    MADE, NEVER, NO_NAME, OTHER_ARCHIVES, ZIP, NotJudged, UnpackLimits, budget_order, is_zip,
    left_out, shortened, sort_out, unpack, write)

MOODLE = re.compile(r'(?P<student>.+?)_(?P<number>\d+)_assignsubmission_[a-z]+_?(?P<file>.*)')
CANVAS = re.compile(
    r'(?P<student>[^_]+)(?P<late>_late)?_(?P<number>\d+)_(?P<upload>\d+)_(?P<file>.+)',
    re.IGNORECASE)
#: The number that Canvas adds to the name of a file that was handed in again.
AGAIN = re.compile(r'-(\d+)(?=\.\w+$)')
#: Names that a student's file cannot have: the folder of marks uses them, or no file can have them.
TAKEN_NAMES = re.compile(r'|\..*|overview|.*\.marks', re.DOTALL)
#: A name is at most this long, so that an ending fits behind it [bytes]. Linux allows 255.
LONGEST_NAME = 180
#: A larger file is not copied, unless it is an archive [bytes].
LARGEST_COPIED = 20000000


# -- names

def file_name(text: str) -> str:
    """A valid name of a file, which a line can show; most names stay."""
    name = printable(text.strip()).replace('/', '_')
    if TAKEN_NAMES.fullmatch(name):
        name = f'_{name}_'
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
    late: bool = False


def read_name(name: str, is_folder: bool) -> HandedIn:
    """The parts of the name of a file or a folder."""
    moodle, canvas = MOODLE.fullmatch(name), CANVAS.fullmatch(name)
    if moodle:
        return HandedIn(moodle['student'].strip(), moodle['number'], moodle['file'])
    if is_folder:
        return HandedIn(name, '', '')
    if canvas:
        return HandedIn(canvas['student'].strip(), canvas['number'],
                        AGAIN.sub('', canvas['file']), bool(canvas['late']))
    return HandedIn(name[:-len(ZIP)] if is_zip(name) else name, '', name)


def by_student(names: Dict[str, HandedIn]) -> Dict[str, List[str]]:
    """Returns the names of each student; `names`: name of a file or folder -> its parts.

    Several files of one student belong together. Two students of the same name differ by their
    numbers, or, without a number, by the whole names of their files. Each key is a valid name of a
    file.
    """
    groups: Dict[Tuple[str, str, str], List[str]] = {}
    for name, name_parts in names.items():
        alone = '' if name_parts.number else name
        groups.setdefault((file_name(name_parts.student), name_parts.number, alone),
                          []).append(name)
    times = Counter(student for student, _, _ in groups)
    students: Dict[str, List[str]] = {}
    for (student, number, alone), together in groups.items():
        if times[student] > 1:
            student = file_name(f'{student} ({number or alone})')
        while student in students:      # the names differed only in characters that do not show
            student += '_'
        students[student] = together
    return students


def students_named(students: Sequence[str], wanted: Iterable[str]) -> List[str]:
    """The students of the wanted names. Letters of another case, and the two characters of which a
    Mac makes a letter with dots, are accepted if only one student has such a name. ``ValueError``
    for an unknown name, with similar names."""
    def folded(text: str) -> str:
        return unicodedata.normalize('NFC', text).casefold()
    found = []
    for name in wanted:
        same = [name] if name in students else [
            student for student in students if folded(student) == folded(name)]
        if len(same) != 1:
            near = same or [student for student in students if folded(name) in folded(student)] or (
                difflib.get_close_matches(name, students))
            raise ValueError('{} submission is called {}; {}: {}'.format(
                'more than one' if same else 'no', name,
                'near it' if near and not same else 'these are', shortened(near or students, 10)))
        found += same
    return found


# -- submissions

class Submission(NamedTuple):
    """The files and folders that one student handed in."""

    student: str
    files: Dict[Path, str]      # file or folder -> the student's own name of a file
    number: str = ''            # of the student on the platform; '' if it gives none
    late: bool = False          # by the platform


def lay_out(handed_in: Dict[Path, str], folder: Path,
            has_node: Callable[[], bool]) -> Tuple[List[str], List[str]]:
    """Copy the files of a submission, unpacked, into `folder`, which is made. Returns (remarks on
    files that were left out, remarks on those that could not be copied or unpacked: the node may be
    in one).

    Zip files are unpacked unless the node lies beside them: then they do not belong to the code.
    Folders of the names MADE are copied if the node is nowhere else.
    """
    done = _lay_out(handed_in, folder, has_node, MADE)
    if not has_node():
        shutil.rmtree(str(folder))
        done = _lay_out(handed_in, folder, has_node, NEVER)
    return done


def _lay_out(handed_in, folder, has_node, skipped):
    folder.mkdir(parents=True)
    limits, remarks, unread, lost = UnpackLimits(), [], [], []
    files = {}      # place -> file, its name on the platform
    for path, name in sorted(handed_in.items(), key=lambda item: _upload(item[0].name)):
        for source, place in (_files_in(path, remarks, skipped) if path.is_dir()
                              else [(path, Path(name))]):
            if place in files:
                remarks.append('{} was handed in again: {} counts, not {}.'.format(
                    *map(printable, (str(place), path.name, files[place][1]))))
            files[place] = source, path.name
    zips = [place for place in files if is_zip(place.name)]
    for place in sorted(set(files) - set(zips), key=lambda place: budget_order(
            str(place), files[place][0].stat().st_size)):
        source = files[place][0]
        if limits.spend(source.stat().st_size):
            with open(str(source), 'rb') as file:
                if not write(file, folder / place, os.access(str(source), os.X_OK)):
                    lost.append(place)
    remarks += left_out(NO_NAME, lost)
    if zips and has_node():
        remarks += left_out('it is a zip file beside the node', zips)
        zips = []
    for place in zips:
        root = folder / place.parent / (place.stem + '.unpacked')
        while root.exists():        # two names may differ in their endings alone
            root = root.with_name(root.name + '_')
        try:
            remarks += unpack(files[place][0], root, limits, skipped)
        except NotJudged as reason:
            unread.append(str(reason))
    unread += [f'{printable(path.name)} was not unpacked: only zip files are, and none in others.'
               for path in sort_out(folder, NEVER)[0]
               if path.suffix.lower() in OTHER_ARCHIVES][:1]
    return remarks, unread + ([limits.exceeded] if limits.exceeded else [])


def _upload(name):
    """A key by which the latest file of a student comes last: Canvas counts them."""
    canvas, again = CANVAS.fullmatch(name), AGAIN.search(name)
    return int(again.group(1)) if again else 0, int(canvas['upload']) if canvas else 0, name


def submissions_in(folder: Path, print_line: Callable[[str], None]) -> List[Submission]:
    """The Submissions in a folder, sorted by name; ``print_line(line)`` gets the files that are
    left out.

    ``ValueError`` or ``OSError`` if there is nothing to mark.
    """
    names = {}
    for path in sorted(folder.iterdir()):
        if path.name.startswith('.') or NEVER.search(path.name):
            continue
        mode = path.lstat().st_mode
        name_parts = read_name(path.name, stat.S_ISDIR(mode))
        if stat.S_ISDIR(mode) or stat.S_ISREG(mode) and (name_parts.number or is_zip(path.name)):
            names[path.name] = name_parts
            continue
        why = f"neither a folder nor a {'zip file' if stat.S_ISREG(mode) else 'file'}"
        # a link may lead to another student's work, or out of here
        print_line(f"left out, because it is {'a link' if stat.S_ISLNK(mode) else why}: {path}")
    if not names:
        raise ValueError(f'there is no folder and no zip file in {folder}')
    return [Submission(student, {folder / name: names[name].file or name for name in together},
                       names[together[0]].number, any(names[name].late for name in together))
            for student, together in sorted(by_student(names).items())]


def without_wrapping(folder: Path) -> Path:
    """The only folder in `folder` if it holds only folders and zip files, else `folder`. Many
    programs that make zip files put such a folder around all submissions."""
    inside = list(folder.iterdir())
    is_wrapped = len(inside) == 1 and inside[0].is_dir() and all(
        path.is_dir() or is_zip(path.name) for path in inside[0].iterdir())
    return inside[0] if is_wrapped else folder


def _files_in(folder, remarks, skipped):
    """The (path, place in the copy) of each file to copy; remarks name the other files."""
    files, others = sort_out(folder, skipped)
    large = [path for path in files
             if path.stat().st_size > LARGEST_COPIED and not is_zip(path.name)]
    for why, left in (
            ('each is a link, a device, too deep, or may not be read', others),
            (f'each is larger than {LARGEST_COPIED / 1e6:g} MB', large)):
        remarks += left_out(why, [path.relative_to(folder) for path in left])
    return [(path, path.relative_to(folder)) for path in files if path not in set(large)]
