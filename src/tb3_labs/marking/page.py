"""Feedback on paper: a page for each student, and an overview for whoever marks.

Each page needs no other file.
"""
from html import escape
from string import Template
from urllib.parse import quote

from tb3_labs.marking import figures
from tb3_labs.marking.criteria import Outcome
from tb3_labs.report.html import STYLE, Markup, picture, table

#: So many of the last lines of each run are shown.
LINES = 15
MARKS = {Outcome.MET: '\N{CHECK MARK}', Outcome.MISSED: '\N{BALLOT X}',
         Outcome.NOT_OFFERED: '\N{EN DASH}'}
COLOURS = {Outcome.MET: '#d9efd9', Outcome.MISSED: '#f6d5d0', Outcome.NOT_OFFERED: '#e4e4e4'}

PAGE = Template('''<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>$title</title><style>
$style
td.words { min-width: 20em; }
pre { font-size: 8pt; background: #f3f3f3; padding: 4px; white-space: pre-wrap;
      overflow-wrap: anywhere; }
.verdict { padding: 0 4px; }
</style></head><body>
<h1>$title</h1>
$body
</body></html>
''')


def feedback(marks, lab):
    """The page of one student."""
    parts = ['<p><b>{:g} of {:g} points.</b> {}</p>'.format(
        marks.points, marks.worth, escape('Node: {}.'.format(marks.node) if marks.node else ''))]
    parts += ['<p>{}</p>'.format(escape(remark)) for remark in marks.remarks]
    parts.append(_verdicts(marks.graded))
    if marks.extra:
        parts += ['<h2>Beyond the handout</h2>', _verdicts(marks.extra)]
    if marks.observation is not None and marks.observation.truth:
        parts += ['<h2>What the robot did</h2>', picture(
            figures.png(figures.over_time(marks.observation)), 'over time',
            'True heading, and what the node commanded; shaded: what was done to it.')]
        way = figures.path(marks.observation)
        if way is not None:
            parts.append(picture(figures.png(way), 'path', 'The true way in the local frame; '
                                 'stars: the goals.'))
    if marks.observation is not None:
        parts += _printed(marks.observation)
    return _page('{}: {}'.format(lab, marks.student), parts)


def _verdicts(verdicts):
    return table(['what it should do', '', 'points', 'what was seen, and where to look'], [
        [v.criterion.meaning, _mark(v), '{:g} / {:g}'.format(v.points, v.worth), v.sentence]
        for v in verdicts], words=('what was seen, and where to look',))


def _mark(verdict):
    return Markup('<span class="verdict" style="background: {}" title="{}">{}</span>'.format(
        COLOURS[verdict.outcome], verdict.outcome.value, MARKS[verdict.outcome]))


def _printed(observation):
    parts = ['<h2>What the node printed last</h2>']
    for number, run in enumerate(observation.runs, 1):
        lines = [line for line in run.printed.splitlines() if line.strip()]
        parts.append('<p>Start {} of {}{}</p><pre>{}</pre>'.format(
            number, len(observation.runs), '' if run.ready is not None else ', never ready',
            escape('\n'.join(line[:300] for line in lines[-LINES:])) or '(nothing)'))
    return parts


def overview(all_marks, lab, page_names):
    """The page of all students; `page_names`: the file name of each one's page."""
    some = all_marks[0]
    heads = ['student', 'points'] + [v.criterion.name.replace('_', ' ')
                                     for v in some.graded + some.extra] + ['remarks']
    rows = [[Markup('<a href="{}">{}</a>'.format(quote(name), escape(marks.student))),
             '{:g} / {:g}'.format(marks.points, marks.worth)]
            + [_mark(verdict) for verdict in marks.graded + marks.extra]
            + [' '.join(marks.remarks)] for marks, name in zip(all_marks, page_names)]
    totals = sorted(marks.points for marks in all_marks)
    summary = '{} submission{}, median {:g} of {:g} points. The last {} criteria are beyond the ' \
        'handout.'.format(len(totals), '' if len(totals) == 1 else 's',
                          totals[len(totals) // 2], some.worth, len(some.extra))
    return _page('{}: overview'.format(lab), ['<p>{}</p>'.format(escape(summary)),
                                              table(heads, rows, words=('remarks',))])


def _page(title, parts):
    return PAGE.substitute(title=escape(title), style=STYLE, body='\n'.join(parts))
