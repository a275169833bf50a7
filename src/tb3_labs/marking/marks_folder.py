"""The folder that keeps the marks of a class from one run to the next.

    marks.csv, overview.html     all students
    STUDENT.html                 to hand back
    gradescope/STUDENT/          results.json
    logs/                        STUDENT.json (the observation), STUDENT.marks.json, output
"""
import hashlib
import json
from contextlib import suppress
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import rospkg

from tb3_labs.command_line import output_folder, printable, write_output
from tb3_labs.marking.feedback import Table, feedback, overview, results
from tb3_labs.marking.intake.sandbox import OWN_PACKAGE, UNPROTECTED
from tb3_labs.marking.marks import LABS, Marks, from_record, to_record
from tb3_labs.marking.trial.observation import LONGEST, Observation

#: Names of files.
TABLE, OVERVIEW, RESULTS, RECORD = 'marks.csv', 'overview.html', 'results.json', '.marks.json'
#: At most this many remarks and as many findings are written for one student.
MOST_SENTENCES = 100
#: This package, and the program of its simulated robot; an installed one lies in lib.
PACKAGE, ROBOT = Path(rospkg.RosPack().get_path(OWN_PACKAGE)), 'fake_turtlebot3.py'


class MarksFolder:
    """The marks of one lab, or of some of its parts, in a folder that is made if it is missing."""

    def __init__(self, path: Path, lab: str, parts: Sequence[str], worth: Mapping[str, float],
                 options: Dict[str, Any], rescores: bool = True) -> None:
        """`worth`: criterion -> points; `options`: all other settings of a try. ``ValueError`` if
        the folder has marks of another lab or other parts, or a table that cannot be read; unless
        it `rescores`, also if its marks have other points."""
        self._path, self.lab, self.parts, self.worth = output_folder(path), lab, parts, worth
        self.logs = output_folder(self._path / 'logs')
        decisive = hashlib.sha256(b''.join(path.read_bytes() for path in decisive_files()))
        #: Two tries of a submission that agree in all this end alike.
        self._options = options
        self._key = {'lab': lab, 'parts': sorted(parts), 'options': options,
                     'version': decisive.hexdigest()}
        #: Student -> Marks, the key of their try, and the points of each criterion on their page.
        self._kept: Dict[str, Tuple[Marks, Dict[str, Any], List[float]]] = {}
        for file in sorted(self.logs.glob('*' + RECORD)):
            self._read(file)
        self._table()
        if not rescores:
            self._check_points()

    def kept(self, student: str, submission: str) -> Optional[Marks]:
        """A student's Marks if a new try of this digest would end alike, else None."""
        marks, key, _ = self._kept.get(student, (None, None, None))
        options = dict(self._options)
        chosen = key['options'].get('name', '') if key else ''
        if '/' in chosen and not options.get('name'):   # a person chose this one's node
            options['name'] = chosen
        return marks if key == dict(self._key, submission=submission, options=options) else None

    def write(self, marks: Marks, submission: str) -> None:
        """Write the marks of one student, and forget their observation.

        `submission`: its digest; '' if it is to be tried again in the next run.
        """
        marks.unjudged = ' '.join(_cleaned([marks.unjudged]))
        marks.remarks, marks.findings = _cleaned(marks.remarks), _cleaned(marks.findings)
        self._keep(marks, dict(self._key, submission=submission))

    def write_overview(self, unprotected: bool = False) -> Tuple[Optional[Path], List[str]]:
        """Write the files about all students; `unprotected`: were there no sandboxes?

        Returns (path of the page, lines for the instructor); (None, []) if there are no marks.
        """
        all_marks = [marks for _, (marks, *_) in sorted(self._kept.items())]
        if not all_marks:
            return None, []
        write_output(self._path / TABLE, self._table().renewed(all_marks))
        renewed = [marks.student for marks in all_marks if self._renew_page(marks)]
        notes = [UNPROTECTED] * unprotected + [
            'With other points than before: {}.'.format(', '.join(renewed))] * bool(renewed) + [
            'To look at: {}: {}'.format(marks.student, finding)
            for marks in all_marks for finding in marks.findings]
        write_output(self._path / OVERVIEW, overview(all_marks, LABS[self.lab].title, notes))
        return self._path / OVERVIEW, notes

    def _read(self, file):
        try:
            record = json.loads(file.read_text(encoding='utf-8'))
            key = record['key']
            mine = [key['lab'], key['parts']] == [self.lab, sorted(self.parts)]
        except (ValueError, KeyError, TypeError):
            return      # cut off, or of another version: it is tried again
        if not mine:
            raise ValueError('{} has marks of {}, {}: choose another folder for these'.format(
                self._path, key['lab'], ', '.join(key['parts']) or 'all parts'))
        with suppress(ValueError, KeyError):    # of an older version: tried again if handed in
            self._kept[file.name[:-len(RECORD)]] = from_record(
                record, LABS[self.lab].criteria, self.worth, self.parts), key, record['page']

    def _check_points(self):
        for _, (marks, _, before_all) in sorted(self._kept.items()):
            for verdict, before in zip(marks.verdicts, before_all):
                if verdict.worth != before:
                    raise ValueError(
                        '{} was marked with other points ({}: {:g}, not {:g}): give their file by '
                        '--points; a file that is given counts for all'.format(
                            self._path, verdict.criterion.label, before, verdict.worth))

    def _table(self):
        path = self._path / TABLE
        try:
            return Table(path.read_text(encoding='utf-8') if path.exists() else '')
        except ValueError as problem:
            raise ValueError('{} cannot be read, and may hold what a person wrote: {}'.format(
                path, 'a spreadsheet must save it as "CSV UTF-8"' if isinstance(
                    problem, UnicodeDecodeError) else problem)) from None

    def _renew_page(self, marks):
        """Write the page again if points were changed. Returns True if they were."""
        _, key, shown = self._kept[marks.student]
        if shown == [verdict.worth for verdict in marks.verdicts]:
            return False
        file = self.logs / (marks.student + '.json')
        if file.exists():
            marks.observation = Observation.from_json(file.read_text())
        self._keep(marks, key)
        return True

    def _keep(self, marks, key):
        page = feedback(marks, LABS[self.lab].title)
        write_output(self._path / (marks.student + '.html'), page)
        marks.observation = None        # the observations of a class need hundreds of MB
        folder = output_folder(output_folder(self._path / 'gradescope') / marks.student)
        if marks.judged:
            write_output(folder / RESULTS, json.dumps(results(marks), indent=1))
        elif (folder / RESULTS).exists():
            (folder / RESULTS).unlink()     # of an earlier try: no longer true
        record = to_record(marks, key)
        self._kept[marks.student] = marks, key, record['page']
        write_output(self.logs / (marks.student + RECORD), json.dumps(record))


def _cleaned(sentences):
    """The first sentences, each short and printable: they may quote a submission."""
    return [printable(sentence[:LONGEST]) for sentence in sentences[:MOST_SENTENCES]]


def decisive_files() -> List[Path]:
    """The files of this package that decide a trial: nodes, robot, checks, launch files."""
    programs = [PACKAGE / 'scripts' / ROBOT, PACKAGE.parents[1] / 'lib' / OWN_PACKAGE / ROBOT]
    return sorted(Path(__file__).resolve().parents[1].glob('**/*.py')) + sorted(
        path for path in [*programs, *PACKAGE.glob('launch/**/*')]
        if path.is_file() and path.suffix != '.pyc' and path.name != 'points.yaml')
