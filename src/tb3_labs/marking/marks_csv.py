"""Makes marks.csv, the table of a class, and overview.html, a page with the same content.

The table has the columns `student`, `points`, `of` (full marks), a column for each criterion,
`node`, `remarks`, `id` (the student's number on the learning platform), `late`, `decided`,
`reason`, and columns that a person added.

The column of a criterion beyond the handout has a name that begins with 'extra_'. If such a
criterion is worth no points, its cells contain 'yes' or 'no'. If a submission was not judged, the
criteria's cells are empty. A text from a submission is never written as a formula, which a
spreadsheet would run. A person may write points into `decided`, and a sentence into `reason`.
"""
import csv
import io
import math
from html import escape
from typing import Dict, List, Optional, Sequence, Tuple
from urllib.parse import quote

from tb3_labs.marking.labs.criteria import Outcome
from tb3_labs.marking.marks import NOT_JUDGED, Marks
from tb3_labs.marking.student_results import outcome_symbol
from tb3_labs.report.page.document import Markup, document, safe_cell, table

STUDENT, POINTS, FULL_POINTS = 'student', 'points', 'of'
DECIDED, REASON, REMARKS = 'decided', 'reason', 'remarks'
FIRST_COLUMNS = [STUDENT, POINTS, FULL_POINTS]
#: A spreadsheet allows 32767 characters in a cell, and safe_cell() may add a few to the remarks.
MAX_REMARKS_LENGTH = 32757
csv.field_size_limit(2 ** 31 - 1)       # by default, csv refuses cells of over 131072 characters


class MarksTable:
    """The table that the previous run of mark.py wrote."""

    def __init__(self, text: str = '') -> None:
        """`text` is the text of marks.csv, or '' in the first run. Raises ``ValueError`` if the
        text is not a table of marks, or if a person's points are invalid."""
        self._columns, self._rows = _read_table(text.lstrip('\ufeff') or ','.join(FIRST_COLUMNS))
        #: A person's decisions: {student: (points or None, reason)}.
        self.decisions: Dict[str, Tuple[Optional[float], str]] = {}
        for row in self._rows:
            student, decided, reason = row[STUDENT], row.get(DECIDED, ''), row.get(REASON, '')
            if decided or reason:
                self.decisions.setdefault(student, (_decided_points(decided, student), reason))

    def change_sentences(self, all_marks: Sequence[Marks]) -> List[str]:
        """Returns [a sentence for the instructor] on changed points, or [] if no points have
        changed. The criteria may be different now, or a person may have overwritten the points."""
        old_points = {row[STUDENT]: row[POINTS] for row in self._rows}
        changes, may_be_overwritten = [], False
        for marks in all_marks:
            cells = cells_of(marks)
            old = old_points.get(cells[STUDENT])
            new = cells[POINTS] or NOT_JUDGED
            # a text is always a change, because it becomes NaN, which equals no number
            if old and _number_in(old) != _number_in(new):
                changes.append(f'{marks.student} ({old}, now {new})')
                # a person may have written the old points into the wrong column
                may_be_overwritten |= marks.decided_points is None
        if not changes:
            return []
        sentence = f"With other points than before: {', '.join(changes)}."
        if may_be_overwritten:
            sentence += f' A person\'s points belong into the column "{DECIDED}".'
        return [sentence]

    def renewed_text(self, all_marks: Sequence[Marks]) -> str:
        """Returns the text of the table with new marks. The columns that a person added are kept.
        Rows without new marks are also kept, even if several of them have the same name."""
        columns = list(cells_of(all_marks[0]))
        columns += [column for column in self._columns if column not in columns]
        new_rows = []
        old_rows = list(self._rows)
        for marks in all_marks:
            new_row = cells_of(marks)
            rows_of_student = [row for row in old_rows if row[STUDENT] == new_row[STUDENT]]
            if rows_of_student:
                old_row = rows_of_student[0]
                old_rows.remove(old_row)
                new_row = {**old_row, **new_row}
            new_rows.append(new_row)
        out = io.StringIO(newline='')
        writer = csv.DictWriter(out, columns, lineterminator='\n')
        writer.writeheader()
        writer.writerows(new_rows + old_rows)
        return out.getvalue()


