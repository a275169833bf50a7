"""The folder that keeps the trials and the marks of a class from one run to the next.

    marks.csv, overview.html     all students
    STUDENT.html                 to hand back
    gradescope/STUDENT/          results.json
    logs/                        STUDENT.bag (the trial), STUDENT.marks.json, output

A trial is kept as long as another one would be the same (trial_key.py). Verdicts, points and
sentences are made again from its bag in each run.
"""
import fcntl
import hashlib
import json
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple

from tb3_labs.command_line import output_folder, printable, reason, write_output
from tb3_labs.marking.intake.sandbox import UNPROTECTED
from tb3_labs.marking.marks import LABS, Marks, judged
from tb3_labs.marking.marks_csv import POINTS, WATCHED, MarksTable, cells_of, overview
from tb3_labs.marking.student_page import results, student_page
from tb3_labs.marking.trial.from_bag import read_trial
from tb3_labs.marking.trial_key import version
from tb3_labs.report.page.document import safe

#: Names of files.
TABLE, OVERVIEW, RESULTS, RECORD, BAG = (
    'marks.csv', 'overview.html', 'results.json', '.marks.json', '.bag')
#: The parts of Marks that a record keeps, since the trial's bag does not have them.
HANDED_IN = ('student', 'node', 'number', 'late', 'remarks', 'findings', 'unjudged', 'seconds',
             'private_paths')


