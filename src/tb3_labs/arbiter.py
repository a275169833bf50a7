"""Who drives: a turn, the mouse, or nobody? One rule, as one table.

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

What is not listed changes nothing. `mouse moved` and `mouse centred` come from an active mouse,
outside and inside its dead zone; `mouse released` is the moment in which it is deactivated or
lost, not every message of a mouse that is not active. At each change the robot is stopped first,
by one zero.
"""
from enum import Enum


class Driver(Enum):
    """Who drives the robot."""

    NOBODY = 'nobody'
    TURN = 'turn'
    MOUSE = 'mouse'


class Event(Enum):
    """What may change that."""

    TURN_ASKED = 'turn asked'
    TURN_OVER = 'turn over'
    MOUSE_MOVED = 'mouse moved'
    MOUSE_CENTRED = 'mouse centred'
    MOUSE_RELEASED = 'mouse released'


_RULE = {
    (Driver.NOBODY, Event.TURN_ASKED): Driver.TURN,
    (Driver.NOBODY, Event.MOUSE_MOVED): Driver.MOUSE,
    (Driver.TURN, Event.TURN_OVER): Driver.NOBODY,
    (Driver.TURN, Event.MOUSE_MOVED): Driver.MOUSE,
    (Driver.TURN, Event.MOUSE_RELEASED): Driver.NOBODY,
    (Driver.MOUSE, Event.MOUSE_CENTRED): Driver.NOBODY,
    (Driver.MOUSE, Event.MOUSE_RELEASED): Driver.NOBODY,
}


def who_drives(driver, event):
    """The Driver after `event`."""
    return _RULE.get((driver, event), driver)
