"""Finds the submissions of a class, which are folders and files of a learning platform. For each
submission, this module copies the files, chooses the node, and finds the node's packages.

Moodle gives a folder a name such as ``Ann Miller_12345_assignsubmission_file_``. If a file was
handed in, Moodle adds the file's name at the end. Canvas writes ``millerann_12345_67890_lab2.zip``.
If a student is late, Canvas adds ``_LATE`` to the student's name. If ``lab2.zip`` is handed in
again, Canvas writes ``lab2-1.zip``. A name may contain any bytes, so each name is checked.

No handed-in file is changed or run. A stranger's file may use all memory, or take hours to read.
Therefore a separate process with limits reads a submission.
"""
import codecs
import json
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, List, NamedTuple, Sequence, Tuple

from tb3_labs.command_line import printable
from tb3_labs.marking.intake.archives import (
    IGNORED_PATHS, NotJudged, copy_submission, digest_of, short_list)
from tb3_labs.marking.intake.find_node import find_node
from tb3_labs.marking.intake.imports import find_missing_modules
from tb3_labs.marking.intake.packages import node_package, package_name, packages_in
from tb3_labs.marking.limits import LIMIT_READER_COMMAND
from tb3_labs.marking.student_nodes import NodeNames

MOODLE_NAME = re.compile(r'(?P<student>.+?)_(?P<number>\d+)_assignsubmission_[a-z]+_?(?P<file>.*)')
CANVAS_NAME = re.compile(
    r'(?P<student>[^_]+)(?P<late>_late)?_(?P<number>\d+)_(?P<upload>\d+)_(?P<file>.+)',
    re.IGNORECASE)
#: Matches the number that Canvas adds to the name of a file that is handed in again.
CANVAS_REPETITION = re.compile(r'-(\d+)(?=\.\w+$)')
#: These names are special in Linux or in the folder of marks, so a student's file is renamed.
RESERVED_NAMES = re.compile(r'|\..*|overview|.*\.marks', re.DOTALL)
MAX_NAME_BYTES = 180        # Linux allows 255, so there is space for an ending
#: This program reads a submission. The program's input and output are JSON.
READ_PROGRAM = '''import json, sys
del sys.path[0]
from tb3_labs.marking.intake import submissions
try:
    answer = submissions.read_in_this_process(*json.load(sys.stdin)), None
except submissions.NotJudged as error:
    answer = None, [str(error), error.advice]
json.dump(answer, sys.stdout)
'''


def valid_file_name(text: str) -> str:
    """Returns a valid and printable name for a file. If `text` is valid, the name is `text`."""
    name = printable(text.strip()).replace('/', '_')
    if RESERVED_NAMES.fullmatch(name):
        name = f'_{name}_'
    return name.encode()[:MAX_NAME_BYTES].decode(errors='ignore')


class PlatformName(NamedTuple):
    """The parts of a name that a learning platform gave to a file or a folder."""

    student: str
    number: str         # the student's number on the platform, or '' if there is none
    file: str           # the file's name on the student's computer, or '' for a folder
    is_late: bool = False


def platform_name_of(name: str, is_folder: bool) -> PlatformName:
    """Returns the parts of the name of a file or a folder."""
    moodle = MOODLE_NAME.fullmatch(name)
    if moodle:
        return PlatformName(moodle['student'].strip(), moodle['number'], moodle['file'])
    if is_folder:
        return PlatformName(name, number='', file='')
    canvas = CANVAS_NAME.fullmatch(name)
    if canvas:
        return PlatformName(canvas['student'].strip(), canvas['number'],
                            CANVAS_REPETITION.sub('', canvas['file']), bool(canvas['late']))
    return PlatformName(re.sub(r'(\.tar)?\.\w+$', '', name), number='', file=name)


def grouped_by_student(names: Dict[str, PlatformName]) -> Dict[str, List[str]]:
    """Returns {student: names of the student's files and folders}. `names` is {name of a file or a
    folder: its PlatformName}.

    Files belong to one student if the student's name and the number are the same. A file without a
    number belongs to a separate student. If several students have the same name, the number or the
    file's name is added to each name. Each student's name is a valid name of a file.
    """
    groups: Dict[Tuple[str, str, str], List[str]] = {}
    for name, platform_name in names.items():
        lone_file = '' if platform_name.number else name
        group = valid_file_name(platform_name.student), platform_name.number, lone_file
        groups.setdefault(group, []).append(name)
    group_counts = Counter(student for student, _, _ in groups)
    students: Dict[str, List[str]] = {}
    for (student, number, lone_file), names_of_student in groups.items():
        if group_counts[student] > 1:
            student = valid_file_name(f'{student} ({number or lone_file})')
        while student in students:      # valid_file_name() may make two names equal
            student += '_'
        students[student] = names_of_student
    return students


def refuse_unknown_names(names: Iterable[str], students: Sequence[str]) -> None:
    """Raises ``ValueError`` if one of `names` is not a student's name."""
    for name in names:
        if name not in students:
            raise ValueError(f'no submission is called {name}; these are: '
                             + short_list(students, max_names=100))


