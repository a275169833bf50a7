"""Finds the velocity that a mouse asks for, and whether the mouse is active or lost.

Positions of the mouse are from -1 to 1. x is positive to the right, y upwards. Speeds are in m/s
and rad/s. The time `now` [s] is on a steady clock (:mod:`tb3_labs.nodes`). Source: the mouse lab.
"""
import math
from collections import defaultdict
from typing import DefaultDict, NamedTuple, Optional

from tb3_labs.geometry.angles import clamp
from tb3_labs.handout import MOUSE_DEAD_ZONE, MOUSE_FULL
from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.supervision.events import IncomingMessage, LogQueue, Novelty
from tb3_labs.supervision.timeouts import INPUT_TIMEOUT, MAX_TRANSIT_TIME, Freshness, Lateness

REMEDY_OF_LOST_MOUSE = 'move it to the middle of the screen to use it again'


class MouseState(NamedTuple):
    is_active: bool
    x: float
    y: float


def to_mouse(message) -> MouseState:
    """Returns the MouseState of a MouseController. Raises ``ValueError`` for NaN or infinity."""
    x, y = message.xPos, message.yPos
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError(f'mouse position ({x}, {y}) is not finite')
    return MouseState(message.status.data, x, y)


class Mouse:
    """Finds whether one mouse is active or lost. An active mouse repeats its messages."""

    def __init__(self) -> None:
        self.freshness = Freshness('mouse', INPUT_TIMEOUT)
        self.is_reported_active = False       # by the last message
        self.is_lost = True
        self._silence_ended_at = -math.inf    # end [s] of the last silence or delay
        self._lateness = Lateness()

    @property
    def is_active(self) -> bool:
        return self.is_reported_active and not self.is_lost

    def on_message(self, message: 'IncomingMessage[MouseState]', asks_for_stop: bool) -> None:
        """`asks_for_stop` is True for an inactive mouse, or in the middle of the screen."""
        now = message.arrived_at
        is_active = message.content.is_active
        is_first = self.freshness.count == 0    # then the state before this message is unknown
        was_active = is_active if is_first else self.is_reported_active
        was_inactive = not is_first and not was_active
        if was_inactive and self._is_steady(now):
            self.is_lost = False
        self._store_silence(message, was_active)
        if message.novelty is not Novelty.SAME_STAMP:
            self.freshness.on_message(now)
        self.is_reported_active = is_active
        if asks_for_stop and self._is_steady(now):
            self.is_lost = False

    def _store_silence(self, message: 'IncomingMessage[MouseState]', was_active: bool) -> None:
        now = message.arrived_at
        is_late = self._lateness.on_message(message.sent_at, now) > INPUT_TIMEOUT
        was_silent = was_active and not self.freshness.is_fresh(now)    # inactive mice are silent
        if is_late or was_silent:
            self._silence_ended_at = now
        if is_late and message.content.is_active:
            self.is_lost = True

    def _is_steady(self, now: float) -> bool:
        return now - self._silence_ended_at >= MAX_TRANSIT_TIME

    def lose(self, now: float) -> None:
        self.is_lost = True
        self._silence_ended_at = now


class Mice:
    """Finds whether a mouse is active, and which velocity this mouse asks for.

    A mouse is treated as lost at the start, and after a sleep of this process. An active mouse that
    is silent is also lost. A lost mouse stays inactive until the user deactivates this mouse, or
    moves it to the middle of the screen. A message that is delayed, or that follows a silence, does
    not activate a mouse.

    Several mice may be connected. The latest sender drives. If one mouse is
    lost or deactivated, all others are lost, too, since a user may have forgotten an active mouse.
    """

    def __init__(self, log: LogQueue) -> None:
        self._log = log
        self.freshness = Freshness('mouse_info', INPUT_TIMEOUT)    # all mice together
        #: An active mouse asks for this velocity, which is zero in the middle of the screen.
        self.twist = Twist2()
        self._mice: DefaultDict[str, Mouse] = defaultdict(Mouse)
        self._loss_is_logged = False

    @property
    def is_active(self) -> bool:
        """Returns True if at least one mouse is active and not lost."""
        return any(mouse.is_active for mouse in self._mice.values())

    def on_message(self, message: 'IncomingMessage[MouseState]') -> str:
        """Use the message of a mouse. Returns the reason why the message stops the robot, or ''. A
        deactivation stops the robot even if the mouse was lost."""
        was_active = self.is_active
        is_deactivated = self._update(message)
        if self.is_active:
            if not was_active:
                self._log.add('The mouse is active: it drives outside the middle of the screen; '
                              'scroll up to stop')
            return ''
        if not message.content.is_active:
            self._loss_is_logged = False
            must_stop = was_active or is_deactivated
            return 'the mouse was deactivated' if must_stop else ''
        # the message reports an active mouse, but the mouse is treated as lost
        if was_active:
            self._loss_is_logged = True
            return 'messages of the mouse are late: ' + REMEDY_OF_LOST_MOUSE
        if not self._loss_is_logged:
            self._loss_is_logged = True
            self._log.add('The mouse was active before: ' + REMEDY_OF_LOST_MOUSE)
        return ''

    def _update(self, message: 'IncomingMessage[MouseState]') -> bool:
        """Update the mouse that sent the message. Returns True if the message deactivates it."""
        is_active, x, y = message.content
        twist = Twist2(linear=_speed(y), angular=_speed(-x))
        mouse = self._mice[message.sender]
        was_active = mouse.is_active
        is_deactivated = mouse.is_reported_active and not is_active
        self.freshness.on_message(message.arrived_at)
        mouse.on_message(message, asks_for_stop=not is_active or twist == Twist2())
        if mouse.is_active:
            self.twist = twist
        is_newly_lost = was_active and not mouse.is_active
        if is_deactivated or is_newly_lost:
            self.lose(message.arrived_at, current_mouse=mouse)
        return is_deactivated

    def lose_if_silent(self, now: float, has_slept: bool = False) -> str:
        """Treat all mice as lost if an active mouse is silent, or if this process has just slept.
        Returns a text about the silent active mouse; '' if no active mouse is silent."""
        silent_mice = [mouse for mouse in self._mice.values()
                       if mouse.is_active and not mouse.freshness.is_fresh(now)]
        if has_slept or silent_mice:
            self.lose(now)
        if not silent_mice:
            return ''
        self._loss_is_logged = True
        return f'{silent_mice[0].freshness.silence_text(now)}: {REMEDY_OF_LOST_MOUSE}'

    def lose(self, now: float, current_mouse: Optional[Mouse] = None) -> None:
        """Treat all mice except `current_mouse` as lost."""
        for mouse in self._mice.values():
            if mouse is not current_mouse:
                mouse.lose(now)


def _speed(position: float) -> float:
    """Returns 0 in the dead zone and on its edge, else MOUSE_FULL times the position."""
    if abs(position) <= MOUSE_DEAD_ZONE:
        return 0.0
    return MOUSE_FULL * clamp(position, -1.0, 1.0)
