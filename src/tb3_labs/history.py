"""The last moments of both sensors, and what both said at one instant.

Instants are told by the sender's header stamps: they give intervals well, but come from the
robot's clock, which may be a second off. The usual delay between stamp and arrival translates the
receiver's "now" into that clock. Where stamps cannot be used (zero, standing still) arrival times
take their place for both sensors.

Units: seconds, metres, radians. Edge cases: a step of the sender's clock, either way, starts the
history anew; over a gap of more than `MAX_GAP` nothing is interpolated; order of arrival between
the two sensors does not matter.
"""
from bisect import bisect_left
from collections import deque
from statistics import median
from typing import NamedTuple

from tb3_labs.angles import difference, wrap
from tb3_labs.se2 import Pose2, interpolate

#: How much is remembered [s].
MEMORY = 1.5
#: Longest silence over which motion is taken to be even [s].
MAX_GAP = 0.3
#: A stamp this far from where the last ones lay is a new clock [s].
CLOCK_STEP = 1.0
#: The usual delay is the median of this many.
DELAYS = 101


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
        self._unpaired = None
        self._delays = deque(maxlen=DELAYS)
        #: False once the sender's stamps turned out to be unusable.
        self.uses_stamps = True

    def add_imu(self, sample, arrival):
        """Remember an ImuSample that arrived at `arrival` [s, receiver's clock]."""
        self._imu.add(self._time_of(self._imu, sample.stamp, arrival), sample.yaw)

    def add_odometry(self, sample, arrival):
        """Remember an OdometrySample that arrived at `arrival` [s, receiver's clock]."""
        time = self._time_of(self._odometry, sample.stamp, arrival)
        self._odometry.add(time, sample.pose)
        self._unpaired = (time, sample)

    def take_pair(self):
        """The newest (OdometrySample, IMU yaw at its stamp) that was not taken yet, or None."""
        if self._unpaired is None or self._imu.newest < self._unpaired[0]:
            return None
        time, sample = self._unpaired
        self._unpaired = None
        yaw = self._imu.at(time)
        return None if yaw is None else (sample, yaw)

    def at(self, now):
        """The Instant at `now` [s, receiver's clock]; None where it is not known (yet)."""
        if not self._delays:
            return None
        stamp = now - median(self._delays)
        pose, yaw = self._odometry.at(stamp), self._imu.at(stamp)
        return None if pose is None or yaw is None else Instant(stamp, pose, yaw)

    def _time_of(self, track, stamp, arrival):
        """When a sample was measured, on the time axis of the tracks."""
        if self.uses_stamps and (stamp <= 0.0 or stamp == track.newest):
            self.uses_stamps = False
            self._start_anew()
        time = stamp if self.uses_stamps else arrival
        delay = arrival - time
        clock_stepped = self._delays and abs(delay - self._delays[-1]) > CLOCK_STEP
        if clock_stepped or time < track.newest:
            self._start_anew()
        self._delays.append(delay)
        return time

    def _start_anew(self):
        self._imu.clear()
        self._odometry.clear()
        self._unpaired = None
        self._delays.clear()
