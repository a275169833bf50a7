"""A drive to a goal from outside: settings, four states, texts of `goal_state`, lines to users.

The states are those that the Transformation lab lists:

    ROTATE_TO_GOAL -> MOVE_FORWARD -> ROTATE_TO_FINAL -> GOAL_REACHED

Units: metres, radians. Source: the course's first move-to-goal lab.
"""
import math
from dataclasses import dataclass
from enum import Enum
from typing import Callable, NamedTuple, Optional, Tuple

from tb3_labs import handout
from tb3_labs.config import Config, setting
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import Motion
from tb3_labs.supervision.events import NewsDesk

#: Time between two lines of progress [s].
PROGRESS_PERIOD = 1.0


@dataclass(frozen=True)
class DriveConfig(Config):
    """Settings of a drive to a goal."""

    allow_reverse: bool = setting(False, 'drive backwards where that is the shorter way')
    distance_tolerance: float = setting(0.01, 'the goal is reached within this distance', unit='m',
                                        low=0.002, high=1.0)
    angle_tolerance_deg: float = setting(0.5, 'the heading is reached within this angle',
                                         unit='deg', low=0.2, high=45.0)
    max_linear: float = setting(0.26, "fastest drive; the robot's own limit holds as well",
                                unit='m/s', low=0.02, high=1.0)
    max_angular: float = setting(1.5, "fastest turn; the robot's own limit holds as well",
                                 unit='rad/s', low=0.1, high=5.0)
    linear_acceleration: float = setting(4.0, 'speeding up; a fifth of it for braking',
                                         unit='m/s^2', low=0.1, high=10.0)
    angular_acceleration: float = setting(45.0, 'speeding up a turn; a quarter of it for braking',
                                          unit='rad/s^2', low=1.0, high=80.0)


class GoalState(Enum):
    """The state of a drive."""

    ROTATE_TO_GOAL = handout.ROTATE_TO_GOAL
    MOVE_FORWARD = handout.MOVE_FORWARD
    ROTATE_TO_FINAL = handout.ROTATE_TO_FINAL
    GOAL_REACHED = handout.GOAL_REACHED


#: Names of the states in which the robot drives, in order.
DRIVING = tuple(state.name for state in GoalState if state is not GoalState.GOAL_REACHED)
#: `goal_state` is the name of a state, WAITING_FOR_CONTROL, or one of these words with a reason.
WAITING, STOPPED, GAVE_UP = 'waiting', 'stopped', 'gave up'
WAITING_FOR_CONTROL = WAITING + ' for control'


def to_go(distance: float, angle_deg: float) -> str:
    """The remaining way of a drive in words [m, deg]; the angle is for the turn at the end."""
    return f'{distance:.3f} m to go, {abs(angle_deg):.1f} deg off the final heading'


def with_reason(word: str, reason: str) -> str:
    """The text of `goal_state` for one of WAITING, STOPPED, GAVE_UP and its reason."""
    return f'{word}: {reason}'


class DriveStatus(NamedTuple):
    """The public status of a drive at one moment; poses in local."""

    state: GoalState
    goal: Optional[Pose2]
    tolerance: float              # of the distance to the goal [m]
    attempt: int                  # number of the drive: each goal and restart begins a new one
    begun: bool                   # has the robot been told to move in this attempt?
    active: bool                  # is the drive going on?
    failure: str                  # reason why the drive was given up; '' if it was not
    hold_reason: str              # reason why the robot stands during a drive, or ''
    has_control: bool             # may the node drive?
    sensor_problem: str           # lost or contradicting sensors, in words; '' if there are none

    def left(self, motion: Optional[Motion]) -> Tuple[float, float]:
        """The distance [m] and the angle [deg, not negative] from here to the goal."""
        assert self.goal is not None and motion is not None
        distance, angle = errors(motion.pose, self.goal)
        return distance, abs(math.degrees(angle))

    @property
    def words(self) -> str:
        """The text on `goal_state`; '' until the first command."""
        if self.failure:
            return with_reason(GAVE_UP, self.failure)
        if not self.active:
            return self.state.name
        if not self.has_control:
            return WAITING_FOR_CONTROL
        if not self.begun:
            return with_reason(WAITING, self.sensor_problem) if self.sensor_problem else ''
        return with_reason(STOPPED, self.hold_reason) if self.hold_reason else self.state.name


def turned(start: float, face: float, end: float) -> float:
    """Sum of both turns [rad] of a drive: from yaw `start` to the line's `face`, then to `end`."""
    return abs(difference(face, start)) + abs(difference(end, face))


def errors(pose: Pose2, goal: Pose2) -> Tuple[float, float]:
    """(distance [m], angle [rad]) by which `pose` misses `goal`."""
    return pose.distance_to(goal), difference(goal.yaw, pose.yaw)


def is_stopped(goal_state: str) -> bool:
    """Is this the text of a drive that is interrupted for a moment?"""
    return goal_state.startswith(STOPPED)


def is_over(goal_state: str) -> bool:
    """Is this the text of a drive that is over?"""
    return goal_state == GoalState.GOAL_REACHED.name or goal_state.startswith(GAVE_UP)


class Announcer:
    """Finds what is new in the status of a drive, and makes lines for the user."""

    def __init__(self, news: NewsDesk) -> None:
        self._news = news
        self._said: Tuple = ()         # the state of the last line
        self._begun = 0                # the attempt that began last
        self._begun_at = 0.0           # the time at which it began
        self._progress_at = 0.0

    def look(self, status: DriveStatus, motion: Callable[[], Optional[Motion]],
             now: float) -> bool:
        """Returns True if the status is new. A drive's progress is one line a second, too.
        `motion()`: the robot's Motion now."""
        said = (status.attempt, status.goal, status.words)
        if not status.words or said == self._said:
            if abs(now - self._progress_at) >= PROGRESS_PERIOD:
                self._progress_at = now
                if status.words in DRIVING:
                    self._news.tell(f'{status.words}: {to_go(*status.left(motion()))}')
            return False
        self._said, self._progress_at = said, now
        begins = status.begun and status.attempt != self._begun
        if begins:
            self._begun, self._begun_at = status.attempt, now
        if status.failure:
            self._news.tell(f'Goal ({status.goal}) given up: {status.failure}', True)
        elif not status.active:
            distance, angle = status.left(motion())
            self._news.tell(f'{handout.SAYS_REACHED}! {distance:.3f} m and {angle:.1f} deg off, '
                            f'after {now - self._begun_at:.1f} s')
        elif status.words in DRIVING:
            if begins:
                self._news.tell(f'Goal ({status.goal}): {to_go(*status.left(motion()))}')
            self._news.tell(status.words)
        elif is_stopped(status.words):
            self._news.tell(status.words.capitalize(), warning=True)
        else:
            hint = ' (True on ctrl_relinq)' if status.words == WAITING_FOR_CONTROL else ''
            self._news.tell(f'Goal ({status.goal}): {status.words}{hint}')
        return True
