"""The folder that keeps the trials and the marks of a class from one run to the next.

    marks.csv, overview.html     all students
    STUDENT.html                 to hand back
    gradescope/STUDENT/          results.json
    logs/                        STUDENT.bag (the trial), STUDENT.marks.json, output

A trial is kept until something changes that acts on it: see `trial_key`. Verdicts, points and
sentences are made again from its bag in each run.
"""
import fcntl
import hashlib
import importlib
import json
import re
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import rospkg

from tb3_labs.command_line import output_folder, printable, reason, write_output
from tb3_labs.marking.intake.node_start import OWN_PACKAGE
from tb3_labs.marking.intake.sandbox import UNPROTECTED
from tb3_labs.marking.marks import LABS, Marks, judged
from tb3_labs.marking.marks_csv import POINTS, WATCHED, MarksTable, cells_of, overview
from tb3_labs.marking.student_page import results, student_page
from tb3_labs.marking.trial.from_bag import read_trial
from tb3_labs.report.page.document import safe

#: Names of files.
TABLE, OVERVIEW, RESULTS, RECORD, BAG = (
    'marks.csv', 'overview.html', 'results.json', '.marks.json', '.bag')
#: The fields of Marks that a record keeps, since the trial's bag does not have them.
RECORDED_FIELDS = ('student', 'node', 'number', 'late', 'remarks', 'findings', 'unjudged',
                   'seconds', 'places')
#: This package, and the program of its simulated robot.
PACKAGE, ROBOT = Path(rospkg.RosPack().get_path(OWN_PACKAGE)), 'fake_turtlebot3.py'
MARKING = Path(__file__).resolve().parent
#: The files of trial/ that do not act on a node: they only read a recording.
READING_FILES = 'from_bag.py', 'remarks.py'


class Options(NamedTuple):
    """Settings of the trials of a class."""

    package: str = ''           # of the node, if the lab does not know it
    name: str = ''              # of the node's file, if the lab does not know it
    option: str = ''            # the value of the lab's option; '' if it has none
    sandbox: bool = True        # do the submissions' programs run in a Sandbox?


