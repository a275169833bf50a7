"""The run of a node that was tried: timeline and diagnosis, as a part of the node's page."""
import json
import math
from dataclasses import replace
from html import escape
from typing import Any, Callable, Dict

import numpy as np

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.labs.criteria import Outcome
from tb3_labs.marking.marks import LABS, Marks
from tb3_labs.marking.trial.evidence import tracebacks_before_the_end
from tb3_labs.marking.trial.observation import (
    ASKED_DEG, GOAL_POSE, LOCAL_T_WORLD, NotSeen, Observation)
from tb3_labs.report.cause import hints
from tb3_labs.report.cause.diagnosis import Diagnosis, diagnose
from tb3_labs.report.page.timeline import mark, section, timeline
from tb3_labs.report.run_data import Poses, RunData, States, Values
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS


def shown(marks: Marks, linked: Callable[[str], str] = escape) -> str:
    """The part of a page, HTML; '' if the robot was not seen. ``linked(sentence)``: its HTML."""
    if marks.observation is None or not marks.observation.truth:
        return ''
    run = as_run(marks.observation)
    found = diagnosis(run, marks)
    hint = own_hint(marks) or ('' if found.mistake else own_hint(marks, is_last=True))
    return '\n'.join([
        section(moments(run, marks, found)), '<h2>What went wrong</h2><p>{}</p>'.format(
            linked(hint)) if hint else hints.section(found)])


def own_hint(marks: Marks, is_last: bool = False) -> str:
    """The sentence on the mistake of a node that lost points; '' if there is none. `is_last`: the
    one for a node whose mistake nothing else explains."""
    seen = marks.observation
    if marks.is_full or seen is None or tracebacks_before_the_end(seen):
        return ''       # an exception is the mistake
    try:
        return (LABS[seen.lab].last_hint if is_last else LABS[seen.lab].hint)(seen)
    except NotSeen:
        return ''


def moments(run: RunData, marks: Marks, found: Diagnosis = Diagnosis('')) -> Dict[str, Any]:
    """The timeline's data of a run, the observation of these marks, and its diagnosis: the robot,
    the commands, the stimuli of the node, and the moments of criteria that were not met."""
    seen = marks.observation or Observation('', '')
    shown_marks = [mark('drive' if GOAL_POSE in stimulus.facts else 'hand', stimulus.begin,
                        stimulus.name, stimulus.end) for stimulus in seen.stimuli]
    shown_marks += [mark('hand', begin, "the check's own movement of the robot", end)
                    for begin, end in seen.own_moves]
    shown_marks += [mark('start', start.begin, 'the node is started') for start in seen.runs]
    shown_marks += [mark('lost', verdict.moment, 'not met: ' + verdict.criterion.meaning)
                    for verdict in marks.verdicts
                    if verdict.outcome is Outcome.MISSED and verdict.moment is not None]
    return timeline(run, MODELS[DEFAULT_MODEL], shown_marks, found.asked, found.ghost)


def diagnosis(run: RunData, marks: Marks) -> Diagnosis:
    """Returns the Diagnosis of a run, the observation of these marks, unless it has full marks. A
    node that never heard a sensor has none: its remark says which. Nor has a gamepad's."""
    if marks.is_full or marks.observation is None or marks.observation.deaf or (
            not LABS[marks.observation.lab].is_diagnosed or own_hint(marks)
            or tracebacks_before_the_end(marks.observation)):
        return Diagnosis('')
    return diagnose(run)


def hint_in_a_line(marks: Marks) -> str:
    """The mistake of a node, by the lab or by the way in which the robot moved; '' if unknown."""
    if own_hint(marks) or marks.observation is None or not marks.observation.truth:
        return own_hint(marks)
    return hints.in_a_line(diagnosis(as_run(marks.observation), marks)) or own_hint(
        marks, is_last=True)


def as_run(seen: Observation) -> RunData:
    """Returns the recording of a trial as the report takes it. Its poses in ``local`` are the true
    ones; its resets are the poses at which a drive began; its states are the names of the
    stimuli."""
    if seen.run is None:
        raise ValueError('there is no recording')
    true = seen.run.ground_truth
    drives = [stimulus for stimulus in seen.stimuli if GOAL_POSE in stimulus.facts]
    frames = [Pose2(*drive.facts[LOCAL_T_WORLD]) for drive in drives]
    ends = [drive.begin for drive in drives[1:]] + [math.inf]
    resets = [(drive.begin, frame @ true.at(drive.begin))
              for drive, frame in zip(drives, frames)]
    return replace(
        seen.run, name=seen.node, local_pose=Poses.joined(
            [true.between(drive.begin, end).seen_from(frame)
             for drive, end, frame in zip(drives, ends, frames)]) if drives else true,
        goals=_rows(Poses, [[drive.begin, *drive.facts[GOAL_POSE]] for drive in drives]),
        states=_rows(States, [[each.begin, each.name] for each in seen.stimuli]),
        resets=_rows(Poses, [[at, pose.x, pose.y, pose.yaw] for at, pose in resets]),
        control=_rows(Values, [row for drive in drives for row in (
            [drive.begin, 1.0], [drive.end, 0.0])]),
        derived=('states',), devices=(), frames=Poses.none(), presses=Values.none(),
        starts=tuple(run.begin for run in seen.runs),
        letters=_rows(Values, [row for each in seen.stimuli if ASKED_DEG in each.facts
                               for row in ([each.begin, np.sign(each.facts[ASKED_DEG])],
                                           [each.end, 0.0])]))


def _rows(kind, rows):
    """The Samples of these rows: time, and the other columns."""
    columns = list(zip(*rows))
    return kind(*(np.array(column, dtype=object if isinstance(column[0], str) else float)
                  for column in columns[:1] + columns)) if rows else kind.none()


def seen_inside(seen: Observation) -> RunData:
    """The recording of a trial for the links of :mod:`tb3_labs.watch`: its control as it was given,
    its resets by their calls, else by the node's lines. After a call that failed the node's frame
    is unknown: until the next start its variables are left out."""
    run = as_run(seen)
    if seen.run is None:
        return run
    calls = [(at, event) for at, event in zip(run.events.arrival, map(json.loads, run.events.words))
             if event.get('kind') == 'call']
    said = seen.run.resets
    resets = np.column_stack([said.arrival, said.x, said.y, said.yaw]).tolist() + [
        [at, *event['pose']] for at, event in calls
        if not event['problem'] and not np.any(np.abs(said.arrival - at) < 1.0)]
    kept = np.ones(len(run.variables), bool)
    for at in [at for at, event in calls if event['problem']]:
        ends = [each.begin for each in seen.runs if each.begin > at] + [math.inf]
        kept &= (run.variables.arrival < at) | (run.variables.arrival > ends[0])
    return replace(run, control=seen.run.control, variables=run.variables.take(kept),
                   resets=_rows(Poses, sorted(resets)))
