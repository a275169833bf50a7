"""An approach moves the robot to a goal and stops it there in spite of delays.

A controller that looks only at the measured position brakes too late, and overshoots. An approach
is a Smith predictor, which controls the *predicted remaining travel*: the distance to the goal at
which a robot that is told to stop now would come to rest. The formula is

    remaining - (speed of the motors) * lag - gain * (travel of the commands under way)

After the command 0, a motor with the speed v still travels v * lag, which is the integral of
v exp(-t/lag). Each sample gives one prediction, with the delay, lag and gain from `motor_response`.
A `FilteredNumber` filters the noise of the predictions. Between two samples, only the commands
change the predicted remaining travel. A braking profile gives the speed for this travel. After the
first stop, *nudges*, which are short commands, correct the remaining error.

Units: radians or metres for travel, radians or metres per second for speeds, seconds for times.
Source: Smith, Closer control of loops with dead time, Chemical Engineering Progress 53 (1957).
"""
import math
from dataclasses import dataclass

from tb3_labs.control.commands import CommandHistory
from tb3_labs.control.motor_response import TIME_DEVIATION, Identification, MotorResponse
from tb3_labs.geometry.angles import clamp

MAX_ROUNDING_TIME = 1e-6    # [s]; after rounding, two equal times differ by less than this
#: This is added to the divisor of the gain for a nudge, because a nudge may last two periods.
NUDGE_GAIN_DIVISOR = 0.5
#: In 95 of 100 cases the error of an estimate is less than this number of standard deviations.
CONFIDENCE_FACTOR = 2.0
#: A sample contradicts an estimate if they differ by more than this number of standard deviations.
CONTRADICTING_DEVIATIONS = 4.0
MIN_LAG = 1e-6    # [s]; a lag of 0 would cause a division by zero


@dataclass(frozen=True)
class ApproachConfig:
    """Settings of an approach. The unit of travel is rad for a turn, and m for a drive."""

    period: float          # time [s] for which the robot obeys each command
    acceleration: float    # greatest acceleration [1/s^2] of the command
    #: Deceleration [1/s^2] of the braking profile. It is less than the acceleration, so that the
    #: robot can follow the profile in spite of disturbances.
    deceleration: float
    gain: float         # [1/s]; near the goal, the speed is the gain times the remaining travel
    min_speed: float    # lowest speed of a motion; a slower robot would take too long
    #: The command is 0 if the predicted remaining travel is less than this. Without a dead band,
    #: the robot would move to and fro about the goal at the lowest speed.
    dead_band: float
    nudge_dead_band: float = 0.0    # least `dead_band` after the first stop
    max_overshoot: float = 0.0      # a robot that would stop farther beyond the goal backs up
    nudge_time: float = 0.0         # a stop may end a nudge only after this time [s]
    #: True if the sensor measures the speed at one instant, as a gyro does. The odometry sends the
    #: mean speed of a control period, which is too high while the robot brakes.
    measures_instant_speed: bool = False


def braking_speed(distance: float, deceleration: float, gain: float) -> float:
    """Returns the fastest speed from which a robot can stop within `distance`, which is at least 0.

    Far from the goal, the speed follows the braking profile v = sqrt(2 a d), with the distance d
    and the `deceleration` a [1/s^2]. A motor cannot follow the infinite slope of this profile at
    d = 0. Therefore the speed near the goal is the distance times the `gain` [1/s]. At the distance
    `meeting_distance`, both formulas give the same speed and the same slope.
    """
    meeting_distance = deceleration / gain ** 2
    if distance <= meeting_distance:
        return gain * distance
    return math.sqrt(deceleration * (2.0 * distance - meeting_distance))


def first_order_response(speed: float, command: float, lag: float, dt: float) -> float:
    """Returns the speed that a motor with `speed` has after `dt` [s] of a constant `command`."""
    share = -math.expm1(-dt / max(lag, MIN_LAG))
    return speed + share * (command - speed)


class FilteredNumber:
    """A Kalman filter of one number. The estimate of a constant number is the mean of all samples.
    After a change of the number, new samples have more weight."""

    def __init__(self) -> None:
        self.value = 0.0    # the estimate; 0 before the first sample
        self._variance = math.inf

    @property
    def uncertainty(self) -> float:
        """The likely bound of the error: `CONFIDENCE_FACTOR` standard deviations."""
        return CONFIDENCE_FACTOR * math.sqrt(self._variance)

    def shift(self, change: float, deviation: float = 0.0) -> None:
        """Add `change`, which has the standard deviation `deviation`, to the number."""
        self.value += change
        self._variance += deviation * deviation    # deviation ** 2 could raise OverflowError

    def add(self, sample: float, noise: float) -> None:
        """Improve the estimate by a sample with the standard deviation `noise`. A sample replaces
        the estimate if the sample has no noise, is the first, or contradicts the estimate."""
        noise_variance = noise * noise
        max_difference = CONTRADICTING_DEVIATIONS * math.sqrt(self._variance + noise_variance)
        agrees = abs(sample - self.value) <= max_difference
        both_have_noise = noise_variance > 0.0 and math.isfinite(self._variance)
        if agrees and both_have_noise:
            weight = self._variance / (self._variance + noise_variance)
            self.value += weight * (sample - self.value)
            self._variance = weight * noise_variance
        else:
            self.value = sample
            self._variance = noise_variance


