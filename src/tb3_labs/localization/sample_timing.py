"""Finds the times of samples, and the noise of an IMU.

SampleTiming measures the silence before each sample and learns the sender's clock. A TimedSample
contains all times of a sample, so no other module measures a time.

The stamps of messages show the time between two samples well. Stamps come from the robot's clock,
which may be wrong by a second, may be set, or may always show zero. Arrivals are on the receiver's
clock, but include the delays of the network. The order of samples is the order of their stamps. The
*least delay* is the shortest time between stamp and arrival in the last seconds. This delay
converts times between the robot's clock and the receiver's clock. If the stamps are not a clock,
the arrivals replace the stamps of both sensors.

Units: seconds. Cases:

1. An old stamp is used, because it shows that its message was delayed.
2. A stamp that goes back by less than `MAX_CORRECTION` shows a clock that is being corrected. The
   time of the source's samples then stays at the highest stamp so far, until a stamp is higher.
3. A new *epoch* begins with a stamp that goes back by `MAX_CORRECTION` or more, is in the future,
   or follows a long silence. Times of different epochs cannot be compared.
4. Stamps are not a clock if they are zero, stand still, or differ between two sources.

Source: the least delay as in NTP's clock filter (RFC 5905, section 10).
"""
import math
from collections import defaultdict
from typing import Any, DefaultDict, NamedTuple, Optional

from tb3_labs.geometry.angles import difference
from tb3_labs.robot.samples import ImuSample, OdometrySample, Sample
from tb3_labs.supervision.timeouts import LONG_SILENCE, MAX_GYRO_GAP, WindowMinimum

MAX_CORRECTION = 0.1    # [s]; a clock that goes back by less is being corrected, and was not set
MIN_CLOCK_STEP = 1.0    # [s]; a stamp that is this much ahead of its arrival belongs to a new clock
#: Stamps that are wrong by MIN_CLOCK_STEP or more for longer than this time [s] are not a clock.
MAX_WRONG_TIME = 1.0
MAX_REPEATS = 3            # if a stamp is repeated this often, the stamps are not a clock
MIN_NOISE_WEIGHT = 0.02    # least weight of a new sample in the variance of the noise
#: A turn is slow and even if its rate [rad/s] is at most the first value, and if the change of its
#: rate between two samples is at most the second value.
MAX_SLOW_TURN_RATE = 0.2
MAX_EVEN_RATE_CHANGE = 0.03


class TimedSample(NamedTuple):
    sample: Any              # an ImuSample or OdometrySample
    previous_sample: Any     # the previous sample of the same sensor, or None
    arrival: float           # time of arrival [s, receiver's clock]
    time: float              # time of measurement [s, sender's clock]; `arrival` if unknown
    epoch: int               # epoch of the sender's clock
    measured_at: float       # time of measurement [s, receiver's clock]
    silence: float           # time [s] since this sensor's previous sample; infinite at first
    silence_of_robot: float  # time [s] since the latest sample of any sensor; infinite at first
    stamp_interval: float    # time [s] from the previous stamp; 0 for the first sample

    def age(self, now: float) -> float:
        """Returns the time [s] since the measurement; 0 if the receiver's clock went back."""
        return max(0.0, now - self.measured_at)

    @property
    def interval(self) -> float:
        """Time [s] since the previous sample, by stamps if possible, otherwise by arrivals."""
        if 0.0 < self.stamp_interval <= self.silence + MIN_CLOCK_STEP:
            return self.stamp_interval
        return self.silence


class SampleTiming:
    def __init__(self) -> None:
        self.clock = SenderClock()
        self.imu: Optional[TimedSample] = None         # the latest sample
        self.odometry: Optional[TimedSample] = None    # the latest sample

    def on_imu(self, sample: ImuSample, now: float) -> TimedSample:
        self.imu = self._time_sample('imu', self.imu, sample, now)
        return self.imu

    def on_odometry(self, sample: OdometrySample, now: float) -> TimedSample:
        self.odometry = self._time_sample('odom', self.odometry, sample, now)
        return self.odometry

    def _time_sample(self, source: str, last: Optional[TimedSample], sample: Sample,
                     now: float) -> TimedSample:
        silence = _silence_since(last, now)
        previous = last.sample if last else None
        stamp_interval = sample.stamp - previous.stamp if previous else 0.0
        silence_of_robot = min(_silence_since(self.imu, now), _silence_since(self.odometry, now))
        time = self.clock.add_stamp(
            source, sample.stamp, now, silence=silence, silence_of_robot=silence_of_robot)
        return TimedSample(
            sample, previous, arrival=now, time=time, epoch=self.clock.epoch,
            measured_at=self.clock.to_receiver_time(time, now), silence=silence,
            silence_of_robot=silence_of_robot, stamp_interval=stamp_interval)


