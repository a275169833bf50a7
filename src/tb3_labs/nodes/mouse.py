"""Turns positions of the mouse into a velocity.

Units: positions from -1 to 1, x to the right, y up; speeds in m/s and rad/s, left positive; seconds
on a clock that never stands still and never goes back (`now`), since a person moves the mouse.
Source: the course's mouse lab.
"""
import math
from collections import defaultdict
from typing import DefaultDict, Dict, Set

from tb3_labs.control.speed_laws import Twist2
from tb3_labs.geometry.angles import clamp
from tb3_labs.localization.sender_clock import Lateness
from tb3_labs.supervision.freshness import Freshness
from tb3_labs.supervision.permission import WAKING

#: An active mouse that is silent for longer than this is lost [s].
MOUSE_TIMEOUT = 0.2
#: Within this distance of the middle of the screen, in each direction, the mouse asks for zero.
MOUSE_DEAD_ZONE = 0.25
#: The edge of the screen asks for this [m/s], [rad/s]; the robot clips it to its own limit.
MOUSE_FULL = 0.5


class Mouse:
    """Knows whether the mouse is active, and the velocity that it asks for.

    A mouse counts as lost at first, when it falls silent while it is active, and when this process
    slept. It then stays inactive until it is in the middle of the screen, or is deactivated.
    Messages that the network delayed, or that came together after a silence, do not end the loss. A
    deactivation always counts as a stop.

    Several mice may be heard. A mouse that is deactivated stops all: the others do not count until
    they are in the middle, or deactivated.
    """

    def __init__(self) -> None:
        self.source = Freshness('mouse', MOUSE_TIMEOUT)
        self.active = False
        #: The velocity that an active mouse asks for; zero in the middle of the screen.
        self.twist = Twist2()
        self._is_lost = True
        self._back_at = -math.inf    # end of the last silence
        self._repeats = False        # was it active? An active mouse repeats itself
        # by sender: its usual delay, and its last stamp
        self._lateness: DefaultDict[str, Lateness] = defaultdict(Lateness)
        self._stamps: Dict[str, float] = {}
        # senders whose last message was active, and senders that another mouse has stopped
        self._switched_on: Set[str] = set()
        self._stopped: Set[str] = set()

    def heard(self, active: bool, x: float, y: float, now: float, sender: str = '',
              stamp: float = 0.0) -> bool:
        """A message arrived, sent at `stamp` [s, sender's clock; 0: unknown]. Returns True if it
        deactivates a mouse, also a lost one. This is a stop.

        ``ValueError`` for a position that is not finite.
        """
        twist = mouse_twist(x, y)
        at_rest = not active or twist == Twist2()
        deactivated = not active and sender in self._switched_on
        if deactivated:
            self._switched_on.discard(sender)
            self._stopped = set(self._switched_on)
        elif active:
            self._switched_on.add(sender)
        if at_rest:
            self._stopped.discard(sender)
        elif sender in self._stopped:
            return False
        if self.source.count and not self._repeats and now - self._back_at >= WAKING:
            self._is_lost = False    # it was inactive until now
        stands_still = stamp == self._stamps.get(sender, 0.0)    # then it is not a time
        self._stamps[sender] = stamp
        if not stands_still and self._lateness[sender].of(stamp, now) > MOUSE_TIMEOUT:
            self._back_at = now
            self._is_lost = self._is_lost or active
        elif not self.source.is_fresh(now) and (self._repeats or not self.source.count and active):
            self._back_at = now
        self.source.heard(now)
        self._repeats = active
        if at_rest and now - self._back_at >= WAKING:
            self._is_lost = False
        self.active = active and not self._is_lost
        if self.active:
            self.twist = twist
        return deactivated

    def is_silent(self, now: float) -> bool:
        """Is the mouse active, but silent?"""
        return self.active and not self.source.is_fresh(now)

    def lose(self, now: float) -> None:
        """The mouse is lost, and no longer active."""
        self.active, self._is_lost, self._back_at = False, True, now


def mouse_twist(x: float, y: float) -> Twist2:
    """The velocity that a mouse at (x, y) asks for; ``ValueError`` if they are not finite.

    Each direction has its own dead zone, the closed interval +/-MOUSE_DEAD_ZONE. Outside of it
    the position counts from the middle. A position beyond the screen's edge counts as at the edge.
    """
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError('mouse position ({}, {}) is not finite'.format(x, y))
    return Twist2(_scaled(y), _scaled(-x))


def _scaled(position: float) -> float:
    if abs(position) <= MOUSE_DEAD_ZONE:
        return 0.0
    return MOUSE_FULL * clamp(position, -1.0, 1.0)
