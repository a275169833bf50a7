"""The table of all marks, marks.csv, in which a person fills in cells.

Columns: student, points, of (full marks), the points for each criterion, node, late, the weights of
the lab in the course, remarks, and the columns that a person has added. A criterion beyond the
handout has 'extra_' before its name, and 'yes' or 'no' in its cell if it is worth nothing. The
points of a submission that could not be judged are empty. A text from a submission is never written
as a formula.

The section `course` of a lab's points has rows of name and points, such as ``{code: 25,
demonstration: 25, report: 50}``. The first row has the points of the criteria, scaled. A person
fills in the others.
"""
import csv
import io
import math
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence

from tb3_labs.marking.criteria import Outcome
from tb3_labs.marking.marks import COURSE, Marks, checked_points
from tb3_labs.report.tables import safe

STUDENT, POINTS, OF, NODE, LATE, REMARKS = 'student', 'points', 'of', 'node', 'late', 'remarks'
YES, NO = 'yes', 'no'
TOTAL = 'total'


# -- the course

class Row(NamedTuple):
    """One row of a lab's section `course`."""

    name: str
    points: float      # full marks

    @property
    def label(self) -> str:
        """The name, and the points of full marks."""
        return '{} ({:g})'.format(self.name, self.points)


def course_of(lab: str, table: Any) -> List[Row]:
    """Returns the rows of a lab's section `course`, if it has one; `table`: as for points_of().

    ``ValueError`` if they are not valid.
    """
    given = table[lab].get(COURSE) or {}
    if not isinstance(given, dict):
        raise ValueError('{}: "{}" is a section of its own'.format(lab, COURSE))
    if TOTAL in given:
        raise ValueError('{}: "{}" is the sum of the other rows'.format(lab, TOTAL))
    return [Row(str(name), checked_points(lab, name, points)) for name, points in given.items()]


def scaled(marks: Marks, points: float) -> float:
    """Returns the points that were earned, scaled so that full marks are worth `points`."""
    return round(points * marks.points / marks.worth, 2) if marks.worth else 0.0


def cells(rows: Sequence[Row], marks: Marks, given: Mapping[str, str]) -> List[str]:
    """Returns the cell of each row, and the cell of their sum if there are several rows.

    `given`: name of a row -> a person's cell. The sum is empty until each cell is a number.
    """
    if not rows:
        return []
    texts = ['{:g}'.format(scaled(marks, rows[0].points)) if marks.judged else ''] + [
        given.get(row.name, '') for row in rows[1:]]
    if len(rows) == 1:
        return texts
    numbers = [number_in(text) for text in texts]
    known = [number for number in numbers if number is not None]
    return texts + ['{:g}'.format(sum(known)) if len(known) == len(rows) else '']


def labels(rows: Sequence[Row]) -> List[str]:
    """The heading of each cell of :func:`cells`."""
    total = [Row(TOTAL, sum(row.points for row in rows))] if len(rows) > 1 else []
    return [row.label for row in [*rows, *total]]


def name_in(label: str) -> str:
    """Returns the name in a label, '' if it is not a label. The points in it may be old."""
    name, bracket, points = label.rpartition(' (')
    return name if bracket and number_in(points.rstrip(')')) is not None else ''


def number_in(text: str) -> Optional[float]:
    """Returns the number in a person's text, with a comma or a point; None if it is not a
    number."""
    try:
        number = float(text.strip().replace(',', '.'))
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def sentence(rows: Sequence[Row], marks: Marks, given: Mapping[str, str]) -> str:
    """The points in the course, for the student's page; '' without rows."""
    parts = ['{} {} of {:g}'.format(row.name, cell, row.points)
             for row, cell in zip(rows, cells(rows, marks, given)) if cell.strip()]
    return 'In the course: {}.'.format(', '.join(parts)) if parts else ''


# -- the table

class Table:
    """The table of the last run, with the cells that a person filled in.

    `text` is '' in the first run. ``ValueError`` if the text is not such a table.
    """

    def __init__(self, text: str = '') -> None:
        text = text.lstrip('\ufeff')
        heading = text.partition('\n')[0]
        mark = max(',;\t', key=heading.count)       # a spreadsheet may write another mark
        reader = csv.DictReader(io.StringIO(text, newline=''), delimiter=mark)
        self._heads: List[str] = list(reader.fieldnames or [])
        if self._heads and self._heads[:3] != [STUDENT, POINTS, OF]:
            raise ValueError('it does not begin with the columns {}, {}, {}'.format(
                STUDENT, POINTS, OF))
        try:
            self._rows: Dict[str, Dict[str, str]] = {
                row[STUDENT]: {head: row[head] or '' for head in self._heads} for row in reader}
        except csv.Error as problem:
            raise ValueError(str(problem)) from None

    def given(self, student: str) -> Dict[str, str]:
        """Returns the cells that a person filled in for a student: name of a row -> text."""
        row = self._rows.get(safe(student), {})
        return {name_in(head): text for head, text in row.items() if name_in(head)}

    def renewed(self, all_marks: Sequence[Marks], rows: Sequence[Row]) -> str:
        """Returns the table with these marks in place of the old ones.

        The cells and columns that a person filled in stay. The rows of other students stay.
        """
        some = all_marks[0]
        heads = [STUDENT, POINTS, OF] + [v.criterion.label for v in some.graded + some.extra] + [
            NODE, LATE] + labels(rows) + [REMARKS]
        added = self._heads[self._heads.index(REMARKS) + 1:] if REMARKS in self._heads else []
        out = io.StringIO(newline='')
        writer = csv.writer(out, lineterminator='\n')
        writer.writerow(heads + added)
        others = dict(self._rows)
        for marks in all_marks:
            old = others.pop(safe(marks.student), {})
            writer.writerow(_cells(marks, rows, self.given(marks.student))
                            + [old.get(head, '') for head in added])
        for student, old in others.items():
            given = self.given(student)
            writer.writerow([old.get(head) or given.get(name_in(head), '')
                             for head in heads + added])
        return out.getvalue()


def _cells(marks, rows, given):
    points = ['{:g}'.format(v.points) for v in marks.graded] + [
        '{:g}'.format(v.points) if v.worth else YES if v.outcome is Outcome.MET else NO
        for v in marks.extra]
    return ([safe(marks.student), '{:g}'.format(marks.points) if marks.judged else '',
             '{:g}'.format(marks.worth)]
            + (points if marks.judged else [''] * len(points))
            + [safe(marks.node), YES if marks.late else '']
            + cells(rows, marks, given) + [safe(' '.join(marks.sentences))])
