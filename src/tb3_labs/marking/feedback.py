"""Feedback: a page and a results.json for each student, an overview for the person who marks.

A page needs no other file. It shows an observation as a run for the report's timeline: the true
robot, the commands, the stimuli of the node, and the moments of criteria that were not met. Its
frame ``odom`` is the frame of the true poses. Its heading and speeds are true.

Gradescope reads results.json. In it each test has a score; the whole score is their sum. Nothing is
shown before the instructor publishes the grades.
Source: "Autograder Specifications", https://gradescope-autograders.readthedocs.io/en/latest/specs/.
"""
import math
from dataclasses import replace
from html import escape
from string import Template
from typing import Any, Dict, Iterator, List, Sequence
from urllib.parse import quote

import numpy as np

from tb3_labs.geometry.angles import wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.criteria import Outcome, Verdict
from tb3_labs.marking.marks import NOT_JUDGED, Marks
from tb3_labs.marking.move2goal import GOAL_POSE, LOCAL_T_WORLD, SENSED
from tb3_labs.marking.observation import MOVED, RESTED, Observation, Stimulus
from tb3_labs.marking.turn import EACH_TURN
from tb3_labs.report import hints
from tb3_labs.report.diagnosed_drives import Fresh, seen_drive
from tb3_labs.report.diagnosed_turns import turns_of
from tb3_labs.report.diagnosis import Diagnosis, of_drives, of_turns
from tb3_labs.report.mistakes import Declared
from tb3_labs.report.movements import movements
from tb3_labs.report.run_data import (
    Commands, ImuSamples, OdometrySamples, Poses, RunData, States, Values)
from tb3_labs.report.tables import STYLE, Markup, table
from tb3_labs.report.timeline import Mark, mark, section, timeline
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS

#: A rate is a mean over this time before and after its moment [s].
MEAN = 0.05
#: A page shows the last LINES lines of each run, each with at most LINE_LENGTH characters.
LINES, LINE_LENGTH = 15, 300
SYMBOLS = {Outcome.MET: '\N{CHECK MARK}', Outcome.MISSED: '\N{BALLOT X}',
           Outcome.NOT_OFFERED: '\N{EN DASH}'}
COLOURS = {Outcome.MET: '#d9efd9', Outcome.MISSED: '#f6d5d0', Outcome.NOT_OFFERED: '#e4e4e4'}

#: Headings of the wide columns, which have sentences.
SEEN, WHY, REMARKS = 'what was seen, and where to look', 'why no points', 'remarks'
#: When a student sees the tests in Gradescope.
VISIBILITY = 'after_published'

PAGE = Template('''<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>$title</title><style>
$style
td.words { min-width: 20em; }
pre { font-size: 8pt; background: #f3f3f3; padding: 4px; white-space: pre-wrap;
      overflow-wrap: anywhere; }
.verdict { padding: 0 4px; }
$more
</style></head><body>
<h1>$title</h1>
$body
</body></html>
''')
#: An overview has a column for each criterion: their names are upright, the page is in landscape.
WIDE = '''@page { size: A4 landscape; }
body { max-width: 269mm; }
th, td { padding: 1px 2px; text-align: center; }
td:first-child { min-width: 7em; overflow-wrap: anywhere; } td:nth-child(2) { white-space: nowrap; }
td.words { min-width: 9em; overflow-wrap: anywhere; } td:nth-child(3):not(:empty) { min-width: 24em; }
tr { break-inside: avoid; } td details, td summary { margin: 0; font-weight: normal; }
.upright { writing-mode: vertical-rl; transform: rotate(180deg); white-space: nowrap; }'''


def feedback(marks: Marks, lab: str) -> str:
    """A student's page, HTML; `lab`: its title."""
    points = '{:g} of {:g} points.'.format(marks.points, marks.worth)
    parts = ['<p><b>{}</b> {}</p>'.format(points if marks.judged else 'Not judged.', escape(
        'Node: {}.'.format(marks.node) if marks.node else ''))]
    parts += ['<p>{}</p>'.format(escape(remark)) for remark in marks.sentences]
    if marks.judged:
        parts.append(_verdicts(marks.graded))
    if marks.judged and marks.extra:
        parts += ['<h2>Beyond the handout</h2>', _verdicts(marks.extra)]
    if marks.observation is not None and marks.observation.truth:
        verdicts = [*marks.graded, *marks.extra]
        is_right = all(verdict.outcome is not Outcome.MISSED for verdict in verdicts)
        found = Diagnosis('') if is_right else diagnosis(marks.observation)
        parts += [section(moments(marks.observation, verdicts, found)), hints.section(found)]
    if marks.observation is not None:
        parts += _printed(marks.observation)
    return _page('{}: {}'.format(lab, marks.student), parts)


