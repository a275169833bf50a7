"""The resets of a recorded run, and the epochs between them.

A *reset* is a jump of the robot's pose in ``local`` that odometry and IMU do not show.

``local`` also moves in ``odom`` without a reset. If the odometry jumps and the robot does not,
move_to_goal shifts ``local`` in ``odom``, so that the robot keeps its pose in ``local`` (see
:mod:`tb3_labs.localization.odometry_jumps`). The shift is up to 15 mm if the firmware reverses a
displacement, and of any size if the robot's own `reset` zeroes the odometry. The odometry itself
tells such a shift from a reset:

* If the odometry is sound and complete, each move of ``local`` in it, even a small one, is a reset.
  tf gives the exact pose of ``local``.
* Otherwise the odometry is corrected as move_to_goal corrects it, and a reset is a jump by more
  than `JUMP` against the corrected odometry. The same rule is used without tf, and if ``local``
  hardly ever stands still in tf: a node then computes ``local`` from both noisy sensors.

Units: metres, radians, seconds since the recording's start on the recorder's clock.
Edge case: two resets between two messages are one.
"""
import math
from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.angles import continuous_at, difference, wrap, wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.odometry_jumps import (
    FASTEST, POSE_LOST, RESET_SILENCE, SLACK, Jump, JumpFilter)
from tb3_labs.report.run_data import ImuSamples, OdometrySamples, Poses, RunData
from tb3_labs.robot.samples import ImuSample, OdometrySample

#: A jump of local_pose against the odometry by more than this is a reset [m], [rad].
JUMP, JUMP_ANGLE = 0.02, math.radians(1.0)
#: In tf, ``local`` stands still if it moves by no more than this [m], [rad].
STILL = 1e-5
#: tf may show a change of the odometry too early or too late, by up to this [s].
AROUND = 0.25
#: If an interval of the odometry is this many times longer than others, a message is missing.
HOLE = 1.5
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


def epochs(run: RunData) -> List[Epoch]:
    """The Epochs of a run, in order; the first begins at -inf, the last ends at inf."""
    frames = _frames(run)
    first = [0] + _resets(run, frames)
    begins = [-math.inf] + [_begin(run, frames, k) for k in first[1:]]
    ends = begins[1:] + [math.inf]
    return [Epoch(begin, end, frames.pose(k), _local_T_world(run, begin, end))
            for k, begin, end in zip(first, begins, ends)]


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
    return Poses(times, times, x, y, wrap_all(continuous_at(times, odometry.time, odometry.yaw)))


def _changes(frames: Poses) -> np.ndarray:
    """The times at which each frame after the first comes into force [s]."""
    last, first = frames.time[:-1], frames.time[1:]
    return np.maximum((last + first) / 2.0, first - HALFWAY)


def _begin(run: RunData, frames: Poses, k: int) -> float:
    """Returns the start of frame `k` [s]; if tf misses messages, by the jump of local_pose."""
    first, last = np.searchsorted(run.local_pose.time, (frames.time[k - 1], frames.time[k]))
    local = run.local_pose.take(slice(first, last + 1))
    if len(local) > 2:
        robot = robot_in_odom(run, local.time)
        frames = robot @ local.inverse()
        distance, angle = _steps(frames, robot)
        k = 1 + int(np.argmax(distance / JUMP + angle / JUMP_ANGLE))
    return float(_changes(frames)[k - 1])


def _steps(frames: Poses, robot: Poses) -> Tuple[np.ndarray, np.ndarray]:
    """Returns (distances, angles) by which the robot jumps in ``local`` at each change of frame."""
    robot = robot.take(slice(1, None))
    old, new = (frames.take(part).inverse() @ robot for part in (slice(None, -1), slice(1, None)))
    return np.hypot(new.x - old.x, new.y - old.y), np.abs(wrap_all(new.yaw - old.yaw))


