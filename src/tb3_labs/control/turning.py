"""Turns on the spot by the IMU: their settings. Their law is
:class:`tb3_labs.control.approach.PreciseTurn`.

Units: radians, counter-clockwise positive. A turn is asked for as an angle, not as a heading: 180
and -180 are different turns, and 360 is a full turn. The handout's law cannot tell them apart.
"""
import math
from dataclasses import dataclass
from typing import Optional

from tb3_labs.config import Config, setting
from tb3_labs.control.approach import PreciseTurn
from tb3_labs.control.motor_response import Response
from tb3_labs.robot.turtlebot3 import RobotModel

#: Turns by the keys of the keyboard [deg].
TURN_KEYS = {'l': 90.0, 'r': -90.0, 'b': 180.0}


def degrees_of(text: str) -> float:
    """The turn that `text` asks for [deg]: a key, or a number; else ``ValueError``."""
    try:
        return TURN_KEYS[text] if text in TURN_KEYS else float(text)
    except ValueError:
        raise ValueError('{!r} is not valid: l (90 degrees left), r (90 right), b (180, about '
                         'turn), a number of degrees (left positive), q (quit)'.format(
                             text[:20])) from None


@dataclass(frozen=True)
class TurnConfig(Config):
    """Settings of a turn."""

    max_ang_z: float = setting(1.5, "fastest turn; the robot's own limit holds as well", 'rad/s',
                               low=0.1, high=5.0)
    tolerance_deg: float = setting(0.12, 'the goal is reached within this angle', 'deg',
                                   low=0.1, high=45.0)
    angular_acceleration: float = setting(45.0, 'speeding up; a quarter of it for braking',
                                          'rad/s^2', low=1.0, high=80.0)


def make_turn(config: TurnConfig, model: RobotModel,
              response: Optional[Response] = None) -> PreciseTurn:
    """The law of a turn; `response` holds the known delay and lag of this robot."""
    return PreciseTurn(min(config.max_ang_z, model.max_angular), config.angular_acceleration,
                       math.radians(config.tolerance_deg), response or Response())
