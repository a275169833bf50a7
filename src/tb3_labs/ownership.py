"""Who holds the robot, as a gamepad knows it: the gamepad, move_to_goal, or nobody? One table.

    holder         event            holder then
    nobody         pad ready        gamepad
    nobody         relinquish       move_to_goal
    nobody         given            move_to_goal
    gamepad        relinquish       move_to_goal
    gamepad        given            move_to_goal
    gamepad        pad lost         nobody
    move_to_goal   regain           nobody
    move_to_goal   taken            nobody
    move_to_goal   pad lost         nobody

What is not listed changes nothing. `relinquish` and `regain` are presses of their buttons, rising
edges. `given` and `taken` are what others did: a hand, another pad, move_to_goal itself. `pad
ready` means that the pad is heard and its sticks are at rest (or, with a hold button, that this
was pressed anew). So a stick that is already pushed when the robot comes back drives nothing. A
lost pad gives the robot to nobody: an operator without a stop button is no operator. Whoever stops
holding the robot sends one zero and is silent.
Source: the Transformation lab's handout, and what happened to those who had no such rule.
"""
from enum import Enum


class Holder(Enum):
    """Who may drive."""

    NOBODY = 'nobody'
    GAMEPAD = 'gamepad'
    MOVE_TO_GOAL = 'move_to_goal'


class PadEvent(Enum):
    """What may change that."""

    READY = 'pad ready'
    RELINQUISH = 'relinquish'
    REGAIN = 'regain'
    GIVEN = 'given'
    TAKEN = 'taken'
    LOST = 'pad lost'


_RULE = {
    (Holder.NOBODY, PadEvent.READY): Holder.GAMEPAD,
    (Holder.NOBODY, PadEvent.RELINQUISH): Holder.MOVE_TO_GOAL,
    (Holder.NOBODY, PadEvent.GIVEN): Holder.MOVE_TO_GOAL,
    (Holder.GAMEPAD, PadEvent.RELINQUISH): Holder.MOVE_TO_GOAL,
    (Holder.GAMEPAD, PadEvent.GIVEN): Holder.MOVE_TO_GOAL,
    (Holder.GAMEPAD, PadEvent.LOST): Holder.NOBODY,
    (Holder.MOVE_TO_GOAL, PadEvent.REGAIN): Holder.NOBODY,
    (Holder.MOVE_TO_GOAL, PadEvent.TAKEN): Holder.NOBODY,
    (Holder.MOVE_TO_GOAL, PadEvent.LOST): Holder.NOBODY,
}


def who_holds(holder, event):
    """The Holder after `event`."""
    return _RULE.get((holder, event), holder)
