"""The folder that keeps the trials and the marks of a class from one run of mark.py to the next.

    marks.csv, overview.html     all students
    STUDENT.html                 the page that a student gets
    gradescope/STUDENT/          results.json
    logs/                        STUDENT.bag (the trial), STUDENT.marks.json, output

A trial is kept until the submission, a setting, or one of the `trial_files` changes. Each run of
mark.py makes verdicts, points and sentences anew from the kept bags.
"""
import fcntl
import hashlib
import json
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import rospkg

from tb3_labs.command_line import error_text, output_folder, printable, write_output
from tb3_labs.marking.intake.sandbox import NO_SANDBOX_WARNING
from tb3_labs.marking.labs.gamepad import HANDOUT_PAD
from tb3_labs.marking.marks import LABS, Marks, marks_after_trial
from tb3_labs.marking.marks_csv import MarksTable, overview_page
from tb3_labs.marking.student_nodes import OWN_PACKAGE
from tb3_labs.marking.student_results import results, student_page
from tb3_labs.marking.trial.from_bag import read_trial
from tb3_labs.report.page.document import safe_cell

TABLE_FILE = 'marks.csv'
RECORD_SUFFIX = '.marks.json'
#: A student's record keeps these fields of Marks, because the bag of the trial lacks them.
RECORDED_FIELDS = ('student', 'node', 'number', 'late', 'remarks', 'findings', 'unjudged',
                   'seconds', 'path_prefixes')
PACKAGE_FOLDER = Path(rospkg.RosPack().get_path(OWN_PACKAGE))
ROBOT_SCRIPT = 'fake_turtlebot3.py'


class Options(NamedTuple):
    """Settings of the trials of a class."""

    package: str = ''           # the name of the node's package, or '' for each usual name
    name: str = ''              # the name of the node's file, or '' for each usual name
    pad: str = HANDOUT_PAD      # the kind of gamepad that the check imitates
    sandbox: bool = True        # the programs of submissions run in a Sandbox


