"""The folder of the marks, which keeps them from one run to the next.

    marks.csv, overview.html     all students
    STUDENT.html                 to hand back
    gradescope/STUDENT/          results.json
    logs/                        STUDENT.json (the observation), STUDENT.marks.json, output

Columns of marks.csv: student, points, of (full marks), the points for each criterion, node,
remarks, and columns that a person has added. A criterion beyond the handout has 'extra_' before its
name, and 'yes' or 'no' in its cell if it is worth nothing. The points of a submission that could
not be judged are empty. A text from a submission is never written as a formula.
"""
import csv
import hashlib
import io
import json
import os
from pathlib import Path
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple

from tb3_labs.command_line import printable
from tb3_labs.marking.criteria import Outcome
from tb3_labs.marking.feedback import feedback, overview, results
from tb3_labs.marking.marks import KEY, LABS, Marks, from_record, to_record
from tb3_labs.marking.observation import LONGEST, Observation
from tb3_labs.marking.sandbox import UNPROTECTED
from tb3_labs.report.tables import safe

#: Names of files.
TABLE, OVERVIEW, RESULTS, RECORD = 'marks.csv', 'overview.html', 'results.json', '.marks.json'
#: Key of a record: the points of each criterion on the student's page.
PAGE = 'page'
#: At most this many remarks and as many findings are written for one student.
MOST_SENTENCES = 100
#: Keys of a record's KEY: two tries that agree in all of them end alike.
LAB, PARTS, SUBMISSION, OPTIONS, VERSION = 'lab', 'parts', 'submission', 'options', 'version'
#: Columns of the table, and the cells of a criterion without points.
STUDENT, POINTS, OF, NODE, REMARKS = 'student', 'points', 'of', 'node', 'remarks'
YES, NO = 'yes', 'no'


class MarksFolder:
    """The marks of one lab, or of some of its parts, in a folder that is made if it is missing."""

    def __init__(self, path: Path, lab: str, parts: Iterable[str], worth: Mapping[str, float],
                 options: Dict[str, Any], rescores: bool = True) -> None:
        """`worth`: criterion -> points; `options`: all other settings of a try. ``ValueError`` if
        the folder has marks of another lab or other parts, or a table that cannot be read; unless
        it `rescores`, also if its marks have other points."""
        self._path, self._lab, self._parts = Path(path), lab, sorted(parts)
        self.logs = self._path / 'logs'
        self._worth = worth
        self._key = {LAB: lab, PARTS: self._parts, OPTIONS: options, VERSION: _version()}
        self.logs.mkdir(parents=True, exist_ok=True)
        self._records: Dict[str, Dict[str, Any]] = {}
        for file in sorted(self.logs.glob('*' + RECORD)):
            self._read(file)
        self._table()
        if not rescores:
            self._check_points()

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
        marks.unjudged = ' '.join(_cleaned([marks.unjudged]))
        marks.remarks, marks.findings = _cleaned(marks.remarks), _cleaned(marks.findings)
        self._keep(marks, to_record(marks, self._key_of(submission)))

    def write_overview(self, unprotected: bool = False) -> Tuple[Optional[Path], List[str]]:
        """Write the files about all students; `unprotected`: were there no sandboxes?

        Returns (path of the page, lines for the instructor); (None, []) if there are no marks.
        """
        all_marks = [marks for marks, _ in self._of_all()]
        if not all_marks:
            return None, []
        _replace(self._path / TABLE, self._table().renewed(all_marks))
        renewed = [marks.student for marks in all_marks if self._renew_page(marks)]
        notes = [UNPROTECTED] * unprotected + [
            'With other points than before: {}.'.format(', '.join(renewed))] * bool(renewed) + [
            'To look at: {}: {}'.format(marks.student, finding)
            for marks in all_marks for finding in marks.findings]
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

    def _check_points(self):
        for marks, before_all in self._of_all():
            for verdict, before in zip(marks.verdicts, before_all):
                if verdict.worth != before:
                    raise ValueError(
                        '{} was marked with other points ({}: {:g}, not {:g}): give their file by '
                        '--points; a file that is given counts for all'.format(
                            self._path, verdict.criterion.label, before, verdict.worth))

    def _key_of(self, submission):
        return dict(self._key, **{SUBMISSION: submission})

    def _of_all(self):
        """Yields (Marks, points of each criterion on the student's page)."""
        for _, record in sorted(self._records.items()):
            try:
                yield self._marks(record), record[PAGE]
            except (ValueError, KeyError):
                continue    # the record is of an older version, and nothing new was handed in

    def _marks(self, record):
        return from_record(record, LABS[self._lab].criteria, self._worth, self._parts)

    def _table(self):
        path = self._path / TABLE
        try:
            return Table(path.read_text(encoding='utf-8') if path.exists() else '')
        except ValueError as problem:
            raise ValueError('{} cannot be read, and may hold what a person wrote: {}'.format(
                path, problem)) from None

    def _renew_page(self, marks):
        """Write the page again if points were changed. Returns True if they were."""
        record = self._records[marks.student]
        if record[PAGE] == _shown(marks):
            return False
        file = self.logs / (marks.student + '.json')
        if file.exists():
            marks.observation = Observation.from_json(file.read_text())
        self._keep(marks, record)
        return True

    def _keep(self, marks, record):
        page = feedback(marks, LABS[self._lab].title)
        _replace(self._path / (marks.student + '.html'), page)
        marks.observation = None        # the observations of a class need hundreds of MB
        folder = self._path / 'gradescope' / marks.student
        folder.mkdir(parents=True, exist_ok=True)
        if marks.judged:
            _replace(folder / RESULTS, json.dumps(results(marks), indent=1))
        elif (folder / RESULTS).exists():
            (folder / RESULTS).unlink()     # of an earlier try: no longer true
        self._records[marks.student] = dict(record, **{PAGE: _shown(marks)})
        _replace(self.logs / (marks.student + RECORD), json.dumps(self._records[marks.student]))


