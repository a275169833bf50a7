"""Does the gyro contradict the wheels, or the orientation of its own IMU?

If a board calibrates its gyro while the robot turns, the board takes this rate of turn for zero.
From then on the gyro is wrong by this rate, even at rest. Each rate of the gyro is compared with
the rates of the wheels, from a little earlier to a little later. Delay, slip and uneven wheels
explain a part of the difference; the rest is added up. A carried robot contradicts its wheels, too.

Times are the samples' stamps, so delays of the network do not matter. Cases:

* Without stamps, or without samples of the wheels, a contradiction is not found.
* After a silence the comparison starts again. A contradiction is over when gyro and resting wheels
  have agreed for `AGREEMENT_TIME`.
* A motion waits until gyro and wheels were compared at rest for `AGREEMENT_TIME`. The motion waits
  again after a silence of more than timeouts.RESUME_TIME, since the board may have calibrated its
  gyro. If the samples of the wheels cannot be compared, the motion waits only for `AGREEMENT_TIME`.
* In motion, an error of the gyro is not found if slip (5.5 % of the turn) or uneven wheels
  (7.5 deg/s at full speed) may explain the error.

Units: seconds, radians. Sources: the firmware's lag of 13 to 105 ms; a recorded drive of a Burger,
in which at most 0.5 deg of the turns are unexplained.
"""
from collections import deque
from typing import Deque, List, NamedTuple, Optional, Tuple

from tb3_labs.geometry.angles import clamp, difference
from tb3_labs.localization.sample_timing import SMALL_STEP, TimedSample
from tb3_labs.robot.samples import REST_ANGULAR, WheelSample
from tb3_labs.robot.turtlebot3 import RobotModel
from tb3_labs.supervision.sensors_and_stalls import SURE_TURN_RATE
from tb3_labs.supervision.timeouts import (
    GYRO_GAP, INTERPOLATED_GAP, MEAN_ONLY_GAP, RESUME_TIME)

#: The gyro may show a turn later than the wheels, by at most this time [s].
MAX_GYRO_LAG = 0.13
#: The gyro may show a turn earlier than the wheels, by at most this time [s].
MAX_GYRO_LEAD = 0.04
#: A healthy gyro differs from slipping wheels by up to this share of the turn.
SLIP_SHARE = 0.055
#: A healthy gyro differs from uneven wheels by up to this share of _WheelTurn.rate_of_one_wheel.
UNEVEN_SHARE = 0.033
#: A healthy gyro drifts by up to this [rad/s].
GYRO_DRIFT = 0.02
#: After the gyro agreed with resting wheels, a slip up to this share is possible, as on a carpet.
MAX_SLIP_SHARE = 0.45
#: After the gyro agreed with resting wheels, worn wheels may be uneven by up to this share.
MAX_UNEVEN_SHARE = 0.1
#: The slip of the wheels is known after steady turns for this time in total [s].
SLIP_TIME = 0.1
#: A steady turn is faster than this [rad/s].
STEADY_TURN_RATE = 0.3
#: The rates of the wheels in a steady turn differ by less than this share.
STEADY_TURN_SPREAD = 0.1
#: The gyro contradicts the wheels when the unexplained turn is larger than this [rad].
MAX_UNEXPLAINED_TURN = 0.015
#: A contradiction is over when gyro and wheels agreed for this long, with the wheels at rest [s].
AGREEMENT_TIME = 1.0
#: If the margin of _Comparison.plausible_rates() is below this rate, the wheels rest [rad/s].
RESTING_MARGIN = 1.2 * GYRO_DRIFT
#: Turns of the wheels are remembered for this long [s].
WHEEL_MEMORY = 0.6
#: The problem in words, and its remedy.
GYRO_LIES = ('the gyro contradicts the wheels (calibrated while the robot moved? carried? not a '
             '{}?): let it rest, then `rostopic pub -1 {} std_msgs/Empty`')

#: The orientation is stuck if it stays the same while the gyro shows a turn of this size [rad].
GYRO_TURNED = 0.1
#: The noise of a stuck orientation is smaller than this [rad].
STUCK_NOISE = 0.02
#: A stuck orientation changes by less than this share of the gyro's turn.
STUCK_SHARE = 0.25
#: The problem in words, and its remedy.
STUCK_ORIENTATION = ("the imu's orientation stands while its gyro turns: switch the robot off and "
                     'on, or start its driver anew')


