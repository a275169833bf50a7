"""The folder of the marks, which keeps them from one run to the next.

    marks.csv, overview.html     all students
    STUDENT.html                 to hand back
    gradescope/STUDENT/          results.json
    logs/                        STUDENT.json (the observation), STUDENT.marks.json, output

A person may fill in cells of marks.csv; they are kept, too.
"""
import hashlib
import json
import os
from datetime import datetime
from pathlib import Path
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple

import rospkg

from tb3_labs.marking.conduct import NODE_TEXT, for_instructor
from tb3_labs.marking.feedback import feedback, overview, results
from tb3_labs.marking.marks import KEY, LABS, MARKS, Marks, Row, from_record, to_record
from tb3_labs.marking.marks_table import LATE, Table, sentence
from tb3_labs.marking.names import printable
from tb3_labs.marking.observation import Observation

#: Names of files.
TABLE, OVERVIEW, RESULTS, RECORD = 'marks.csv', 'overview.html', 'results.json', '.marks.json'
#: Key of a record: the values on the student's page that may change without a try.
PAGE = 'page'
#: At most MOST_SENTENCES remarks and as many findings are written for one student. Each has at most
#: LONGEST characters.
MOST_SENTENCES, LONGEST = 100, 2000
#: Keys of a record's KEY: two tries that agree in all of them end alike.
LAB, PARTS, SUBMISSION, OPTIONS, VERSION = 'lab', 'parts', 'submission', 'options', 'version'
#: Folders with nodes of this package; the students' nodes are compared with these.
FOLDERS = ('scripts', 'src/tb3_labs/nodes', 'test/ros/student_nodes')


class MarksFolder:
    """The marks of one lab, or of some of its parts, in a folder that is made if it is missing."""

    def __init__(self, path: Path, lab: str, parts: Iterable[str], worth: Mapping[str, float],
                 rows: Sequence[Row], options: Dict[str, Any]) -> None:
        """`worth`: criterion -> points; `rows`: of the course; `options`: all other
        settings of a try. ``ValueError`` if the folder has marks of another lab or other parts."""
        self._path, self._lab, self._parts = Path(path), lab, sorted(parts)
        self.logs = self._path / 'logs'
        self._worth, self._rows = worth, rows
        self._key = {LAB: lab, PARTS: self._parts, OPTIONS: options, VERSION: _version()}
        self.logs.mkdir(parents=True, exist_ok=True)
        self._records: Dict[str, Dict[str, Any]] = {}
        for file in sorted(self.logs.glob('*' + RECORD)):
            self._read(file)
        self._table()       # fails at once if the table cannot be read

    def kept(self, student: str, submission: str) -> Optional[Marks]:
        """A student's Marks if a new try of this digest would end alike, else None."""
        record = self._records.get(student)
        if record is None or record[KEY] != self._key_of(submission):
            return None
        return self._marks(record)

    def write(self, marks: Marks, submission: str) -> None:
        """Write the marks of one student, and forget their observation.

        `submission`: its digest; '' if it is to be tried again in the next run.
        """
        marks.remarks, marks.findings = _cleaned(marks.remarks), _cleaned(marks.findings)
        self._keep(marks, to_record(marks, self._key_of(submission)))

    def set_late(self, student: str, late: str) -> None:
        """Set the sentence on lateness in a student's marks; '': handed in on time."""
        self._records[student][MARKS][LATE] = late

    def write_overview(self, unprotected: bool = False,
                       given: Sequence[str] = ()) -> Tuple[Optional[Path], List[str]]:
        """Write the files about all students; arguments: as for for_instructor().

        Returns (path of the page, lines for the instructor); (None, []) if there are no marks.
        """
        all_marks = []
        for _, record in sorted(self._records.items()):
            try:
                all_marks.append(self._marks(record))
            except ValueError:
                continue    # the record is of an older version, and nothing new was handed in
        if not all_marks:
            return None, []
        _replace(self._path / TABLE, self._table().renewed(all_marks, self._rows))
        for marks in all_marks:
            self._renew_page(marks)
        nodes = {file.name[:-len(NODE_TEXT)]: file.read_text(errors='replace')
                 for file in sorted(self.logs.glob('*' + NODE_TEXT))}
        notes = for_instructor(all_marks, nodes, _own_nodes(), unprotected, given)
        _replace(self._path / OVERVIEW, overview(all_marks, LABS[self._lab].title, notes))
        return self._path / OVERVIEW, notes

    def _read(self, file):
        try:
            record = json.loads(file.read_text(encoding='utf-8'))
            key = record[KEY]
            mine = (key[LAB], key[PARTS]) == (self._lab, self._parts)
        except (ValueError, KeyError, TypeError):
            return      # cut off, or of another version: it is tried again
        if not mine:
            raise ValueError('{} has marks of {}, {}: choose another folder for these'.format(
                self._path, key[LAB], ', '.join(key[PARTS]) or 'all parts'))
        self._records[file.name[:-len(RECORD)]] = record

    def _key_of(self, submission):
        return dict(self._key, **{SUBMISSION: submission})

    def _marks(self, record):
        return from_record(record, LABS[self._lab].criteria, self._worth, self._parts)

    def _table(self):
        path = self._path / TABLE
        try:
            return Table(path.read_text(encoding='utf-8') if path.exists() else '')
        except ValueError as problem:
            raise ValueError('{} cannot be read, and may hold what a person wrote: {}'.format(
                path, problem)) from None

    def _page_of(self, marks):
        course = sentence(self._rows, marks, self._table().given(marks.student))
        return [course, marks.late] + [verdict.worth for verdict in marks.verdicts]

    def _renew_page(self, marks):
        """Write the page again if points were changed, or a person filled in cells."""
        record = self._records[marks.student]
        if record[PAGE] == self._page_of(marks):
            return
        file = self.logs / (marks.student + '.json')
        if file.exists():
            marks.observation = Observation.from_json(file.read_text())
        self._keep(marks, record)

    def _keep(self, marks, record):
        shown = self._page_of(marks)
        page = feedback(marks, LABS[self._lab].title, shown[0])
        _replace(self._path / (marks.student + '.html'), page)
        marks.observation = None        # the observations of a class need hundreds of MB
        folder = self._path / 'gradescope' / marks.student
        folder.mkdir(parents=True, exist_ok=True)
        if marks.judged:
            _replace(folder / RESULTS, json.dumps(results(marks, self._rows), indent=1))
        elif (folder / RESULTS).exists():
            (folder / RESULTS).unlink()     # of an earlier try: no longer true
        self._records[marks.student] = dict(record, **{PAGE: shown})
        _replace(self.logs / (marks.student + RECORD), json.dumps(self._records[marks.student]))


