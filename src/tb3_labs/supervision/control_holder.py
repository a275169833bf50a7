"""Decides whether a pad or move_to_goal drives. A table gives the next holder after each event.

A node that loses the robot sends one zero command, and then no other. Source: the gamepad lab.
"""
import math
from enum import Enum

from tb3_labs.supervision.events import Queue
from tb3_labs.supervision.timeouts import RENEWAL_PERIOD


class ControlHolder(Enum):
    """The node that may drive, as far as one `gamepad` node knows."""

    NOBODY = 'nobody'
    GAMEPAD = 'gamepad'
    MOVE_TO_GOAL = 'move_to_goal'


class ControlEvent(Enum):
    """An event that may change the holder. With a lost pad, a person cannot stop the robot."""

    # the pad sends messages. Its sticks rest, or its hold button was pressed again
    READY = 'pad ready'
    RELINQUISH = 'relinquish'    # the relinquish button was pressed
    REGAIN = 'regain'            # the regain button was pressed
    GRANTED = 'granted'          # a terminal or another pad gave control
    TAKEN = 'taken'              # another node, or move_to_goal itself, took control
    STOPPED = 'stopped'          # another node sent False while a stick was pushed
    LOST = 'pad lost'


#: The next holder for each (holder, event). All other events do not change the holder.
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
    """The messages of one pad on `ctrl_relinq`. A True gives the robot to move_to_goal, and a False
    takes the robot back. A pad sends a message only after a person has pressed a button."""

    def __init__(self) -> None:
        self.must_renew = False    # this pad has given a permission, and must renew it
        self.waiting: Queue[bool] = Queue()    # messages to publish
        #: Time [s] of a True that move_to_goal has not obeyed yet; -inf if there is none.
        self.unconfirmed_since = -math.inf
        self._sent_at = -math.inf      # time [s] of the latest message or renewal
        self.stopped_at = -math.inf    # time [s] of the latest stop by this pad or another node

    def pop_renewal(self, now: float) -> bool:
        """Returns True if the caller must send a renewal now."""
        is_due = self.must_renew and now - self._sent_at >= RENEWAL_PERIOD
        if is_due:
            self._sent_at = now
        return is_due

    def grant(self, now: float, lateness: float) -> None:
        """Queue a True for a button press that was delayed by `lateness` [s]. Also queue a renewal
        for each `RENEWAL_PERIOD` of this delay, because move_to_goal finds the delay from them."""
        self.must_renew = True
        self.unconfirmed_since = now
        self._sent_at = now
        missed_renewals = int(lateness / RENEWAL_PERIOD)
        self.waiting.extend([True] * (1 + missed_renewals))

    def confirm_grant(self) -> None:
        """Store that move_to_goal has obeyed the latest True."""
        self.unconfirmed_since = -math.inf

    def stop(self, caused_at: float) -> None:
        """Queue a False, because control was taken or the pad was lost at `caused_at` [s]."""
        self.must_renew = False
        self.stopped_at = max(self.stopped_at, caused_at)    # a delayed press may be older
        self.waiting.append(False)
