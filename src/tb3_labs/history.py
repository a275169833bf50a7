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
        self._unpaired = deque()
        self._delays = deque(maxlen=DELAYS)
        self._last_stamp = {}
        self._stepped_at = None
        #: Counts how often the history was started anew; instants of different epochs don't compare.
        self.epoch = 0
        #: False once the sender's stamps turned out to be unusable.
        self.uses_stamps = True

    def add_imu(self, sample, arrival):
        """Remember an ImuSample that arrived at `arrival` [s, receiver's clock]."""
        self._imu.add(self._time_of(self._imu, sample.stamp, arrival), sample.yaw)

    def add_odometry(self, sample, arrival):
        """Remember an OdometrySample that arrived at `arrival` [s, receiver's clock]."""
        time = self._time_of(self._odometry, sample.stamp, arrival)
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

    def stamp_of(self, now):
        """`now` [s, receiver's clock] on the sender's clock; None before the first sample."""
        return now - median(self._delays) if self._delays else None

    def at(self, stamp):
        """The Instant at `stamp` [s, sender's clock]; None where it is not known (yet)."""
        pose, yaw = self._odometry.at(stamp), self._imu.at(stamp)
        return None if pose is None or yaw is None else Instant(stamp, pose, yaw)

    def _time_of(self, track, stamp, arrival):
        """When a sample was measured, on the time axis of the tracks."""
        if self.uses_stamps and (stamp <= 0.0 or stamp == self._last_stamp.get(track)):
            self._give_up_stamps()
        self._last_stamp[track] = stamp
        delay = arrival - stamp
        stepped = self._delays and abs(delay - self._delays[-1]) > CLOCK_STEP
        if self.uses_stamps and (stepped or stamp < track.newest):
            if self._stepped_at is not None and abs(arrival - self._stepped_at) < CLOCK_STEP:
                self._give_up_stamps()   # not one clock that stepped: two that disagree
            else:
                self._stepped_at = arrival
                self._start_anew()
        if self.uses_stamps:
            self._delays.append(delay)
            return stamp
        if arrival < track.newest:
            self._start_anew()           # the receiver's own clock went back
        self._delays.append(0.0)
        return arrival

    def _give_up_stamps(self):
        self.uses_stamps = False
        self._start_anew()

    def _start_anew(self):
        self._imu.clear()
        self._odometry.clear()
        self._unpaired.clear()
        self._delays.clear()
        self.epoch += 1
