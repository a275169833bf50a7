"""Does the gyro contradict the wheels, or the orientation of its own IMU?

If a board calibrates its gyro while the robot turns, it treats this rate of turn as zero. Then the
gyro shows the opposite turn while the robot rests. In motion it is wrong by the same rate. A
robot that is carried looks the same, since its wheels rest. So each rate of the gyro is compared
with the rates at which the wheels turned the robot a little earlier and later. The turn that delay,
slip and uneven wheels do not explain is added up.

Times are the samples' stamps, so delays of the network do not matter. Cases:

* Without stamps, or without samples of the wheels, no contradiction is found.
* supervision.stale_or_stalled finds wheels that turn although the robot stands, and a gyro that
  repeats one reading.
* After a silence the comparison begins again. A contradiction is over when gyro and wheels agreed
  for `AGREED`, with the wheels at rest.
* No motion begins before gyro and wheels were compared for `AGREED`, at rest. In a silence of more
  than timeouts.RESUME_TIME a board may have calibrated its gyro again. If the wheels cannot be
  compared within `AGREED`, the motion does not wait for them.
* In motion, an error of the gyro is not found if slip or uneven wheels may explain it: 5.5 % of
  the turn, and 7.5 deg/s at full speed.

Units: seconds, radians. Sources: the firmware's lag of 13 to 105 ms, and a recorded drive of a
Burger, in which at most 0.5 deg of its turns are unexplained.
"""
import math
from collections import deque
from typing import Deque, NamedTuple, Optional, Tuple

from tb3_labs.geometry.angles import clamp, difference
from tb3_labs.localization.sample_timing import TimedSample
from tb3_labs.robot.samples import WheelSample
from tb3_labs.robot.turtlebot3 import RobotModel
from tb3_labs.supervision.stale_or_stalled import SURELY_TURNS
from tb3_labs.supervision.timeouts import GYRO_GAP, MEAN_ONLY, RESUME_TIME, SMALL_STEP, WHEEL_GAP

#: A turn of the wheels may show in the gyro up to this much later [s].
LAG = 0.13
#: A turn of the wheels may show in the gyro up to this much earlier [s].
LEAD = 0.04
#: Wheels slip: a sound gyro differs from them by up to this share of the turn.
SLIP = 0.055
#: Uneven wheels: a turn by the faster wheel alone differs from a sound gyro by up to this share.
UNEVEN = 0.033
#: A sound gyro drifts by up to this [rad/s].
DRIFT = 0.02
#: A gyro that agreed with resting wheels is calibrated until the next silence, in which it may be
#: calibrated again. With a calibrated gyro, wheels may slip by this share, as on a carpet.
WORST_SLIP = 0.45
#: With a calibrated gyro, wheels may be uneven by this share, as when one is worn.
WORST_UNEVEN = 0.1
#: A calibrated gyro shows the slip of the wheels after steady turns of this total time [s].
SLIP_TIME = 0.1
#: A steady turn is faster than this [rad/s].
TURNING = 0.3
#: The rates of the wheels in a steady turn differ by less than this share.
STEADY_TURN = 0.1
#: The gyro contradicts the wheels when the unexplained turn is larger than this [rad].
UNEXPLAINED = 0.015
#: The contradiction is over when gyro and wheels agreed for this long, with the wheels at rest [s].
AGREED = 1.0
#: Wheels rest while the margin around their rates, see plausible(), is below this [rad/s].
RESTING_MARGIN = 1.2 * DRIFT
#: A robot that turns more slowly than this stands [rad/s].
STANDING_RATE = 0.03
#: Turns of the wheels are remembered for this long [s].
WHEEL_MEMORY = 0.6
#: The problem in words, and its remedy.
GYRO_LIES = ('the gyro contradicts the wheels (calibrated while the robot moved? carried? not a '
             '{}?): let it rest, then `rostopic pub -1 {} std_msgs/Empty`')

#: The orientation stands if it does not change while the gyro turns by this [rad].
GYRO_TURNED = 0.1
#: An orientation that stands changes by less than this, its noise [rad].
STANDING_NOISE = 0.02
#: Also, an orientation that stands changes by less than this share of the gyro's turn.
STANDING_SHARE = 0.25
#: The problem in words, and its remedy.
ORIENTATION_STANDS = ("the imu's orientation stands while its gyro turns: switch the robot off and "
                      'on, or start its driver anew')