def _shown(marks):
    return [verdict.worth for verdict in marks.verdicts]


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


# -- the table

class Table:
    """The table of the last run, with the columns and rows that a person added; ``ValueError`` if
    the text is not such a table. It is '' in the first run."""

    def __init__(self, text: str = '') -> None:
        text = text.lstrip('\ufeff')
        heading = text.partition('\n')[0]
        delimiter = max(',;\t', key=heading.count)      # a spreadsheet may write another one
        try:
            rows = list(filter(None, csv.reader(io.StringIO(text, newline=''),
                                                delimiter=delimiter)))
        except csv.Error as problem:
            raise ValueError(str(problem)) from None
        self._heads, self._rows = (rows[0], rows[1:]) if rows else ([], [])
        if rows and self._heads[:3] != [STUDENT, POINTS, OF]:
            raise ValueError('it does not begin with the columns {}, {}, {}'.format(
                STUDENT, POINTS, OF))

    def renewed(self, all_marks: Sequence[Marks]) -> str:
        """The table with these marks. A person's columns stay, and others' rows, also if several
        have one name."""
        some = all_marks[0]
        heads = [STUDENT, POINTS, OF] + [v.criterion.label for v in some.graded + some.extra] + [
            NODE, REMARKS]
        nowhere = max(map(len, [self._heads, *self._rows]))
        places = [self._heads.index(head) if head in self._heads else nowhere for head in heads]
        added = [place for place in range(nowhere) if place not in places]

        def cells(row: List[str], of: Sequence[int]) -> List[str]:
            return [row[place] if place < len(row) else '' for place in of]
        out = io.StringIO(newline='')
        writer = csv.writer(out, lineterminator='\n')
        writer.writerow(heads + cells(self._heads, added))
        others = list(self._rows)
        for marks in all_marks:
            old = next((row for row in others if row[0] == safe(marks.student)), None)
            if old is not None:
                others.remove(old)
            writer.writerow(_cells(marks) + cells(old or [], added))
        for row in others:
            writer.writerow(cells(row, places + added))
        return out.getvalue()


def _cells(marks):
    points = ['{:g}'.format(v.points) for v in marks.graded] + [
        '{:g}'.format(v.points) if v.worth else YES if v.outcome is Outcome.MET else NO
        for v in marks.extra]
    return ([safe(marks.student), '{:g}'.format(marks.points) if marks.judged else '',
             '{:g}'.format(marks.worth)]
            + (points if marks.judged else [''] * len(points))
            + [safe(marks.node), safe(' '.join(marks.sentences))])
