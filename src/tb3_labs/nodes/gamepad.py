"""Everything `gamepad` decides, without ROS: who holds the robot, and what the sticks command.

Messages of the pad go in with the time of their arrival; :meth:`GamepadCore.command` says what to
send. None means: be silent (after one zero, if the robot was being driven). Every press of a button
counts, also where several messages arrive together: the operator's words for `ctrl_relinq` are
collected in order, see :meth:`GamepadCore.take_words`.

B always says False, whoever holds the robot and however that came about. A says True; what merely
keeps that alive is a renewal, which is the node's. A press of A that the network held up for long
does not count.

A pad that is silent while the robot depends on it is lost: while its stick is off the middle, and
while move_to_goal drives by its permission. joy_node sends only changes unless its autorepeat_rate
is set, so a stick held still looks the same as a lost pad; which of the two it is cannot be told,
and both stop the robot.

Units: seconds on a clock that never stands still and never goes back (`now`), m/s, rad/s.
"""
import math

from tb3_labs.control.speed_laws import Twist2, saturate
from tb3_labs.localization.sender_clock import Lateness
from tb3_labs.news import NewsDesk
from tb3_labs.nodes.pad import read_pad
from tb3_labs.supervision.arbitration import HOLDERS, Holder, HolderEvent, after
from tb3_labs.supervision.freshness import Freshness
from tb3_labs.supervision.permission import LONGEST_LAPSE, RENEWAL

#: A pad that is silent for this long is lost [s].
PAD_TIMEOUT = 0.25
#: After taking the robot back the pad waits until move_to_goal has stopped [s].
HAND_OVER = 0.15
#: How late a message is shows when a pad has been heard for this long [s].
WAKING = 0.3
#: What move_to_goal says this soon after A may have been said before it heard of it [s].
CROSSING = 0.3


