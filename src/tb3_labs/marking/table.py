"""The table of a class, marks.csv: the marker's columns, and those that a person fills in.

Columns: student, points, of (full marks), the points for each criterion, node, remarks, id (of the
student on the learning platform), late, decided, reason; then the columns that a person has added.
A criterion beyond the handout has 'extra_' before its name, and 'yes' or 'no' in its cell if it is
worth nothing. The points of a submission that could not be judged are empty. A text from a
submission is never written as a formula.

A person decides by points in `decided`, and may give a `reason`. Points or remarks that a person
has written over the marker's own are taken for both.
"""
import csv
import io
import math
from typing import Dict, Mapping, Sequence

from tb3_labs.marking.labs.criteria import Outcome
from tb3_labs.marking.marks import Decision, Marks
from tb3_labs.report.page.document import safe

#: The first columns; the columns of a person's decision.
FIRST = STUDENT, POINTS, OF = ['student', 'points', 'of']
DECIDED, REASON, REMARKS = 'decided', 'reason', 'remarks'
#: A spreadsheet has no longer cell; what a person wrote may be longer.
LONGEST_CELL = 32767
csv.field_size_limit(2 ** 31 - 1)


class Table:
    """The table of the last run; ``ValueError`` if the text is not such a table. It is '' in the
    first run."""

    def __init__(self, text: str = '') -> None:
        text = text.lstrip('\ufeff')
        heading = text.partition('\n')[0]
        delimiter = max(',;\t', key=heading.count)      # a spreadsheet may write another one
        try:
            rows = list(filter(None, csv.reader(io.StringIO(text, newline=''),
                                                delimiter=delimiter)))
        except csv.Error as problem:
            raise ValueError(str(problem)) from None
        if rows and rows[0][:3] != FIRST:
            raise ValueError('it does not begin with the columns ' + ', '.join(FIRST))
        self._width = max(map(len, rows), default=0)
        # all rows have one more cell, which is empty
        self._heads, *self._rows = [row + [''] * (self._width + 1 - len(row))
                                    for row in rows or [[]]]

    def decisions(self, written: Mapping[str, Mapping[str, str]]) -> Dict[str, Decision]:
        """What a person has decided: student -> Decision. `written`: what the marker wrote into
        the cells of each student, {student: {POINTS: ..., REMARKS: ...}}.

        ``ValueError`` with student and cell if it is not a number of points.
        """
        found = {}
        for row in self._rows:
            cells = dict(zip(self._heads, row))
            student = next((name for name in written if safe(name) == row[0]), None)
            if student is None or student in found:
                continue
            edited = {name: cells[name] for name in written[student]
                      if not _is_same(cells.get(name, ''), written[student][name])}
            points = cells.get(DECIDED, '') or edited.get(POINTS, '')
            why = cells.get(REASON, '') or edited.get(REMARKS, '')
            if points or why:
                found[student] = Decision(_number(student, points) if points else None, why)
        return found

    def renewed(self, all_marks: Sequence[Marks]) -> str:
        """The table with these marks. A person's columns stay, and others' rows, also if several
        have one name."""
        heads = list(cells_of(all_marks[0]))
        places = [self._heads.index(head) if head in self._heads else -1 for head in heads]
        added = [place for place in range(self._width) if place not in places]
        out = io.StringIO(newline='')
        writer = csv.writer(out, lineterminator='\n')
        writer.writerow(heads + [self._heads[place] for place in added])
        others = list(self._rows)
        for marks in all_marks:
            old = next((row for row in others if row[0] == safe(marks.student)), None)
            if old is not None:
                others.remove(old)
            writer.writerow([*cells_of(marks).values()]
                            + [old[place] if old else '' for place in added])
        for row in others:
            writer.writerow([row[place] for place in places + added])
        return out.getvalue()


def cells_of(marks: Marks) -> Dict[str, str]:
    """The marker's cells of a row: column -> text."""
    is_judged = not marks.unjudged
    cells = {STUDENT: safe(marks.student), POINTS: _points(marks.points) if marks.is_known else '',
             OF: _points(marks.worth)}
    for verdict in marks.graded + marks.extra:
        says = 'yes' if verdict.outcome is Outcome.MET else 'no'
        is_free = verdict.criterion.extra and not verdict.worth
        cells[verdict.criterion.label] = '' if not is_judged else (
            says if is_free else _points(verdict.points))
    decision = marks.decision
    cells.update({
        'node': safe(marks.node), REMARKS: safe(' '.join(marks.sentences)[:LONGEST_CELL - 10]),
        'id': safe(marks.number), 'late': 'late' if marks.late else '',
        DECIDED: _points(decision.points) if decision and decision.points is not None else '',
        REASON: safe(decision.reason) if decision else ''})
    return cells


def _points(number: float) -> str:
    return '{:g}'.format(number)


def _is_same(cell: str, written: str) -> bool:
    """Does a cell still hold what was written? A spreadsheet may write 14 as 14.0 or 14,0."""
    try:
        return float(cell.replace(',', '.')) == float(written)
    except ValueError:
        return not cell or cell.strip().lstrip("'") == written.strip().lstrip("'")


def _number(student: str, cell: str) -> float:
    try:
        number = float(cell.replace(',', '.'))      # as a spreadsheet of another language has it
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number >= 0.0):
        raise ValueError('{}: {} = {!r} is not valid: a number of at least 0, or nothing'.format(
            student, DECIDED, cell[:40]))
    return number
