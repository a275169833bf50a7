"""The table of a class, marks.csv, and the page with the same, overview.html.

The table has the marker's columns, and those that a person fills in.

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
from html import escape
from typing import Dict, Mapping, Optional, Sequence
from urllib.parse import quote

from tb3_labs.marking.labs.criteria import Outcome
from tb3_labs.marking.marks import NOT_JUDGED, Decision, Marks
from tb3_labs.marking.student_page import symbol
from tb3_labs.report.page.document import Markup, document, safe, table

#: The first columns; the columns of a person's decision.
FIRST = STUDENT, POINTS, OF = ['student', 'points', 'of']
WATCHED = DECIDED, POINTS, REASON, REMARKS = 'decided', 'points', 'reason', 'remarks'
#: No cell of a spreadsheet is longer; a person's own text may be.
LONGEST_CELL = 32767
csv.field_size_limit(2 ** 31 - 1)


class MarksTable:
    """The table of the last run; ``ValueError`` if the text is not such a table. It is '' in the
    first run."""

    def __init__(self, text: str = '') -> None:
        text = text.lstrip('\ufeff')
        heading = text.partition('\n')[0]
        delimiter = max(',;\t', key=heading.count)      # a spreadsheet may write another delimiter
        try:
            rows = list(filter(None, csv.reader(io.StringIO(text, newline=''),
                                                delimiter=delimiter)))
        except csv.Error as problem:
            raise ValueError(str(problem)) from None
        rows = rows or [FIRST]
        if not set(FIRST) <= set(rows[0]):
            raise ValueError('it lacks one of the columns ' + ', '.join(FIRST))
        self._width = max(map(len, rows))
        places = list(map(rows[0].index, FIRST))    # a person may have moved them
        places += [place for place in range(self._width + 1) if place not in places]
        # all rows have one more cell, which is empty
        self._heads, *self._rows = [[(row + [''] * (self._width + 1 - len(row)))[place]
                                     for place in places] for row in rows]

    def decisions(self, written: Mapping[str, Mapping[str, str]]) -> Dict[str, Decision]:
        """A person's decisions: name in the table -> Decision. `written`: what the marker
        wrote into the cells WATCHED of each name.

        ``ValueError`` with name and cell if it is not a number of points.
        """
        found: Dict[str, Decision] = {}
        for row in self._rows:
            cells, before = dict(zip(self._heads, row)), written.get(row[0], {})
            edited = [name for name in before if not _is_same(cells.get(name, ''), before[name])]
            # what was written last is used
            points, why = (next((name for name in (own, other) if name in edited), own)
                           for own, other in ((DECIDED, POINTS), (REASON, REMARKS)))
            if (cells.get(points) or cells.get(why)) and row[0] not in found:
                found[row[0]] = Decision(_number(row[0], points, cells.get(points, '')),
                                         cells.get(why, ''))
        return found

    def renew(self, all_marks: Sequence[Marks]) -> str:
        """The table with these marks. A person's columns stay, and the rows of other students, also
        if several have one name."""
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
        prints = 'yes' if verdict.outcome is Outcome.MET else 'no'
        is_free = verdict.criterion.extra and not verdict.worth
        cells[verdict.criterion.label] = '' if not is_judged else (
            prints if is_free else _points(verdict.points))
    decision = marks.decision
    cells.update({
        'node': safe(marks.node), REMARKS: safe(' '.join(marks.sentences)[:LONGEST_CELL - 10]),
        'id': safe(marks.number), 'late': 'late' if marks.late else '',
        DECIDED: _points(decision.points) if decision and decision.points is not None else '',
        REASON: safe(decision.reason) if decision else ''})
    return cells


def _points(number: float) -> str:
    return f'{number:g}'


def _is_same(cell: str, written: str) -> bool:
    """Does a cell still hold the written value? A spreadsheet may write 14 as 14.0 or 14,0."""
    try:
        return float(cell.replace(',', '.')) == float(written)
    except ValueError:
        return not cell or cell.strip().lstrip("'") == written.strip().lstrip("'")


def _number(student: str, name: str, cell: str) -> Optional[float]:
    if not cell:
        return None
    try:
        number = float(cell.replace(',', '.'))      # as a spreadsheet of another language has it
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number >= 0.0):
        raise ValueError(f'{student}: {name} = {cell[:40]!r} is not valid: a number of at least 0, '
                         'or nothing')
    return number


# -- the page of all students

#: The heading of a wide column, which has sentences.
WHY = 'why no points'
#: A column for each criterion: their names are upright, the page is in landscape.
WIDE = '''
@page { size: A4 landscape; }
body { max-width: 269mm; }
th, td { padding: 1px 2px; text-align: center; }
td:first-child { min-width: 7em; overflow-wrap: anywhere; } td:nth-child(2) { white-space: nowrap; }
td.words { min-width: 9em; overflow-wrap: anywhere; }
td:nth-child(3):not(:empty) { min-width: 24em; }
tr { break-inside: avoid; } td details, td summary { margin: 0; font-weight: normal; }
.upright { writing-mode: vertical-rl; transform: rotate(180deg); white-space: nowrap; }'''


def overview(all_marks: Sequence[Marks], lab: str, notes: Sequence[str] = ()) -> str:
    """The page of all students, HTML; `lab`: its title; `notes`: for the instructor alone."""
    some = all_marks[0]
    names = [escape(v.criterion.name.replace('_', ' ')) for v in some.graded + some.extra]
    heads = ['student', 'points', WHY,
             *(Markup(f'<span class="upright">{name}</span>') for name in names), REMARKS]
    rows = [[Markup(f'<a href="{quote(marks.student)}.html">{escape(marks.student)}</a>'),
             f'{marks.points:g} / {marks.worth:g}' if marks.is_known else NOT_JUDGED,
             marks.why_none]
            + ['' if marks.unjudged else symbol(verdict) for verdict in marks.graded + marks.extra]
            + [_folded(marks.decision_sentences + marks.remarks)]
            for marks in all_marks]
    own = ['<h2>For the instructor alone</h2>'] if notes else []
    own += [f'<p>{escape(note)}</p>' for note in notes]
    totals = sorted(marks.points for marks in all_marks if marks.is_known)
    summary = f'{len(all_marks)} submission' + ('' if len(all_marks) == 1 else 's')
    if len(totals) < len(all_marks):
        summary += f', {len(all_marks) - len(totals)} {NOT_JUDGED}'
    if totals:
        summary += f'. Median {totals[len(totals) // 2]:g} of {some.worth:g} points'
    summary += f'. The last {len(some.extra)} criteria are beyond the handout.'
    return document(f'{lab}: overview', own + [
        f'<p>{summary}</p>', table(heads, rows, words=(WHY, REMARKS))], WIDE)


def _folded(sentences):
    return Markup(f'<details><summary>{len(sentences)}</summary>{escape(" ".join(sentences))}'
                  '</details>') if sentences else ''
