"""The states of a drive to a goal, and the texts on the topic `goal_state`.

Source: the Transformation lab, and the course's first move-to-goal lab.
"""
from enum import Enum

from tb3_labs import handout


class GoalState(Enum):
    """The states of a drive, in order."""

    ROTATE_TO_GOAL = handout.ROTATE_TO_GOAL
    MOVE_FORWARD = handout.MOVE_FORWARD
    ROTATE_TO_FINAL = handout.ROTATE_TO_FINAL
    GOAL_REACHED = handout.GOAL_REACHED


#: The names of the states in which the robot drives.
DRIVING = tuple(state.name for state in GoalState if state is not GoalState.GOAL_REACHED)
#: A text on `goal_state` is the name of a state, or begins with WAITING, STOPPED or GAVE_UP.
WAITING, STOPPED, GAVE_UP = 'waiting', 'stopped', 'gave up'
WAITING_FOR_CONTROL = WAITING + ' for control'


def is_stopped(goal_state: str) -> bool:
    """Returns True if a text on `goal_state` shows a drive that is interrupted for a moment."""
    return goal_state.startswith(STOPPED)


def is_over(goal_state: str) -> bool:
    """Returns True if a text on `goal_state` shows a drive that has ended."""
    return goal_state == GoalState.GOAL_REACHED.name or goal_state.startswith(GAVE_UP)