def _verdicts(verdicts):
    sentences = [_sentence(verdict, verdict.seen in [above.seen for above in verdicts[:number]])
                 for number, verdict in enumerate(verdicts)]
    return table(['what is asked', '', 'points', SEEN], [
        [v.criterion.meaning, _mark(v), '{:g} / {:g}'.format(v.points, v.worth), sentence]
        for v, sentence in zip(verdicts, sentences)], words=(SEEN,))


def _sentence(verdict, is_repeated):
    said = replace(verdict, seen='the same').sentence if is_repeated else verdict.sentence
    if verdict.moment is None or verdict.outcome is not Outcome.MISSED:
        return said
    return Markup('{} <a href="#t={:.1f}">Watch it</a>'.format(escape(said), verdict.moment))


def _mark(verdict):
    return Markup('<span class="verdict" style="background: {}" title="{}">{}</span>'.format(
        COLOURS[verdict.outcome], verdict.outcome.value, SYMBOLS[verdict.outcome]))


def _printed(observation):
    parts = ['<h2>What the node printed last</h2>']
    for number, run in enumerate(observation.runs, 1):
        lines = [line for line in run.printed.splitlines() if line.strip()]
        parts.append('<p>Start {} of {}{}</p><pre>{}</pre>'.format(
            number, len(observation.runs), '' if run.ready is not None else ', never ready',
            escape('\n'.join(line[:LINE_LENGTH] for line in lines[-LINES:])) or '(nothing)'))
    return parts