class OrientationWatch:
    """Does the orientation of an IMU follow its gyro?

    Some boards and drivers send an orientation that stands (turtlebot3 #912), or is always zero.
    The contradiction is over when the orientation moves, or when the gyro rested for `AGREED`.
    """

    def __init__(self) -> None:
        self._begin: Optional[float] = None   # yaw at the begin of the comparison [rad]
        self._farthest = 0.0                  # largest change of the yaw since then [rad]
        self._turned = 0.0                    # turn by the gyro since then [rad]
        self._rested_for = 0.0                # time for which the gyro rested [s]
        #: Does the orientation stand?
        self.stands = False

    def on_imu(self, timed: TimedSample) -> None:
        (_, yaw, yaw_rate), last, seconds = timed.sample, timed.before, timed.step
        if last is None or self._begin is None:
            self._begin = yaw
            return
        rate = 0.5 * (last.yaw_rate + yaw_rate)
        self._rested_for += seconds
        if yaw == last.yaw and yaw_rate == last.yaw_rate:
            return    # a frozen IMU; stale_or_stalled finds it
        if abs(rate) < SURELY_TURNS:
            self._turned = 0.0
            self.stands = self.stands and self._rested_for < AGREED
        elif 0.0 < seconds <= GYRO_GAP:
            self._turned += rate * seconds
            self._rested_for = 0.0
        self._farthest = max(self._farthest, abs(difference(yaw, self._begin)))
        if self._farthest > max(STANDING_NOISE, STANDING_SHARE * abs(self._turned)):
            self._begin, self._farthest, self._turned = yaw, 0.0, 0.0
            self.stands = False
        elif abs(self._turned) > GYRO_TURNED:
            self.stands = True


class _WheelTurn(NamedTuple):
    """The turn of the wheels from one of their samples to the next."""

    begin: float
    end: float
    rate: float        # rate at which both wheels turned the robot [rad/s]
    one_wheel: float   # rate at which the faster wheel alone would turn it [rad/s]


class _GyroRate(NamedTuple):
    """A rate of the gyro [rad/s], measured at `begin` and assumed until `end`."""

    begin: float
    end: float
    rate: float
    is_repeated: bool


class _Comparison:
    """The comparison since the last silence, or since the robot's clock was set."""

    def __init__(self) -> None:
        self.wheels: Optional[WheelSample] = None    # the latest
        self.readings: Deque[_GyroRate] = deque()    # not compared yet
        self.turns: Deque[_WheelTurn] = deque()
        self.is_calibrated = False  # did the gyro agree with resting wheels?
        self.turned_for = 0.0       # time of its steady turns by a calibrated gyro [s]
        self.slip = 0.0             # mean slip in these turns
        self.unexplained = 0.0      # [rad]
        self.agreed_for = 0.0       # [s]

    def plausible(self, least: float, most: float, one_wheel: float) -> Tuple[float, float, float]:
        """Returns (least, most, margin) of the robot's rate of turn [rad/s], which may be beyond
        the first two by up to the margin. `least`, `most`, `one_wheel`: the least and the largest
        _WheelTurn.rate, and the largest _WheelTurn.one_wheel [rad/s].
        """
        margin = SLIP * max(-least, most) + DRIFT
        if not self.is_calibrated:
            return least, most, margin + UNEVEN * one_wheel
        slips = (self.slip,) if self.turned_for >= SLIP_TIME else (0.0, WORST_SLIP)
        return (min(least * (1.0 - slip) for slip in slips),
                max(most * (1.0 - slip) for slip in slips), margin + WORST_UNEVEN * one_wheel)

    def learn_slip(self, reading: _GyroRate, least: float, most: float) -> None:
        """Learn the slip: a calibrated gyro shows which share of a steady turn the wheels lose."""
        if (self.is_calibrated and self.turned_for < SLIP_TIME and least * most > TURNING ** 2
                and most - least < STEADY_TURN * abs(most)):
            seconds = reading.end - reading.begin
            self.turned_for += seconds
            slip = clamp(1.0 - 2.0 * reading.rate / (least + most), 0.0, WORST_SLIP)
            self.slip += seconds / self.turned_for * (slip - self.slip)


