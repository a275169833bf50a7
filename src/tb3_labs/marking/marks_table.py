"""The table of the marks, marks.csv, and the points in the course.

Columns: student, points, of (full marks), the points for each criterion, node, late, the weights of
the lab in the course, remarks, and the columns that a person has added. A person may fill in the
cells of the course. A criterion beyond the handout has 'extra_' before its name, and 'yes' or 'no'
in its cell if it is worth nothing. The points of a submission that could not be judged are empty. A
text from a submission is never written as a formula.
"""
import csv
import io
import math
from typing import Dict, List, Mapping, Optional, Sequence

from tb3_labs.marking.criteria import Outcome
from tb3_labs.marking.marks import TOTAL, Marks, Row
from tb3_labs.report.tables import safe

#: The columns of the table, and the cells of a criterion without points.
STUDENT, POINTS, OF, NODE, LATE, REMARKS = 'student', 'points', 'of', 'node', 'late', 'remarks'
YES, NO = 'yes', 'no'


class Table:
    """The table of the last run, with the cells that a person filled in; ``ValueError`` if the
    text is not such a table. It is '' in the first run."""

    def __init__(self, text: str = '') -> None:
        text = text.lstrip('\ufeff')
        heading = text.partition('\n')[0]
        delimiter = max(',;\t', key=heading.count)      # a spreadsheet may write another one
        reader = csv.DictReader(io.StringIO(text, newline=''), delimiter=delimiter)
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
        """The cells that a person filled in for a student: name of a row -> text."""
        row = self._rows.get(safe(student), {})
        return {name_in(head): text for head, text in row.items() if name_in(head)}

    def renewed(self, all_marks: Sequence[Marks], rows: Sequence[Row]) -> str:
        """The table with these marks. A person's cells and columns stay, and others' rows."""
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


def cells(rows: Sequence[Row], marks: Marks, given: Mapping[str, str]) -> List[str]:
    """The cell of each row, and that of their sum if there are several rows; `given`: name of a
    row -> a person's cell. The sum is empty until each cell is a number."""
    if not rows:
        return []
    texts = ['{:g}'.format(marks.scaled(rows[0].points)) if marks.judged else ''] + [
        given.get(row.name, '') for row in rows[1:]]
    if len(rows) == 1:
        return texts
    numbers = [number_in(text) for text in texts]
    known = [number for number in numbers if number is not None]
    return texts + ['{:g}'.format(sum(known)) if len(known) == len(rows) else '']


def labels(rows: Sequence[Row]) -> List[str]:
    """The heading of each cell of :func:`cells`: the name, and the points of full marks."""
    total = [Row(TOTAL, sum(row.points for row in rows))] if len(rows) > 1 else []
    return ['{} ({:g})'.format(*row) for row in [*rows, *total]]


def name_in(label: str) -> str:
    """Returns the name in a label, '' if it is not a label. The points in it may be old."""
    name, bracket, points = label.rpartition(' (')
    return name if bracket and number_in(points.rstrip(')')) is not None else ''


def number_in(text: str) -> Optional[float]:
    """The number in a person's text, with a comma or a point; None if it is not a number."""
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
