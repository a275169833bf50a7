"""Does the gyro contradict the wheels?

A board may calibrate its gyro while the robot turns. Then the gyro takes the rate of this turn for
zero, and shows a wrong rate even at rest. Each rate of the gyro is compared with the rates that the
wheels had a little earlier, at the same time, and a little later. Delay, slip and uneven wheels
explain a part of the difference between gyro and wheels. The rest of each difference is added up.
If this sum is large, as when a person carries the robot, the gyro contradicts the wheels.

Only stamps are compared, so delays of the network do not matter. Cases:

1. Without stamps, or without samples of the wheels, no contradiction is found.
2. A motion waits until gyro and wheels were compared at rest for `AGREEMENT_TIME`. A motion waits
   again after a silence of more than timeouts.RESUME_TIME, because the board may have calibrated
   its gyro. If the wheels' samples cannot be compared, a motion waits only for `AGREEMENT_TIME`.
3. If a wrong gyro shows a slower turn than the wheels, the error looks like slip. This error is
   found only when the wheels rest. The gyro of a real robot does not become wrong during a motion,
   because the board is silent for 2.6 s during a calibration.

Units: seconds, radians. Sources: In the firmware, the gyro is late by 13 to 105 ms. In a recorded
drive of a Burger, the wheels leave at most 0.5 deg of the gyro's turns unexplained.
"""
from collections import deque
from typing import Deque, List, NamedTuple, Optional, Tuple

from tb3_labs.geometry.angles import clamp
from tb3_labs.localization.sample_timing import MAX_CORRECTION, TimedSample
from tb3_labs.robot.samples import MAX_REST_TURN_RATE, WheelSample
from tb3_labs.robot.turtlebot3 import RobotModel
from tb3_labs.supervision.timeouts import (
    MAX_GYRO_GAP, MAX_INTERPOLATED_GAP, MAX_WHEEL_GAP, RESUME_TIME)

MAX_GYRO_DELAY = 0.13           # [s]; the gyro may show a turn this much later than the wheels
MAX_GYRO_LEAD = 0.04            # [s]; the gyro may show a turn this much earlier than the wheels
MAX_SLIP_SHARE = 0.45           # slip may hide this share of the wheels' turn, as on a carpet
MAX_UNEVEN_SHARE = 0.1          # uneven wheels explain this share of _WheelTurn.rate_of_one_wheel
MAX_GYRO_DRIFT = 0.02           # [rad/s]; a healthy gyro is wrong by at most this rate
MAX_UNEXPLAINED_TURN = 0.015    # [rad]; after a larger turn, the gyro contradicts the wheels
#: A contradiction is over when the wheels have rested, and the gyro has agreed, for this time [s].
AGREEMENT_TIME = 1.0
WHEEL_MEMORY_TIME = 0.6    # [s]; older samples are forgotten
#: The text for the user. The braces stand for the robot's model and its reset topic.
GYRO_CONTRADICTION = (
    'the gyro contradicts the wheels (calibrated while the robot moved? carried? not a {}?): let '
    'it rest, then `rostopic pub -1 {} std_msgs/Empty`')


class _WheelTurn(NamedTuple):    # the robot's turn between two samples of the wheels
    begin: float
    end: float
    rate: float                 # [rad/s]
    rate_of_one_wheel: float    # rate [rad/s] at which the faster wheel alone would turn the robot


class _GyroRate(NamedTuple):    # a rate that was measured at `begin`, and is assumed until `end`
    begin: float
    end: float
    rate: float          # [rad/s]
    is_repeated: bool    # the next sample is the same, so the driver may hang


class _Comparison:
    """The comparison of gyro and wheels since the latest silence or change of the clock."""

    def __init__(self) -> None:
        self.wheels: Optional[WheelSample] = None    # the latest sample
        self.gyro_rates: Deque[_GyroRate] = deque()  # the rates that were not compared yet
        self.turns: Deque[_WheelTurn] = deque()
        self.unexplained_turn = 0.0    # sum [rad] of the turns that the wheels do not explain
        self.agreed_for = 0.0          # time [s] for which gyro and wheels agreed

    def wheel_turns_near(self, gyro_rate: _GyroRate) -> Optional[List[_WheelTurn]]:
        """Returns the turns of the wheels that `gyro_rate` may show; None if a turn is unknown."""
        begin = gyro_rate.begin - MAX_GYRO_DELAY
        end = gyro_rate.end + MAX_GYRO_LEAD
        turns = [turn for turn in self.turns if turn.end > begin and turn.begin < end]
        if not turns or turns[0].begin > begin:    # the earliest turn was not measured
            return None
        for turn in turns:
            if turn.rate_of_one_wheel and turn.end - turn.begin > MAX_WHEEL_GAP:
                return None
        return turns


def _plausible_rates(turns: List[_WheelTurn]) -> Tuple[float, float]:
    """Returns the lowest and the highest rate [rad/s] of a healthy gyro during `turns`."""
    rates = [turn.rate for turn in turns]
    rates_with_slip = [(1.0 - MAX_SLIP_SHARE) * rate for rate in rates]
    margin = MAX_GYRO_DRIFT + MAX_UNEVEN_SHARE * max(turn.rate_of_one_wheel for turn in turns)
    return min(rates + rates_with_slip) - margin, max(rates + rates_with_slip) + margin


