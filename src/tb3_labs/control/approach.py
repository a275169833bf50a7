"""An approach drives until the remaining way is zero, and comes to rest there in spite of delays.

The *way at rest* is the way that would remain if the robot were commanded to stop now. `commands`
predicts the way at rest from each sample, by the delay, lag and gain that `motor_response`
identifies. An `Estimate` filters the noise of the predictions. Between two samples, only the
command changes the way at rest. A braking profile gives the speed for the way at rest. *Nudges* are
short commands after the first stop, and correct the last error.

Units: radians or metres for ways, per second for speeds; seconds. Both directions are alike.
Source: braking profile, see :func:`tb3_labs.control.commands.braking_speed`.
"""
import math
from dataclasses import dataclass

from tb3_labs.control.commands import (
    CommandHistory, Estimate, LawStep, braking_speed, first_order_response, remaining_at_rest)
from tb3_labs.control.motor_response import TIME_DEVIATION, Identification, Response
from tb3_labs.geometry.angles import clamp, difference, unwrap
from tb3_labs.robot.samples import REST_ANGULAR
from tb3_labs.robot.turtlebot3 import CONTROL_RATE, Twist2
from tb3_labs.supervision.sensors_and_stalls import Settling

#: Two times that differ by less than this, as by rounding, belong to the same sample [s].
SAME_SAMPLE_TIME = 1e-6


@dataclass(frozen=True)
class ApproachConfig:
    """Settings of an approach of one axis, turning or driving. Lengths are [rad] or [m]."""

    #: Each command is obeyed for this long [s].
    period: float
    #: A command changes by this much at most [1/s^2].
    acceleration: float
    #: Deceleration of the braking profile [1/s^2], less than `acceleration`, so that the robot can
    #: follow the profile in spite of disturbance.
    braking: float
    #: Near zero the speed is this gain times the way at rest [1/s].
    gain: float
    #: The lowest speed that is commanded. Below this speed the last way would take too long.
    slowest: float
    #: A way at rest that is this near to zero needs no motion: the command is a stop. Otherwise the
    #: robot would drive to and fro about zero at the lowest speed.
    close_enough: float
    #: After the first stop, a way at rest that is this near to zero is not corrected. A larger
    #: `close_enough` takes precedence.
    leave_alone: float = 0.0
    #: The robot backs up only if it would come to rest beyond zero by more than this.
    backwards_from: float = 0.0
    #: The gain is divided by 1 + (this value) * (the number of reversals), since an approach that
    #: reverses repeatedly has a wrong model of the robot.
    reversal_caution: float = 1.0
    #: The divisor of the gain grows by this for a nudge, which the robot may obey for two periods.
    nudge_caution: float = 0.5
    #: A nudge is held for this long [s], so that a stop does not replace the nudge too early.
    nudge_time: float = 0.0
    #: True: the measured speed is the present speed, as of a gyro. False: the measured speed is the
    #: mean of the last control period, as of odometry. While braking, this mean is too high.
    speed_is_prompt: bool = False


class Approach:
    """One axis (turning or driving) that comes to rest where `remaining` is zero."""

    def __init__(self, config: ApproachConfig, response: Response) -> None:
        """`response` has the known values of the robot. This approach improves them."""
        self._config = config
        self._response = response
        self.start()

    def start(self) -> None:
        """Begin again with a robot that stands."""
        self._now = 0.0                     # since the start [s]
        self._measured_at = -math.inf       # time of the latest sample [s]
        #: The way that would remain if the robot were commanded to stop now.
        self.at_rest = Estimate()
        self._direction = 0.0     # sign of the latest command that was not zero
        self._reversals = 0       # number of changes of the direction
        self._nudges = False      # was the robot commanded to stop since the start?
        self._identification = Identification(self._response, self._config.speed_is_prompt)
        self._begin(math.nan, 0.0)

    def extend(self, by: float) -> None:
        """Add `by` to the remaining way: the goal was moved during the approach."""
        self._start_remaining += by
        self.at_rest.shift(by, 0.0)

    def must_rest(self, age: float) -> bool:
        """Were all commands stops that the robot obeyed in the last `age` [s]?"""
        history = self._history
        return history.only_stops_since(
            history.now - age - self._identification.estimate.delay - 2.0 * self._config.period)

    def cruises(self, fastest: float) -> bool:
        """Is the command `fastest` now, and also in the next two periods?"""
        later = abs(self.at_rest.value) - 2.0 * self._config.period * fastest
        return abs(self._history.command) == fastest and (
            braking_speed(later, self._config.braking, self._config.gain) >= fastest)

    def step(self, remaining: float, speed: float, fastest: float, dt: float,
             noise: float = 0.0, age: float = 0.0) -> float:
        """Returns the speed to command, at most `fastest`, for the remaining way and the measured
        speed. The last step was `dt` [s] ago.

        `noise`: standard deviation of `remaining`; `age`: time since the measurement [s].
        """
        self._now += dt
        if self._direction:
            self._advance(speed, dt)
        else:
            dt = self._config.period
            self._begin(remaining, speed)
        self._identification.update(
            self._history, self._start_remaining - remaining, speed, fastest, age)
        self._motor_speed = self._speed_of_motors(speed, dt)
        if self._now - age > self._measured_at + SAME_SAMPLE_TIME:
            self._measured_at = self._now - age
            estimate = self._identification.estimate
            self.at_rest.add(remaining_at_rest(remaining, self._motor_speed, self._history,
                                               estimate.delay + age, estimate.lag, estimate.gain),
                             noise)
        wanted = self._wanted(fastest)
        latest, change = self._history.command, self._config.acceleration * dt
        self._history.send(clamp(wanted, latest - change, latest + change))
        return self._history.command

    def _begin(self, remaining: float, speed: float) -> None:
        """Begin the history of the commands just before the first command."""
        self._history = CommandHistory(self._config.period)
        self._identification.begin(speed)
        self._start_remaining = remaining
        self._motor_speed = speed

    def _advance(self, speed: float, dt: float) -> None:
        """Let `dt` [s] pass. The travel commanded in that time reduces the way at rest."""
        history = self._history
        before = history.commanded(history.begin)
        history.advance(dt)
        commanded = history.commanded(history.begin) - before
        fastest = max(abs(speed), abs(history.command))
        self.at_rest.shift(-self._identification.estimate.gain * commanded,
                           TIME_DEVIATION * fastest)

    def _speed_of_motors(self, speed: float, dt: float) -> float:
        """Returns the measured speed if it is prompt, otherwise the model's speed."""
        if self._config.speed_is_prompt:
            return speed
        estimate = self._identification.estimate
        return first_order_response(
            self._motor_speed, self._history.arrived(estimate.delay), estimate.lag, dt)

    def _wanted(self, fastest: float) -> float:
        """Returns the speed that is wanted, before the acceleration limits its change."""
        config = self._config
        self._nudges = self._nudges or bool(self._direction and not self._history.command)
        leave_alone = config.leave_alone if self._nudges else 0.0
        distance = self.at_rest.value
        near = self.at_rest.uncertainty + max(config.close_enough, leave_alone)
        if distance > near or distance < -max(near, config.backwards_from):
            caution = 1.0 + config.reversal_caution * self._reversals
            if self._nudges:
                caution += config.nudge_caution
            speed = abs(braking_speed(distance, config.braking, config.gain / caution))
            speed = clamp(speed, min(config.slowest, fastest), fastest)
            wanted = math.copysign(speed, distance)
            if wanted * self._direction < 0.0:
                self._reversals += 1
            self._direction = wanted
            return wanted
        if self._nudges and self._history.unchanged_for < config.nudge_time:
            return self._history.command
        return 0.0


