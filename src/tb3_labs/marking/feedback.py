"""Feedback: a page and a results.json for each student, and an overview of the class.

A page needs no other file: it is the report of the recorded trial, with the verdicts on top.

Gradescope reads results.json. In it each test has a score; the whole score is their sum. The
student sees all of it as soon as the marking has ended. A submission that was not judged has the
score 0 and the reason there: Gradescope takes a missing file for a fault of the autograder.
Source: "Autograder Specifications", https://gradescope-autograders.readthedocs.io/en/latest/specs/.
"""
import re
from dataclasses import replace
from html import escape, unescape
from pathlib import Path
from typing import Any, Dict, List, Sequence
from urllib.parse import quote

import rospkg

from tb3_labs.marking.labs.criteria import NOT_TRIED, Outcome
from tb3_labs.marking.marks import NOT_JUDGED, Marks
from tb3_labs.marking.shown_run import mistake_of, shown
from tb3_labs.report.page import mistake
from tb3_labs.report.page.document import Markup, document, table

#: A page shows the last SHOWN_LINES lines of each run, each with at most LINE_LENGTH characters.
SHOWN_LINES, LINE_LENGTH = 15, 300
SYMBOLS = {Outcome.MET: '\N{CHECK MARK}', Outcome.MISSED: '\N{BALLOT X}',
           Outcome.NOT_OFFERED: '\N{EN DASH}'}
COLOURS = {Outcome.MET: '#d9efd9', Outcome.MISSED: '#f6d5d0', Outcome.NOT_OFFERED: '#e4e4e4'}

#: Headings of the wide columns, which have sentences.
SEEN, WHY, REMARKS = 'what was seen, and where to look', 'why no points', 'remarks'
#: A place in a lab sheet, as criteria and hints name it: sheet, heading, step.
PLACE = re.compile(r'doc/(\w+\.md), "([^"]*)"(?:, step (\d+))?')
PACKAGE = Path(rospkg.RosPack().get_path('tb3_labs'))
#: When a student sees the tests in Gradescope: also 'after_due_date', 'after_published', 'hidden'.
VISIBILITY = 'visible'
#: A link to a moment of the timeline, which Gradescope does not show.
WATCH = re.compile(' <a href="#t=[^>]*>Watch it</a>')

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
    places = Places()
    parts, run = _head(marks, places), shown(marks, places.linked)
    if not marks.unjudged:
        parts.append(_verdicts(marks.graded, bool(run), places))
        if marks.extra:
            parts += ['<h2>Beyond the handout</h2>', _verdicts(marks.extra, bool(run), places)]
    if marks.observation is not None:
        parts += [run] + _printed(marks.observation)
    return document('{}: {}'.format(lab, marks.student), parts + places.parts, STUDENTS)


def _head(marks, places):
    points = '{:g} of {:g} points.'.format(marks.points, marks.worth)
    return ['<p><b>{}</b> {}</p>'.format(points if marks.is_known else 'Not judged.', escape(
        'Node: {}.'.format(marks.node) if marks.node else ''))] + [
            '<p>{}</p>'.format(places.linked(text)) for text in decided(marks) + marks.sentences]


def decided(marks: Marks) -> List[str]:
    """The sentence on a person's decision, in a list; [] if there is none."""
    if marks.decision is None:
        return []
    gave = 'A person gave these points; the marker gave {:g}.'.format(
        sum(verdict.points for verdict in marks.verdicts)) if marks.is_decided else ''
    return [' '.join(filter(None, [gave, marks.decision.reason]))]


class Places:
    """The places in the lab sheets that a page names: links to them, and what stands there."""

    def __init__(self) -> None:
        self._texts: Dict[str, str] = {}

    def linked(self, sentence: str) -> Markup:
        """HTML of a sentence, in which each place is a link."""
        return Markup(PLACE.sub(self._link, escape(sentence, quote=False)))

    def _link(self, found: Any) -> str:
        name = found.group()
        if name not in self._texts:
            sheet, heading, step = (unescape(part) for part in found.groups(''))
            self._texts[name] = _text_at(sheet, heading, step)
        return '<a href="#place-{}">{}</a>'.format(
            list(self._texts).index(name) + 1, name) if self._texts[name] else name

    @property
    def parts(self) -> List[str]:
        """The HTML of the places."""
        texts = ['<details><summary>{}</summary><pre id="place-{}">{}</pre></details>'.format(
            name, k, escape(text)) for k, (name, text) in enumerate(self._texts.items(), 1) if text]
        return (['<h2>In the lab sheets</h2>'] if texts else []) + texts


