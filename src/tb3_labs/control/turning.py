"""Turns on the spot by the IMU: their settings, and the IMU lab's own law. The other law is
:class:`tb3_labs.control.approach.PreciseTurn`.

Units: radians, counter-clockwise positive; the lab's own constants are in degrees, as in the
handout. A turn is asked for as an angle, not as a heading: 180 and -180 are different turns, and
360 is a full turn. The handout's law alone cannot tell them apart.
Source: LabTurn is the IMU lab's handout, number by number.
"""
import math
from dataclasses import dataclass
from typing import Optional, Protocol

from tb3_labs.config import Config, setting
from tb3_labs.control.approach import PreciseTurn
from tb3_labs.control.motor_response import Response
from tb3_labs.control.speed_laws import LawStep, Twist2, proportional
from tb3_labs.geometry.angles import difference
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

    law: str = setting('precise', "precise, or lab for the handout's own law",
                       choices=('precise', 'lab'))
    k_hdg: float = setting(0.1, "lab: rate of turn for each remaining degree", 'rad/s',
                           low=0.001, high=10.0)
    hdg_tol: float = setting(10.0, 'lab: the turn ends within this angle of its goal', 'deg',
                             low=0.1, high=45.0)
    min_ang_z: float = setting(0.5, 'lab: slowest turn', 'rad/s', low=0.0, high=5.0)
    max_ang_z: float = setting(1.5, "fastest turn; the robot's own limit holds as well", 'rad/s',
                               low=0.1, high=5.0)
    tolerance_deg: float = setting(0.12, 'precise: the goal is reached within this angle', 'deg',
                                   low=0.1, high=45.0)
    angular_acceleration: float = setting(45.0, 'precise: speeding up; a quarter of it for braking',
                                          'rad/s^2', low=1.0, high=80.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.min_ang_z > self.max_ang_z:
            raise ValueError('min_ang_z = {:g} is not valid: a number up to max_ang_z, which is '
                             '{:g} rad/s'.format(self.min_ang_z, self.max_ang_z))


class TurningLaw(Protocol):
    """A law for turns on the spot."""

    period: float              # time from one command to the next [s]
    MAX_ANGLE: float           # the largest turn [rad]
    MAX_ANGLE_IN_WORDS: str    # the same in degrees, as a refusal words it
    extends: bool              # does a request in a turn move the goal of this turn?
    carries_error: bool        # does a turn correct the error of the turn before?

    def start(self, yaw: float, angle: float) -> None:
        """Turn by `angle` [rad], beginning at `yaw` [rad]."""

    def extend(self, angle: float) -> None:
        """Move the goal of the present turn by `angle` [rad]."""

    def step(self, yaw: float, rate: float, dt: float, age: float = 0.0,
             noise: float = 0.0) -> LawStep:
        """The command for a robot that faces `yaw` [rad] and turns at `rate` [rad/s].

        `dt`: time since the last step [s]; `age`: the sample's age [s]; `noise`: standard
        deviation of the sample's yaw [rad].
        """


def make_turn(config: TurnConfig, model: RobotModel,
              response: Optional[Response] = None) -> TurningLaw:
    """The law named in `config`; `response` holds the known delay and lag of this robot."""
    if config.law == 'lab':
        return LabTurn(config, model)
    return PreciseTurn(min(config.max_ang_z, model.max_angular), config.angular_acceleration,
                       math.radians(config.tolerance_deg), response or Response())


class LabTurn:
    """The handout's law: proportional and clamped. The turn is over once inside the tolerance.

    The goal is only a heading. The robot turns to it the short way round.
    """

    period = 0.1    # [s]: 10 Hz
    MAX_ANGLE = math.pi
    MAX_ANGLE_IN_WORDS = "the handout's law goes the short way round, at most 180"
    extends = False
    carries_error = False

    def __init__(self, config: TurnConfig, model: RobotModel) -> None:
        self._goal = 0.0
        self._gain = config.k_hdg
        self._tolerance = config.hdg_tol
        self._slowest = min(config.min_ang_z, model.max_angular)
        self._fastest = min(config.max_ang_z, model.max_angular)

    def start(self, yaw: float, angle: float) -> None:
        self._goal = yaw + angle

    def extend(self, angle: float) -> None:
        """Not called: `extends` is False."""

    def step(self, yaw: float, rate: float, dt: float, age: float = 0.0,
             noise: float = 0.0) -> LawStep:
        """The command; this law uses the yaw alone."""
        error = math.degrees(difference(self._goal, yaw))
        command = proportional(error, self._gain, self._slowest, self._fastest)
        return LawStep(Twist2(0.0, command), math.radians(error), abs(error) < self._tolerance)