class GyroWatch:
    """Compares the gyro of one robot with its wheels."""

    def __init__(self, model: RobotModel, reset_topic: str = '/reset') -> None:
        self._model = model
        self._gyro_lies = GYRO_LIES.format(model.name, reset_topic)
        #: Has any reading been compared?
        self.has_compared = False
        self._sends_wheels = False
        self._rested_for = 0.0       # time of all comparisons at rest [s]
        self._alone_for = 0.0        # time of gyro samples since the last comparison [s]
        self._orientation = OrientationWatch()
        self._contradicts = False
        self._comparison = _Comparison()

    def on_imu(self, timed: TimedSample, sends_wheels: bool = False) -> None:
        """Take in a sample of the IMU. `sends_wheels`: does the robot send its wheels, too?"""
        self._sends_wheels = self._sends_wheels or sends_wheels
        if timed.silence > RESUME_TIME:
            self._rested_for = self._alone_for = 0.0
        elif self._alone_for < AGREED:
            self._alone_for += timed.silence
        self._orientation.on_imu(timed)
        sample, last = timed.sample, timed.before
        if timed.by_stamps < -SMALL_STEP:
            self._comparison = _Comparison()
        readings = self._comparison.readings
        if 0.0 < timed.by_stamps <= GYRO_GAP:
            readings.append(_GyroRate(last.stamp, sample.stamp, last.yaw_rate,
                                      sample[1:] == last[1:]))
        if readings and readings[0].end < sample.stamp - WHEEL_MEMORY:
            readings.popleft()    # no samples of the wheels arrive

    def on_wheels(self, sample: WheelSample) -> None:
        self._sends_wheels = True
        last, time = self._comparison.wheels, sample.stamp
        if last is not None and not -SMALL_STEP <= time - last.stamp <= WHEEL_GAP:
            self._comparison = _Comparison()
        elif last is not None and time > last.stamp:
            self._add_turn(last, sample)
        self._comparison.wheels, readings = sample, self._comparison.readings
        while readings and readings[0].end + LEAD <= time:
            self._compare(readings.popleft())

    def problem(self) -> str:
        """Returns the contradiction and its remedy, in words; '' if there is none."""
        if self._orientation.stands:
            return ORIENTATION_STANDS
        return self._gyro_lies if self._contradicts else ''

    @property
    def is_checked(self) -> bool:
        """Were gyro and wheels compared at rest, or is there nothing to compare?"""
        return not self._sends_wheels or max(self._rested_for, self._alone_for) >= AGREED

    def _add_turn(self, last: WheelSample, sample: WheelSample) -> None:
        begin, end = last.stamp, sample.stamp
        left, right = sample.left - last.left, sample.right - last.right
        per_track = self._model.wheel_radius / self._model.wheel_separation / (end - begin)
        turns = self._comparison.turns
        turns.append(_WheelTurn(begin, end, (right - left) * per_track,
                                max(abs(left), abs(right)) * per_track))
        while turns[0].end < end - WHEEL_MEMORY:
            turns.popleft()

    def _compare(self, reading: _GyroRate) -> None:
        comparison, first, last = self._comparison, reading.begin - LAG, reading.end + LEAD
        least, most, one_wheel, known_since = math.inf, -math.inf, 0.0, math.inf
        for begin, end, rate, fastest in comparison.turns:
            if end > first and begin < last:
                if fastest and end - begin > MEAN_ONLY:
                    return
                known_since = min(known_since, begin)
                least, most, one_wheel = min(least, rate), max(most, rate), max(one_wheel, fastest)
        if known_since > first:
            return
        self.has_compared = True
        comparison.learn_slip(reading, least, most)
        least, most, margin = comparison.plausible(least, most, one_wheel)
        nearest = clamp(reading.rate, least - margin, most + margin)
        stands = abs(reading.rate) < min(STANDING_RATE, abs(nearest))
        excess = 0.0 if stands else reading.rate - nearest
        seconds, rests = reading.end - reading.begin, margin < RESTING_MARGIN
        self._rested_for += seconds if rests else 0.0
        if self._alone_for < AGREED:
            self._alone_for = 0.0
        if excess and not reading.is_repeated:
            comparison.agreed_for = 0.0
            comparison.unexplained += excess * seconds
            self._contradicts = self._contradicts or abs(comparison.unexplained) > UNEXPLAINED
        elif not excess and (rests or not self._contradicts):    # at rest a contradiction ends
            comparison.agreed_for += seconds
            if comparison.agreed_for >= AGREED:
                comparison.unexplained, self._contradicts = 0.0, False
                comparison.is_calibrated = comparison.is_calibrated or rests
