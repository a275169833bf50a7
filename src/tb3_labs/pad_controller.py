"""Everything `gamepad` decides, without ROS: who holds the robot, and what the sticks command.

Messages of the pad go in with the time of their arrival; :meth:`PadController.command` says what to
send. None means: be silent (after one zero, if the robot was being driven).

A pad that is silent while the robot depends on it is lost: while its stick is off the middle, and
while move_to_goal drives. joy_node sends only changes unless its autorepeat_rate is set, so a stick
held still looks the same as a lost pad; which of the two it is cannot be told, and both stop the
robot.

Units: seconds on the receiver's clock (`now`), m/s, rad/s.
"""
from tb3_labs.freshness import Freshness
from tb3_labs.motion import Twist2, saturate
from tb3_labs.news import NewsDesk
from tb3_labs.ownership import Holder, PadEvent, who_holds
from tb3_labs.pad import read_pad

#: A pad that is silent for this long is lost [s].
PAD_TIMEOUT = 0.25
#: After taking the robot back the pad waits until move_to_goal has stopped [s].
HAND_OVER = 0.15


class PadController:
    """One pad, one robot."""

    def __init__(self, config, model):
        """`config`: a pad.PadConfig; `model`: a turtlebot3.RobotModel."""
        self.holder = Holder.NOBODY
        self._config = config
        self._model = model
        self.joy = Freshness('joy', PAD_TIMEOUT)
        self._state = None           # the last PadState; None before it, and after a loss
        self._repeats = False        # does the pad send what has not changed?
        self._last_message = None
        self._is_new = False
        self._wants_reset = False
        self._silent_until = 0.0
        self._desk = NewsDesk()
        #: Takes the News since the last call.
        self.take_news = self._desk.take

    # -- what comes in

    def on_joy(self, axes, buttons, now):
        """Take a message of the pad in; ``ValueError`` where it is none of this kind of pad."""
        state = read_pad(axes, buttons, self._config)
        self._repeats = self._repeats or (axes, buttons) == self._last_message
        self._last_message = axes, buttons
        self.joy.heard(now)
        before = self._state or state   # what is pressed at first was not pressed now
        self._state, self._is_new = state, True
        if self._is_ready(state, before):
            self._happens(PadEvent.READY, now)
        if state.regain and not before.regain:
            self._happens(PadEvent.REGAIN, now)
        elif state.relinquish and not before.relinquish and not state.regain:
            self._happens(PadEvent.RELINQUISH, now)
        if state.reset and not before.reset:
            self._wants_reset = True

    def take_reset(self):
        """Was the reset button pressed since the last call?"""
        wanted, self._wants_reset = self._wants_reset, False
        return wanted

    # -- what comes out

    @property
    def relinquished(self):
        """May move_to_goal drive?"""
        return self.holder is Holder.MOVE_TO_GOAL

    @property
    def watched(self):
        """Must somebody look at the clock, even if no message arrives?"""
        return self.relinquished or self._drives()

    def due(self, now):
        """Is it time for :meth:`command`?"""
        return self._is_new or self._is_lost(now)

    def command(self, now):
        """The Twist2 to send now, or None: silence."""
        self._is_new = False
        if self._is_lost(now):
            self._state = None
            self._happens(PadEvent.LOST, now)
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

    def _is_ready(self, state, before):
        if self._has_hold:
            return state.hold and not before.hold
        return state.at_rest

    def _is_lost(self, now):
        depends = self._drives() or (self.relinquished and not self._config.drive_without_pad)
        return depends and not self.joy.is_fresh(now)

    def _happens(self, event, now):
        before, self.holder = self.holder, who_holds(self.holder, event)
        if event is PadEvent.LOST:
            again = 'press the hold button' if self._has_hold else 'let go of the sticks'
            self._desk.tell('{}: robot stopped; {} to drive again{}'.format(
                self.joy.complaint(now).capitalize(), again,
                '' if self._repeats else '. If the pad is there, start joy_node with '
                'autorepeat_rate 20, as gamepad.launch does'), warning=True)
        elif self.holder is Holder.MOVE_TO_GOAL is not before:
            self._desk.tell('move_to_goal drives: press B to take the robot back')
        elif self.holder is Holder.GAMEPAD is not before:
            self._desk.tell('The gamepad drives: press A to let move_to_goal drive')
            if before is Holder.MOVE_TO_GOAL:
                self._silent_until = now + HAND_OVER