class MarksFolder:
    """The folder with the marks of a class in a lab, or in some parts of the lab."""

    def __init__(self, path: Path, lab: str, parts: Sequence[str],
                 criterion_points: Mapping[str, float], options: Options,
                 is_for_class: bool = True) -> None:
        """Make the folder `path` if it is missing. If `is_for_class` is false, the options were
        chosen for some students. Raises ``ValueError`` if the folder contains marks of another lab
        or of other parts, or a table that cannot be read."""
        self._path = output_folder(path)
        self.logs = output_folder(self._path / 'logs')
        self.lab, self.parts, self.options = lab, parts, options
        self._is_for_class = is_for_class
        self._criterion_points = criterion_points
        trial_code = b''.join(path.read_bytes() for path in trial_files(lab))
        self._trial_settings = {
            'lab': lab, 'parts': sorted(parts),
            'version': hashlib.sha256(trial_code).hexdigest()}
        #: {student: the content of STUDENT.marks.json}
        self._records: Dict[str, Dict[str, Any]] = {}
        #: {student whose page this run has written: Marks without the observation}
        self._new_marks: Dict[str, Marks] = {}
        for file in sorted(self.logs.glob('*' + RECORD_SUFFIX)):
            self._read_record(file)
        self._table = self._read_table()

    def bag(self, student: str) -> Path:
        """Returns the path of the bag of a student's trial."""
        return self.logs / (student + '.bag')

    def _bag_digest(self, student: str) -> str:
        bag = self.bag(student)
        return hashlib.sha256(bag.read_bytes()).hexdigest() if bag.is_file() else ''

    def options_of(self, student: str) -> Options:
        """Returns the options of a student's trial. If this run names neither a package nor a
        file, the student keeps the package and the file that a person has chosen earlier."""
        record = self._records.get(student)
        if record is None or self.options.package or self.options.name:
            return self.options
        package, name = (record['key']['options'].get(key, '') for key in ('package', 'name'))
        # a path is always a choice for one student
        if not (record.get('has_own_choice') or '/' in name):
            return self.options
        return self.options._replace(package=package, name=name)

    def _key(self, student, digest):
        options = self.options_of(student)._asdict()
        return dict(self._trial_settings, submission=digest, options=options)

    def write_if_unchanged(self, student: str, digest: str) -> Optional[Marks]:
        """Write a student's page and results if the trial can be kept. Returns the Marks, or None
        if the submission's `digest`, a setting, or a file of the trial has changed."""
        record = self._records.get(student)
        if record is None:
            return None
        if record['key'] != self._key(student, digest):
            return None
        marks = self._written_marks(student)
        return None if marks.unjudged else marks    # an unjudged submission is tried again

    def _written_marks(self, student):
        """Returns a student's Marks. Writes page and results if this run has not written them."""
        if student in self._new_marks:
            return self._new_marks[student]
        return self._judge_and_write(self._records[student])

    def write_student(self, trial_marks: Marks, digest: str) -> Marks:
        """Write a student's record, page and results. Returns the Marks with points."""
        options = self.options_of(trial_marks.student)
        has_old_choice = options != self.options
        record: Dict[str, Any] = {
            'key': self._key(trial_marks.student, digest),
            'has_own_choice': has_old_choice or not self._is_for_class,
            'handed_in': {name: getattr(trial_marks, name) for name in RECORDED_FIELDS},
            'bag': self._bag_digest(trial_marks.student)}
        self._records[trial_marks.student] = record
        marks = self._judge_and_write(record)
        if marks.delay_sentence:
            record['key']['submission'] = ''    # so that the next run tries the submission again
        write_output(self.logs / (marks.student + RECORD_SUFFIX), json.dumps(record))
        return marks

    def write_overview(self) -> Tuple[Optional[Path], List[str]]:
        """Write the table and the page of all students. Returns (path of the page, lines for the
        instructor), or (None, []) if there are no marks."""
        if not self._records:
            return None, []
        all_marks = [self._written_marks(student) for student in sorted(self._records)]
        # without a byte order mark, Excel would not read the table as UTF-8
        write_output(self._path / TABLE_FILE, '\ufeff' + self._table.renewed_text(all_marks))
        notes = [] if self.options.sandbox else [NO_SANDBOX_WARNING]
        notes += self._table.change_sentences(all_marks)
        notes += [f'To look at: {marks.student}: {finding}'
                  for marks in all_marks for finding in marks.findings]
        known_names = set(map(safe_cell, self._records))
        notes += [f'{TABLE_FILE} has a decision on {printable(name)}, of whom there are no marks.'
                  for name in self._table.decisions if name not in known_names]
        page = self._path / 'overview.html'
        write_output(page, overview_page(all_marks, LABS[self.lab].title, notes))
        return page, notes

    def _read_record(self, file):
        try:
            record = json.loads(file.read_text(encoding='utf-8'))
            lab, parts = record['key']['lab'], record['key']['parts']
            is_complete = set(record['handed_in']) == set(RECORDED_FIELDS)
        except (ValueError, KeyError, TypeError):
            return      # without a record the submission is tried again
        if lab != self.lab or parts != sorted(self.parts):
            raise ValueError(f"{self._path} has marks of {lab}, {', '.join(parts) or 'all parts'}: "
                             'choose another folder for these')
        if is_complete:
            student = file.name[:-len(RECORD_SUFFIX)]
            self._records[student] = record

    def _read_table(self):
        path = self._path / TABLE_FILE
        if not path.exists():
            return MarksTable()
        try:
            return MarksTable(path.read_text(encoding='utf-8'))
        except UnicodeDecodeError:
            reason = 'a spreadsheet must save it as "CSV UTF-8"'
        except ValueError as error:
            reason = str(error)
        raise ValueError(f'{path} cannot be read, and may hold what a person wrote: {reason}')

    def _judge_and_write(self, record):
        """Write a student's page and results. Returns the Marks with points."""
        trial_marks = Marks(**record['handed_in'])
        observation = None
        if not trial_marks.unjudged:
            try:
                observation = self._read_trial(trial_marks, record.get('bag'))
            except ValueError as error:
                trial_marks.unjudged = f'Its trial cannot be judged: {error_text(error)}.'
        try:
            marks, page = self._marks_and_page(trial_marks, observation)
        except Exception as error:    # an error with one student must not end the run
            trial_marks = replace(trial_marks, unjudged=error_sentence(error))
            marks, page = self._marks_and_page(trial_marks, None)
        write_output(self._path / (marks.student + '.html'), page)
        folder = output_folder(output_folder(self._path / 'gradescope') / marks.student)
        write_output(folder / 'results.json', json.dumps(results(marks), indent=1))
        # the observation is dropped, because those of a whole class would need hundreds of MB
        self._new_marks[marks.student] = replace(marks, observation=None)
        return marks

    def _read_trial(self, trial_marks, bag_digest):
        """Returns the observation in a bag. Raises ``ValueError`` if the bag has another digest."""
        bag = self.bag(trial_marks.student)
        if bag_digest != self._bag_digest(trial_marks.student):
            raise ValueError(f'it is not in {bag} any more')
        return read_trial(bag, trial_marks.path_prefixes)

    def _marks_and_page(self, trial_marks, observation):
        marks = marks_after_trial(
            trial_marks, observation, self.lab, self._criterion_points, self.parts)
        marks.decided_points, marks.decision_reason = self._table.decisions.get(
            safe_cell(marks.student), (None, ''))
        return marks, student_page(marks, LABS[self.lab].title)


def error_sentence(problem: Exception) -> str:
    """Returns a sentence on an error in the code of the marking."""
    return f'The marking of it failed: {error_text(problem)} ({type(problem).__name__}).'


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Lock the folder `path` for other runs of mark.py during a ``with`` block. Raises
    ``ValueError`` if another run already uses the folder."""
    with open(str(output_folder(output_folder(path) / 'logs') / '.lock'), 'a') as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(
                f'another mark.py writes into {path}: wait until it has ended') from None
        yield


def trial_files(lab: str) -> List[Path]:
    """Returns the files that influence the node in a trial of a lab. The files of criteria, points
    and sentences are left out, because a change of these files needs no new trial."""
    marking = Path(__file__).resolve().parent
    installed_robot = PACKAGE_FOLDER.parents[1] / 'lib' / OWN_PACKAGE / ROBOT_SCRIPT
    paths = {*marking.glob('trial/*.py'), *marking.glob('labs/ros_*.py'),
             marking / 'labs/stimuli.py', marking.parent / 'handout.py',
             *marking.parent.glob('simulation/*.py'), PACKAGE_FOLDER / 'scripts' / ROBOT_SCRIPT,
             installed_robot, PACKAGE_FOLDER / 'launch/fake_robot.launch',
             PACKAGE_FOLDER / f'launch/checks/check_{lab}.test'}
    paths -= {marking / 'trial/from_bag.py', marking / 'trial/remarks.py'}  # these only read bags
    return sorted(path for path in paths if path.is_file())
