"""Finds the local frame and the goal at each time of a recorded run.

A *frame interval* is the time from one reset of ``local`` to the next. The log line of a reset
comes a moment before or after the first pose in the new frame. A frame interval begins at the
largest jump of local_pose within `RESET_SEARCH_TIME` of the log line. A jump is a motion that the
odometry does not show. A reset before the first local_pose, or after the last, begins no interval.

``local`` may move in ``odom`` within a frame interval. If the odometry jumps while the robot rests,
move_to_goal shifts ``local`` by the jump (see :mod:`tb3_labs.localization.odometry_jumps`).
"""
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import List, Optional, Set, Tuple

import numpy as np

from tb3_labs.geometry.arrays import index_at_or_before, wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.recording.run_data import Poses, RunData

#: The log line of a reset, and the first pose in the new frame, are at most this time [s] apart.
RESET_SEARCH_TIME = 0.3
#: The jump with the largest weight begins a frame interval. The weight is the size of the jump [m],
#: minus this number times the time [s] from the jump to the log line. If no pose jumps, the pose
#: nearest to the log line has the largest weight.
WEIGHT_LOSS_PER_SECOND = 0.05
#: A new frame begins midway between the last message in the old frame and the first message in the
#: new frame, but at most this time [s] before the first message.
MAX_FIRST_MESSAGE_DELAY = 0.05
#: A goal that arrived at most this time [s] after a state belongs to the state.
MAX_GOAL_DELAY = 0.1


@dataclass(frozen=True)
class FrameInterval:
    """The time between two resets of ``local``."""

    begin: float
    end: float
    odom_T_local: Pose2               # at `begin`
    local_T_world: Optional[Pose2]    # None if unknown


@dataclass(frozen=True)
class RecordedState:
    """The time in which goal_state was `name`."""

    name: str
    begin: float
    end: float
    goal: Optional[Pose2]             # in local; None if the goal is unknown


@lru_cache(maxsize=1)
def frame_intervals(run: RunData) -> List[FrameInterval]:
    """Returns the FrameIntervals of a run, from the time -inf to the time inf."""
    frames = _frames(run)
    begins = [-math.inf] + _interval_begins(run)
    ends = begins[1:] + [math.inf]
    # at the beginning of an interval, the first transform on tf has the exact pose of ``local``
    first_indices = np.searchsorted(frames.time, begins).clip(max=len(frames) - 1)
    return [FrameInterval(begin, end, frames.pose(int(index)), _local_T_world(run, begin, end))
            for index, begin, end in zip(first_indices, begins, ends)]


def _interval_begins(run: RunData) -> List[float]:
    """Returns the begin [s] of each frame interval after the first."""
    local = run.local_pose
    jump_sizes = _jump_sizes(run)
    begins = _begins_of_frames(local)
    chosen_jumps: Set[int] = set()
    for reset_at in run.resets.time:
        window = reset_at - RESET_SEARCH_TIME, reset_at + RESET_SEARCH_TIME
        first_pose, end_pose = np.searchsorted(local.time, window)
        # a jump leads from the pose with the same index to the next pose
        near_indices = range(max(0, first_pose - 1), min(end_pose, len(jump_sizes)))
        # two resets never begin the same interval
        candidates = [jump for jump in near_indices if jump not in chosen_jumps]
        if candidates and local.time[0] < reset_at:
            delays = np.abs(begins[candidates] - reset_at)
            weights = jump_sizes[candidates] - WEIGHT_LOSS_PER_SECOND * delays
            chosen_jumps.add(candidates[int(np.argmax(weights))])
    return [float(begin) for begin in begins[sorted(chosen_jumps)]]


def _jump_sizes(run: RunData) -> np.ndarray:
    """Returns the size of the jump from each local_pose to the next. A radian counts as a metre."""
    moved_in_local = _displacements(run.local_pose)
    moved_in_odom = _displacements(run.odometry.at(run.local_pose.time))
    jumps = moved_in_local.inverse() @ moved_in_odom
    return np.hypot(jumps.x, jumps.y) + np.abs(jumps.yaw)


def _displacements(poses: Poses) -> Poses:
    """Returns the displacement from each pose to the next, in the frame of the earlier pose."""
    return poses.take(slice(None, -1)).inverse() @ poses.take(slice(1, None))


def local_in_odom(run: RunData, times: np.ndarray) -> Poses:
    """Returns the poses of ``local`` in ``odom`` at the times [s]."""
    frames = _frames(run)
    return frames.take(index_at_or_before(_begins_of_frames(frames), times) + 1)


def _frames(run: RunData) -> Poses:
    """Returns the recorded poses of ``local`` in ``odom``. If tf was not recorded, the poses are
    computed from local_pose and the odometry."""
    if len(run.frames):
        return run.frames
    return run.odometry.at(run.local_pose.time) @ run.local_pose.inverse()


def _begins_of_frames(frames: Poses) -> np.ndarray:
    """Returns the time [s] at which each of the `frames` after the first becomes valid."""
    last, first = frames.time[:-1], frames.time[1:]
    return np.maximum((last + first) / 2.0, first - MAX_FIRST_MESSAGE_DELAY)


def _local_T_world(run: RunData, begin: float, end: float) -> Optional[Pose2]:
    """Returns the pose of ``world`` in ``local``, or None without ground truth. The first
    local_pose in the interval is assumed to be exact."""
    if not len(run.ground_truth):
        return None
    local_T_robot = run.local_pose.between(max(begin, run.ground_truth.time[0]),
                                           min(end, run.ground_truth.time[-1]))
    if not len(local_T_robot):
        return None
    world_T_robot = run.ground_truth.pose_at(local_T_robot.time[0])
    return local_T_robot.pose(0) @ world_T_robot.inverse()


def true_poses(run: RunData, interval: FrameInterval, parent_T_local: Pose2 = Pose2(),
               end: float = math.inf) -> Poses:
    """Returns the robot's true poses in `parent` until `end` [s], or no poses without them."""
    if interval.local_T_world is None:
        return Poses.none()
    truth = run.ground_truth.between(interval.begin, min(end, interval.end))
    return truth.in_parent(parent_T_local @ interval.local_T_world)


@lru_cache(maxsize=1)
def recorded_states(run: RunData) -> List[RecordedState]:
    """Returns the RecordedStates in order. Each state begins when its message arrives."""
    begins = run.states.arrival.tolist()
    ends = begins[1:] + [run.duration]
    goals = index_at_or_before(run.goals.arrival, run.states.arrival + MAX_GOAL_DELAY).tolist()
    return [RecordedState(name, begin, end, run.goals.pose(goal) if goal >= 0 else None)
            for name, begin, end, goal in zip(run.states.text, begins, ends, goals)]


def goal_errors(run: RunData) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns (times [s], distances [m], angles [rad]) from each local_pose to its goal."""
    first_goal_at = min(run.goals.arrival, default=math.inf)
    poses = run.local_pose.between(first_goal_at, math.inf)
    goals = run.goals.take(index_at_or_before(run.goals.arrival, poses.time))
    distances = np.hypot(goals.x - poses.x, goals.y - poses.y)
    return poses.time, distances, wrap_all(goals.yaw - poses.yaw)
