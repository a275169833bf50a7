"""An approach drives until the remaining way is zero, and stops there in spite of delays.

If a controller looks only at the measured position, it brakes too late, and overshoots. An approach
is a Smith predictor: it looks at the *way after a stop*. If the robot were commanded to stop now,
this way would remain:

    remaining - (speed of the motors) * lag - gain * (travel of the commands under way)

The middle term is the way that a first-order motor coasts, since the integral of v exp(-t / lag) is
v lag. Each sample predicts the way after a stop from the delay, lag and gain that `motor_response`
identifies. An `Estimate` filters the noise of the predictions. Between two samples, only the
command changes the way after a stop. A braking profile gives the speed for this way. After the
first stop, *nudges* correct the last error. A nudge is a short command.

Units: radians or metres for ways, per second for speeds; seconds. Both directions are alike.
Source: O. J. M. Smith, Closer control of loops with dead time, Chemical Engineering Progress 53
(1957), 217-219.
"""
import math
from dataclasses import dataclass

from tb3_labs.control.commands import CommandHistory, Estimate, first_order_response
from tb3_labs.control.motor_response import TIME_DEVIATION, Identification, MotorResponse
from tb3_labs.geometry.angles import clamp

#: Times that differ by less than this [s] belong to the same sample, since times are rounded.
SAME_SAMPLE_TIME = 1e-6
#: For a nudge, this is added to the divisor of the gain, since a nudge may last two periods.
NUDGE_GAIN_DIVISOR = 0.5


@dataclass(frozen=True)
class ApproachConfig:
    """Settings of an approach of one axis, turning or driving. A way is in [rad] or [m]."""

    #: The robot obeys each command for this time [s].
    period: float
    #: Greatest acceleration [1/s^2] of the command.
    acceleration: float
    #: Deceleration of the braking profile [1/s^2]. It is less than `acceleration`, so that the
    #: robot can follow the profile in spite of disturbances.
    braking: float
    #: Near zero the speed is this gain [1/s] times the way after a stop.
    gain: float
    #: The lowest speed of a motion. At a lower speed the last part of the way would take too long.
    slowest: float
    #: The robot stops if the way after a stop is nearer to zero than this. Otherwise it would drive
    #: to and fro about zero at the lowest speed.
    close_enough: float
    #: If this is larger than `close_enough`, it replaces `close_enough` for a nudge.
    nudge_dead_band: float = 0.0
    #: The robot backs up only if it would come to rest beyond zero by more than this.
    backwards_from: float = 0.0
    #: A nudge lasts at least this time [s], so that a stop does not replace the nudge too early.
    nudge_time: float = 0.0
    #: Is the measured speed the present speed, as from a gyro? The odometry sends the mean over the
    #: last control period, which is too high while the robot brakes.
    speed_is_prompt: bool = False


def braking_speed(distance: float, deceleration: float, gain: float) -> float:
    """Returns the fastest speed from which a robot can stop within the `distance`, at least 0.

    At a large distance d the speed is the braking profile, sqrt(2 a d) for the `deceleration` a
    [1/s^2]. The slope of this profile is infinite at 0, and no motor can follow that slope. So near
    0 the speed is the line `gain` d, with the gain in [1/s]. Line and profile meet without a kink.
    """
    meeting = deceleration / gain ** 2
    if distance <= meeting:
        return gain * distance
    return math.sqrt(deceleration * (2.0 * distance - meeting))