class OrientationMonitor:
    """Does the orientation of an IMU follow its gyro? Some boards and drivers send an orientation
    that never changes (turtlebot3 #912). The contradiction is over when the orientation moves, or
    the gyro rested for `AGREEMENT_TIME`."""

    def __init__(self) -> None:
        self._first_yaw: Optional[float] = None   # yaw at the start of the comparison [rad]
        self._farthest = 0.0                  # largest change of the yaw since then [rad]
        self._turned = 0.0                    # turn by the gyro since then [rad]
        self._rested_for = 0.0                # time for which the gyro rested [s]
        self.is_stuck = False                 # does the orientation contradict the gyro?

    def on_imu(self, timed: TimedSample) -> None:
        sample, last = timed.sample, timed.before
        yaw, seconds = sample.yaw, timed.step
        if last is None or self._first_yaw is None:
            self._first_yaw = yaw
            return
        rate = 0.5 * (last.yaw_rate + sample.yaw_rate)
        self._rested_for += seconds
        if yaw == last.yaw and sample.yaw_rate == last.yaw_rate:
            return    # sensors_and_stalls finds a frozen IMU
        if abs(rate) < SURE_TURN_RATE:
            self._turned = 0.0
            if self._rested_for >= AGREEMENT_TIME:
                self.is_stuck = False
        elif 0.0 < seconds <= GYRO_GAP:
            self._turned += rate * seconds
            self._rested_for = 0.0
        self._farthest = max(self._farthest, abs(difference(yaw, self._first_yaw)))
        if self._farthest > max(STUCK_NOISE, STUCK_SHARE * abs(self._turned)):
            self._first_yaw = yaw
            self._farthest = self._turned = 0.0
            self.is_stuck = False
        elif abs(self._turned) > GYRO_TURNED:
            self.is_stuck = True


class _WheelTurn(NamedTuple):
    """The turn of the robot by its wheels between two samples of the wheels."""

    begin: float
    end: float
    rate: float                 # rate at which both wheels turned the robot [rad/s]
    rate_of_one_wheel: float    # rate at which the faster wheel alone would turn the robot [rad/s]


class _GyroRate(NamedTuple):
    """A rate of the gyro [rad/s], measured at `begin` and assumed until `end`."""

    begin: float
    end: float
    rate: float
    is_repeated: bool


class _Comparison:
    """The comparison of gyro and wheels since the last silence, or since a change of the clock."""

    def __init__(self) -> None:
        self.wheels: Optional[WheelSample] = None    # the latest sample
        self.readings: Deque[_GyroRate] = deque()    # rates of the gyro that are not compared yet
        self.turns: Deque[_WheelTurn] = deque()
        self.is_calibrated = False  # did the gyro agree with resting wheels?
        self.turned_for = 0.0       # time of steady turns with a calibrated gyro [s]
        self.slip = 0.0             # mean slip in the steady turns
        self.unexplained = 0.0      # sum of the turns that the wheels do not explain [rad]
        self.agreed_for = 0.0       # time for which gyro and wheels agreed [s]

    def turns_around(self, reading: _GyroRate) -> Optional[List[_WheelTurn]]:
        """Returns the turns of the wheels that `reading` may show; None if not all are known."""
        first, last = reading.begin - MAX_GYRO_LAG, reading.end + MAX_GYRO_LEAD
        turns = [turn for turn in self.turns if turn.end > first and turn.begin < last]
        if not turns or turns[0].begin > first:    # `turns` is in order of time
            return None
        for turn in turns:
            if turn.rate_of_one_wheel and turn.end - turn.begin > MEAN_ONLY_GAP:
                return None
        return turns

    def plausible_rates(self, least: float, most: float,
                        one_wheel: float) -> Tuple[float, float, float]:
        """Returns (lowest, highest, margin) [rad/s]. The rate of a healthy gyro is between `lowest`
        - `margin` and `highest` + `margin`. The arguments are the least and the largest
        _WheelTurn.rate, and the largest _WheelTurn.rate_of_one_wheel."""
        margin = SLIP_SHARE * max(-least, most) + GYRO_DRIFT
        if not self.is_calibrated:
            return least, most, margin + UNEVEN_SHARE * one_wheel
        slips = (self.slip,) if self.turned_for >= SLIP_TIME else (0.0, MAX_SLIP_SHARE)
        lowest = min(least * (1.0 - slip) for slip in slips)
        highest = max(most * (1.0 - slip) for slip in slips)
        return lowest, highest, margin + MAX_UNEVEN_SHARE * one_wheel

    def learn_slip(self, reading: _GyroRate, least: float, most: float) -> None:
        """If the gyro is calibrated, learn which share of a steady turn is slip of the wheels."""
        needs_turn = self.is_calibrated and self.turned_for < SLIP_TIME
        is_fast = least * most > STEADY_TURN_RATE ** 2
        is_steady = most - least < STEADY_TURN_SPREAD * abs(most)
        if needs_turn and is_fast and is_steady:
            seconds = reading.end - reading.begin
            self.turned_for += seconds
            slip = clamp(1.0 - 2.0 * reading.rate / (least + most), 0.0, MAX_SLIP_SHARE)
            self.slip += seconds / self.turned_for * (slip - self.slip)


