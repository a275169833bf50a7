"""All that a user sees of a drive to a goal: settings, states, and the texts on `goal_state`.

The Transformation lab lists the states:

    ROTATE_TO_GOAL -> MOVE_FORWARD -> ROTATE_TO_FINAL -> GOAL_REACHED

Units: metres, radians. Source: the course's first move-to-goal lab.
"""
from dataclasses import dataclass
from enum import Enum
from typing import Tuple

from tb3_labs import handout
from tb3_labs.config import Config, setting
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2


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
#: A text on `goal_state` is the name of a state, WAITING_FOR_CONTROL, or one of these words and a
#: reason.
WAITING, STOPPED, GAVE_UP = 'waiting', 'stopped', 'gave up'
WAITING_FOR_CONTROL = WAITING + ' for control'


def to_go(distance: float, angle_deg: float) -> str:
    """Returns a text about the distance to the goal [m] and the angle to its heading [deg]."""
    return f'{distance:.3f} m to go, {abs(angle_deg):.1f} deg off the final heading'


def sum_of_turns(start: float, face: float, end: float) -> float:
    """Returns the sum of two turns [rad]: from yaw `start` to `face`, and from `face` to `end`."""
    return abs(difference(face, start)) + abs(difference(end, face))


def errors(pose: Pose2, goal: Pose2) -> Tuple[float, float]:
    """Returns (distance [m], angle [rad]) by which `pose` misses `goal`."""
    return pose.distance_to(goal), difference(goal.yaw, pose.yaw)


def is_stopped(goal_state: str) -> bool:
    """Does this text on `goal_state` show a drive that is interrupted for a moment?"""
    return goal_state.startswith(STOPPED)


def is_over(goal_state: str) -> bool:
    """Does this text on `goal_state` show a drive that has ended?"""
    return goal_state == GoalState.GOAL_REACHED.name or goal_state.startswith(GAVE_UP)