class MarksFolder:
    """The folder with the marks of a lab, or of some of its parts. It is made if it is missing."""

    def __init__(self, path: Path, lab: str, parts: Sequence[str], worth: Mapping[str, float],
                 options: Options = Options(), rescores: bool = True) -> None:
        """`worth` has the points of each criterion.

        Raises ``ValueError`` if the folder has marks of another lab or of other parts, a table that
        cannot be read, or, unless it `rescores`, marks with other points.
        """
        self._path, self.lab, self.parts, self.worth = output_folder(path), lab, parts, worth
        self.logs, self.options = output_folder(self._path / 'logs'), options
        self._key = {'lab': lab, 'parts': sorted(parts), 'options': options._asdict(),
                     'version': trial_key(lab)}
        #: student -> record; student -> Marks whose page this run has written.
        self._records: Dict[str, Dict[str, Any]] = {}
        self._shown: Dict[str, Marks] = {}
        for file in sorted(self.logs.glob('*' + RECORD)):
            self._read_record(file)
        self._table = self._read_table()
        if not rescores:
            self._check_points()

    def bag(self, student: str) -> Path:
        """Returns the path of the bag of a student's trial."""
        return self.logs / (student + BAG)

    def _digest(self, student: str) -> str:
        """Returns a hash of a student's bag; '' if it is missing."""
        bag = self.bag(student)
        return hashlib.sha256(bag.read_bytes()).hexdigest() if bag.is_file() else ''

    def marks_if_unchanged(self, student: str, submission: str) -> Optional[Marks]:
        """Returns a student's Marks if neither the submission, of this digest, nor anything else
        has changed since its trial; else None."""
        record = self._records.get(student)
        if record is None:
            return None
        options, chosen = self.options, record['key']['options'].get('name', '')
        if '/' in chosen and not options.name:      # a person chose this student's node
            options = options._replace(name=chosen)
        if record['key'] != dict(self._key, submission=submission, options=options._asdict()):
            return None
        marks = self._show(record)
        return None if marks.unjudged else marks    # its bag is gone, or cannot be read

    def write(self, handed_in: Marks, submission: str) -> Marks:
        """Keep what was handed in, and write its page and results. Returns its Marks.

        `submission` is its digest. It is not kept if the machine delayed the trial: then the next
        run tries the submission again.
        """
        record = self._records[handed_in.student] = {
            'key': dict(self._key, submission=submission),
            'handed_in': {name: getattr(handed_in, name) for name in RECORDED_FIELDS},
            'worth': self.worth, 'bag': self._digest(handed_in.student),
            'cells': self._records.get(handed_in.student, {}).get('cells', {})}   # in the table
        marks = self._show(record)
        if marks.delayed:
            record['key']['submission'] = ''
        self._write(record)
        return marks

    def write_overview(self, unprotected: bool = False) -> Tuple[Optional[Path], List[str]]:
        """Write the table and the page of all students. `unprotected` is True if there were no
        sandboxes.

        Returns (path of the page, lines for the instructor); (None, []) if there are no marks.
        """
        if not self._records:
            return None, []
        renewed, all_marks = [], []
        for student, record in sorted(self._records.items()):
            marks = self._shown.get(student) or self._show(record)
            cells = {name: cells_of(marks)[name] for name in WATCHED}
            if record['cells'].get(POINTS) not in (None, '', cells[POINTS]):
                renewed.append(student)
            record.update(worth=self.worth, cells=cells)
            all_marks.append(marks)
        # The table is written first. With an old table and new records, cells that the marker wrote
        # would look like a person's.
        write_output(self._path / TABLE, self._table.renew(all_marks))
        for record in self._records.values():
            self._write(record)
        notes = [UNPROTECTED] if unprotected else []
        if renewed:
            notes.append(f"With other points than before: {', '.join(renewed)}.")
        notes += [f'To look at: {marks.student}: {finding}'
                  for marks in all_marks for finding in marks.findings]
        notes += [f'{TABLE} has a decision on {printable(name)}, of whom there are no marks.'
                  for name in self._decisions if name not in map(safe, self._records)]
        write_output(self._path / OVERVIEW, overview(all_marks, LABS[self.lab].title, notes))
        return self._path / OVERVIEW, notes

    def _read_record(self, file):
        try:
            record = json.loads(file.read_text(encoding='utf-8'))
            lab, parts = record['key']['lab'], record['key']['parts']
            is_complete = set(record['handed_in']) == set(RECORDED_FIELDS) and isinstance(
                record['cells'], dict) and isinstance(record['worth'], dict)
        except (ValueError, KeyError, TypeError):
            return      # incomplete, or of another version: its submission is tried again
        if [lab, parts] != [self.lab, sorted(self.parts)]:
            raise ValueError(f"{self._path} has marks of {lab}, {', '.join(parts) or 'all parts'}: "
                             'choose another folder for these')
        if is_complete:
            self._records[file.name[:-len(RECORD)]] = record

    def _check_points(self):
        for record in self._records.values():
            for name, before in record['worth'].items():
                if self.worth.get(name, before) != before:
                    raise ValueError(
                        f'{self._path} was marked with other points ({name}: {before:g}, not '
                        f'{self.worth[name]:g}): give their file by --points; a file that is given '
                        'counts for all')

    def _read_table(self):
        path = self._path / TABLE
        try:
            table = MarksTable(path.read_text(encoding='utf-8') if path.exists() else '')
            self._decisions = table.decisions(
                {safe(student): record['cells'] for student, record in self._records.items()})
            return table
        except ValueError as problem:
            why = 'a spreadsheet must save it as "CSV UTF-8"' if isinstance(
                problem, UnicodeDecodeError) else problem
            raise ValueError(
                f'{path} cannot be read, and may hold what a person wrote: {why}') from None

    def _show(self, record):
        """Write the page and the results of a record. Returns its Marks."""
        handed_in, observation = Marks(**record['handed_in']), None
        bag = self.bag(handed_in.student)
        if not handed_in.unjudged:
            try:
                if record.get('bag') != self._digest(handed_in.student):
                    raise ValueError(f'it is not in {bag} any more')
                observation = read_trial(bag, handed_in.places)
            except ValueError as problem:
                handed_in.unjudged = f'Its trial cannot be judged: {reason(problem)}.'
        try:
            marks, page = self._judged(handed_in, observation)
        except Exception as problem:    # any error: the other pages are still written
            marks, page = self._judged(replace(handed_in, unjudged=failure(problem)), None)
        write_output(self._path / (marks.student + '.html'), page)
        folder = output_folder(output_folder(self._path / 'gradescope') / marks.student)
        write_output(folder / RESULTS, json.dumps(results(marks), indent=1))
        # the observations of a class need hundreds of MB
        self._shown[marks.student] = replace(marks, observation=None)
        return marks

    def _judged(self, handed_in, observation):
        """Returns (Marks, the student's page)."""
        marks = judged(handed_in, observation, self.lab, self.worth, self.parts)
        marks.decision = self._decisions.get(safe(marks.student))
        return marks, student_page(marks, LABS[self.lab].title)

    def _write(self, record):
        write_output(self.logs / (record['handed_in']['student'] + RECORD), json.dumps(record))