def _text_at(sheet: str, heading: str, step: str) -> str:
    """The text of a step of a sheet, or below a heading; '' if the sheet is not here."""
    path = PACKAGE / 'doc' / sheet
    if not path.is_file():      # an installed package has no pages
        return ''
    below = path.read_text(encoding='utf-8').partition('# {}\n'.format(heading))[2]
    text = re.split('^#+ ', below, 1, re.MULTILINE)[0]
    if step:
        text = re.split(r'^{}\. '.format(step), text, 1, re.MULTILINE)[-1]
        text = re.split(r'^{}\. '.format(int(step) + 1), text, 1, re.MULTILINE)[0]
    return text.strip()


def _verdicts(verdicts, has_timeline, places):
    rows, above = [], set()
    for v in verdicts:
        sentence = places.linked((replace(v, seen='the same') if v.seen in above else v).sentence)
        above |= {v.seen} - {'', NOT_TRIED}
        if has_timeline and v.moment is not None and v.outcome is Outcome.MISSED:
            sentence = Markup('{} <a href="#t={:.1f}">Watch it</a>'.format(sentence, v.moment))
        rows.append([v.criterion.meaning, _mark(v), '{:g} / {:g}'.format(
            v.points, v.worth) if v.worth else '', sentence])
    return table(['what is asked', '', 'points', SEEN], rows, words=(SEEN,), is_plain=True)


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


def overview(all_marks: Sequence[Marks], lab: str, notes: Sequence[str] = ()) -> str:
    """The page of all students, HTML; `lab`: its title; `notes`: for the instructor alone."""
    some = all_marks[0]
    heads = ['student', 'points', WHY] + [Markup('<span class="upright">{}</span>'.format(
        escape(v.criterion.name.replace('_', ' ')))) for v in some.graded + some.extra] + [REMARKS]
    rows = [[Markup('<a href="{}">{}</a>'.format(quote(marks.student + '.html'),
                                                 escape(marks.student))),
             '{:g} / {:g}'.format(marks.points, marks.worth) if marks.is_known else NOT_JUDGED,
             marks.why_none]
            + ['' if marks.unjudged else _mark(verdict) for verdict in marks.graded + marks.extra]
            + [_folded(decided(marks) + marks.remarks)]
            for marks in all_marks]
    look = ['<h2>For the instructor alone</h2>'] * bool(notes) + [
        '<p>{}</p>'.format(escape(note)) for note in notes]
    totals = sorted(marks.points for marks in all_marks if marks.is_known)
    summary = '{} submission{}{}. {}The last {} criteria are beyond the handout.'.format(
        len(all_marks), '' if len(all_marks) == 1 else 's',
        '' if len(totals) == len(all_marks) else ', {} {}'.format(
            len(all_marks) - len(totals), NOT_JUDGED),
        'Median {:g} of {:g} points. '.format(totals[len(totals) // 2], some.worth)
        if totals else '', len(some.extra))
    return document('{}: overview'.format(lab), look + [
        '<p>{}</p>'.format(escape(summary)), table(heads, rows, words=(WHY, REMARKS))], WIDE)


def _folded(sentences):
    return Markup('<details><summary>{}</summary>{}</details>'.format(
        len(sentences), escape(' '.join(sentences)))) if sentences else ''


# -- Gradescope

def results(marks: Marks) -> Dict[str, Any]:
    """Returns the object for json.dump(): a test for each criterion, and the rest of the page."""
    places = Places()
    parts = _head(marks, places) + [
        WATCH.sub('', mistake.section(marks.link, mistake_of(marks), places.linked))]
    if marks.observation is not None:
        parts += _printed(marks.observation)
    return {
        'score': round(float(marks.points), 2) if marks.is_known else 0.0,
        'execution_time': int(round(marks.seconds)),
        'output': '\n'.join(parts + places.parts),
        'output_format': 'html',
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
        } for number, verdict in enumerate(marks.graded + marks.extra, 1) if marks.is_known],
        'extra_data': {'student': marks.student},
    }
