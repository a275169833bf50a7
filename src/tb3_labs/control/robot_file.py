"""The numbers of one robot, measured before: the laws begin with them, and learn on from there.

They are named as the simulated robot's settings are, so one YAML file serves both. Other names in
it are not used here. With the separation of the wheels, a precise turn commands the rate that the
robot then turns at: the firmware counts with the model's separation.

Units: seconds, metres. Edge cases: a number that is missing has the value of the simulated robot;
a value of another type, out of its bounds, or that does not fit the model raises ``ValueError``.
"""
import os
from dataclasses import dataclass
from typing import Any, Mapping

import yaml

from tb3_labs.config import Config, from_parameters, setting
from tb3_labs.control.motor_response import MAX_DELAY, MAX_LAG, Response
from tb3_labs.robot.turtlebot3 import CONTROL_RATE, RobotModel

#: A separation differs from that of the model by this share at most.
SAME_MODEL = 0.2


@dataclass(frozen=True)
class RobotFileConfig(Config):
    """The file that a node reads at its start."""

    robot_file: str = setting('', "YAML file with this robot's numbers, as commission.py writes "
                              "it: the precise law begins with them; '': with usual ones")


@dataclass(frozen=True)
class RobotNumbers(Config):
    """The numbers that the laws use, of those that the simulated robot has."""

    command_latency: float = setting(0.0, 'delay of each command', 's', 0.0, 5.0)
    command_jitter: float = setting(0.0, 'mean of an additional delay of each command', 's',
                                    0.0, 1.0)
    sensor_latency: float = setting(0.0, 'delay of each sample', 's', 0.0, 5.0)
    yaw_lag: float = setting(0.0135, 'age of the yaw at its stamp', 's', 0.0, 1.0)
    motor_lag: float = setting(0.05, 'time constant of the motors, first order', 's', 0.0, 2.0)
    wheel_separation: float = setting(0.0, "distance of the wheels; 0: the model's", 'm', 0.0, 1.0)


def read_response(config: RobotFileConfig, model: RobotModel) -> Response:
    """The Response by the file named in `config`, else the usual one. ``ValueError`` if the file
    cannot be read, or a number in it is not valid."""
    if not config.robot_file:
        return Response()
    # roslaunch starts a node in another folder; the person's is still in the environment
    path = os.path.join(os.environ.get('PWD', ''), os.path.expanduser(config.robot_file))
    try:
        with open(path, encoding='utf-8') as file:
            given = yaml.safe_load(file)
        if not isinstance(given, dict):
            raise ValueError('it has no lines such as "motor_lag: 0.05"')
        return response_of(given, model)
    except (OSError, ValueError, yaml.YAMLError) as problem:
        raise ValueError('robot_file = {}: {}'.format(
            config.robot_file, ' '.join(str(problem).split()))) from None


def response_of(given: Mapping[str, Any], model: RobotModel) -> Response:
    """The Response that the laws begin with, by the numbers `given` of a robot of this `model`."""
    numbers = from_parameters(RobotNumbers, given)
    scale = (numbers.wheel_separation or model.wheel_separation) / model.wheel_separation
    if abs(scale - 1.0) > SAME_MODEL:
        raise ValueError('wheel_separation = {:g} is not valid: the {} has {:g} m'.format(
            numbers.wheel_separation, model.name, model.wheel_separation))
    delay = (0.5 / CONTROL_RATE + numbers.command_latency + numbers.command_jitter
             + numbers.sensor_latency + numbers.yaw_lag)
    return Response(min(delay, MAX_DELAY), min(numbers.motor_lag, MAX_LAG), turn_scale=scale)
