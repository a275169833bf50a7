"""A turn with its settings, its goal and its result. The table NEXT_DRIVER says whether a turn or
the mouse drives. The control law of a turn is :class:`tb3_labs.control.turning.PreciseTurn`.

Angles are in radians, counter-clockwise positive. A request for a turn contains an angle, so 180
and -180 are different turns, and 360 is a full turn. In the handout a request contains a heading.
"""
import math
from dataclasses import dataclass
from enum import Enum
from typing import Optional

from tb3_labs.config import Config, setting
from tb3_labs.control.braking import FilteredNumber
from tb3_labs.control.motor_response import MotorResponse
from tb3_labs.control.turning import PreciseTurn
from tb3_labs.geometry.angles import unwrap
from tb3_labs.handout import LEFT_KEY, MAX_ANG_Z, RIGHT_KEY, TURN_DEG
from tb3_labs.localization.sample_timing import TimedSample, YawNoise
from tb3_labs.robot.turtlebot3 import RobotModel
from tb3_labs.supervision.events import IncomingMessage, SenderRequests
from tb3_labs.supervision.motion_monitors import StallMonitor

#: The yaw of a robot at rest drifts by at most this angle [rad] from one sample to the next.
RESTING_YAW_DRIFT = math.radians(0.02)
#: {key of the keyboard: requested turn [deg]}
TURN_KEYS = {LEFT_KEY: TURN_DEG, RIGHT_KEY: -TURN_DEG, 'b': 180.0}


def parse_turn(text: str) -> float:
    """Returns the angle [deg] for a key or a number. Raises ``ValueError`` for another text."""
    if text in TURN_KEYS:
        return TURN_KEYS[text]
    try:
        return float(text)
    except ValueError:
        raise ValueError(f'{text[:20]!r} is not valid: l (90 degrees left), r (90 right), b (180, '
                         'about turn), a number of degrees (left positive), q (quit)') from None


@dataclass(frozen=True)
class TurnConfig(Config):
    """Settings of a turn."""

    max_ang_z: float = setting(MAX_ANG_Z, "fastest turn; the robot's own limit holds as well",
                               'rad/s', low=0.1, high=5.0)
    tolerance_deg: float = setting(0.12, 'the goal is reached within this angle', 'deg',
                                   low=0.1, high=45.0)
    angular_acceleration: float = setting(45.0, 'speeding up; a quarter of it for braking',
                                          'rad/s^2', low=1.0, high=80.0)


def make_turn_law(config: TurnConfig, model: RobotModel,
                  response: Optional[MotorResponse] = None) -> PreciseTurn:
    """Returns the control law of a turn. `response` contains the motors' delay and lag."""
    return PreciseTurn(min(config.max_ang_z, model.max_angular), config.angular_acceleration,
                       math.radians(config.tolerance_deg), response or MotorResponse())


class Heading:
    """The heading of a robot, measured only by the IMU. The zero of the heading is arbitrary."""

    def __init__(self) -> None:
        self.yaw = math.nan    # yaw [rad] without jumps at +/-pi; NaN before the first sample
        self.yaw_rate = 0.0    # [rad/s]
        self.noise = YawNoise()
        self.resting_yaw = FilteredNumber()    # filtered yaw [rad] of a robot at rest

    def on_imu(self, timed: TimedSample) -> None:
        sample = timed.sample
        is_first = math.isnan(self.yaw)
        self.yaw = sample.yaw if is_first else unwrap(sample.yaw, self.yaw)
        self.yaw_rate = sample.yaw_rate
        self.noise.learn(timed)
        if self.noise.deviation:
            self.resting_yaw.shift(0.0, RESTING_YAW_DRIFT + abs(self.yaw_rate * timed.interval))
            self.resting_yaw.add(self.yaw, self.noise.deviation)
        else:    # the noise is not known yet
            self.resting_yaw = FilteredNumber()
            self.resting_yaw.shift(self.yaw)


class ActiveTurn:
    """A turn, from its request until its result is logged. Its angles do not jump at +/-pi."""

    def __init__(self, requested: float, yaw: float, now: float) -> None:
        self.requested = requested
        self.goal = yaw + requested
        self.stall = StallMonitor()
        self.remaining_at_end = 0.0    # angle [rad] that the law has measured with its filter
        self._begun_at = now

    def move_goal(self, angle: float) -> None:
        self.requested += angle
        self.goal += angle
        self.stall = StallMonitor()

    def remaining(self, yaw: float) -> float:
        return self.goal - yaw

    def result_text(self, now: float) -> str:
        """Returns the result of the turn. The robot must be at rest."""
        requested = math.degrees(self.requested)
        error = math.degrees(self.remaining_at_end)
        side = 'short of' if error * requested > 0.0 else 'beyond'
        return (f'Turned {requested - error:.2f} degrees in {now - self._begun_at:.1f} s: '
                f'{abs(error):.2f} degrees {side} {requested:.2f}')


class Driver(Enum):
    """The driver of the robot. When the driver changes, one zero command stops the robot first."""

    NOBODY = 'nobody'
    TURN = 'turn'
    MOUSE = 'mouse'


class DriverEvent(Enum):
    """An event that may change the driver. A message of an inactive mouse is not an event."""

    TURN_REQUESTED = 'turn asked'
    TURN_OVER = 'turn over'
    MOUSE_MOVED = 'mouse moved'           # an active mouse is outside of the dead zone
    MOUSE_CENTRED = 'mouse centred'       # an active mouse is in the dead zone
    MOUSE_RELEASED = 'mouse released'     # the mouse was deactivated or lost


#: {(driver, event): next driver}. An event that is not listed for a driver does not change the
#: driver. For example, a turn is refused while the mouse drives. Source: the mouse lab.
NEXT_DRIVER = {
    (Driver.NOBODY, DriverEvent.TURN_REQUESTED): Driver.TURN,
    (Driver.NOBODY, DriverEvent.MOUSE_MOVED): Driver.MOUSE,
    (Driver.TURN, DriverEvent.TURN_OVER): Driver.NOBODY,
    (Driver.TURN, DriverEvent.MOUSE_MOVED): Driver.MOUSE,
    (Driver.TURN, DriverEvent.MOUSE_RELEASED): Driver.NOBODY,
    (Driver.MOUSE, DriverEvent.MOUSE_CENTRED): Driver.NOBODY,
    (Driver.MOUSE, DriverEvent.MOUSE_RELEASED): Driver.NOBODY,
}


def accept_turn(requests: SenderRequests, turn: IncomingMessage, is_waking: bool = False) -> bool:
    """Store the request for a turn in `requests`. Returns False if the turn may be old. Also
    returns False if the turn repeats a turn that was refused or has ended. `is_waking` is True if
    this process has just slept."""
    request = requests.on_request(turn.sender, turn.content, turn.arrived_at)
    if turn.novelty.is_doubtful:
        request.is_ended = True
    is_accepted = not request.is_ended
    if is_waking:    # the core refuses this turn, and its repetitions are refused here
        request.is_ended = True
    return is_accepted