class Approach:
    """The motion of one axis, turning or driving, until it rests where `remaining` is zero."""

    def __init__(self, config: ApproachConfig, response: MotorResponse) -> None:
        """`response` has the values of the robot. This approach improves them."""
        self._config = config
        self._response = response
        self.start()

    def start(self) -> None:
        """Start a new approach of a robot at rest."""
        self._now = 0.0                     # time since the start [s]
        self._measured_at = -math.inf       # time of the latest sample [s]
        #: The way that would remain if the robot were commanded to stop now.
        self.way_after_stop = Estimate()
        self._direction = 0.0        # sign of the latest motion; 0 before the first
        self._reversals = 0          # number of changes of the direction
        self._has_stopped = False    # was a stop commanded after the first motion?
        self._identification = Identification(self._response, self._config.speed_is_prompt)
        self._begin(math.nan, 0.0)    # the first step begins again, from its own sample

    def move_goal(self, by: float) -> None:
        """Move the goal. The way `by` is added to the remaining way."""
        self._start_remaining += by
        self.way_after_stop.shift(by, 0.0)

    def only_stops_obeyed(self, age: float) -> bool:
        """Did the robot obey only stops in the last `age` [s]?"""
        history = self._history
        return history.only_stops_since(
            history.now - age - self._identification.estimate.delay - 2.0 * self._config.period)

    def step(self, remaining: float, speed: float, fastest: float, dt: float,
             noise: float = 0.0, age: float = 0.0) -> float:
        """Returns the speed to command, at most `fastest`.

        `remaining` is the remaining way, with the standard deviation `noise`. `speed` is the
        measured speed. Both were measured `age` [s] ago. The last step was `dt` [s] ago.
        """
        self._now += dt
        if self._direction:
            self._advance(speed, dt)
        else:    # a motion was not commanded yet
            dt = self._config.period
            self._begin(remaining, speed)
        self._identification.update(
            self._history, self._start_remaining - remaining, speed, fastest, age)
        self._motor_speed = self._speed_of_motors(speed, dt)
        if self._now - age > self._measured_at + SAME_SAMPLE_TIME:
            self._measured_at = self._now - age
            self.way_after_stop.add(self._predicted_way(remaining, age), noise)
        latest = self._history.command
        if self._direction and not latest:
            self._has_stopped = True
        wanted = self._speed_to_zero(fastest)
        if wanted:
            self._remember_direction(wanted)
        elif self._must_hold_nudge():
            wanted = latest
        change = self._config.acceleration * dt
        self._history.send(clamp(wanted, latest - change, latest + change))
        return self._history.command

    def _begin(self, remaining: float, speed: float) -> None:
        """Start the history of commands, just before the first command."""
        self._history = CommandHistory(self._config.period)
        self._identification.begin(speed)
        self._start_remaining = remaining
        self._motor_speed = speed

    def _advance(self, speed: float, dt: float) -> None:
        """Let `dt` [s] pass. The travel commanded in this time reduces the way after a stop."""
        history = self._history
        before = history.commanded_travel(history.period_start)
        history.advance(dt)
        travel = history.commanded_travel(history.period_start) - before
        faster = max(abs(speed), abs(history.command))
        self.way_after_stop.shift(-self._identification.estimate.gain * travel,
                                  TIME_DEVIATION * faster)

    def _speed_of_motors(self, speed: float, dt: float) -> float:
        """Returns the measured speed if it is prompt, otherwise the model's speed."""
        if self._config.speed_is_prompt:
            return speed
        estimate = self._identification.estimate
        return first_order_response(
            self._motor_speed, self._history.arrived(estimate.delay), estimate.lag, dt)

    def _predicted_way(self, remaining: float, age: float) -> float:
        """Returns the way after a stop, computed from one sample that is `age` [s] old."""
        estimate = self._identification.estimate
        under_way = self._history.travel_under_way(estimate.delay + age)
        return remaining - self._motor_speed * estimate.lag - estimate.gain * under_way

    def _speed_to_zero(self, fastest: float) -> float:
        """Returns the speed that brings the way after a stop to zero. The acceleration is not
        limited here. The speed is 0 if the way is close enough to zero."""
        config = self._config
        distance = self.way_after_stop.value
        dead_band = config.close_enough
        gain_divisor = 1.0 + self._reversals
        if self._has_stopped:
            dead_band = max(dead_band, config.nudge_dead_band)
            gain_divisor += NUDGE_GAIN_DIVISOR
        near = self.way_after_stop.uncertainty + dead_band
        is_far = distance > near or distance < -max(near, config.backwards_from)
        if not is_far:
            return 0.0
        speed = braking_speed(abs(distance), config.braking, config.gain / gain_divisor)
        speed = clamp(speed, min(config.slowest, fastest), fastest)
        return math.copysign(speed, distance)

    def _must_hold_nudge(self) -> bool:
        """Is the latest command a nudge that must last longer?"""
        return self._has_stopped and self._history.unchanged_for < self._config.nudge_time

    def _remember_direction(self, velocity: float) -> None:
        """Count reversals. A robot that reverses repeatedly differs from its model."""
        if velocity * self._direction < 0.0:
            self._reversals += 1
        self._direction = velocity
