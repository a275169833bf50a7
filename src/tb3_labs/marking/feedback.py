"""Feedback: a page and a results.json for each student, an overview and a table of the class.

A page needs no other file. The check has made its timeline, see shown_run.py.

Gradescope reads results.json. In it each test has a score; the whole score is their sum. Nothing is
shown before the instructor publishes the grades.
Source: "Autograder Specifications", https://gradescope-autograders.readthedocs.io/en/latest/specs/.

Columns of the table, marks.csv: student, points, of (full marks), the points for each criterion,
node, remarks, and columns that a person has added. A criterion beyond the handout has 'extra_'
before its name, and 'yes' or 'no' in its cell if it is worth nothing. The points of a submission
that could not be judged are empty. A text from a submission is never written as a formula.
"""
import csv
import io
from dataclasses import replace
from html import escape
from typing import Any, Dict, Sequence
from urllib.parse import quote

from tb3_labs.marking.labs.criteria import NOT_TRIED, Outcome
from tb3_labs.marking.marks import LABS, NOT_JUDGED, Marks
from tb3_labs.marking.trial.evidence import tracebacks_before_the_end
from tb3_labs.marking.trial.observation import NotSeen
from tb3_labs.report.page.document import Markup, document, safe, table

#: A page shows the last SHOWN_LINES lines of each run, each with at most LINE_LENGTH characters.
SHOWN_LINES, LINE_LENGTH = 15, 300
SYMBOLS = {Outcome.MET: '\N{CHECK MARK}', Outcome.MISSED: '\N{BALLOT X}',
           Outcome.NOT_OFFERED: '\N{EN DASH}'}
COLOURS = {Outcome.MET: '#d9efd9', Outcome.MISSED: '#f6d5d0', Outcome.NOT_OFFERED: '#e4e4e4'}

#: Headings of the wide columns, which have sentences.
SEEN, WHY, REMARKS = 'what was seen, and where to look', 'why no points', 'remarks'
#: The first columns of the table.
FIRST = ['student', 'points', 'of']
#: When a student sees the tests in Gradescope.
VISIBILITY = 'after_published'

STUDENTS = '''
td.words { min-width: 20em; }
pre { font-size: 8pt; background: #f3f3f3; padding: 4px; white-space: pre-wrap;
      overflow-wrap: anywhere; }
'''
#: An overview has a column for each criterion: their names are upright, the page is in landscape.
WIDE = '''
@page { size: A4 landscape; }
body { max-width: 269mm; }
th, td { padding: 1px 2px; text-align: center; }
td:first-child { min-width: 7em; overflow-wrap: anywhere; } td:nth-child(2) { white-space: nowrap; }
td.words { min-width: 9em; overflow-wrap: anywhere; }
td:nth-child(3):not(:empty) { min-width: 24em; }
tr { break-inside: avoid; } td details, td summary { margin: 0; font-weight: normal; }
.upright { writing-mode: vertical-rl; transform: rotate(180deg); white-space: nowrap; }'''


def feedback(marks: Marks, lab: str) -> str:
    """A student's page, HTML; `lab`: its title."""
    points = '{:g} of {:g} points.'.format(marks.points, marks.worth)
    parts = ['<p><b>{}</b> {}</p>'.format(points if marks.judged else 'Not judged.', escape(
        'Node: {}.'.format(marks.node) if marks.node else ''))]
    parts += ['<p>{}</p>'.format(escape(remark)) for remark in marks.sentences + list(
        filter(None, [own_hint(marks)]))]
    shown = marks.observation.shown if marks.observation is not None else ''
    if marks.judged:
        parts.append(_verdicts(marks.graded, bool(shown)))
    if marks.judged and marks.extra:
        parts += ['<h2>Beyond the handout</h2>', _verdicts(marks.extra, bool(shown))]
    if marks.observation is not None:
        parts += [shown] + _printed(marks.observation)
    return document('{}: {}'.format(lab, marks.student), parts, STUDENTS)


def _verdicts(verdicts, has_timeline):
    rows, above = [], set()
    for v in verdicts:
        sentence = (replace(v, seen='the same') if v.seen in above else v).sentence
        above |= {v.seen} - {'', NOT_TRIED}
        if has_timeline and v.moment is not None and v.outcome is Outcome.MISSED:
            sentence = Markup('{} <a href="#t={:.1f}">Watch it</a>'.format(
                escape(sentence), v.moment))
        rows.append([v.criterion.meaning, _mark(v), '{:g} / {:g}'.format(v.points, v.worth),
                     sentence])
    return table(['what is asked', '', 'points', SEEN], rows, words=(SEEN,))


def _mark(verdict):
    outcome = verdict.outcome
    if verdict.criterion.extra and outcome is Outcome.MISSED:
        outcome = Outcome.NOT_OFFERED       # what nobody asked for is not wrong
    return Markup('<span class="verdict" style="background: {}" title="{}">{}</span>'.format(
        COLOURS[outcome], verdict.outcome.value, SYMBOLS[outcome]))


