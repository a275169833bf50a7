"""One pad: the messages that are heard from it, and those that it sends on `ctrl_relinq`.

Units: axes from -1 to 1, forward and left positive (as joy_node sends them). Seconds on a clock
that never stands still and never goes back (`now`); `stamp` is on the sender's clock.
"""
import math
from typing import List, NamedTuple, Optional, Sequence, Tuple

from tb3_labs.localization.sender_clock import Lateness
from tb3_labs.nodes.pad_config import PadConfig
from tb3_labs.supervision.freshness import Freshness
from tb3_labs.supervision.permission import LONGEST_LAPSE, RENEWAL

#: A pad that is silent for longer than this is lost [s].
PAD_TIMEOUT = 0.25
#: The lateness of a message is known after a pad has been heard for this long [s].
LATENESS_SHOWS = 0.3
#: A message of move_to_goal this soon after a press of A may be older than the press [s].
CROSSING = 0.3


class PadState(NamedTuple):
    """A pad at one moment: sticks after their dead zone, and buttons pressed."""

    forward: float = 0.0
    left: float = 0.0
    relinquish: bool = False
    regain: bool = False
    reset: bool = False
    hold: bool = False

    @property
    def at_rest(self) -> bool:
        """Are both sticks in their middle?"""
        return self.forward == 0.0 and self.left == 0.0


class PadMessage(NamedTuple):
    """One message of a pad."""

    state: PadState
    before: PadState         # the state of the message before it
    lateness: float          # its delay [s]
    came_after_loss: bool


class PadListener:
    """Reads the sticks and buttons of one pad, and says whether they are current.

    joy_node sends only changes unless its autorepeat_rate is set: the silence of a pad that has
    never repeated itself does not show a loss.
    """

    def __init__(self, config: PadConfig) -> None:
        self.source = Freshness('joy', PAD_TIMEOUT)
        #: The latest state; None before the first message, and after a loss.
        self.state: Optional[PadState] = None
        #: Does the pad repeat an unchanged state?
        self.repeats = False
        self._config = config
        self._lateness = Lateness()
        self._heard_since = math.inf     # from then on the lateness of messages is learned
        self._is_late = False
        self._last: Optional[Tuple[Sequence[float], Sequence[int]]] = None    # its axes and buttons

    def hear(self, axes: Sequence[float], buttons: Sequence[int], now: float,
             stamp: float) -> PadMessage:
        """Take in a message, sent at `stamp` (0: unknown); ``ValueError`` for another kind of pad.

        A button that is down in the first message may have been pressed long ago, and counts as
        pressed now only if it is a stop.
        """
        state = read_pad(axes, buttons, self._config)
        self.repeats = self.repeats or (axes, buttons) == self._last
        self._last = axes, buttons
        lateness = self._lateness.of(stamp, now) if stamp > 0.0 else 0.0
        came_after_loss = self.repeats and not self.source.is_fresh(now)
        self.source.heard(now)
        if math.isinf(self._heard_since) or (came_after_loss and stamp <= 0.0):
            self._heard_since = now
        self._is_late = lateness > PAD_TIMEOUT
        before, self.state = self.state, state
        if before is None or came_after_loss:
            before = state._replace(regain=False)
        return PadMessage(state, before, lateness, came_after_loss)

    def tells_lateness(self, now: float) -> bool:
        """Has the pad been heard for long enough to know how late a message is?"""
        return now - self._heard_since >= LATENESS_SHOWS

    def is_current(self, now: float) -> bool:
        """Does the last message show the present state of the pad?"""
        return self.tells_lateness(now) and not self._is_late


def read_pad(axes: Sequence[float], buttons: Sequence[int], config: PadConfig) -> PadState:
    """The PadState of a message's axes and buttons; ``ValueError`` for another kind of pad."""
    needed_axes = 1 + max(config.linear_axis, config.angular_axis)
    needed_buttons = 1 + max(config.relinquish_button, config.regain_button, config.reset_button,
                             config.hold_button)
    if len(axes) < needed_axes or len(buttons) < needed_buttons:
        raise ValueError('{} axes and {} buttons, where the parameters need {} and {}: another '
                         'kind of pad?'.format(len(axes), len(buttons), needed_axes,
                                               needed_buttons))
    forward, left = axes[config.linear_axis], axes[config.angular_axis]
    if not (math.isfinite(forward) and math.isfinite(left)):
        raise ValueError('stick ({}, {}) is not finite'.format(forward, left))
    return PadState(
        _outside(config.dead_zone, forward), _outside(config.dead_zone, left),
        relinquish=bool(buttons[config.relinquish_button]),
        regain=bool(buttons[config.regain_button]), reset=bool(buttons[config.reset_button]),
        hold=config.has_hold and bool(buttons[config.hold_button]))


def _outside(dead_zone: float, position: float) -> float:
    """0 inside the dead zone; linear from its edge to the full stick."""
    size = min(abs(position), 1.0)
    if size <= dead_zone:
        return 0.0
    return math.copysign((size - dead_zone) / (1.0 - dead_zone), position)


class ControlMessages:
    """The messages of one pad for `ctrl_relinq`: True gives the robot to move_to_goal, False takes
    it. The first one is False: a pad that has just started gives nothing.
    """

    def __init__(self) -> None:
        #: Does move_to_goal have control by this pad? Then the pad must renew its permission.
        self.gives = False
        self._waiting = [False]
        self._given_at = -math.inf      # time of the last unanswered True
        #: Time at which control was taken from move_to_goal, by anyone [s].
        self.stopped_at = -math.inf

    def take(self) -> List[bool]:
        messages, self._waiting = self._waiting, []
        return messages

    def give(self, now: float, lateness: float) -> None:
        """Queue a True, by a press that was delayed by `lateness` [s].

        The renewals that were due since the press are added, so that they show its age.
        """
        self.gives, self._given_at = True, now
        self._waiting += [True] * (1 + int(lateness / RENEWAL))

    def stop(self, caused_at: float) -> None:
        """Queue a False, for any holder: the operator's press at `caused_at`, or the pad's loss."""
        self.gives = False
        self.stopped_at = max(self.stopped_at, caused_at)    # a late B is older than a loss
        self._waiting.append(False)

    def end(self) -> None:
        """Queue a False if this pad gave control, since another node took it."""
        if self.gives:
            self.gives = False
            self._waiting.append(False)

    def move_to_goal_has_control(self) -> None:
        """move_to_goal says that it has control, so it has heard the True."""
        self._given_at = -math.inf

    def crossed(self, now: float) -> bool:
        """Was the last True so recent that a "no control" of move_to_goal may be older?"""
        return now - self._given_at < CROSSING

    def too_late(self, now: float, lateness: float) -> bool:
        """Is a press of A that was delayed by `lateness` [s] too old, or was control taken since?
        """
        return lateness > LONGEST_LAPSE or now - lateness < self.stopped_at
