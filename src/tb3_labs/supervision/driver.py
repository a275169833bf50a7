"""Who drives: a turn or the mouse? A table gives the driver after an event.

An event that is not in the table changes nothing: a turn that is asked for during a turn moves its
goal, and is refused while the mouse drives. At each change of the driver the robot is stopped
first, by one zero. Sources: the course's mouse lab, and the failures of nodes without such a rule.
"""
from enum import Enum


class Driver(Enum):
    """The driver of the robot, as `controller` decides."""

    NOBODY = 'nobody'
    TURN = 'turn'
    MOUSE = 'mouse'


class DriverEvent(Enum):
    """An event that may change the driver. A message of an inactive mouse is not an event."""

    TURN_ASKED = 'turn asked'
    TURN_OVER = 'turn over'
    MOUSE_MOVED = 'mouse moved'           # it is active, and outside its dead zone
    MOUSE_CENTRED = 'mouse centred'       # it is active, and inside; a turn goes on
    MOUSE_RELEASED = 'mouse released'     # once, when it is deactivated or lost


#: {(driver, event): driver after it}
DRIVERS = {
    (Driver.NOBODY, DriverEvent.TURN_ASKED): Driver.TURN,
    (Driver.NOBODY, DriverEvent.MOUSE_MOVED): Driver.MOUSE,
    (Driver.TURN, DriverEvent.TURN_OVER): Driver.NOBODY,
    (Driver.TURN, DriverEvent.MOUSE_MOVED): Driver.MOUSE,
    (Driver.TURN, DriverEvent.MOUSE_RELEASED): Driver.NOBODY,
    (Driver.MOUSE, DriverEvent.MOUSE_CENTRED): Driver.NOBODY,
    (Driver.MOUSE, DriverEvent.MOUSE_RELEASED): Driver.NOBODY,
}
