"""Remembers the recent samples of both sensors and interpolates their values at one instant.

A node reads every message of the odometry, but not every sample of the IMU. In a gap of the IMU
that is longer than `MAX_INTERPOLATED_GAP`, the odometry shows how the robot turned.

Units: seconds on the sender's clock (:mod:`tb3_labs.localization.sample_timing`), metres, radians.
Edge cases: A new epoch of the sender's clock empties the buffer. A gap of the odometry longer than
`MAX_INTERPOLATED_GAP` is not interpolated. Messages of both sensors may arrive in any order.
"""
import math
from bisect import bisect_left
from collections import deque
from typing import Any, Callable, Deque, NamedTuple, Optional, Tuple

from tb3_labs.geometry.angles import difference, interpolate_angle, wrap
from tb3_labs.geometry.se2 import Pose2, interpolate
from tb3_labs.localization.sample_timing import TimedSample
from tb3_labs.robot.samples import OdometrySample
from tb3_labs.supervision.timeouts import MAX_BRIDGED_GAP, MAX_INTERPOLATED_GAP

SAMPLE_MEMORY_TIME = 1.5    # [s]; older samples are forgotten


class _TimedValue(NamedTuple):
    time: float
    value: Any


class Track:
    """The recent values of one source, in order of time."""

    def __init__(self, interpolate: Callable[[Any, Any, float], Any]) -> None:
        """``interpolate(start, end, fraction)`` returns the value at a `fraction` from 0 to 1."""
        self._interpolate = interpolate
        self._values: Deque[_TimedValue] = deque()

    def add(self, time: float, value: Any) -> None:
        """Append a value, or replace the value of the same `time`. Call this in order of time."""
        if time == self.latest_time:
            self._values.pop()
        self._values.append(_TimedValue(time, value))
        while self._values[0].time < time - SAMPLE_MEMORY_TIME:
            self._values.popleft()

    def replace_values(self, function: Callable[[Any], Any]) -> None:
        self._values = deque(_TimedValue(time, function(value)) for time, value in self._values)

    @property
    def latest_time(self) -> float:
        """Time of the latest value; minus infinity before the first value."""
        return self._values[-1].time if self._values else -math.inf

    def neighbours_of(self, time: float) -> Optional[Tuple[_TimedValue, _TimedValue]]:
        """Returns the values before and after `time`, or twice the value of exactly this `time`;
        None if `time` is too early or too late."""
        if time > self.latest_time or time < self._values[0].time:
            return None
        # (time,) is less than (time, value), so this value is the first that is not before `time`
        index_after = bisect_left(self._values, (time,))
        after = self._values[index_after]
        before = after if after.time == time else self._values[index_after - 1]
        return before, after

    def value_at(self, time: float) -> Any:
        """Returns the value at `time`; None if `time` is too early, too late, or in a gap."""
        neighbours = self.neighbours_of(time)
        if neighbours is None:
            return None
        start, end = neighbours
        gap = end.time - start.time
        if gap == 0.0:
            return start.value
        if gap > MAX_INTERPOLATED_GAP:
            return None
        return self._interpolate(start.value, end.value, (time - start.time) / gap)


class SampleBuffer:
    def __init__(self) -> None:
        self._start_epoch(epoch=0)

    def _start_epoch(self, epoch: int) -> None:
        self._epoch = epoch    # epoch of the samples
        self._imu = Track(interpolate_angle)
        self._odometry = Track(interpolate)
        self._unpaired: Deque[_TimedValue] = deque()    # samples of the odometry

    def add_imu(self, timed: TimedSample) -> None:
        self._forget_other_epochs(timed.epoch)
        self._imu.add(timed.time, timed.sample.yaw)

    def add_odometry(self, timed: TimedSample) -> None:
        self._forget_other_epochs(timed.epoch)
        self._odometry.add(timed.time, timed.sample.pose)
        self._unpaired.append(_TimedValue(timed.time, timed.sample))
        while self._unpaired[0].time < timed.time - SAMPLE_MEMORY_TIME:
            self._unpaired.popleft()

    def shift(self, shift: Pose2) -> None:
        """Convert all samples to a new ``odom``, in which the old ``odom`` has the pose `shift`."""
        self._odometry.replace_values(lambda pose: shift @ pose)
        self._unpaired = deque(_TimedValue(time, sample._replace(pose=shift @ sample.pose))
                               for time, sample in self._unpaired)

    def pop_pair(self) -> Optional[Tuple[OdometrySample, float]]:
        """Returns the latest OdometrySample that was not returned yet, and the IMU's yaw [rad] at
        its stamp. Returns None if there is no new pair."""
        pair = None
        while self._unpaired and self._unpaired[0].time <= self._imu.latest_time:
            time, sample = self._unpaired.popleft()
            yaw = self._imu_yaw_at(time)
            if yaw is not None:
                pair = sample, yaw
        return pair

    def readings_at(self, stamp: float) -> Optional[Tuple[Pose2, float]]:
        """Returns (odom_T_base, yaw of the IMU [rad]) at `stamp` [s]; None if either is unknown."""
        pose = self._odometry.value_at(stamp)
        yaw = self._imu_yaw_at(stamp)
        if pose is None or yaw is None:
            return None
        return pose, yaw

    def _imu_yaw_at(self, time: float) -> Optional[float]:
        """Returns the yaw of the IMU [rad]; None if it is unknown. In a gap that is too long to be
        interpolated, the odometry shows the turn."""
        measured_yaw = self._imu.value_at(time)
        if measured_yaw is not None:
            return measured_yaw
        neighbours = self._imu.neighbours_of(time)
        if neighbours is None:
            return None
        start, end = neighbours
        if end.time - start.time > MAX_BRIDGED_GAP:
            return None
        return self._yaw_in_gap(time, start, end)

    def _yaw_in_gap(self, time: float, start: _TimedValue, end: _TimedValue) -> Optional[float]:
        """Returns the yaw [rad] at `time`, which is in a gap of the IMU from `start` to `end`."""
        start_pose = self._odometry.value_at(start.time)
        pose = self._odometry.value_at(time)
        if start_pose is None or pose is None:
            return None
        yaw = start.value + difference(pose.yaw, start_pose.yaw)
        end_pose = self._odometry.value_at(end.time)
        if end_pose is not None:    # the odometry at the end of the gap may not have arrived yet
            # the turns of both sensors in the gap differ by the drift, which grows evenly
            drift = difference(end.value - start.value, difference(end_pose.yaw, start_pose.yaw))
            yaw += drift * (time - start.time) / (end.time - start.time)
        return wrap(yaw)

    def _forget_other_epochs(self, epoch: int) -> None:
        if epoch != self._epoch:
            self._start_epoch(epoch)
