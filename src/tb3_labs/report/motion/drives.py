"""Finds the drives of a recorded run, and measures their errors and drift.

The run has a local_pose, recorded or computed (see :mod:`tb3_labs.report.motion.movements`).
Frames: ``odom`` (global), ``local`` (declared by the last reset), ``world`` (of the ground truth).
Units: metres, radians, seconds since the recording's start on the recorder's clock.
Edge case: a value is NaN if its ground truth or its samples were not recorded.
"""
import math
from dataclasses import dataclass
from typing import List, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.control.goal_state import DRIVING, GoalState, is_stopped
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.recording.run_data import MIN_GAP, Poses, RunData
from tb3_labs.report.motion.resets_and_goals import (
    FrameInterval, RecordedState, frame_intervals, recorded_states)

#: A drive's errors are measured at rest, at the latest this time [s] after the end of the drive.
SETTLE_TIME = 1.0
#: The turn to the goal may last until this time [s] after the start of MOVE_FORWARD.
STRAIGHT_AFTER = 0.3
#: If a reset begins a drive, the new frame comes at most this time [s] after the drive's begin.
RESET_DELAY = 0.1
#: An unknown (distance, angle) has this value.
UNKNOWN = math.nan, math.nan
TURN_TO_GOAL, FORWARD, FINAL_TURN = DRIVING


@dataclass(frozen=True)
class DriveReport:
    """The report of a drive, from its first ROTATE_TO_GOAL to its end."""

    begin: float
    end: float
    goal: Optional[Pose2]             # in local
    outcome: str                      # 'reached', or why the drive ended
    error: Tuple[float, float]        # (distance [m], angle [rad]) to the goal, by local_pose
    true_error: Tuple[float, float]   # (distance, angle) to the goal, by the ground truth
    drift: float                      # [rad], change of the heading in MOVE_FORWARD


def drives(run: RunData) -> List[DriveReport]:
    """Returns the DriveReport of each drive, in order."""
    states, frames = recorded_states(run), frame_intervals(run)
    reports = []
    first = 0
    while first < len(states):
        end = first + 1
        if states[first].state in DRIVING:
            while end < len(states) and _is_same_drive(frames, states[end - 1], states[end]):
                end += 1
            reports.append(_drive(run, frames, states[first:end], states[end:end + 1]))
        first = end
    return reports


def frame_interval_of(frames: Sequence[FrameInterval], begin: float, end: float) -> FrameInterval:
    """Returns the FrameInterval in which a drive from `begin` to `end` [s] took place.

    A reset may begin the drive, and the pose may show this reset a moment after `begin`. A reset in
    the second half of the drive has ended the drive, so the interval after this reset is not
    returned.
    """
    latest = min(begin + RESET_DELAY, (begin + end) / 2.0)
    return [interval for interval in frames if interval.begin <= latest][-1]


def _is_same_drive(frames: Sequence[FrameInterval], previous: RecordedState,
                   following: RecordedState) -> bool:
    if following.state != TURN_TO_GOAL:
        return following.state in DRIVING or is_stopped(following.state)
    # after a stop, or if the final error is too large, the robot drives to the same goal again
    is_again = previous.state == FINAL_TURN or is_stopped(previous.state)
    interval, next_interval = (
        frame_interval_of(frames, each.begin, each.end) for each in (previous, following))
    return is_again and previous.goal == following.goal and interval is next_interval


def _drive(run: RunData, frames: Sequence[FrameInterval], parts: Sequence[RecordedState],
           next_states: Sequence[RecordedState]) -> DriveReport:
    """Returns the report of the drive with the states `parts`. `next_states` contains the state
    after the drive, and is empty if the recording ended during the drive."""
    begin, end, goal = parts[0].begin, parts[-1].end, parts[0].goal
    interval = frame_interval_of(frames, begin, end)
    measured_until = end
    if next_states and next_states[0].state != TURN_TO_GOAL:
        measured_until = min(end + SETTLE_TIME, next_states[0].end)
    local, truth = (poses.between(interval.begin, min(measured_until, interval.end))
                    for poses in (run.local_pose, run.ground_truth))
    true_error = UNKNOWN
    if interval.local_T_world is not None:
        true_error = _final_error(truth.seen_from(interval.local_T_world), goal, end)
    return DriveReport(begin, end, goal, outcome=_outcome(next_states),
                       error=_final_error(local, goal, end), true_error=true_error,
                       drift=_drift(run, parts))


def _final_error(poses: Poses, goal: Optional[Pose2], end: float) -> Tuple[float, float]:
    """Returns (distance, angle) from the last pose to the goal. Returns UNKNOWN without a pose near
    the drive's `end` [s]."""
    if goal is None or not len(poses) or poses.time[-1] < end - MIN_GAP:
        return UNKNOWN
    last = poses.pose(-1)
    return last.distance_to(goal), difference(goal.yaw, last.yaw)


def _drift(run: RunData, parts: Sequence[RecordedState]) -> float:
    stretches = [part for part in parts if part.state == FORWARD]
    if not stretches:
        return math.nan
    longest = max(stretches, key=lambda part: part.end - part.begin)
    yaw = np.unwrap(run.imu.between(longest.begin + STRAIGHT_AFTER, longest.end).yaw)
    return float(yaw[-1] - yaw[0]) if len(yaw) > 1 else math.nan


def _outcome(next_states: Sequence[RecordedState]) -> str:
    if not next_states:
        return 'recording ended'
    following = next_states[0].state
    if following == GoalState.GOAL_REACHED.name:
        return 'reached'
    return 'begun anew' if following == TURN_TO_GOAL else following
