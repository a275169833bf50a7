"""The last moments of both sensors, and what both said at one instant.

Units: seconds on the sender's clock (:mod:`tb3_labs.sender_clock`), metres, radians. Edge cases:
a new epoch of that clock starts the history anew; over a gap of more than `MAX_GAP` nothing is
interpolated; order of arrival between the two sensors does not matter.
"""
from bisect import bisect_left
from collections import deque
from typing import NamedTuple

from tb3_labs.angles import difference, wrap
from tb3_labs.sender_clock import SenderClock
from tb3_labs.se2 import Pose2, interpolate

#: How much is remembered [s].
MEMORY = 1.5
#: Longest silence over which motion is taken to be even [s].
MAX_GAP = 0.3


class Track:
    """Values of one source over time, in order of time."""

    def __init__(self, between):
        self._between = between
        self._times = deque()
        self._values = deque()

    def add(self, time, value):
        """Append a value; `time` is later than the last one's."""
        self._times.append(time)
        self._values.append(value)
        while self._times[0] < time - MEMORY:
            self._times.popleft()
            self._values.popleft()

    def clear(self):
        """Forget everything."""
        self._times.clear()
        self._values.clear()

    @property
    def newest(self):
        """Time of the newest value; minus infinity where there is none."""
        return self._times[-1] if self._times else float('-inf')

    def at(self, time):
        """The value at `time`, or None where it is not known (too old, too new, in a gap)."""
        index = bisect_left(self._times, time)
        if index == len(self._times):
            return None
        after = self._times[index]
        if after == time:
            return self._values[index]
        if index == 0 or after - self._times[index - 1] > MAX_GAP:
            return None
        before = self._times[index - 1]
        return self._between(self._values[index - 1], self._values[index],
                             (time - before) / (after - before))


def _yaw_between(start, end, fraction):
    return wrap(start + fraction * difference(end, start))


class Instant(NamedTuple):
    """What both sensors said at `stamp` [s, sender's clock]."""

    stamp: float
    odom_T_base: Pose2
    imu_yaw: float


class SensorHistory:
    """Remembers IMU and odometry samples; answers for both at one instant."""

    def __init__(self):
        self._imu = Track(_yaw_between)
        self._odometry = Track(interpolate)
        self._unpaired = deque()
        #: The SenderClock by which samples are ordered.
        self.clock = SenderClock()

    def add_imu(self, sample, arrival):
        """Remember an ImuSample that arrived at `arrival` [s, receiver's clock]."""
        self._imu.add(self._time_of('imu', sample, arrival), sample.yaw)

    def add_odometry(self, sample, arrival):
        """Remember an OdometrySample that arrived at `arrival` [s, receiver's clock]."""
        time = self._time_of('odometry', sample, arrival)
        self._odometry.add(time, sample.pose)
        self._unpaired.append((time, sample))
        while self._unpaired[0][0] < time - MEMORY:
            self._unpaired.popleft()

    def take_pair(self):
        """The newest (OdometrySample, IMU yaw at its stamp) that was not taken yet, or None."""
        pair = None
        while self._unpaired and self._unpaired[0][0] <= self._imu.newest:
            time, sample = self._unpaired.popleft()
            yaw = self._imu.at(time)
            pair = pair if yaw is None else (sample, yaw)
        return pair

    def at(self, stamp):
        """The Instant at `stamp` [s, sender's clock]; None where it is not known (yet)."""
        pose, yaw = self._odometry.at(stamp), self._imu.at(stamp)
        return None if pose is None or yaw is None else Instant(stamp, pose, yaw)

    def _time_of(self, source, sample, arrival):
        epoch = self.clock.epoch
        time = self.clock.time_of(source, sample.stamp, arrival)
        if self.clock.epoch != epoch:
            self._imu.clear()
            self._odometry.clear()
            self._unpaired.clear()
        return time