def overview(all_marks: Sequence[Marks], lab: str, notes: Sequence[str] = ()) -> str:
    """The page of all students, HTML; `lab`: its title; `notes`: for the instructor alone."""
    some = all_marks[0]
    heads = ['student', 'points', WHY] + [Markup('<span class="upright">{}</span>'.format(
        escape(v.criterion.name.replace('_', ' ')))) for v in some.graded + some.extra] + [REMARKS]
    rows = [[_link(marks),
             '{:g} / {:g}'.format(marks.points, marks.worth) if marks.judged else NOT_JUDGED,
             marks.why_none]
            + [_mark(verdict) if marks.judged else '' for verdict in marks.graded + marks.extra]
            + [_folded(marks.remarks)] for marks in all_marks]
    look = ['<p><b>Not judged, look at it:</b> {}</p>'.format('; '.join('{} ({})'.format(
        _link(marks), escape(marks.unjudged)) for marks in all_marks if not marks.judged))]
    totals = sorted(marks.points for marks in all_marks if marks.judged)
    summary = '{} submission{}{}. {}The last {} criteria are beyond the handout.'.format(
        len(all_marks), '' if len(all_marks) == 1 else 's',
        '' if len(totals) == len(all_marks) else ', {} {}'.format(
            len(all_marks) - len(totals), NOT_JUDGED),
        'Median {:g} of {:g} points. '.format(totals[len(totals) // 2], some.worth)
        if totals else '', len(some.extra))
    return _page('{}: overview'.format(lab), look * (len(totals) < len(all_marks))
                 + ['<p>{}</p>'.format(escape(summary)), table(heads, rows, words=(WHY, REMARKS))]
                 + (['<h2>For the instructor alone</h2>'] if notes else [])
                 + ['<p>{}</p>'.format(escape(note)) for note in notes], WIDE)


def _link(marks):
    return Markup('<a href="{}">{}</a>'.format(quote(marks.student + '.html'),
                                               escape(marks.student)))


def _folded(remarks):
    return Markup('<details><summary>{}</summary>{}</details>'.format(
        len(remarks), escape(' '.join(remarks))) if remarks else '')


def _page(title, parts, more=''):
    return PAGE.substitute(title=escape(title), style=STYLE, more=more, body='\n'.join(parts))


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


# -- the timeline, and the diagnosis

def moments(observation: Observation, verdicts: Sequence[Verdict],
            found: Diagnosis = Diagnosis('')) -> Dict[str, Any]:
    """The timeline's data of an observation with true poses, the verdicts on it, its diagnosis."""
    data = timeline(_run(observation), MODELS[DEFAULT_MODEL], _marks(observation, verdicts),
                    found.asked, found.ghost)
    return dict(data, heading_of='true heading')


def diagnosis(observation: Observation) -> Diagnosis:
    """Returns the Diagnosis of a node by its drives, or by its turns."""
    run = _run(observation)
    drives = list(_fresh_drives(observation, run))
    if drives:
        goal = next(stimulus.facts[GOAL_POSE] for stimulus in observation.stimuli
                    if GOAL_POSE in stimulus.facts)
        return of_drives(drives, Pose2(*goal))
    turns = [turn._replace(may_be_cut=not stimulus.facts[RESTED],
                           sides=(math.copysign(1.0, EACH_TURN[stimulus.name].asked_deg),))
             for stimulus in observation.stimuli
             if stimulus.name in EACH_TURN and stimulus.facts[MOVED]
             for turn in turns_of(_part(run, stimulus))]
    return of_turns(run, turns) if turns else Diagnosis('')


def _fresh_drives(observation: Observation, run: RunData) -> Iterator[Fresh]:
    """Yields each drive, in ``odom`` as the sensors had it at the start of the drive."""
    starts: Dict[int, Declared] = {}
    for stimulus in observation.stimuli:
        if not stimulus.facts.get(SENSED) or not stimulus.facts[MOVED]:
            continue
        x, y, yaw, imu = stimulus.facts[SENSED]
        truth = run.odometry.at(stimulus.begin)
        odom_T_true = Pose2(x, y, yaw) @ truth.inverse()
        last = Declared(Pose2(x, y, yaw), imu,
                        Pose2(*stimulus.facts[LOCAL_T_WORLD]) @ truth)
        process = sum(start.begin <= stimulus.begin for start in observation.runs)
        first = starts.setdefault(process, last)
        part = _part(run, stimulus)
        part = replace(part, odometry=OdometrySamples(**dict(
            vars(part.odometry), **vars(part.odometry.seen_from(odom_T_true)))))
        ends = np.array([] if stimulus.facts[RESTED] else [stimulus.end])
        for movement in movements(part)[:1]:
            seen = seen_drive(part, movement, ends)
            yield seen._replace(shown_T_odom=odom_T_true.inverse()), last, first


def _part(run: RunData, stimulus: Stimulus) -> RunData:
    """Returns the part of a run during a stimulus; the node has control in it."""
    begin, end = stimulus.begin, stimulus.end
    control = Values(np.array([begin]), np.array([begin]), np.array([1.0]))
    return replace(run, duration=end, imu=run.imu.between(begin, end), control=control,
                   odometry=run.odometry.between(begin, end), resets=Poses.none(),
                   commands=run.commands.between(begin, end))


def _run(observation: Observation) -> RunData:
    time, x, y, yaw = np.array(observation.truth, dtype=float).T
    east, north, speed_of_turn = (_rate(time, values) for values in (x, y, yaw))
    speeds = east * np.cos(yaw) + north * np.sin(yaw), speed_of_turn
    commands = np.array(observation.commands, dtype=float).reshape(-1, 3).T
    drives = [stimulus for stimulus in observation.stimuli if GOAL_POSE in stimulus.facts]
    true = Poses(time, time, x, y, wrap_all(yaw))
    local = _in_local(true, drives)
    resets = local.take([k for k in np.searchsorted(
        local.time, [drive.begin for drive in drives[1:]]) if k < len(local)])
    begins = np.array([stimulus.begin for stimulus in observation.stimuli])
    goals = np.array([(drive.begin, drive.begin, *drive.facts[GOAL_POSE]) for drive in drives])
    return RunData(
        observation.node, 0.0, float(time[-1]), ImuSamples(time, time, true.yaw, speeds[1]),
        OdometrySamples(time, time, x, y, true.yaw, *speeds), Commands(commands[0], *commands),
        local, goals=Poses(*goals.reshape(-1, 5).T), resets=resets,
        states=States(begins, begins, np.array([stimulus.name for stimulus in observation.stimuli],
                                               dtype=object)))


def _rate(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Returns the mean rate around each time, since times of two samples may be nearly the same."""
    before, after = ((time + reach).clip(time[0], time[-1]) for reach in (-MEAN, MEAN))
    change = np.interp(after, time, values) - np.interp(before, time, values)
    return change / np.maximum(after - before, MEAN)


def _in_local(true: Poses, drives: Sequence[Stimulus]) -> Poses:
    """The true poses in the local frame of each drive, from its start to the next drive; in the
    true frame if there are no drives."""
    ends = [drive.begin for drive in drives[1:]] + [np.inf]
    parts = [true.between(drive.begin, end).seen_from(Pose2(*drive.facts[LOCAL_T_WORLD]))
             for drive, end in zip(drives, ends)]
    return Poses.joined(parts) if parts else true


def _marks(observation: Observation, verdicts: Sequence[Verdict]) -> List[Mark]:
    return ([mark('drive' if GOAL_POSE in stimulus.facts else 'hand', stimulus.begin,
                  stimulus.name, stimulus.end) for stimulus in observation.stimuli]
            + [mark('start', run.begin, 'the node is started') for run in observation.runs]
            + [mark('lost', verdict.moment, 'not met: ' + verdict.criterion.meaning)
               for verdict in verdicts
               if verdict.outcome is Outcome.MISSED and verdict.moment is not None])
