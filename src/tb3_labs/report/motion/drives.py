"""Finds the drives of a recorded run, and measures their errors and drift."""
import math
from dataclasses import dataclass
from typing import List, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.control.goal_state import DRIVING, GoalState, is_stopped
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.recording.run_data import MIN_GAP, Poses, RunData
from tb3_labs.report.motion.resets_and_goals import (
    FrameInterval, RecordedState, frame_intervals, recorded_states, true_poses)

#: A drive's errors are measured when the robot rests, at most this time [s] after the drive ends.
SETTLE_TIME = 1.0
#: The turn to the goal may last until this time [s] after the start of MOVE_FORWARD.
TURN_OVERLAP_TIME = 0.3
#: If a reset begins a drive, the new frame comes at most this time [s] after the drive begins.
MAX_RESET_DELAY = 0.1
UNKNOWN_ERROR = math.nan, math.nan
TURN_TO_GOAL, FORWARD, FINAL_TURN = DRIVING


@dataclass(frozen=True)
class DriveReport:
    """The report of a drive, from its first ROTATE_TO_GOAL to its end."""

    begin: float
    end: float
    goal: Optional[Pose2]             # in local
    is_goal_assumed: bool             # no goal was recorded, so `goal` is the lab's
    outcome: str                      # 'reached', or why the drive ended
    error: Tuple[float, float]        # (distance [m], angle [rad]) to the goal, by local_pose
    true_error: Tuple[float, float]   # (distance, angle) to the goal, by the ground truth
    drift: float                      # [rad], change of the heading in MOVE_FORWARD

    @property
    def outcome_text(self) -> str:
        return f'{self.outcome} (the goal is assumed)' if self.is_goal_assumed else self.outcome


def drive_reports(run: RunData) -> List[DriveReport]:
    frames = frame_intervals(run)
    groups: List[List[RecordedState]] = []      # each drive, and each other state, is a group
    for state in recorded_states(run):
        is_in_drive = len(groups) > 0 and groups[-1][0].name in DRIVING
        if is_in_drive and _is_same_drive(frames, groups[-1][-1], state):
            groups[-1].append(state)
        else:
            groups.append([state])
    next_states = [group[0] for group in groups[1:]] + [None]
    return [_drive_report(run, frames, group, next_state)
            for group, next_state in zip(groups, next_states) if group[0].name in DRIVING]


def frame_interval_of(frames: Sequence[FrameInterval], begin: float, end: float) -> FrameInterval:
    """Returns the FrameInterval of a drive from `begin` to `end` [s]. If a reset begins the drive,
    the new frame may come a moment later. A reset in the second half has ended the drive."""
    latest = min(begin + MAX_RESET_DELAY, (begin + end) / 2.0)
    begun = [interval for interval in frames if interval.begin <= latest]
    return begun[-1]        # the first interval begins at -inf


def _is_same_drive(frames: Sequence[FrameInterval], previous: RecordedState,
                   following: RecordedState) -> bool:
    if following.name != TURN_TO_GOAL:
        return following.name in DRIVING or is_stopped(following.name)
    # after a stop, or if the final error is too large, the robot drives to the same goal again
    may_repeat = previous.name == FINAL_TURN or is_stopped(previous.name)
    if not may_repeat or previous.goal != following.goal:
        return False
    interval = frame_interval_of(frames, previous.begin, previous.end)
    return interval is frame_interval_of(frames, following.begin, following.end)


def _drive_report(run: RunData, frames: Sequence[FrameInterval], states: Sequence[RecordedState],
                  next_state: Optional[RecordedState]) -> DriveReport:
    """Returns the report. `next_state` is None if the recording ended during the drive."""
    begin, end = states[0].begin, states[-1].end
    goal = states[0].goal
    interval = frame_interval_of(frames, begin, end)
    rest_end = end
    if next_state is not None and next_state.name != TURN_TO_GOAL:
        rest_end = min(end + SETTLE_TIME, next_state.end)
    measuring_end = min(rest_end, interval.end)
    local = run.local_pose.between(interval.begin, measuring_end)
    truth = true_poses(run, interval, end=measuring_end)
    return DriveReport(
        begin, end, goal, is_goal_assumed='goals' in run.derived, outcome=_outcome(next_state),
        error=_final_error(local, goal, end), true_error=_final_error(truth, goal, end),
        drift=_drift(run, states))


def _final_error(poses: Poses, goal: Optional[Pose2], end: float) -> Tuple[float, float]:
    """Returns (distance, angle) to the goal at the drive's `end` [s], or UNKNOWN_ERROR."""
    if goal is None or not len(poses) or poses.time[-1] < end - MIN_GAP:
        return UNKNOWN_ERROR
    last = poses.pose(-1)
    return last.distance_to(goal), difference(goal.yaw, last.yaw)


def _drift(run: RunData, states: Sequence[RecordedState]) -> float:
    forward_states = [state for state in states if state.name == FORWARD]
    if not forward_states:
        return math.nan
    longest = max(forward_states, key=lambda state: state.end - state.begin)
    yaw = np.unwrap(run.imu.between(longest.begin + TURN_OVERLAP_TIME, longest.end).yaw)
    return float(yaw[-1] - yaw[0]) if len(yaw) > 1 else math.nan


def _outcome(next_state: Optional[RecordedState]) -> str:
    if next_state is None:
        return 'recording ended'
    if next_state.name == GoalState.GOAL_REACHED.name:
        return 'reached'
    return 'begun anew' if next_state.name == TURN_TO_GOAL else next_state.name
