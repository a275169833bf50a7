"""Does a pad hold the robot, or move_to_goal? A table gives the holder after an event.

A node that stops holding the robot sends one zero, and is silent. The ControlMessages of a pad tell
move_to_goal whether it may drive. Sources: the course's gamepad lab, and the failures of nodes
without such a rule.
"""
import math
from enum import Enum
from typing import List

from tb3_labs.supervision.timeouts import RENEWAL


class ControlHolder(Enum):
    """The node that may drive, as a `gamepad` knows it."""

    NOBODY = 'nobody'
    GAMEPAD = 'gamepad'
    MOVE_TO_GOAL = 'move_to_goal'


class ControlEvent(Enum):
    """An event that may change the holder.

    READY: the pad is heard and its sticks are at rest (or its hold button was pressed again). In
    LOST nobody may drive, since the operator has no stop button any more.
    """

    READY = 'pad ready'
    RELINQUISH = 'relinquish'    # this button was pressed
    REGAIN = 'regain'            # this button was pressed
    GRANTED = 'granted'          # control was given elsewhere: at a terminal, by another pad
    TAKEN = 'taken'              # control was taken elsewhere, or by move_to_goal itself
    STOPPED = 'stopped'          # another node sent False while a stick was pushed
    LOST = 'pad lost'


#: {(holder, event): holder after it}. An event that is not here changes nothing.
NEXT_HOLDER = {
    (ControlHolder.NOBODY, ControlEvent.READY): ControlHolder.GAMEPAD,
    (ControlHolder.NOBODY, ControlEvent.RELINQUISH): ControlHolder.MOVE_TO_GOAL,
    (ControlHolder.NOBODY, ControlEvent.GRANTED): ControlHolder.MOVE_TO_GOAL,
    (ControlHolder.GAMEPAD, ControlEvent.RELINQUISH): ControlHolder.MOVE_TO_GOAL,
    (ControlHolder.GAMEPAD, ControlEvent.GRANTED): ControlHolder.MOVE_TO_GOAL,
    (ControlHolder.GAMEPAD, ControlEvent.STOPPED): ControlHolder.NOBODY,
    (ControlHolder.GAMEPAD, ControlEvent.LOST): ControlHolder.NOBODY,
    (ControlHolder.MOVE_TO_GOAL, ControlEvent.REGAIN): ControlHolder.NOBODY,
    (ControlHolder.MOVE_TO_GOAL, ControlEvent.TAKEN): ControlHolder.NOBODY,
    (ControlHolder.MOVE_TO_GOAL, ControlEvent.LOST): ControlHolder.NOBODY,
}


class ControlMessages:
    """The messages of one pad for `ctrl_relinq`: True gives the robot to move_to_goal, False takes
    it. A pad that has just started sends nothing: no person has pressed anything."""

    def __init__(self) -> None:
        #: Does move_to_goal have control by this pad? Then the pad must renew its permission.
        self.grants = False
        self._waiting: List[bool] = []
        #: Time of the last True without an answer of move_to_goal [s].
        self.given_at = -math.inf
        self._sent_at = -math.inf       # time of the last message, or renewal
        #: Time at which control was taken from move_to_goal, by anyone [s].
        self.stopped_at = -math.inf

    def pop_all(self) -> List[bool]:
        """The messages since the last call."""
        messages, self._waiting = self._waiting, []
        return messages

    def renews(self, now: float) -> bool:
        """Is a renewal due? If so, it is assumed to be sent."""
        is_due = self.grants and now - self._sent_at >= RENEWAL
        if is_due:
            self._sent_at = now
        return is_due

    def grant(self, now: float, lateness: float) -> None:
        """Queue a True, by a press that was delayed by `lateness` [s]. A renewal for each `RENEWAL`
        since the press shows its age."""
        self.grants, self.given_at, self._sent_at = True, now, now
        self._waiting += [True] * (1 + int(lateness / RENEWAL))

    def stop(self, caused_at: float) -> None:
        """Queue a False, for any holder: control was taken, or the pad lost, at `caused_at`."""
        self.grants = False
        self.stopped_at = max(self.stopped_at, caused_at)    # a late B is older than a loss
        self._waiting.append(False)
