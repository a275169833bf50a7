"""The table of all marks, marks.csv, in which a person fills in cells.

Columns: student, points, of (full marks), the points for each criterion, node, late, what the lab
counts in the course, remarks, and the columns that a person has added. A criterion beyond the
handout has 'extra_' before its name, and 'yes' or 'no' if it is worth nothing. The points of a
submission that could not be judged are empty. What a stranger may have written is no formula.
"""
import csv
import io
from typing import Dict, List, Sequence

from tb3_labs.marking import course
from tb3_labs.marking.criteria import Outcome
from tb3_labs.marking.marks import Marks
from tb3_labs.report.tables import safe

STUDENT, POINTS, OF, NODE, LATE, REMARKS = 'student', 'points', 'of', 'node', 'late', 'remarks'
YES, NO = 'yes', 'no'


class Table:
    """The table as it was, by which what a person wrote is kept. `text` is '' at first.

    ``ValueError`` if the text is no such table.
    """

    def __init__(self, text: str = '') -> None:
        text = text.lstrip('\ufeff')
        heading = text.partition('\n')[0]
        mark = max(',;\t', key=heading.count)       # spreadsheets have their own minds
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
        """What a person wrote of a student: the name of a course's row -> text."""
        row = self._rows.get(safe(student), {})
        return {course.name_in(head): text for head, text in row.items() if course.name_in(head)}

    def renewed(self, all_marks: Sequence[Marks], rows: Sequence[course.Row]) -> str:
        """The table with these marks in place of the old ones.

        The cells and the columns that a person filled in stay, and the rows of other students.
        """
        some = all_marks[0]
        heads = [STUDENT, POINTS, OF] + [v.criterion.label for v in some.graded + some.extra] + [
            NODE, LATE] + course.labels(rows) + [REMARKS]
        added = [head for head in self._heads[self._heads.index(REMARKS) + 1:]] \
            if REMARKS in self._heads else []
        out = io.StringIO(newline='')
        writer = csv.writer(out, lineterminator='\n')
        writer.writerow(heads + added)
        students = set()
        for marks in all_marks:
            old = self._rows.get(safe(marks.student), {})
            students.add(safe(marks.student))
            writer.writerow(_cells(marks, rows, self.given(marks.student))
                            + [old.get(head, '') for head in added])
        for student, old in self._rows.items():
            if student not in students:
                given = self.given(student)
                writer.writerow([old.get(head) or given.get(course.name_in(head), '')
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
            + course.cells(rows, marks, given) + [safe(' '.join(marks.sentences))])