def _resets(run: RunData, frames: Poses) -> List[int]:
    """Indices of the frames that were declared by a reset."""
    if len(frames) < 2:
        return []
    robot = robot_in_odom(run, frames.time)
    distance, angle = _steps(frames, robot)
    moved = (distance > STILL) | (angle > STILL)
    by_tf = len(run.frames) > 0 and moved.mean() < 0.5
    if not by_tf:
        moved = (distance > JUMP) | (angle > JUMP_ANGLE)
    too_far = np.hypot(np.diff(robot.x), np.diff(robot.y)) > (
        SLACK + FASTEST * np.diff(robot.time))
    return [k + 1 for k in np.flatnonzero(moved | too_far) if _is_reset(
        run, frames.time[k], frames.time[k + 1], by_tf and bool(moved[k]))]


def _is_reset(run: RunData, last: float, first: float, moved: bool) -> bool:
    """Was ``local`` declared anew between `last` and `first`? `moved`: ``local`` moved in tf."""
    local = run.local_pose
    before = max(0, int(np.searchsorted(local.time, last, side='right')) - 1)
    after = min(len(local) - 1, int(np.searchsorted(local.time, first)))
    mended = _mended_odometry(run, local.time[before], local.time[after])
    if mended.is_lost or (moved and mended.is_sound):
        return True
    expected, said = local.pose(before) @ mended.motion, local.pose(after)
    return (said.distance_to(expected) > JUMP
            or abs(difference(said.yaw, expected.yaw)) > JUMP_ANGLE)


class _Mended(NamedTuple):
    """The motion between two moments, by the corrected odometry and the IMU."""

    motion: Pose2      # of the robot, relative to its first pose: place by odometry, heading by IMU
    is_sound: bool     # nothing had to be corrected, and nothing is missing
    is_lost: bool      # the pose is lost, and there is no ``local`` until it is declared anew


def _mended_odometry(run: RunData, begin: float, end: float) -> _Mended:
    around = begin - AROUND, end + AROUND
    first, last = np.searchsorted(run.odometry.time, around)
    heard, imu = run.odometry.take(slice(max(0, first - 2), last)), run.imu.between(*around)
    if len(heard) < 2 or not len(imu):
        return _Mended(Pose2(), False, False)
    poses, steady, jumps = steady_odometry(heard, run.imu)
    jumps = [(time, jump) for time, jump in jumps if begin < time <= end]
    driven = poses.at(begin).inverse() @ poses.at(end)
    before, after = imu.yaw_at((begin, end))
    pauses = np.diff(heard.time)
    turned = after - before - sum(jump.imu_turn for _, jump in jumps)
    return _Mended(Pose2(driven.x, driven.y, wrap(turned)),
                   bool(steady == Pose2() and pauses.max() < HOLE * np.median(pauses)),
                   any(jump.outcome == POSE_LOST for _, jump in jumps))


def steady_odometry(odometry: OdometrySamples,
                    imu: ImuSamples) -> Tuple[Poses, Pose2, List[Tuple[float, Jump]]]:
    """Returns an odometry as move_to_goal corrects it: (Poses without jumps, the last pose of
    ``odom`` in their frame, [(time, Jump)])."""
    steady, poses, jumps = JumpFilter(), [], []
    newest = np.searchsorted(imu.arrival, odometry.arrival, side='right') - 1
    for k, heard in enumerate(newest.clip(0)):
        if odometry.arrival[k] - imu.arrival[heard] > RESET_SILENCE:
            heard = min(heard + 1, len(imu) - 1)    # the first sample after the silence
        sample, jump = steady.take(
            OdometrySample(odometry.time[k], odometry.pose(k), float(odometry.linear[k]),
                           float(odometry.angular[k])), odometry.arrival[k],
            ImuSample(imu.time[heard], imu.yaw[heard], imu.yaw_rate[heard]))
        poses.append((sample.pose.x, sample.pose.y, sample.pose.yaw))
        if jump is not None:
            jumps.append((float(odometry.time[k]), jump))
    return (Poses(odometry.arrival, odometry.time, *np.array(poses).T), steady.steady_T_odom,
            jumps)


def _local_T_world(run: RunData, begin: float, end: float) -> Optional[Pose2]:
    """Returns the pose of world in local, by the first local_pose after a reset, which is true."""
    if not len(run.ground_truth):
        return None
    known = run.local_pose.between(max(begin, run.ground_truth.time[0]),
                                   min(end, run.ground_truth.time[-1]))
    if not len(known):
        return None
    return known.pose(0) @ run.ground_truth.at(known.time[0]).inverse()