def late_by(due: datetime, handed_in: Optional[datetime], what: str) -> str:
    """A sentence if the thing `what` was handed in late, else ''."""
    if handed_in is None or handed_in <= due:
        return ''
    return 'Late: {} is of {:%Y-%m-%d %H:%M}, it was due {:%Y-%m-%d %H:%M}.'.format(
        what, handed_in, due)


def due_time(text: str) -> datetime:
    """The time 'YYYY-MM-DD HH:MM', or 23:59 of a date; ``ValueError`` for any other text."""
    try:
        return datetime.strptime(text if ':' in text else text + ' 23:59', '%Y-%m-%d %H:%M')
    except ValueError:
        raise ValueError('{!r} is not a time such as "2026-11-20 23:59"'.format(text)) from None


def _cleaned(sentences):
    """The first sentences, each short and printable: they may quote a submission."""
    return [printable(sentence[:LONGEST]) for sentence in sentences[:MOST_SENTENCES]]


def _replace(path, text):
    """Write a file; after an interruption it has either the whole old text or the whole new one."""
    part = path.with_name(path.name + '.part')
    part.write_text(text, encoding='utf-8', errors='backslashreplace')
    os.replace(str(part), str(path))


def _version():
    """A text that changes with the code of the marking."""
    whole = hashlib.sha256()
    for path in sorted(Path(__file__).resolve().parent.glob('*.py')):
        whole.update(path.read_bytes())
    return whole.hexdigest()


def _own_nodes():
    """Returns name -> program of the nodes of this package, if its sources are here."""
    place = Path(rospkg.RosPack().get_path('tb3_labs'))
    return {'tb3_labs/{}/{}'.format(folder, path.name): path.read_text(errors='replace')
            for folder in FOLDERS for path in sorted((place / folder).glob('*.py'))}
