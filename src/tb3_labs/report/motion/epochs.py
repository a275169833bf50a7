"""The epochs of a recorded run: from one reset of ``local`` to the next.

A node logs each reset (see :mod:`tb3_labs.report.bag.messages`). The line comes a moment before or
after the first pose in the new frame. So an epoch begins where local_pose jumps most, beside the
odometry, within `NEAR_RESET` of a line.

``local`` also moves in ``odom`` within an epoch: if the odometry jumps and the robot does not,
move_to_goal shifts ``local``, so that the robot keeps its pose in it (see
:mod:`tb3_labs.localization.odometry_jumps`).

Units: metres, radians, seconds since the recording's start on the recorder's clock.
Edge case: a reset before the first local_pose, or after the last one, begins no epoch.
"""
import math
from dataclasses import dataclass
from typing import List, Optional, Sequence, Set

import numpy as np

from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.run_data import Poses, RunData, cached_per_run

#: The first pose in a new frame comes at most this long before or after the line of its reset [s].
NEAR_RESET = 0.3
#: A jump by this angle has the weight of a jump by a metre [rad]. A jump that is a second farther
#: from the line has less weight by AWAY [m]: a reset may declare the pose that the robot has.
LEVER, AWAY = 1.0, 0.05
#: A new frame begins midway between the last message of the old frame and the first message of the
#: new one, but at most this long before that first message [s].
HALFWAY = 0.05
#: If a reset begins a drive, the first pose in the new frame may come this long after the start of
#: the drive [s].
RESET_DELAY = 0.1


@dataclass(frozen=True)
class Epoch:
    """One declaration of ``local``, in force from `begin` to `end`; `odom_T_local`: its first
    pose."""

    begin: float
    end: float
    odom_T_local: Pose2
    local_T_world: Optional[Pose2]    # None: unknown


@cached_per_run
def epochs(run: RunData) -> List[Epoch]:
    """The Epochs of a run, in order; the first begins at -inf, the last ends at inf."""
    frames = _frames(run)
    begins = [-math.inf] + _begins(run)
    ends = begins[1:] + [math.inf]
    # tf gives the exact pose of ``local``, from the first transform of the epoch on
    first = np.searchsorted(frames.time, begins).clip(max=len(frames) - 1)
    return [Epoch(begin, end, frames.pose(int(k)), _local_T_world(run, begin, end))
            for k, begin, end in zip(first, begins, ends)]


def _begins(run: RunData) -> List[float]:
    """Returns the start of each epoch after the first [s]. Two resets are two epochs, also if both
    are near both lines."""
    local = run.local_pose
    robot = robot_in_odom(run, local.time)
    moved = (local.take(slice(None, -1)).inverse() @ local.take(slice(1, None))).inverse() @ (
        robot.take(slice(None, -1)).inverse() @ robot.take(slice(1, None)))
    jumps = np.hypot(moved.x, moved.y) + np.abs(moved.yaw) / LEVER
    begins = _changes(local)
    found: Set[int] = set()
    for time in run.resets.time:
        first, last = np.searchsorted(local.time, (time - NEAR_RESET, time + NEAR_RESET))
        around = [k for k in range(max(0, first - 1), min(last, len(jumps))) if k not in found]
        if around and local.time[0] < time:
            found.add(max(around, key=lambda k: jumps[k] - AWAY * abs(begins[k] - time)))
    return [float(begin) for begin in begins[sorted(found)]]


def epoch_of(in_order: Sequence[Epoch], begin: float, end: float) -> Epoch:
    """Returns the Epoch of a drive from `begin` to `end` [s].

    The reset that began the drive may show a moment late. A reset that is nearer to the end of the
    drive than to its start has ended the drive.
    """
    latest = min(begin + RESET_DELAY, (begin + end) / 2.0)
    return [epoch for epoch in in_order if epoch.begin <= latest][-1]


def local_in_odom(run: RunData, times: np.ndarray) -> Poses:
    """The poses of ``local`` in ``odom`` at each of the times [s]."""
    frames = _frames(run)
    return frames.take(np.searchsorted(_changes(frames), times, side='right'))


def _frames(run: RunData) -> Poses:
    """Returns the poses of ``local`` in ``odom``: by tf, else by local_pose."""
    if len(run.frames):
        return run.frames
    return robot_in_odom(run, run.local_pose.time) @ run.local_pose.inverse()


def robot_in_odom(run: RunData, times: np.ndarray) -> Poses:
    """The robot's poses in ``odom`` at each of the times [s], interpolated."""
    odometry = run.odometry
    x, y = (np.interp(times, odometry.time, column) for column in (odometry.x, odometry.y))
    return Poses(times, times, x, y, wrap_all(odometry.yaw_at(times)))


def _changes(frames: Poses) -> np.ndarray:
    """The times at which each frame after the first comes into force [s]."""
    last, first = frames.time[:-1], frames.time[1:]
    return np.maximum((last + first) / 2.0, first - HALFWAY)


def _local_T_world(run: RunData, begin: float, end: float) -> Optional[Pose2]:
    """Returns the pose of world in local, by the first local_pose after a reset, which is true."""
    if not len(run.ground_truth):
        return None
    known = run.local_pose.between(max(begin, run.ground_truth.time[0]),
                                   min(end, run.ground_truth.time[-1]))
    if not len(known):
        return None
    return known.pose(0) @ run.ground_truth.at(known.time[0]).inverse()