def _read_table(text: str) -> Tuple[List[str], List[Dict[str, str]]]:
    """Returns (columns, rows) of a table of marks. A row is {column: cell}."""
    first_line = text.partition('\n')[0]
    delimiter = max(',;\t', key=first_line.count)    # a spreadsheet may write another delimiter
    reader = csv.DictReader(io.StringIO(text, newline=''), restval='', delimiter=delimiter)
    try:
        rows = list(reader)
    except csv.Error as error:
        raise ValueError(str(error)) from None
    columns = list(reader.fieldnames or ())
    if not set(FIRST_COLUMNS) <= set(columns):
        raise ValueError('it lacks one of the columns ' + ', '.join(FIRST_COLUMNS))
    # DictReader stores the cells that have no heading under the key None
    has_extra_cells = any(None in row for row in rows)
    if has_extra_cells or len(set(columns)) < len(columns):
        raise ValueError('each column needs a heading of its own in the first row')
    return columns, rows


def cells_of(marks: Marks) -> Dict[str, str]:
    """Returns the cells that mark.py writes into a student's row: {column: text}."""
    cells = {STUDENT: safe_cell(marks.student),
             POINTS: f'{marks.points:g}' if marks.has_known_points else '',
             FULL_POINTS: f'{marks.full_points:g}'}
    for verdict in marks.graded_verdicts + marks.extra_verdicts:
        if marks.unjudged:
            text = ''
        elif verdict.criterion.is_extra and not verdict.full_points:
            text = 'yes' if verdict.outcome is Outcome.MET else 'no'
        else:
            text = f'{verdict.points:g}'
        cells[verdict.criterion.label] = text
    cells['node'] = safe_cell(marks.node)
    cells[REMARKS] = safe_cell(' '.join(marks.sentences)[:MAX_REMARKS_LENGTH])
    cells['id'] = safe_cell(marks.number)
    cells['late'] = 'late' if marks.late else ''
    cells[DECIDED] = '' if marks.decided_points is None else f'{marks.decided_points:g}'
    cells[REASON] = safe_cell(marks.decision_reason)
    return cells


def _number_in(cell: str) -> float:
    """Returns the number in a cell, or NaN if the cell contains another text."""
    try:
        return float(cell.replace(',', '.'))      # some languages write a decimal comma
    except ValueError:
        return math.nan


def _decided_points(cell: str, student: str) -> Optional[float]:
    if not cell:
        return None
    points = _number_in(cell)
    if not 0.0 <= points < math.inf:        # this condition is also true for NaN
        raise ValueError(f'{student}: {DECIDED} = {cell[:40]!r} is not valid: a number of at least '
                         '0, or nothing')
    return points


LANDSCAPE_STYLE = '''
@page { size: A4 landscape; }
body { max-width: 269mm; }
th { writing-mode: vertical-rl; white-space: nowrap; }
th, td { padding: 1px 2px; text-align: center; }
td.words { min-width: 24em; overflow-wrap: anywhere; }'''


def overview_page(all_marks: Sequence[Marks], lab_title: str, notes: Sequence[str]) -> str:
    """Returns the page of all students as HTML. `notes` are sentences only for the instructor."""
    rows = []
    for marks in all_marks:
        cells = cells_of(marks)
        cells[STUDENT] = Markup(
            f'<a href="{quote(marks.student)}.html">{escape(marks.student)}</a>')
        cells[POINTS] = cells[POINTS] or NOT_JUDGED
        if not marks.unjudged:
            cells.update({verdict.criterion.label: outcome_symbol(verdict)
                          for verdict in marks.verdicts})
        rows.append(list(cells.values()))
    blocks = ['<h2>Only for the instructor</h2>'] if notes else []
    blocks += [f'<p>{escape(note)}</p>' for note in notes]
    blocks.append(table(list(cells_of(all_marks[0])), rows, text_columns=(REMARKS,)))
    return document(f'{lab_title}: overview', blocks, LANDSCAPE_STYLE)
