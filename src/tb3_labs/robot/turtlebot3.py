"""The numbers of the robots.

Units: metres, radians, seconds. Sources: ROBOTIS OpenCR firmware 1.2.6 (`turtlebot3_core` and its
motor driver), the Dynamixel XL430/XM430 manuals. The data sheet rounds the Burger's speeds up to
0.22 m/s and 2.84 rad/s.
"""
import math
from dataclasses import dataclass, replace
from typing import Dict, Mapping, NamedTuple

CONTROL_RATE = 30.0    # [1/s]; the rate at which the firmware obeys commands and sends odometry
COMMAND_TIMEOUT = 0.5    # [s]; after this time without a command, the firmware stops the wheels
WHEEL_JOINTS = 'wheel_left_joint', 'wheel_right_joint'    # as in turtlebot3_description


class Twist2(NamedTuple):
    linear: float = 0.0     # forward speed [m/s]
    angular: float = 0.0    # rate of turn [rad/s], positive to the left


@dataclass(frozen=True)
class RobotModel:
    """One kind of TurtleBot3. The firmware clips commands to `max_linear` and `max_angular`."""

    name: str
    wheel_radius: float       # [m]
    wheel_separation: float   # distance [m] between the wheels' middles
    motor_rpm: float          # fastest rotation [1/min] of a wheel
    motor_steps: int          # limit of the motor, in units of firmware.MOTOR_SPEED_STEP
    max_linear: float         # [m/s]
    max_angular: float        # [rad/s]
    body_radius: float        # radius [m] of a circle that contains the robot

    @property
    def half_track(self) -> float:
        """Distance [m] from the robot's centre to a wheel."""
        return self.wheel_separation / 2.0

    @property
    def max_wheel_speed(self) -> float:
        """Fastest speed [m/s] of a wheel's rim. It limits |v| + half_track |w|."""
        return self.wheel_radius * self.motor_rpm * 2.0 * math.pi / 60.0


BURGER = RobotModel(name='burger', wheel_radius=0.033, wheel_separation=0.160, motor_rpm=61.0,
                    motor_steps=265, max_linear=0.2108, max_angular=2.635, body_radius=0.105)
WAFFLE = RobotModel(name='waffle', wheel_radius=0.033, wheel_separation=0.287, motor_rpm=77.0,
                    motor_steps=330, max_linear=0.26, max_angular=1.82, body_radius=0.220)
MODELS: Dict[str, RobotModel] = {
    'burger': BURGER, 'waffle': WAFFLE, 'waffle_pi': replace(WAFFLE, name='waffle_pi')}
DEFAULT_MODEL = 'burger'
MODEL_VARIABLE = 'TURTLEBOT3_MODEL'    # names the robot if no parameter does


def saturate(twist: Twist2, max_linear: float, max_angular: float, model: RobotModel) -> Twist2:
    """Returns `twist`, limited by `max_linear` [m/s], `max_angular` [rad/s] and the limits of
    `model`. If a wheel is still too fast, the robot drives the same curve more slowly."""
    linear_limit = min(max_linear, model.max_linear)
    angular_limit = min(max_angular, model.max_angular)
    linear = max(min(twist.linear, linear_limit), -linear_limit)    # NaN stays NaN
    angular = max(min(twist.angular, angular_limit), -angular_limit)
    wheel_speed = abs(linear) + model.half_track * abs(angular)
    if wheel_speed > model.max_wheel_speed:
        scale = model.max_wheel_speed / wheel_speed
        return Twist2(scale * linear, scale * angular)
    return Twist2(linear, angular)


def robot_model(name: str, source: str = 'model') -> RobotModel:
    """Returns the model `name`. Raises ``ValueError`` for an unknown name, which `source` gave."""
    if name not in list(MODELS):    # the value of a parameter may be a list, which has no hash
        raise ValueError(f"{source} = {name!r} is not valid: one of {', '.join(MODELS)}")
    return MODELS[name]


def model_of_environment(environment: Mapping[str, str]) -> RobotModel:
    """Returns the model that MODEL_VARIABLE names, or a Burger if the variable is not set."""
    return robot_model(environment.get(MODEL_VARIABLE) or DEFAULT_MODEL, MODEL_VARIABLE)