def turning_approach(acceleration: float, tolerance: float) -> ApproachConfig:
    """Returns the ApproachConfig of a precise turn, in [rad/s^2] and [rad]."""
    period = PreciseTurn.period
    return ApproachConfig(
        period=period, acceleration=acceleration, braking=0.25 * acceleration, gain=24.0,
        slowest=0.02, close_enough=0.0007, leave_alone=0.5 * tolerance, nudge_time=period,
        speed_is_prompt=True)


class PreciseTurn:
    """Turns as fast as the limits allow, in the requested direction, and ends at rest."""

    period = 1.0 / CONTROL_RATE    # one command in each control period of the firmware [s]
    MAX_ANGLE = 200.0 * math.pi    # the largest turn [rad]
    #: With a noisy IMU the turn waits at rest for more samples, at most this long [s].
    LONGEST_WAIT_AT_REST = 0.6

    def __init__(self, fastest: float, acceleration: float, tolerance: float,
                 response: Response) -> None:
        """`fastest` [rad/s], `acceleration` [rad/s^2], `tolerance` [rad]; `response`: known delay
        and lag of the robot."""
        self._fastest = fastest
        self._tolerance = tolerance
        self._approach = Approach(turning_approach(acceleration, tolerance), response)
        self.start(0.0, 0.0)

    def start(self, yaw: float, angle: float) -> None:
        """Turn by `angle`, beginning at `yaw` [rad], with a robot that stands."""
        self._face = yaw + angle
        #: The remaining angle, not wrapped, perhaps many whole turns [rad].
        self.remaining = angle
        self._time = 0.0    # since the start [s]
        self._settling = Settling()
        self._approach.start()

    def extend(self, angle: float) -> None:
        """Move the goal of the turn by `angle` [rad]."""
        self._face += angle
        self.remaining += angle
        self._approach.extend(angle)

    def aim(self, face: float) -> None:
        """Turn to the heading `face` [rad] from now on, the short way round."""
        self._approach.extend(difference(face, self._face))
        self._face = face

    def step(self, yaw: float, rate: float, dt: float, age: float = 0.0,
             noise: float = 0.0) -> LawStep:
        """Returns the LawStep for a robot with this `yaw` [rad] and `rate` [rad/s]. The turn is
        finished if the robot rests inside the tolerance, within the limits of the noise.

        `dt`: time since the last step [s]; `age`: the sample's age [s]; `noise`: standard
        deviation of the sample's yaw [rad].
        """
        self._time += dt
        self.remaining = unwrap(self._face - yaw, self.remaining)
        command = self._approach.step(self.remaining, rate, self._fastest, dt, noise, age)
        rests = abs(rate) <= REST_ANGULAR and self._approach.must_rest(age)
        self._settling.update(rests, self._time - age)
        if rests:
            self.remaining = self._approach.at_rest.value
        return LawStep(Twist2(0.0, command), self.remaining,
                       self._settling.rests and self._is_near())

    def _is_near(self) -> bool:
        uncertainty = self._approach.at_rest.uncertainty
        if uncertainty <= 0.35 * self._tolerance:
            return abs(self.remaining) <= self._tolerance
        return (self._settling.rested_for >= self.LONGEST_WAIT_AT_REST
                and abs(self.remaining) <= self._tolerance + uncertainty)
