"""Speed laws and limits shared by turning and driving.

Units: metres or radians for the remaining way, per second for speeds. All laws are odd functions:
they treat both directions alike.
"""
import math
from typing import NamedTuple

from tb3_labs.geometry.angles import clamp
from tb3_labs.robot.turtlebot3 import RobotModel


class Twist2(NamedTuple):
    """A planar velocity: forward speed [m/s] and rate of turn [rad/s]."""

    linear: float = 0.0
    angular: float = 0.0


class LawStep(NamedTuple):
    """A law's answer: the command, the remaining way [m or rad], and whether it is finished."""

    command: Twist2
    remaining: float
    finished: bool


def proportional(error: float, gain: float, slowest: float = 0.0,
                 fastest: float = math.inf) -> float:
    """The handouts' law: gain x error, its size clipped to [slowest, fastest].

    At an error of 0 the speed is still `slowest`: the caller stops before that, by a tolerance.
    """
    return math.copysign(clamp(abs(gain * error), slowest, fastest), error)


def braking_speed(remaining: float, deceleration: float, gain: float) -> float:
    """Fastest speed from which a robot can stop within the remaining way.

    `deceleration` is in [1/s^2], `gain` in [1/s]. Far away this is the braking profile sqrt(2 a d)
    of constant deceleration a. The slope of that profile is infinite at 0, and no motor can follow
    it. So near the end the speed is the line gain x d. Profile and line meet without a step or a
    kink.
    """
    distance = abs(remaining)
    meeting = deceleration / gain ** 2
    if distance <= meeting:
        return math.copysign(gain * distance, remaining)
    return math.copysign(math.sqrt(deceleration * (2.0 * distance - meeting)), remaining)


def saturate(twist: Twist2, max_linear: float, max_angular: float, model: RobotModel) -> Twist2:
    """Returns `twist` within the limits asked for ([m/s], [rad/s]) and the robot's own.

    First each speed is clipped on its own. If both together are still too fast for a wheel, both
    are scaled alike: the robot drives the same curve, only slower.
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