class MarksFolder:
    """The marks of one lab, or of some of its parts, in a folder that is made if it is missing."""

    def __init__(self, path: Path, lab: str, parts: Sequence[str], worth: Mapping[str, float],
                 options: Dict[str, Any], rescores: bool = True) -> None:
        """`worth`: criterion -> points; `options`: all other settings of a try. ``ValueError`` if
        the folder has marks of another lab or other parts, or a table that cannot be read; unless
        it `rescores`, also if its marks have other points."""
        self._path, self.lab, self.parts, self.worth = output_folder(path), lab, parts, worth
        self.logs = output_folder(self._path / 'logs')
        self._options = options
        #: Two trials of a submission that agree in all this end alike.
        self._key = {'lab': lab, 'parts': sorted(parts), 'options': options,
                     'version': version(lab)}
        #: Student -> record; student -> Marks whose page this run has written.
        self._records: Dict[str, Dict[str, Any]] = {}
        self._shown: Dict[str, Marks] = {}
        for file in sorted(self.logs.glob('*' + RECORD)):
            self._read(file)
        self._table = self._read_table()
        if not rescores:
            self._check_points()

    def bag(self, student: str) -> Path:
        """The place of the bag of a student's trial."""
        return self.logs / (student + BAG)

    def _digest(self, student: str) -> str:
        """A hash of this bag; '' if there is none."""
        bag = self.bag(student)
        return hashlib.sha256(bag.read_bytes()).hexdigest() if bag.is_file() else ''

    def kept(self, student: str, submission: str) -> Optional[Marks]:
        """A student's Marks if a new trial of this digest would be the same, else None."""
        record = self._records.get(student)
        if record is None:
            return None
        options, chosen = dict(self._options), record['key']['options'].get('name', '')
        if '/' in chosen and not options.get('name'):   # a person chose this one's node
            options['name'] = chosen
        if record['key'] != dict(self._key, submission=submission, options=options):
            return None
        marks = self._show(record)
        return None if marks.unjudged else marks    # its bag is gone, or cannot be read

    def judged(self, handed_in: Marks) -> Marks:
        """The Marks, computed from the trial's bag and a person's decisions."""
        observation = None
        if not handed_in.unjudged:
            try:
                observation = read_trial(self.bag(handed_in.student), handed_in.private_paths)
            except ValueError as problem:
                handed_in = replace(handed_in, unjudged='Its trial cannot be judged: {}.'.format(
                    reason(problem)))
        marks = judged(handed_in, observation, self.lab, self.worth, self.parts)
        marks.decision = self._decisions.get(safe(handed_in.student))
        return marks

    def write(self, handed_in: Marks, submission: str) -> Marks:
        """Keep what was handed in, and write page and results of its Marks, which are returned.

        `submission`: its digest; '' if the next run must try it again.
        """
        record = self._records[handed_in.student] = {
            'key': dict(self._key, submission=submission),
            'handed_in': {name: getattr(handed_in, name) for name in HANDED_IN},
            'worth': self.worth, 'bag': self._digest(handed_in.student),
            'cells': self._records.get(handed_in.student, {}).get('cells', {})}   # in the table
        self._write(record)
        return self._show(record)

    def write_overview(self, unprotected: bool = False) -> Tuple[Optional[Path], List[str]]:
        """Write the files about all students; `unprotected`: were there no sandboxes?

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
        # the table first: without it the old cells would look like a person's
        write_output(self._path / TABLE, self._table.renewed(all_marks))
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

    def _read(self, file):
        try:
            record = json.loads(file.read_text(encoding='utf-8'))
            key, lab, parts = record['key'], record['key']['lab'], record['key']['parts']
            is_whole = set(record['handed_in']) == set(HANDED_IN) and isinstance(
                record['cells'], dict) and isinstance(record['worth'], dict)
        except (ValueError, KeyError, TypeError):
            return      # cut off, or of another version: it is tried again
        if [lab, parts] != [self.lab, sorted(self.parts)]:
            raise ValueError('{} has marks of {}, {}: choose another folder for these'.format(
                self._path, key['lab'], ', '.join(key['parts']) or 'all parts'))
        if is_whole:
            self._records[file.name[:-len(RECORD)]] = record

    def _check_points(self):
        for record in self._records.values():
            for name, before in record['worth'].items():
                if self.worth.get(name, before) != before:
                    raise ValueError(
                        '{} was marked with other points ({}: {:g}, not {:g}): give their file by '
                        '--points; a file that is given counts for all'.format(
                            self._path, name, before, self.worth[name]))

    def _read_table(self):
        path = self._path / TABLE
        try:
            table = MarksTable(path.read_text(encoding='utf-8') if path.exists() else '')
            self._decisions = table.decisions(
                {safe(student): record['cells'] for student, record in self._records.items()})
            return table
        except ValueError as problem:
            raise ValueError('{} cannot be read, and may hold what a person wrote: {}'.format(
                path, 'a spreadsheet must save it as "CSV UTF-8"' if isinstance(
                    problem, UnicodeDecodeError) else problem)) from None

    def _show(self, record):
        """Write the page and the results of a record; returns its Marks."""
        handed_in, title = Marks(**record['handed_in']), LABS[self.lab].title
        if not handed_in.unjudged and record.get('bag') != self._digest(handed_in.student):
            handed_in.unjudged = 'Its trial cannot be judged: it is not in {} any more.'.format(
                self.bag(handed_in.student))
        try:
            marks = self.judged(handed_in)
            page = student_page(marks, title)
        except Exception as problem:    # any error: the other pages are still written
            marks = self.judged(replace(handed_in, unjudged='The marking of it failed: {} ({}).'
                                        .format(reason(problem), type(problem).__name__)))
            page = student_page(marks, title)
        write_output(self._path / (marks.student + '.html'), page)
        folder = output_folder(output_folder(self._path / 'gradescope') / marks.student)
        write_output(folder / RESULTS, json.dumps(results(marks), indent=1))
        marks.observation = None        # the observations of a class need hundreds of MB
        self._shown[marks.student] = marks
        return marks

    def _write(self, record):
        write_output(self.logs / (record['handed_in']['student'] + RECORD), json.dumps(record))


@contextmanager
def alone_in(path: Path) -> Iterator[None]:
    """Nobody else writes marks into this folder within the ``with`` block; ``ValueError`` if
    somebody does already."""
    with open(str(output_folder(output_folder(path) / 'logs') / '.lock'), 'a') as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError('another mark.py writes into {}: wait until it has ended'.format(
                path)) from None
        yield