class Approach:
    """Turns or drives the robot until `remaining` is zero and the robot rests."""

    def __init__(self, config: ApproachConfig, response: MotorResponse) -> None:
        self._config = config
        self._response = response
        self.start()

    def start(self) -> None:
        """Start a new approach of a robot at rest."""
        self._now = 0.0                  # time [s] since the start
        self._measured_at = -math.inf    # time [s] of the latest sample
        self.predicted_remaining = FilteredNumber()    # [m or rad]
        self._motion_command = 0.0        # latest command to move; 0 before the first motion
        self._reversals = 0          # many reversals show that the robot differs from its model
        self._has_stopped = False    # True after a stop that followed a motion
        self._identification = Identification(self._response, self._config.measures_instant_speed)
        self._start_history(math.nan, 0.0)    # the first step replaces these values

    def move_goal(self, change: float) -> None:
        """Add `change`, which may be negative, to the remaining travel."""
        self._start_remaining += change
        self.predicted_remaining.shift(change)

    def obeyed_only_stops(self, age: float) -> bool:
        """Returns True if the robot obeyed only commands to stop in the last `age` [s]."""
        history = self._history
        return history.sent_only_stops_since(
            history.now - age - self._identification.estimate.delay - 2.0 * self._config.period)

    def step(self, remaining: float, speed: float, max_speed: float, dt: float,
             noise: float = 0.0, age: float = 0.0) -> float:
        """Returns the speed to command, at most `max_speed`.

        `remaining` and `speed` were measured `age` [s] ago. `noise` is the standard deviation of
        `remaining`. The previous step was `dt` [s] ago.
        """
        self._now += dt
        if self._motion_command:
            self._advance(speed, dt)
        else:    # no motion was commanded yet
            dt = self._config.period
            self._start_history(remaining, speed)

        self._identification.update(
            self._history, self._start_remaining - remaining, speed, max_speed, age)
        self._motor_speed = self._next_motor_speed(speed, dt)
        measured_at = self._now - age
        if measured_at > self._measured_at + MAX_ROUNDING_TIME:    # the sample is new
            self._measured_at = measured_at
            self.predicted_remaining.add(self._prediction(remaining, age), noise)

        latest_command = self._history.command
        wanted_command = self._wanted_command(latest_command, max_speed)
        change = self._config.acceleration * dt
        self._history.send(clamp(wanted_command, latest_command - change, latest_command + change))
        return self._history.command

    def _wanted_command(self, latest_command: float, max_speed: float) -> float:
        """Returns the command that is best, if the acceleration allows it."""
        if self._motion_command and not latest_command:
            self._has_stopped = True
        command = self._profile_speed(max_speed)
        if command:
            if command * self._motion_command < 0.0:
                self._reversals += 1
            self._motion_command = command
        elif self._has_stopped and self._history.unchanged_for < self._config.nudge_time:
            return latest_command    # the nudge must last longer
        return command

    def _start_history(self, remaining: float, speed: float) -> None:
        self._history = CommandHistory(self._config.period)
        self._identification.start(speed)
        self._start_remaining = remaining
        self._motor_speed = speed

    def _advance(self, speed: float, dt: float) -> None:
        history = self._history
        travel_before = history.commanded_travel(history.period_start)
        history.advance(dt)
        travel = history.commanded_travel(history.period_start) - travel_before
        max_error = TIME_DEVIATION * max(abs(speed), abs(history.command))
        self.predicted_remaining.shift(-self._identification.estimate.gain * travel, max_error)

    def _next_motor_speed(self, speed: float, dt: float) -> float:
        if self._config.measures_instant_speed:
            return speed
        estimate = self._identification.estimate
        return first_order_response(
            self._motor_speed, self._history.command_at_motors(estimate.delay), estimate.lag, dt)

    def _prediction(self, remaining: float, age: float) -> float:
        """Returns the travel that would remain to the goal if the robot were told to stop now."""
        estimate = self._identification.estimate
        under_way = self._history.travel_under_way(estimate.delay + age)
        return remaining - self._motor_speed * estimate.lag - estimate.gain * under_way

    def _profile_speed(self, max_speed: float) -> float:
        config = self._config
        distance = self.predicted_remaining.value
        dead_band = config.dead_band
        gain_divisor = 1.0 + self._reversals
        if self._has_stopped:
            dead_band = max(dead_band, config.nudge_dead_band)
            gain_divisor += NUDGE_GAIN_DIVISOR
        margin = self.predicted_remaining.uncertainty + dead_band
        is_before_goal = distance > margin
        is_beyond_goal = distance < -max(margin, config.max_overshoot)
        must_move = is_before_goal or is_beyond_goal
        if not must_move:
            return 0.0
        speed = braking_speed(abs(distance), config.deceleration, config.gain / gain_divisor)
        speed = clamp(speed, min(config.min_speed, max_speed), max_speed)
        return math.copysign(speed, distance)
