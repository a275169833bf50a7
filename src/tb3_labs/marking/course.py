"""What a lab counts in a course: the points of its criteria, scaled, and what a person judges.

The section `course` of a lab's points has rows of name and points, such as ``{code: 25,
demonstration: 25, report: 50}``. The first row is that of the criteria. The others are a person's.
"""
import math
from typing import Any, List, Mapping, NamedTuple, Optional, Sequence

from tb3_labs.marking.marks import Marks
from tb3_labs.marking.points import COURSE, checked_points

TOTAL = 'total'


class Row(NamedTuple):
    """One row of what a lab counts in the course."""

    name: str
    points: float      # full marks

    @property
    def label(self) -> str:
        """The name, and the points of full marks."""
        return '{} ({:g})'.format(self.name, self.points)


def course_of(lab: str, table: Any) -> List[Row]:
    """The rows of a lab's section `course`, none without one; `table`: as for points_of().

    ``ValueError`` if they are not valid.
    """
    given = table[lab].get(COURSE) or {}
    if not isinstance(given, dict):
        raise ValueError('{}: "{}" is a section of its own'.format(lab, COURSE))
    if TOTAL in given:
        raise ValueError('{}: "{}" is the sum of the other rows'.format(lab, TOTAL))
    return [Row(str(name), checked_points(lab, name, points)) for name, points in given.items()]


def scaled(marks: Marks, points: float) -> float:
    """The points that were earned if full marks are worth so many."""
    return round(points * marks.points / marks.worth, 2) if marks.worth else 0.0


def cells(rows: Sequence[Row], marks: Marks, given: Mapping[str, str]) -> List[str]:
    """The cell of each row, and of their sum if there are several rows.

    `given`: what a person wrote, by a row's name. The sum is empty until each cell is a number.
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
    if len(rows) < 2:
        return [row.label for row in rows]
    return [row.label for row in rows] + [
        Row(TOTAL, sum(row.points for row in rows)).label]


def name_in(label: str) -> str:
    """The name in a label, '' if it is none: the points may have been changed since."""
    name, bracket, points = label.rpartition(' (')
    return name if bracket and number_in(points.rstrip(')')) is not None else ''


def number_in(text: str) -> Optional[float]:
    """The number that a person wrote, with a comma or a point; None if it is none."""
    try:
        number = float(text.strip().replace(',', '.'))
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def sentence(rows: Sequence[Row], marks: Marks, given: Mapping[str, str]) -> str:
    """What it counts in the course, for the student's page; '' without rows."""
    parts = ['{} {} of {:g}'.format(row.name, cell, row.points)
             for row, cell in zip(rows, cells(rows, marks, given)) if cell.strip()]
    return 'In the course: {}.'.format(', '.join(parts)) if parts else ''