def _unexplained_rate(rate: float, turns: List[_WheelTurn]) -> float:
    """Returns the part [rad/s] of the gyro's `rate` that the `turns` of the wheels do not explain.
    Slip explains a gyro that shows rest while the wheels turn."""
    lowest_rate, highest_rate = _plausible_rates(turns)
    nearest_rate = clamp(rate, lowest_rate, highest_rate)
    is_slower = abs(rate) < abs(nearest_rate)
    if is_slower and abs(rate) < MAX_REST_TURN_RATE:
        return 0.0
    return rate - nearest_rate


class GyroMonitor:
    def __init__(self, model: RobotModel, reset_topic: str = '/reset') -> None:
        self._model = model
        self._contradiction_text = GYRO_CONTRADICTION.format(model.name, reset_topic)
        self.has_compared = False    # a rate of the gyro was compared with the wheels
        self._sends_wheels = False   # the robot sends `joint_states`
        self._rested_for = 0.0       # total time [s] of the comparisons at rest
        self._uncompared_for = 0.0   # time [s] for which the gyro was not compared
        self._has_contradiction = False
        self._comparison = _Comparison()

    def on_imu(self, timed: TimedSample, sends_wheels: bool = False) -> None:
        """Use a sample of the IMU. `sends_wheels` is True if the robot sends `joint_states`."""
        if sends_wheels:
            self._sends_wheels = True
        if timed.silence > RESUME_TIME:
            self._rested_for = 0.0
            self._uncompared_for = 0.0
        elif self._uncompared_for < AGREEMENT_TIME:
            self._uncompared_for += timed.silence

        if timed.stamp_interval < -MAX_CORRECTION:
            self._comparison = _Comparison()
        sample = timed.sample
        previous = timed.previous_sample
        rates = self._comparison.gyro_rates
        if 0.0 < timed.stamp_interval <= MAX_GYRO_GAP:
            is_repeated = (sample.yaw, sample.yaw_rate) == (previous.yaw, previous.yaw_rate)
            rates.append(_GyroRate(previous.stamp, sample.stamp, previous.yaw_rate, is_repeated))
        if rates and rates[0].end < sample.stamp - WHEEL_MEMORY_TIME:
            rates.popleft()    # no samples of the wheels arrive, so no rate is compared

    def on_wheels(self, sample: WheelSample) -> None:
        self._sends_wheels = True
        previous = self._comparison.wheels
        interval = sample.stamp - previous.stamp if previous else 0.0
        if interval < -MAX_CORRECTION or interval > MAX_INTERPOLATED_GAP:
            self._comparison = _Comparison()
        elif previous is not None and interval > 0.0:
            self._add_turn(previous, sample)
        self._comparison.wheels = sample
        rates = self._comparison.gyro_rates
        while rates and rates[0].end + MAX_GYRO_LEAD <= sample.stamp:
            self._compare_with_wheels(rates.popleft())

    def problem_text(self) -> str:
        """Returns a text about the contradiction and its remedy, or ''."""
        return self._contradiction_text if self._has_contradiction else ''

    @property
    def needs_comparison(self) -> bool:
        """Returns True if a motion must wait until gyro and wheels were compared at rest."""
        waited_for = max(self._rested_for, self._uncompared_for)
        return self._sends_wheels and waited_for < AGREEMENT_TIME

    def _add_turn(self, previous: WheelSample, sample: WheelSample) -> None:
        left = sample.left - previous.left
        right = sample.right - previous.right
        seconds = sample.stamp - previous.stamp
        # rate of the robot for each radian by which one wheel turns farther than the other
        rate_per_radian = self._model.wheel_radius / self._model.wheel_separation / seconds
        turns = self._comparison.turns
        turns.append(_WheelTurn(
            previous.stamp, sample.stamp, rate=(right - left) * rate_per_radian,
            rate_of_one_wheel=max(abs(left), abs(right)) * rate_per_radian))
        while turns[0].end < sample.stamp - WHEEL_MEMORY_TIME:
            turns.popleft()

    def _compare_with_wheels(self, gyro_rate: _GyroRate) -> None:
        turns = self._comparison.wheel_turns_near(gyro_rate)
        if turns is None:
            return
        self.has_compared = True
        if self._uncompared_for < AGREEMENT_TIME:    # a wait that has ended stays ended
            self._uncompared_for = 0.0
        seconds = gyro_rate.end - gyro_rate.begin
        wheels_are_at_rest = max(turn.rate_of_one_wheel for turn in turns) < MAX_REST_TURN_RATE
        if wheels_are_at_rest:
            self._rested_for += seconds

        unexplained_rate = _unexplained_rate(gyro_rate.rate, turns)
        if not unexplained_rate:
            self._add_agreement(seconds, wheels_are_at_rest)
        elif not gyro_rate.is_repeated:
            self._add_unexplained_turn(unexplained_rate * seconds)

    def _add_unexplained_turn(self, turn: float) -> None:
        comparison = self._comparison
        comparison.agreed_for = 0.0
        comparison.unexplained_turn += turn
        if abs(comparison.unexplained_turn) > MAX_UNEXPLAINED_TURN:
            self._has_contradiction = True

    def _add_agreement(self, seconds: float, wheels_are_at_rest: bool) -> None:
        if self._has_contradiction and not wheels_are_at_rest:    # it ends only at rest
            return
        comparison = self._comparison
        comparison.agreed_for += seconds
        if comparison.agreed_for >= AGREEMENT_TIME:
            comparison.unexplained_turn = 0.0
            self._has_contradiction = False
