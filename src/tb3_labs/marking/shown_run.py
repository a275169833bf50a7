"""The run of a node that was tried: its timeline and its mistake, as a part of the node's page."""
import math
from dataclasses import replace
from html import escape
from typing import Any, Callable, Dict

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.labs.criteria import Outcome
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.trial.observation import (
    GOAL_POSE, LOCAL_T_WORLD, Observation, samples_of)
from tb3_labs.report.page import mistake
from tb3_labs.report.page.timeline import mark, section, timeline
from tb3_labs.report.run_data import Poses, RunData, Values
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS
from tb3_labs.watch.chain import sentence


def shown(marks: Marks, linked: Callable[[str], str] = escape) -> str:
    """The part of a page, HTML; '' if the robot was not seen. ``linked(sentence)``: its HTML."""
    if marks.observation is None or not marks.observation.truth:
        return ''
    return '\n'.join([
        section(moments(as_run(marks.observation), marks)),
        mistake.section(marks.link, mistake_of(marks), linked)])


def hint_in_a_line(marks: Marks) -> str:
    """The mistake of a node that lost points, and where it is explained; '' if it is unknown."""
    return '{} See {}.'.format(mistake_of(marks), marks.link[0].place) if marks.link else ''


def mistake_of(marks: Marks) -> str:
    """The first broken link as a sentence, with the lines of the node's file."""
    return sentence(marks.link[1], marks.observation.assigned) if (
        marks.link and marks.observation) else ''


def moments(run: RunData, marks: Marks) -> Dict[str, Any]:
    """The timeline's data of a run, the observation of these marks: the robot, the commands, the
    stimuli of the node, and the moments of criteria that were not met."""
    seen = marks.observation or Observation('', '')
    shown_marks = [mark('drive' if GOAL_POSE in stimulus.facts else 'hand', stimulus.begin,
                        stimulus.name, stimulus.end) for stimulus in seen.stimuli]
    shown_marks += [mark('hand', begin, "the check's own movement of the robot", end)
                    for begin, end in seen.own_moves]
    shown_marks += [mark('start', start.begin, 'the node is started') for start in seen.runs]
    shown_marks += [mark('lost', verdict.moment, 'not met: ' + verdict.criterion.meaning)
                    for verdict in marks.verdicts
                    if verdict.outcome is Outcome.MISSED and verdict.moment is not None]
    return timeline(run, MODELS[DEFAULT_MODEL], shown_marks)


def as_run(seen: Observation) -> RunData:
    """Returns the recording of a trial as the timeline takes it. Its poses in ``local`` are the
    true ones; its resets are the poses at which a drive began; its states are the names of the
    stimuli."""
    run = seen.run
    if run is None:
        raise ValueError('there is no recording')
    true = run.ground_truth
    drives = [stimulus for stimulus in seen.stimuli if GOAL_POSE in stimulus.facts]
    frames = [Pose2(*drive.facts[LOCAL_T_WORLD]) for drive in drives]
    ends = [drive.begin for drive in drives[1:]] + [math.inf]
    resets = [(drive.begin, frame @ true.at(drive.begin))
              for drive, frame in zip(drives, frames)]
    return replace(
        run, name=seen.node, local_pose=Poses.joined(
            [true.between(drive.begin, end).seen_from(frame)
             for drive, end, frame in zip(drives, ends, frames)]) if drives else true,
        resets=samples_of(Poses, [[at, pose.x, pose.y, pose.yaw] for at, pose in resets]),
        control=samples_of(Values, [row for drive in drives for row in (
            [drive.begin, 1.0], [drive.end, 0.0])]),
        derived=('states',), devices=(), frames=Poses.none(), presses=Values.none())