class Submission(NamedTuple):
    """The files and folders that one student handed in."""

    student: str
    #: {file or folder: the file's name on the student's computer}. The latest upload comes last.
    files: Dict[Path, str]
    number: str = ''            # the student's number on the platform, or '' if there is none
    is_late: bool = False


def submissions_in(folder: Path, print_line: Callable[[str], None]) -> List[Submission]:
    """Returns the Submissions in a folder, sorted by student. Prints a line on each file that is
    left out. Raises ``ValueError`` or ``OSError`` if there is no submission."""
    platform_names = {}
    for path in sorted(folder.iterdir()):
        if path.name.startswith('.') or IGNORED_PATHS.search(path.name):
            continue
        is_device = not (path.is_dir() or path.is_file())
        if path.is_symlink() or is_device:      # a link may lead to another student's work
            print_line(f'left out, because it is a link or a device: {path}')
        else:
            platform_names[path.name] = platform_name_of(path.name, path.is_dir())
    if not platform_names:
        raise ValueError(f'there is no folder and no file in {folder}')
    submissions = []
    for student, names in sorted(grouped_by_student(platform_names).items()):
        files = {folder / name: platform_names[name].file or name
                 for name in sorted(names, key=_upload_key)}
        number = platform_names[names[0]].number        # all names of a student have this number
        is_late = any(platform_names[name].is_late for name in names)
        submissions.append(Submission(student, files, number, is_late))
    return submissions


def _upload_key(name):
    """Returns a key that sorts the latest upload to Canvas last."""
    repetition = CANVAS_REPETITION.search(name)
    repetition_number = int(repetition[1]) if repetition else 0
    canvas = CANVAS_NAME.fullmatch(name)
    upload_number = int(canvas['upload']) if canvas else 0
    return repetition_number, upload_number, name


class ParsedSubmission(NamedTuple):
    """The result of reading a submission. Paths are relative to the folder of the copy."""

    digest: str                     # a hash of all files of the copy
    remarks: List[str]              # for the student. prepare_workspace() adds sentences
    findings: List[str]             # for the instructor. prepare_workspace() adds sentences
    node: str                       # the node's file
    package_folder: str             # the folder of the node's package
    package_name: str               # the name in this package's package.xml, or '' if invalid
    packages: Dict[str, str]        # {name: folder}. The package nearest to the node is last
    unused_modules: List[str]       # missing modules that the node imports and does not use


def read_submission(submission: Submission, folder: Path, node_names: NodeNames,
                    chosen_package: str = '', chosen_file: str = '') -> ParsedSubmission:
    """Copy a submission into the new folder `folder` and read the copy. If `chosen_package` or
    `chosen_file` is given, the node must have this package or file name. Raises ``NotJudged`` if no
    copy can be made or read, if no file can be the node, or if the node uses a missing module."""
    files = {str(path): original_name for path, original_name in submission.files.items()}
    reader = subprocess.run(
        [*LIMIT_READER_COMMAND, sys.executable, '-c', READ_PROGRAM],
        input=json.dumps([files, str(folder), node_names, chosen_package, chosen_file]),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True,
        cwd='/',                    # python -c could import a file of the current folder
        start_new_session=True)     # Ctrl+C must not end this process
    if reader.returncode != 0:
        lines = [f'exit status {reader.returncode}', *reader.stderr.strip().splitlines()]
        raise NotJudged('It cannot be read, or its reading takes too much memory or time '
                        f'({lines[-1]}).')
    fields, reason_and_advice = json.loads(reader.stdout)
    if reason_and_advice is not None:
        raise NotJudged(*reason_and_advice)
    return ParsedSubmission(*fields)


def read_in_this_process(files: Dict[str, str], copy_path: str, node_names: Sequence[Any],
                         chosen_package: str, chosen_file: str) -> ParsedSubmission:
    """Read a submission in this process, which `read_submission` has started with limits. The
    arguments come from JSON. `files` is {path: the file's name on the student's computer}."""
    copy = Path(copy_path)
    remarks = copy_submission({Path(path): name for path, name in files.items()}, copy)
    chosen = find_node(copy, NodeNames(*node_names), chosen_package, chosen_file)
    node = copy / chosen.path
    if not node.read_bytes().strip(codecs.BOM_UTF8 + b' \t\r\n'):
        raise NotJudged(f'{chosen.path} is empty.')
    package = node_package(node, copy)
    packages = packages_in(copy, node)
    missing = find_missing_modules(node, package, copy, packages)
    if missing.used_modules:
        raise NotJudged(f'{chosen.path} needs modules that do not work on the marking machine: '
                        f"{', '.join(missing.used_modules)}.")
    remarks += chosen.remarks
    if missing.placeholders:
        names = ', '.join(missing.placeholders)
        remarks.append('Messages and services of the submission and of the skeleton stand in for '
                       f'these packages, which were not handed in: {names}.')
    manifest_name = package_name(package)
    if not manifest_name:
        remarks.append('Its package has no package.xml with a valid name.')
    return ParsedSubmission(
        digest_of(copy), remarks, chosen.findings, chosen.path, str(package.relative_to(copy)),
        manifest_name, {name: str(folder.relative_to(copy)) for name, folder in packages.items()},
        missing.unused_modules)