class GyroMonitor:
    """Compares the gyro of one robot with its wheels."""

    def __init__(self, model: RobotModel, reset_topic: str = '/reset') -> None:
        self._model = model
        self._gyro_lies = GYRO_LIES.format(model.name, reset_topic)
        self.has_compared = False    # was any rate of the gyro compared with the wheels?
        self._sends_wheels = False
        self._rested_for = 0.0       # time of all comparisons at rest [s]
        self._uncompared_for = 0.0   # time of gyro samples since the last comparison [s]
        self._orientation = OrientationMonitor()
        self._contradicts = False
        self._comparison = _Comparison()

    def on_imu(self, timed: TimedSample, sends_wheels: bool = False) -> None:
        """Take in a sample of the IMU. `sends_wheels`: does the robot send joint states?"""
        if sends_wheels:
            self._sends_wheels = True
        if timed.silence > RESUME_TIME:
            self._rested_for = self._uncompared_for = 0.0
        elif self._uncompared_for < AGREEMENT_TIME:
            self._uncompared_for += timed.silence
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
        last = self._comparison.wheels
        step = 0.0 if last is None else sample.stamp - last.stamp
        if step < -SMALL_STEP or step > INTERPOLATED_GAP:
            self._comparison = _Comparison()
        elif last is not None and step > 0.0:
            self._add_turn(last, sample)
        self._comparison.wheels = sample
        readings = self._comparison.readings
        while readings and readings[0].end + MAX_GYRO_LEAD <= sample.stamp:
            self._compare_with_wheels(readings.popleft())

    def problem_text(self) -> str:
        """Returns a text about the contradiction and its remedy, or ''."""
        if self._orientation.is_stuck:
            return STUCK_ORIENTATION
        return self._gyro_lies if self._contradicts else ''

    @property
    def is_checked(self) -> bool:
        """Were gyro and wheels compared at rest, or does the robot not send its wheels?"""
        waited_for = max(self._rested_for, self._uncompared_for)
        return not self._sends_wheels or waited_for >= AGREEMENT_TIME

    def _add_turn(self, last: WheelSample, sample: WheelSample) -> None:
        begin, end = last.stamp, sample.stamp
        left, right = sample.left - last.left, sample.right - last.right
        per_track = self._model.wheel_radius / self._model.wheel_separation / (end - begin)
        turns = self._comparison.turns
        turns.append(_WheelTurn(begin, end, rate=(right - left) * per_track,
                                rate_of_one_wheel=max(abs(left), abs(right)) * per_track))
        while turns[0].end < end - WHEEL_MEMORY:
            turns.popleft()

    def _compare_with_wheels(self, reading: _GyroRate) -> None:
        comparison = self._comparison
        turns = comparison.turns_around(reading)
        if turns is None:
            return
        self.has_compared = True
        least, most = min(turn.rate for turn in turns), max(turn.rate for turn in turns)
        comparison.learn_slip(reading, least, most)
        lowest, highest, margin = comparison.plausible_rates(
            least, most, max(turn.rate_of_one_wheel for turn in turns))
        nearest = clamp(reading.rate, lowest - margin, highest + margin)
        shows_rest = abs(reading.rate) < min(REST_ANGULAR, abs(nearest))
        seconds = reading.end - reading.begin
        rests = margin < RESTING_MARGIN
        if rests:
            self._rested_for += seconds
        if self._uncompared_for < AGREEMENT_TIME:
            self._uncompared_for = 0.0
        if shows_rest or reading.rate == nearest:
            self._agree(seconds, rests)
        elif not reading.is_repeated:
            self._disagree((reading.rate - nearest) * seconds)

    def _disagree(self, unexplained: float) -> None:
        """Add up a turn [rad] of the gyro that the wheels do not explain."""
        comparison = self._comparison
        comparison.agreed_for = 0.0
        comparison.unexplained += unexplained
        if abs(comparison.unexplained) > MAX_UNEXPLAINED_TURN:
            self._contradicts = True

    def _agree(self, seconds: float, rests: bool) -> None:
        """Add up the time of agreement. A contradiction ends only while the wheels rest."""
        comparison = self._comparison
        if self._contradicts and not rests:
            return
        comparison.agreed_for += seconds
        if comparison.agreed_for >= AGREEMENT_TIME:
            comparison.unexplained, self._contradicts = 0.0, False
            if rests:
                comparison.is_calibrated = True
