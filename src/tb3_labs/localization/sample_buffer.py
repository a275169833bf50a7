"""Remembers the recent samples of both sensors, and interpolates their values at one instant.

A node reads every message of the odometry, but not every sample of the IMU. If a gap of the IMU is
longer than `MAX_INTERPOLATED_GAP`, the odometry shows how the robot turned in this gap.

Units: seconds on the sender's clock (:mod:`tb3_labs.localization.sample_timing`), metres, radians.
Edge cases: A new epoch of the sender's clock empties the buffer. A gap of the odometry longer than
`MAX_INTERPOLATED_GAP` is not interpolated. Messages of both sensors may arrive in any order.
"""
import math
from bisect import bisect_left
from collections import deque
from typing import Any, Callable, Deque, Optional, Tuple

from tb3_labs.geometry.angles import difference, interpolate_angle, wrap
from tb3_labs.geometry.se2 import Pose2, interpolate
from tb3_labs.localization.sample_timing import TimedSample
from tb3_labs.robot.samples import OdometrySample
from tb3_labs.supervision.timeouts import MAX_BRIDGED_GAP, MAX_INTERPOLATED_GAP

SAMPLE_MEMORY_TIME = 1.5    # [s]


class Track:
    """The recent values of one source, in order of time."""

    def __init__(self, interpolate: Callable[[Any, Any, float], Any]) -> None:
        """``interpolate(start, end, fraction)`` returns the value at a `fraction` from 0 to 1."""
        self._interpolate = interpolate
        self._samples: Deque[Tuple[float, Any]] = deque()    # (time, value)

    def add(self, time: float, value: Any) -> None:
        """Append a value, which replaces an earlier value of the same `time`. `time` must not be
        before :attr:`newest`."""
        if time == self.newest:
            self._samples.pop()
        self._samples.append((time, value))
        while self._samples[0][0] < time - SAMPLE_MEMORY_TIME:
            self._samples.popleft()

    def replace_values(self, function: Callable[[Any], Any]) -> None:
        self._samples = deque((time, function(value)) for time, value in self._samples)

    @property
    def newest(self) -> float:
        """Time of the latest value; minus infinity before the first value."""
        return self._samples[-1][0] if self._samples else -math.inf

    def around(self, time: float) -> Optional[Tuple[Tuple[float, Any], Tuple[float, Any]]]:
        """Returns the samples (time, value) before and after `time`; None if `time` is not between
        two samples. If a sample has exactly this `time`, both returned samples are this sample."""
        index = bisect_left(self._samples, (time,))
        if index == len(self._samples):
            return None
        after = self._samples[index]
        if after[0] == time:
            return after, after
        return (self._samples[index - 1], after) if index else None

    def value_at(self, time: float) -> Any:
        """Returns the value at `time`; None if `time` is too early, too late, or in a gap."""
        neighbours = self.around(time)
        if neighbours is None:
            return None
        (start, start_value), (end, end_value) = neighbours
        if start == end:
            return start_value
        if end - start > MAX_INTERPOLATED_GAP:
            return None
        return self._interpolate(start_value, end_value, (time - start) / (end - start))


class SampleBuffer:
    """Remembers IMU and odometry samples, and interpolates both to one instant."""

    def __init__(self) -> None:
        self._forget(epoch=0)

    def _forget(self, epoch: int) -> None:
        self._epoch = epoch    # epoch of the samples
        self._imu = Track(interpolate_angle)
        self._odometry = Track(interpolate)
        self._unpaired: Deque[Tuple[float, OdometrySample]] = deque()

    def add_imu(self, timed: TimedSample) -> None:
        self._check_epoch(timed.epoch)
        self._imu.add(timed.time, timed.sample.yaw)

    def add_odometry(self, timed: TimedSample) -> None:
        self._check_epoch(timed.epoch)
        self._odometry.add(timed.time, timed.sample.pose)
        self._unpaired.append((timed.time, timed.sample))
        while self._unpaired[0][0] < timed.time - SAMPLE_MEMORY_TIME:
            self._unpaired.popleft()

    def shift(self, shift: Pose2) -> None:
        """Convert all samples to a new ``odom``, in which the old ``odom`` has the pose `shift`."""
        self._odometry.replace_values(lambda pose: shift @ pose)
        self._unpaired = deque((time, sample._replace(pose=shift @ sample.pose))
                               for time, sample in self._unpaired)

    def pop_pair(self) -> Optional[Tuple[OdometrySample, float]]:
        """Returns the latest OdometrySample that was not returned yet, and the IMU's yaw [rad] at
        its stamp. Returns None if there is no new pair."""
        pair = None
        while self._unpaired and self._unpaired[0][0] <= self._imu.newest:
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
        """Returns the yaw of the IMU [rad]. In a long gap, the odometry shows the turn."""
        yaw = self._imu.value_at(time)
        neighbours = self._imu.around(time)
        if yaw is not None or neighbours is None:
            return yaw
        (start, start_yaw), (end, end_yaw) = neighbours
        before, here, after = [self._odometry.value_at(when) for when in (start, time, end)]
        is_bridged = end - start <= MAX_BRIDGED_GAP
        if not is_bridged or before is None or here is None:
            return None
        yaw = start_yaw + difference(here.yaw, before.yaw)
        if after is not None:    # the odometry at the end of the gap may not have arrived yet
            drift = difference(end_yaw - start_yaw, difference(after.yaw, before.yaw))
            yaw += drift * (time - start) / (end - start)
        return wrap(yaw)

    def _check_epoch(self, epoch: int) -> None:
        if epoch != self._epoch:
            self._forget(epoch)
