"""Who drives, who holds the robot? One rule: a table gives the driver or holder after an event.

The table of `controller`, which drives by a turn or by the mouse:

    driver   event             driver then
    nobody   turn asked        turn
    nobody   mouse moved       mouse
    turn     turn asked        turn     (its goal is moved)
    turn     turn over         nobody
    turn     mouse moved       mouse    (the turn is given up)
    turn     mouse centred     turn     (a mouse at rest leaves it alone)
    turn     mouse released    nobody   (the turn is given up)
    mouse    turn asked        mouse    (refused)
    mouse    mouse centred     nobody
    mouse    mouse released    nobody

`mouse moved` and `mouse centred` come from an active mouse, outside and inside its dead zone.
`mouse released` happens once, when the mouse is deactivated or lost; further messages of a mouse
that is not active are no events. At each change the robot is stopped first, by one zero.

The table of `gamepad`, which holds the robot itself or hands it over:

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

`relinquish` and `regain` are presses of their buttons, rising edges. `given` and `taken` come from
others: a person at a terminal, another pad, move_to_goal itself. `pad ready` means that the pad is
heard and its sticks are at rest (or, with a hold button, that this button was pressed again). So a
stick that is already pushed when the robot comes back drives nothing. A lost pad gives the robot to
nobody, since its operator has no stop button any more. A node that stops holding the robot sends
one zero and is silent.

An event that is not listed changes nothing.
Sources: the handouts of both labs, and the failures of nodes without such a rule.
"""
from enum import Enum
from typing import Dict, Tuple, TypeVar


class Driver(Enum):
    """The driver of the robot, as `controller` decides."""

    NOBODY = 'nobody'
    TURN = 'turn'
    MOUSE = 'mouse'


class DriverEvent(Enum):
    """An event that may change that."""

    TURN_ASKED = 'turn asked'
    TURN_OVER = 'turn over'
    MOUSE_MOVED = 'mouse moved'
    MOUSE_CENTRED = 'mouse centred'
    MOUSE_RELEASED = 'mouse released'


DRIVERS = {
    (Driver.NOBODY, DriverEvent.TURN_ASKED): Driver.TURN,
    (Driver.NOBODY, DriverEvent.MOUSE_MOVED): Driver.MOUSE,
    (Driver.TURN, DriverEvent.TURN_OVER): Driver.NOBODY,
    (Driver.TURN, DriverEvent.MOUSE_MOVED): Driver.MOUSE,
    (Driver.TURN, DriverEvent.MOUSE_RELEASED): Driver.NOBODY,
    (Driver.MOUSE, DriverEvent.MOUSE_CENTRED): Driver.NOBODY,
    (Driver.MOUSE, DriverEvent.MOUSE_RELEASED): Driver.NOBODY,
}


class Holder(Enum):
    """The node that may drive, as a `gamepad` knows it."""

    NOBODY = 'nobody'
    GAMEPAD = 'gamepad'
    MOVE_TO_GOAL = 'move_to_goal'


class HolderEvent(Enum):
    """An event that may change that."""

    READY = 'pad ready'
    RELINQUISH = 'relinquish'
    REGAIN = 'regain'
    GIVEN = 'given'
    TAKEN = 'taken'
    LOST = 'pad lost'


HOLDERS = {
    (Holder.NOBODY, HolderEvent.READY): Holder.GAMEPAD,
    (Holder.NOBODY, HolderEvent.RELINQUISH): Holder.MOVE_TO_GOAL,
    (Holder.NOBODY, HolderEvent.GIVEN): Holder.MOVE_TO_GOAL,
    (Holder.GAMEPAD, HolderEvent.RELINQUISH): Holder.MOVE_TO_GOAL,
    (Holder.GAMEPAD, HolderEvent.GIVEN): Holder.MOVE_TO_GOAL,
    (Holder.GAMEPAD, HolderEvent.LOST): Holder.NOBODY,
    (Holder.MOVE_TO_GOAL, HolderEvent.REGAIN): Holder.NOBODY,
    (Holder.MOVE_TO_GOAL, HolderEvent.TAKEN): Holder.NOBODY,
    (Holder.MOVE_TO_GOAL, HolderEvent.LOST): Holder.NOBODY,
}

State = TypeVar('State')
Event = TypeVar('Event')


def after(table: Dict[Tuple[State, Event], State], now: State, event: Event) -> State:
    """The driver or holder after `event`, by `table` (DRIVERS or HOLDERS)."""
    return table.get((now, event), now)
