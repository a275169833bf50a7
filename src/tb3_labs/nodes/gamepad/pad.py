"""The settings and the messages of one pad. The default settings fit the pad of the course's lab.

The values of axes are from -1 to 1. As in joy_node, forward and left are positive. The time `now`
[s] is on a steady clock (:mod:`tb3_labs.nodes`). The time `stamp` [s] is on the sender's clock.
"""
import math
from dataclasses import dataclass
from typing import NamedTuple, Optional, Sequence

from tb3_labs.config import Config, setting
from tb3_labs.handout import (
    ANGULAR_AXIS, BUTTON_A, BUTTON_B, BUTTON_Y, LINEAR_AXIS, MAX_ANGULAR_SPEED)
from tb3_labs.supervision.timeouts import INPUT_TIMEOUT, MAX_TRANSIT_TIME, Freshness, Lateness

MAX_INDEX = 31    # the largest index of an axis or a button


@dataclass(frozen=True)
class PadConfig(Config):
    """The settings of a pad. The indices of axes and buttons begin at 0, as in sensor_msgs/Joy."""

    linear_axis: int = setting(LINEAR_AXIS, 'axis that drives, forward positive', '', 0, MAX_INDEX)
    angular_axis: int = setting(ANGULAR_AXIS, 'axis that turns, left positive', '', 0, MAX_INDEX)
    relinquish_button: int = setting(BUTTON_A, 'lets move_to_goal drive: A', '', 0, MAX_INDEX)
    regain_button: int = setting(BUTTON_B, 'takes it back: B', '', 0, MAX_INDEX)
    reset_button: int = setting(BUTTON_Y, 'resets the pose to (0, 0, 0): Y', '', 0, MAX_INDEX)
    hold_button: int = setting(-1, 'drives only while it is held; -1: none', '', -1, MAX_INDEX)
    dead_zone: float = setting(0.08, 'sticks nearer to their middle are at rest', low=0.0, high=0.9)
    linear_scale: float = setting(0.26, "full stick; the robot's own limit holds as well", 'm/s',
                                  low=0.01, high=1.0)
    angular_scale: float = setting(
        MAX_ANGULAR_SPEED, "full stick; the robot's own limit holds as well", 'rad/s', 0.05, 5.0)

    @property
    def has_hold(self) -> bool:
        """The pad has a hold button, and drives only while this button is pressed."""
        return self.hold_button >= 0


class PadState(NamedTuple):
    """The sticks and buttons of a pad at one moment. A stick in its dead zone has the value 0."""

    forward: float = 0.0
    left: float = 0.0
    relinquish: bool = False
    regain: bool = False
    reset: bool = False
    hold: bool = False
    axes: Sequence[float] = ()    # the numbers in the message
    buttons: Sequence[int] = ()

    @property
    def is_at_rest(self) -> bool:
        return self.forward == 0.0 and self.left == 0.0

    def presses_since(self, earlier: 'PadState') -> 'PadState':
        """Returns this state with only the buttons that were not pressed in `earlier`."""
        return self._replace(
            relinquish=self.relinquish and not earlier.relinquish,
            regain=self.regain and not earlier.regain,
            reset=self.reset and not earlier.reset, hold=self.hold and not earlier.hold)


class PadListener:
    """Finds whether the last message of a pad is current. A joy_node that repeats no message sends
    only changes of the pad's state. So a pad that has never repeated a state may be silent."""

    def __init__(self) -> None:
        self.freshness = Freshness('joy', INPUT_TIMEOUT)
        #: The latest state; None before the first message, and after a loss of the pad.
        self.state: Optional[PadState] = None
        self.has_repeated_state = False
        self.joy_node_hangs = False     # joy_node repeats one message
        self._lateness = Lateness()
        self._learning_since = math.inf    # since this time [s] the usual delay is learned
        self._last_state: Optional[PadState] = None
        self._newest_stamp = -math.inf
        self.presses = PadState()       # the buttons that the last message presses
        self.lateness = 0.0             # delay [s] of the last message
        self.came_after_loss = False    # the last message came after a loss of the pad

    def on_message(self, state: PadState, now: float, stamp: float,
                   joy_node_hangs: bool = False) -> None:
        """Use a message that was sent at `stamp`, or at an unknown time if `stamp` is 0. In the
        first message, and in a message after a loss of the pad, only the stop button counts."""
        if state == self._last_state:
            self.has_repeated_state = True
        self._last_state = state
        self._update_freshness(now, stamp, joy_node_hangs)

        is_first = math.isinf(self._learning_since)
        if is_first or (self.came_after_loss and stamp <= 0.0):
            self._learning_since = now
        previous = self.state
        if previous is None or self.came_after_loss:
            previous = state._replace(regain=False)
        self.presses = state.presses_since(previous)
        self.state = state

    def _update_freshness(self, now: float, stamp: float, joy_node_hangs: bool) -> None:
        self.joy_node_hangs = joy_node_hangs
        self.lateness = self._lateness.on_message(stamp, now)
        # a joy_node that hangs may also repeat the same few messages again and again
        is_old = stamp <= self._newest_stamp and self.lateness > INPUT_TIMEOUT
        self._newest_stamp = max(stamp, self._newest_stamp)
        self.came_after_loss = False
        if not joy_node_hangs and not is_old:
            self.came_after_loss = self.has_repeated_state and not self.freshness.is_fresh(now)
            self.freshness.on_message(now)

    def knows_lateness(self, now: float) -> bool:
        """Returns True if the usual delay of messages is known, so that `lateness` is right."""
        is_stuck = self.joy_node_hangs and not self.freshness.is_fresh(now)
        return not is_stuck and now - self._learning_since >= MAX_TRANSIT_TIME

    def is_current(self, now: float) -> bool:
        """Returns True if the last message shows the current state of the pad."""
        return self.knows_lateness(now) and self.lateness <= INPUT_TIMEOUT


def read_pad(axes: Sequence[float], buttons: Sequence[int], config: PadConfig) -> PadState:
    """Returns the PadState for axes and buttons. Raises ``ValueError`` if an index is too large."""
    needed_axes = 1 + max(config.linear_axis, config.angular_axis)
    needed_buttons = 1 + max(config.relinquish_button, config.regain_button, config.reset_button,
                             config.hold_button)
    if len(axes) < needed_axes or len(buttons) < needed_buttons:
        raise ValueError(f'{len(axes)} axes and {len(buttons)} buttons, where the parameters need '
                         f'{needed_axes} and {needed_buttons}: another kind of pad?')
    forward = axes[config.linear_axis]
    left = axes[config.angular_axis]
    if not (math.isfinite(forward) and math.isfinite(left)):
        raise ValueError(f'stick ({forward}, {left}) is not finite')
    return PadState(
        forward=_stick_speed(config.dead_zone, forward),
        left=_stick_speed(config.dead_zone, left),
        relinquish=bool(buttons[config.relinquish_button]),
        regain=bool(buttons[config.regain_button]), reset=bool(buttons[config.reset_button]),
        hold=config.has_hold and bool(buttons[config.hold_button]), axes=axes, buttons=buttons)


def _stick_speed(dead_zone: float, position: float) -> float:
    """Returns a speed that is 0 in the dead zone and grows linearly to 1 at the full stick."""
    size = min(abs(position), 1.0)
    if size <= dead_zone:
        return 0.0
    return math.copysign((size - dead_zone) / (1.0 - dead_zone), position)