def _printed(observation):
    parts = ['<h2>What the node printed last</h2>']
    for number, run in enumerate(observation.runs, 1):
        lines = [line for line in run.printed.splitlines() if line.strip()]
        parts.append('<p>Start {} of {}{}</p><pre>{}</pre>'.format(
            number, len(observation.runs), '' if run.ready is not None else ', never ready',
            escape('\n'.join(line[:LINE_LENGTH] for line in lines[-SHOWN_LINES:])) or '(nothing)'))
    return parts


def own_hint(marks: Marks, is_last: bool = False) -> str:
    """The sentence on the mistake of a node that lost points; '' if there is none. `is_last`: the
    one for a node whose mistake nothing else explains."""
    seen = marks.observation
    lost = any(verdict.outcome is Outcome.MISSED for verdict in marks.graded)
    if not lost or seen is None or seen.lab not in LABS or tracebacks_before_the_end(seen):
        return ''       # an exception is the mistake
    try:
        return (LABS[seen.lab].last_hint if is_last else LABS[seen.lab].hint)(seen)
    except NotSeen:
        return ''


def overview(all_marks: Sequence[Marks], lab: str, notes: Sequence[str] = ()) -> str:
    """The page of all students, HTML; `lab`: its title; `notes`: for the instructor alone."""
    some = all_marks[0]
    heads = ['student', 'points', WHY] + [Markup('<span class="upright">{}</span>'.format(
        escape(v.criterion.name.replace('_', ' ')))) for v in some.graded + some.extra] + [REMARKS]
    rows = [[Markup('<a href="{}">{}</a>'.format(quote(marks.student + '.html'),
                                                 escape(marks.student))),
             '{:g} / {:g}'.format(marks.points, marks.worth) if marks.judged else NOT_JUDGED,
             marks.why_none]
            + [_mark(verdict) if marks.judged else '' for verdict in marks.graded + marks.extra]
            + [Markup('<details><summary>{}</summary>{}</details>'.format(
                len(marks.remarks), escape(' '.join(marks.remarks))) if marks.remarks else '')]
            for marks in all_marks]
    look = ['<h2>For the instructor alone</h2>'] * bool(notes) + [
        '<p>{}</p>'.format(escape(note)) for note in notes]
    totals = sorted(marks.points for marks in all_marks if marks.judged)
    summary = '{} submission{}{}. {}The last {} criteria are beyond the handout.'.format(
        len(all_marks), '' if len(all_marks) == 1 else 's',
        '' if len(totals) == len(all_marks) else ', {} {}'.format(
            len(all_marks) - len(totals), NOT_JUDGED),
        'Median {:g} of {:g} points. '.format(totals[len(totals) // 2], some.worth)
        if totals else '', len(some.extra))
    return document('{}: overview'.format(lab), look + [
        '<p>{}</p>'.format(escape(summary)), table(heads, rows, words=(WHY, REMARKS))], WIDE)


# -- Gradescope

def results(marks: Marks) -> Dict[str, Any]:
    """Returns the object for json.dump()."""
    return {
        'score': round(float(marks.points), 2),
        'execution_time': int(round(marks.seconds)),
        'output': '\n'.join(['Node: {}.'.format(marks.node)] * bool(marks.node) + marks.sentences),
        'visibility': VISIBILITY,
        'stdout_visibility': 'hidden',
        'tests': [{
            'name': 'Beyond the handout: ' * verdict.criterion.extra + verdict.criterion.meaning,
            'number': str(number),
            'score': verdict.points,
            'max_score': 0.0 if verdict.criterion.extra else verdict.worth,
            'status': 'passed' if verdict.outcome is Outcome.MET else 'failed',
            'output': verdict.sentence,
            'visibility': VISIBILITY,
        } for number, verdict in enumerate(marks.graded + marks.extra, 1)],
        'extra_data': {'student': marks.student},
    }


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
        if rows and rows[0][:3] != FIRST:
            raise ValueError('it does not begin with the columns ' + ', '.join(FIRST))
        self._width = max(map(len, rows), default=0)
        # all rows have one more cell, which is empty
        self._heads, *self._rows = [row + [''] * (self._width + 1 - len(row))
                                    for row in rows or [[]]]

    def renewed(self, all_marks: Sequence[Marks]) -> str:
        """The table with these marks. A person's columns stay, and others' rows, also if several
        have one name."""
        some = all_marks[0]
        heads = FIRST + [v.criterion.label for v in some.graded + some.extra] + ['node', REMARKS]
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
            writer.writerow(_cells(marks) + [old[place] if old else '' for place in added])
        for row in others:
            writer.writerow([row[place] for place in places + added])
        return out.getvalue()


def _cells(marks):
    points = ['{:g}'.format(v.points) for v in marks.graded] + [
        '{:g}'.format(v.points) if v.worth else 'yes' if v.outcome is Outcome.MET else 'no'
        for v in marks.extra]
    return ([safe(marks.student), '{:g}'.format(marks.points) if marks.judged else '',
             '{:g}'.format(marks.worth)]
            + (points if marks.judged else [''] * len(points))
            + [safe(marks.node), safe(' '.join(marks.sentences))])