def _silence_since(last: Optional[TimedSample], now: float) -> float:
    return max(0.0, now - last.arrival) if last else math.inf


class _Stamp(NamedTuple):
    """The latest stamp of one source in an epoch. The defaults mean that no stamp has arrived."""

    stamp: float = math.nan
    time: float = -math.inf        # time of the source's latest sample
    repeats: int = 0               # number of messages that repeated the stamp
    wrong_since: float = math.inf  # arrival [s] of the first wrong stamp since the latest good one


class SenderClock:
    """The robot's clock, learned from the stamps of its messages."""

    def __init__(self) -> None:
        self.epoch = -1                  # number of the epoch; the first epoch is 0
        self.uses_stamps = True          # the stamps show the sender's time
        self._last_arrival = math.nan    # NaN before the first sample
        self._start_epoch()

    def add_stamp(self, source: str, stamp: float, arrival: float, silence: float,
                  silence_of_robot: float) -> float:
        """Store a sample's stamp. Returns the sample's time on the sender's clock, or `arrival` if
        the stamps are not a clock. TimedSample explains `silence` and `silence_of_robot`."""
        last = self._latest_stamps[source]
        repeats = last.repeats + 1 if stamp == last.stamp else 0
        wrong_since = min(last.wrong_since, arrival) if self._is_wrong(stamp, arrival) else math.inf

        stands_still = stamp == 0.0 or repeats >= MAX_REPEATS
        is_wrong_for_long = arrival - wrong_since > MAX_WRONG_TIME
        if self.uses_stamps and (stands_still or is_wrong_for_long):
            self.uses_stamps = False
            self._start_epoch()
        elif self._is_new_clock(stamp - last.stamp, arrival, silence, silence_of_robot):
            self._start_epoch()
            wrong_since = math.inf

        latest_time = self._latest_stamps[source].time    # minus infinity in a new epoch
        time = max(stamp, latest_time) if self.uses_stamps else arrival
        self._latest_stamps[source] = _Stamp(stamp, time, repeats, wrong_since)
        self._last_arrival = arrival
        self._least_delay.add(arrival, arrival - time)
        return time

    def to_sender_time(self, now: float) -> Optional[float]:
        """Returns `now` on the sender's clock; None before the first sample."""
        return None if self._least_delay.value is None else now - self._least_delay.value

    def to_receiver_time(self, time: float, arrival: float) -> float:
        """Returns the time [s, receiver's clock] at which the latest sample was measured. `time` is
        the result of :meth:`add_stamp`. The fastest message is assumed to need no time."""
        assert self._least_delay.value is not None
        return min(arrival, time + self._least_delay.value)

    def _is_wrong(self, stamp: float, arrival: float) -> bool:
        least = self._least_delay.value
        return least is not None and abs(arrival - stamp - least) >= MIN_CLOCK_STEP

    def _is_new_clock(self, interval: float, arrival: float, silence: float,
                      silence_of_robot: float) -> bool:
        """Returns True if a stamp is from a new clock. `interval` is the time [s] since the
        previous stamp of the source; NaN for the first stamp."""
        if self._least_delay.value is None:
            return False
        if silence_of_robot > LONG_SILENCE:
            return True
        if not self.uses_stamps:
            return arrival < self._last_arrival
        # delayed messages arrive together, but their stamps differ as usual
        return interval < -MAX_CORRECTION or interval > silence + MIN_CLOCK_STEP

    def _start_epoch(self) -> None:
        self.epoch += 1
        self._least_delay = WindowMinimum()
        self._latest_stamps: DefaultDict[str, _Stamp] = defaultdict(_Stamp)    # by source


class YawNoise:
    """Learns the noise of one IMU. The previous sample and the gyro's rate predict the yaw of a
    sample. In a slow and even turn, the prediction differs from the measured yaw only by noise."""

    def __init__(self) -> None:
        self.deviation = 0.0    # standard deviation [rad] of one sample's yaw
        self._count = 0

    def learn(self, timed: TimedSample) -> None:
        previous = timed.previous_sample
        interval = timed.interval
        if previous is None or interval == 0.0 or interval >= MAX_GYRO_GAP:
            return
        rate = timed.sample.yaw_rate
        is_slow = abs(rate) <= MAX_SLOW_TURN_RATE
        is_even = abs(rate - previous.yaw_rate) <= MAX_EVEN_RATE_CHANGE
        if not (is_slow and is_even):
            return

        turn = difference(timed.sample.yaw, previous.yaw)
        predicted_turn = 0.5 * (previous.yaw_rate + rate) * interval
        # the difference of two samples has twice the variance of one sample
        sample_variance = 0.5 * (turn - predicted_turn) ** 2
        self._count += 1
        weight = max(MIN_NOISE_WEIGHT, 1.0 / self._count)
        variance = self.deviation ** 2
        self.deviation = math.sqrt(variance + weight * (sample_variance - variance))
