"""Names of submissions: as learning platforms write them, and in a form for files and lines.

Moodle: ``Ann Miller_12345_assignsubmission_file_`` (a folder), or the same with the file's name
behind it. Canvas: ``millerann_12345_67890_lab2.zip``, with ``_LATE`` after the name of a late one,
and ``lab2-1.zip`` for a file that was handed in again. Any other name is the student's.

A file system, the master and a program of a submission take any bytes as a name: quotes, line ends,
escape sequences of a terminal, characters that turn the direction of writing. Each name is checked
here before this package uses or shows it.
"""
import difflib
import hashlib
import keyword
import re
from collections import Counter
from typing import Dict, Iterable, List, NamedTuple, Tuple

from tb3_labs.command_line import printable

#: A name of a package, a type or a field that ROS allows. `\\w` would allow more letters.
NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]*')
#: Names that a student's file cannot have: the folder of marks uses them, or no file can have them.
TAKEN = re.compile(r'|\..*|overview|.*\.marks', re.DOTALL)
#: A name is at most this long, so that an ending fits behind it [bytes]. Linux allows 255.
LONGEST = 180
MOODLE = re.compile(r'(?P<student>.+?)_(?P<number>\d+)_assignsubmission_[a-z]+_?(?P<file>.*)')
CANVAS = re.compile(r'(?P<student>[^_]+)(?:_late)?_(?P<number>\d+)_\d+_(?P<file>.+)',
                    re.IGNORECASE)
#: The number that Canvas adds to the name of a file that was handed in again.
AGAIN = re.compile(r'-\d+(?=\.\w+$)')
ZIP = '.zip'


# -- any name

def is_name(text: str) -> bool:
    """Does ROS allow this as the name of a package, a type or a field, and Python too?"""
    return bool(NAME.fullmatch(text)) and not keyword.iskeyword(text)


def is_type(text: str) -> bool:
    """Is this the name of a type, such as ``lab2/MouseController``?"""
    return len(text.split('/')) == 2 and all(map(is_name, text.split('/')))


def is_zip(name: str) -> bool:
    """Is this the name of a zip file?"""
    return name.lower().endswith(ZIP)


def file_name(text: str) -> str:
    """A valid name of a file that a line can show; most names stay as they are."""
    name = printable(text.strip()).replace('/', '_')
    if TAKEN.fullmatch(name):
        name = '_{}_'.format(name)
    data = name.encode()
    if len(data) > LONGEST:
        name = '{}-{}'.format(data[:LONGEST - 9].decode(errors='ignore'),
                              hashlib.sha256(data).hexdigest()[:8])
    return name


# -- names on a platform

class HandedIn(NamedTuple):
    """The parts of a name on a platform."""

    student: str
    number: str     # of the student on the platform; '' if the name has none
    file: str       # the student's own name of the file; '' if the name is that of a folder


def read_name(name: str, is_folder: bool) -> HandedIn:
    """The parts of the name of a file or a folder."""
    moodle = MOODLE.fullmatch(name)
    if moodle:
        return HandedIn(moodle['student'].strip(), moodle['number'],
                        '' if is_folder else moodle['file'])
    if is_folder:
        return HandedIn(name, '', '')
    canvas = CANVAS.fullmatch(name)
    if canvas:
        return HandedIn(canvas['student'].strip(), canvas['number'],
                        AGAIN.sub('', canvas['file']))
    return HandedIn(name[:-len(ZIP)] if is_zip(name) else name, '', name)


def by_student(names: Iterable[Tuple[str, bool]]) -> Dict[str, List[Tuple[str, HandedIn]]]:
    """Returns the names of each student, with their parts; `names`: (name, is it a folder?).

    Several files of one student belong together. Two students of the same name are told apart by
    their numbers, or, without a number, by the whole names of their files. Each key is a valid
    name of a file.
    """
    groups: Dict[Tuple[str, str, str], List[Tuple[str, HandedIn]]] = {}
    for name, is_folder in names:
        said = read_name(name, is_folder)
        alone = '' if said.number else name
        groups.setdefault((file_name(said.student), said.number, alone), []).append((name, said))
    times = Counter(student for student, _, _ in groups)
    students: Dict[str, List[Tuple[str, HandedIn]]] = {}
    for (student, number, alone), parts in groups.items():
        if times[student] > 1:
            student = file_name('{} ({})'.format(student, number or alone))
        while student in students:      # the names differed only in characters that do not show
            student += '_'
        students[student] = parts
    return students


def chosen(students: Iterable[str], wanted: Iterable[str]) -> List[str]:
    """The students that are wanted, in any case of letters; ``ValueError`` for an unknown name,
    with the names that are similar."""
    known = {student.lower(): student for student in students}
    found = []
    for name in wanted:
        if name.lower() not in known:
            near = [key for key in known if name.lower() in key] or difflib.get_close_matches(
                name.lower(), known)
            raise ValueError('no submission is called {}; {}: {}'.format(
                name, 'near it' if near else 'these are',
                ', '.join(known[key] for key in (near or list(known))[:10])))
        found.append(known[name.lower()])
    return found
