"""Who drives, who holds the robot, and to which goal does it drive?

One rule for the first two: a table gives the driver or holder after an event.

`controller` drives by a turn or by the mouse (DRIVERS); a `gamepad` holds the robot itself, or
hands it to move_to_goal (HOLDERS). An event that is not listed changes nothing: a turn that is
asked for during a turn moves its goal, and is refused while the mouse drives. At each change of the
driver the robot is stopped first, by one zero. A node that stops holding the robot sends one zero,
and is silent. A goal may wait before it is driven to, but a cancel ends it, too (`Arrivals`).

Sources: the course's mouse and gamepad labs, and the failures of nodes without such a rule.
"""
from enum import Enum
from typing import Dict, List, Tuple, TypeVar

from tb3_labs.supervision.freshness import RESUME_TIME


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
    """An event that may change the holder.

    READY: the pad is heard and its sticks are at rest (or its hold button was pressed again). So a
    stick that is already pushed does not drive at once. LOST gives the robot to nobody,
    since its operator has no stop button any more.
    """

    READY = 'pad ready'
    RELINQUISH = 'relinquish'    # this button was pressed
    REGAIN = 'regain'            # this button was pressed
    GIVEN = 'given'              # control was given by others: at a terminal, by another pad
    TAKEN = 'taken'              # control was taken by others, or by move_to_goal itself
    STOPPED = 'stopped'          # another node said False while a stick was pushed
    LOST = 'pad lost'


HOLDERS = {
    (Holder.NOBODY, HolderEvent.READY): Holder.GAMEPAD,
    (Holder.NOBODY, HolderEvent.RELINQUISH): Holder.MOVE_TO_GOAL,
    (Holder.NOBODY, HolderEvent.GIVEN): Holder.MOVE_TO_GOAL,
    (Holder.GAMEPAD, HolderEvent.RELINQUISH): Holder.MOVE_TO_GOAL,
    (Holder.GAMEPAD, HolderEvent.GIVEN): Holder.MOVE_TO_GOAL,
    (Holder.GAMEPAD, HolderEvent.STOPPED): Holder.NOBODY,
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


class Arrival:
    """A goal that has arrived at `now` [s]; it may wait, for instance for its frame.

    `name` and `stamp` [ns, sender's clock] are those of its GoalID; '' and 0 if it has none.
    """

    def __init__(self, now: float, name: str = '', stamp: int = 0) -> None:
        self.arrived_at, self.name, self.stamp = now, name, stamp
        self.refusal = ''

    def objection(self, now: float) -> str:
        """The reason why it must not be driven to; '' if there is none."""
        if self.refusal or now - self.arrived_at <= RESUME_TIME:
            return self.refusal
        return 'it waited for {:.1f} s: send it again'.format(now - self.arrived_at)


class Arrivals:
    """The goal that is driven to, and those that have arrived but wait.

    A cancel ends what arrived before it, wherever that waits: the goal that it names, the goals up
    to its stamp, or each goal if it has neither. A newer goal replaces the older ones. A goal that
    has waited for more than `RESUME_TIME` is void.
    """

    def __init__(self, present: Arrival) -> None:
        self.present = present
        self._waiting: List[Arrival] = []    # in the order of their arrival

    def add(self, goal: Arrival) -> None:
        """`goal` has arrived; to be followed by :meth:`drop`."""
        self._waiting.append(goal)

    def cancel(self, name: str = '', stamp: int = 0) -> bool:
        """A cancel has arrived. Returns True if it ends the present goal."""
        def is_meant(goal: Arrival) -> bool:
            return (goal.name == name if name else not stamp) or 0 < goal.stamp <= stamp

        for goal in filter(is_meant, self._waiting):
            goal.refusal = 'it was cancelled while its frame was awaited'
        return is_meant(self.present)

    def accept(self, goal: Arrival) -> None:
        """`goal` is driven to from now on."""
        self.present = goal
        for older in self._waiting[:self._waiting.index(goal)]:
            older.refusal = older.refusal or 'replaced by a newer goal'

    def drop(self, goal: Arrival) -> None:
        """`goal` waits no longer: it was accepted or refused."""
        self._waiting.remove(goal)