def failure(problem: Exception) -> str:
    """Returns a sentence on an error of the marker itself."""
    return f'The marking of it failed: {reason(problem)} ({type(problem).__name__}).'


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Lock the folder within the ``with`` block, so that no other mark.py writes into it.
    ``ValueError`` if another one has locked it."""
    with open(str(output_folder(output_folder(path) / 'logs') / '.lock'), 'a') as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(
                f'another mark.py writes into {path}: wait until it has ended') from None
        yield


# -- the trials

def trial_key(lab: str) -> str:
    """Returns a hash of the files and constants that act on a trial of a lab. Criteria, points and
    sentences are not in it, since verdicts are made again from the recording."""
    files = trial_files(lab)
    whole = hashlib.sha256(b''.join(path.read_bytes() for path in files))
    whole.update(repr(values_in('\n'.join(
        path.read_text(encoding='utf-8') for path in files if MARKING in path.parents))).encode())
    return whole.hexdigest()


def trial_files(lab: str) -> List[Path]:
    """Returns the files that act on a node of a lab, and the files of the robot."""
    scripts = [path for path in [*MARKING.glob('trial/*.py'), *MARKING.glob('labs/ros_*.py')]
               if path.name not in READING_FILES]
    return sorted(path for path in [
        *scripts, *MARKING.parent.glob('simulation/*.py'), PACKAGE / 'scripts' / ROBOT,
        PACKAGE.parents[1] / 'lib' / OWN_PACKAGE / ROBOT,     # of an installed package
        PACKAGE / 'launch' / 'fake_robot.launch',
        PACKAGE / 'launch' / 'checks' / f'check_{lab}.test'] if path.is_file())


def values_in(scripts: str) -> Dict[str, Any]:
    """Returns 'module NAME' -> value for the constants of the labs that the text of the scripts
    names, such as places, headings and times."""
    words = sorted(set(re.findall(r'\b[A-Z][A-Z0-9_]+\b', scripts)))
    labs = [importlib.import_module('tb3_labs.marking.labs.' + path.stem)
            for path in sorted(MARKING.glob('labs/*.py')) if not path.stem.startswith('ros_')]
    return {f'{lab.__name__} {word}': getattr(lab, word)
            for lab in labs for word in words if hasattr(lab, word)}
