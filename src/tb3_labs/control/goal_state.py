"""The states of a drive to a goal, as the Transformation lab lists them, and the words of
`goal_state`.

    ROTATE_TO_GOAL -> MOVE_FORWARD -> ROTATE_TO_FINAL -> GOAL_REACHED

Source: the Transformation lab's handout.
"""
from enum import Enum


class GoalState(Enum):
    """The state of a drive."""

    ROTATE_TO_GOAL = 'ROTATE_TO_GOAL'
    MOVE_FORWARD = 'MOVE_FORWARD'
    ROTATE_TO_FINAL = 'ROTATE_TO_FINAL'
    GOAL_REACHED = 'GOAL_REACHED'


#: Names of the states in which the robot drives, in order.
DRIVING = tuple(state.name for state in GoalState if state is not GoalState.GOAL_REACHED)
#: `goal_state` is the name of a state, WAITING_FOR_CONTROL, or one of these words and the reason.
WAITING, STOPPED, GAVE_UP = 'waiting', 'stopped', 'gave up'
WAITING_FOR_CONTROL = WAITING + ' for control'


def to_go(distance: float, angle_deg: float) -> str:
    """What is left of a drive [m, deg]. While the robot turns towards its goal the second number may
    grow: it is the turn that is left at the end."""
    return '{:.3f} m to go, {:.1f} deg off the final heading'.format(distance, abs(angle_deg))


def with_reason(word: str, reason: str) -> str:
    """The text of `goal_state` for one of WAITING, STOPPED, GAVE_UP and its reason."""
    return '{}: {}'.format(word, reason)


def is_stopped(goal_state: str) -> bool:
    """Is a drive interrupted for a moment?"""
    return goal_state.startswith(STOPPED)


def is_over(goal_state: str) -> bool:
    """Is it the end of a drive?"""
    return goal_state == GoalState.GOAL_REACHED.name or goal_state.startswith(GAVE_UP)