class GamepadCore:
    """One pad, one robot."""

    def __init__(self, config, model):
        """`config`: a pad.PadConfig; `model`: a turtlebot3.RobotModel."""
        self.holder = Holder.NOBODY
        #: Has move_to_goal control by this pad's permission, which must be renewed?
        self.gives = False
        self.joy = Freshness('joy', PAD_TIMEOUT)
        self._config = config
        self._model = model
        self._lateness = Lateness(LONGEST_LAPSE)
        self._heard_since = None     # from here on it is known how late its messages are
        self._is_late = False
        self._looked_at = 0.0
        self._given_at = 0.0
        self._stopped_at = -math.inf    # when somebody did what took control from move_to_goal
        self._state = None           # the last PadState; None before it, and after a loss
        self._repeats = False        # does the pad send what has not changed?
        self._last_message = None
        self._is_new = False
        self._resets = 0
        self._words = [False]
        self._silent_until = 0.0
        desk = NewsDesk()
        #: Takes the News since the last call.
        self.take_news = desk.take
        self._tell = desk.tell

    # -- what comes in

    def on_joy(self, axes, buttons, now, stamp=0.0):
        """Take a message of the pad in, sent at `stamp` [s, sender's clock; 0: unknown].

        ``ValueError`` where it is none of this kind of pad.
        """
        state = read_pad(axes, buttons, self._config)
        lateness = self._lateness.of(stamp, now) if stamp > 0.0 else 0.0
        self._repeats = self._repeats or (axes, buttons) == self._last_message
        self._last_message = axes, buttons
        was_lost = self._repeats and not self.joy.is_fresh(now)
        self.joy.heard(now)
        if was_lost:
            self._state = None
        if self._heard_since is None or (was_lost and stamp <= 0.0):
            self._heard_since = now
        self._is_late = lateness > PAD_TIMEOUT
        # What is pressed at first was not pressed now. A stop counts all the same.
        before = self._state or state._replace(regain=False)
        self._state, self._is_new = state, True
        if state.regain and not before.regain:
            self._press(HolderEvent.REGAIN, now, now - lateness)
        elif state.relinquish and not before.relinquish and not state.regain:
            self._relinquish(now, lateness)
        if self._is_known(now) and self._is_ready(state, before):
            self._happens(HolderEvent.READY, now)
        elif was_lost and self.holder is Holder.GAMEPAD:
            self._happens(HolderEvent.LOST, now)    # nobody depended on it, until now
        self._resets += state.reset and not before.reset

    def on_control(self, granted, now):
        """move_to_goal says that it has control now, or that it has none."""
        if granted:
            self._given_at = -math.inf    # it has heard of it
            self._happens(HolderEvent.GIVEN, now)
        elif now - self._given_at >= CROSSING:
            self._happens(HolderEvent.TAKEN, now)

    def on_taken(self, now):
        """Somebody else took control from move_to_goal, which this pad may have given.

        What others gave is over when move_to_goal says so: who knows which of both was said last.
        """
        self._stopped_at = now
        if self.gives:
            self._happens(HolderEvent.TAKEN, now)

    def look_at_clock(self, now):
        """To be called again and again: a pad at rest is ready as soon as it is known for long
        enough, and a process that slept does not go on giving."""
        if self.holder is Holder.NOBODY and self._state and self._state.at_rest and (
                not self._has_hold and self._is_known(now)):
            self._happens(HolderEvent.READY, now)
        before, self._looked_at = self._looked_at, now
        if self.gives and now - before > LONGEST_LAPSE:
            self._tell('This node did not run for {:.1f} s: press A to let move_to_goal drive '
                       'again'.format(now - before), warning=True)
            self.on_taken(now)

    def take_reset(self):
        """Was the reset button pressed since the last call?"""
        presses, self._resets = self._resets, 0
        return presses > 0

    # -- what comes out

    def take_words(self):
        """What is to be said on `ctrl_relinq` since the last call, in order: True and False."""
        words, self._words = self._words, []
        return words

    @property
    def watched(self):
        """Must somebody look at the clock, even if no message arrives?"""
        return self.gives or self._drives() or (
            self._state is not None and self.holder is Holder.NOBODY)

    def due(self, now):
        """Is it time for :meth:`command`?"""
        return self._is_new or self._is_lost(now)

    def command(self, now):
        """The Twist2 to send now, or None: silence."""
        self._is_new = False
        if self._is_lost(now):
            self._state = None
            self._tell_loss(now)
            self._press(HolderEvent.LOST, now, now)
        if not self._drives() or now < self._silent_until:
            return None
        asked = Twist2(self._state.forward * min(self._config.linear_scale, self._model.max_linear),
                       self._state.left * min(self._config.angular_scale, self._model.max_angular))
        return saturate(asked, self._model.max_linear, self._model.max_angular, self._model)

    def _drives(self):
        return (self.holder is Holder.GAMEPAD and self._state is not None
                and not self._state.at_rest and (self._state.hold or not self._has_hold))

    @property
    def _has_hold(self):
        return self._config.hold_button >= 0

    def _is_known(self, now):
        """Does the last message say how the pad is now, and not how it was?"""
        return now - self._heard_since >= WAKING and not self._is_late

    def _is_ready(self, state, before):
        if self._has_hold:
            return state.hold and not before.hold
        return state.at_rest

    def _is_lost(self, now):
        depends = self._drives() or (self.gives and not self._config.drive_without_pad)
        return depends and not self.joy.is_fresh(now)

    # -- who holds the robot

    def _relinquish(self, now, lateness):
        if now - self._heard_since < WAKING:
            self._tell('A was pressed the moment the pad was first heard: press it again',
                       warning=True)
        elif lateness > LONGEST_LAPSE or now - lateness < self._stopped_at:
            self._tell('A was pressed {:.1f} s ago, before something took control: press it '
                       'again'.format(lateness), warning=True)
        elif not self.gives:
            self.gives, self._given_at = True, now
            # With the renewals that it would have sent since the press: so its age shows.
            self._words += [True] * (1 + int(lateness / RENEWAL))
            self._happens(HolderEvent.RELINQUISH, now)

    def _press(self, event, now, caused_at):
        """The operator takes the robot, or is lost: False, whoever holds it."""
        self.gives, self._stopped_at = False, caused_at
        self._words.append(False)
        self._happens(event, now)

    def _happens(self, event, now):
        before, self.holder = self.holder, after(HOLDERS, self.holder, event)
        self._is_new = self._is_new or self.holder is not before
        if before is Holder.MOVE_TO_GOAL is not self.holder:
            self._silent_until = now + HAND_OVER
            if self.gives:
                self.gives = False      # somebody else took it: what was given is over
                self._words.append(False)
        if event is HolderEvent.TAKEN and self.holder is not before:
            self._tell('Control was taken from move_to_goal: press A to give it again')
        elif self.holder is Holder.MOVE_TO_GOAL is not before:
            self._tell('move_to_goal drives: press B to take the robot back')
        elif self.holder is Holder.GAMEPAD is not before:
            self._tell('The gamepad drives: press A to let move_to_goal drive')

    def _tell_loss(self, now):
        again = 'press the hold button' if self._has_hold else 'let go of the sticks'
        hint = '' if self._repeats else (
            '. If the pad is there, start joy_node with autorepeat_rate 20, as gamepad.launch does')
        self._tell('{}: robot stopped; {} to drive again{}'.format(
            self.joy.complaint_with_age(now).capitalize(), again, hint), warning=True)
