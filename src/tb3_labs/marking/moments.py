"""An observation as a run for the report's timeline, and its diagnosis.

The timeline shows the true robot, the commands, the stimuli of the node, and the moments of
criteria that were not met. Its frame ``odom`` is the frame of the true poses. Its heading and
speeds are true.
"""
from dataclasses import replace
from typing import Any, Dict, Iterator, List, Sequence

import numpy as np

from tb3_labs.geometry.angles import wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.criteria import Outcome, Verdict
from tb3_labs.marking.move2goal import GOAL_POSE, LOCAL_T_WORLD, SENSED
from tb3_labs.marking.observation import MOVED, RESTED, Observation, Stimulus
from tb3_labs.marking.turn import EACH_TURN
from tb3_labs.report.diagnosed_drives import Fresh, seen_drive
from tb3_labs.report.diagnosed_turns import turns_of
from tb3_labs.report.diagnosis import Diagnosis, of_drives, of_turns
from tb3_labs.report.mistakes import Declared
from tb3_labs.report.movements import movements
from tb3_labs.report.run_data import (
    Commands, ImuSamples, OdometrySamples, Poses, RunData, States, Values)
from tb3_labs.report.timeline import Mark, mark, timeline
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS

#: A rate is a mean over this time before and after its moment [s].
MEAN = 0.05


def moments(observation: Observation, verdicts: Sequence[Verdict],
            found: Diagnosis = Diagnosis('')) -> Dict[str, Any]:
    """Returns the timeline's data of an observation with true poses; `verdicts`: on its node;
    `found`: its diagnosis."""
    data = timeline(_run(observation), MODELS[DEFAULT_MODEL], _marks(observation, verdicts),
                    found.asked, found.ghost)
    return dict(data, heading_of='true heading')


def diagnosis(observation: Observation) -> Diagnosis:
    """Returns the Diagnosis of a node by its drives, or by its turns."""
    drives = list(_fresh_drives(observation))
    if drives:
        goal = next(stimulus.facts[GOAL_POSE] for stimulus in observation.stimuli
                    if GOAL_POSE in stimulus.facts)
        return of_drives(drives, Pose2(*goal))
    run = _run(observation)
    turns = [turn._replace(may_be_cut=not stimulus.facts[RESTED])
             for stimulus in observation.stimuli
             if stimulus.name in EACH_TURN and stimulus.facts[MOVED]
             for turn in turns_of(_part(run, stimulus))]
    return of_turns(run, turns) if turns else Diagnosis('')


def _fresh_drives(observation: Observation) -> Iterator[Fresh]:
    """Yields each drive, in ``odom`` as the sensors had it at the begin of the drive."""
    run = _run(observation)
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
                   odometry=run.odometry.between(begin, end),
                   commands=run.commands.between(begin, end))


def _run(observation: Observation) -> RunData:
    time, x, y, yaw = np.array(observation.truth, dtype=float).T
    east, north, speed_of_turn = (_rate(time, values) for values in (x, y, yaw))
    speeds = east * np.cos(yaw) + north * np.sin(yaw), speed_of_turn
    commands = np.array(observation.commands, dtype=float).reshape(-1, 3).T
    drives = [stimulus for stimulus in observation.stimuli if GOAL_POSE in stimulus.facts]
    true = Poses(time, time, x, y, wrap_all(yaw))
    begins = np.array([stimulus.begin for stimulus in observation.stimuli])
    goals = np.array([(drive.begin, drive.begin, *drive.facts[GOAL_POSE]) for drive in drives])
    return RunData(
        observation.node, 0.0, float(time[-1]), ImuSamples(time, time, true.yaw, speeds[1]),
        OdometrySamples(time, time, x, y, true.yaw, *speeds), Commands(commands[0], *commands),
        _in_local(true, drives), goals=Poses(*goals.reshape(-1, 5).T),
        states=States(begins, begins, np.array([stimulus.name for stimulus in observation.stimuli],
                                               dtype=object)))


def _rate(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Returns the mean rate around each time, since times of two samples may be nearly the same."""
    before, after = ((time + reach).clip(time[0], time[-1]) for reach in (-MEAN, MEAN))
    change = np.interp(after, time, values) - np.interp(before, time, values)
    return change / np.maximum(after - before, MEAN)


def _in_local(true: Poses, drives: Sequence[Stimulus]) -> Poses:
    """Returns the true poses in the local frame of each drive, from its begin to the next drive.

    If there are no drives, the local frame is the true frame.
    """
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
