"""Speed laws and limits shared by turning and driving.

Units: metres or radians for what is left to go, per second for speeds. All laws are odd: they
treat both directions alike. dt = 0 changes nothing.
"""
import math
from typing import NamedTuple


class Twist2(NamedTuple):
    """A planar velocity: forward speed [m/s] and rate of turn [rad/s]."""

    linear: float = 0.0
    angular: float = 0.0


class LawStep(NamedTuple):
    """What a law answers: the command, what remains to go [m or rad], and is it finished."""

    command: Twist2
    remaining: float
    finished: bool


def clamp(value, low, high):
    """`value` brought into [low, high]; NaN stays NaN, where min and max would make it a limit."""
    return value if math.isnan(value) else max(low, min(high, value))


def proportional(error, gain, slowest=0.0, fastest=math.inf):
    """The handouts' law: gain x error, its size kept in [slowest, fastest].

    It moves at `slowest` at an error of 0 as well: whoever uses it stops by a tolerance first.
    """
    return math.copysign(clamp(abs(gain * error), slowest, fastest), error)


def braking_speed(remaining, deceleration, gain):
    """Fastest speed from which the remaining way is enough to stop in.

    Far away the braking profile sqrt(2 a d) of constant deceleration a; near the end the line
    gain x d, which it meets without a step or a kink, because the profile's slope is infinite at
    0 and no motor follows that.
    """
    distance = abs(remaining)
    meeting = deceleration / gain ** 2
    if distance <= meeting:
        return math.copysign(gain * distance, remaining)
    return math.copysign(math.sqrt(deceleration * (2.0 * distance - meeting)), remaining)


def saturate(twist, max_linear, max_angular, model):
    """`twist` within the limits asked for and those of the robot (a turtlebot3.RobotModel).

    Each is clipped on its own first. Where both together then ask too much of a wheel, both are
    scaled alike: the curve stays the same, only slower.
    """
    linear_limit = min(max_linear, model.max_linear)
    angular_limit = min(max_angular, model.max_angular)
    linear = clamp(twist.linear, -linear_limit, linear_limit)
    angular = clamp(twist.angular, -angular_limit, angular_limit)
    wheel = abs(linear) + model.half_track * abs(angular)
    if wheel > model.max_wheel_speed:
        scale = model.max_wheel_speed / wheel
        linear, angular = scale * linear, scale * angular
    return Twist2(linear, angular)
