"""Decides whether the pad or move_to_goal may drive the robot. Computes the pad's command.

No press of a button is lost, even if several messages arrive together. Button B always sends False,
even if the pad drives already. Old presses of A and Y are refused. A silent pad is treated as lost
if a stick is pushed, or if move_to_goal drives by the pad's permission. If joy_node has no
autorepeat_rate, the pad is silent while a pushed stick does not move, and looks lost.

The time `now` [s] is on a steady clock (:mod:`tb3_labs.nodes`). Speeds are in m/s and rad/s.
"""
import math
from dataclasses import dataclass
from typing import Optional, Sequence

from tb3_labs.nodes.gamepad.pad import PadConfig, PadListener, PadState
from tb3_labs.robot.turtlebot3 import RobotModel, Twist2, saturate
from tb3_labs.supervision.control_holder import (
    NEXT_HOLDER, ControlEvent, ControlHolder, ControlMessages)
from tb3_labs.supervision.events import IncomingMessage, LogQueue, Novelty, Output
from tb3_labs.supervision.timeouts import (
    HAND_BACK_TIME, MAX_RESET_AGE, MAX_TRANSIT_TIME, RESUME_TIME, SleepMonitor)

#: If a pushed stick does not move the robot for this time [s], a warning gives the reason.
STICK_WARNING_TIME = 3.0


@dataclass(frozen=True)
class PadOutput(Output):
    """The decision of a GamepadCore."""

    holder: ControlHolder = ControlHolder.NOBODY
    control_messages: Sequence[bool] = ()    # to publish on `ctrl_relinq`, in order
    renewal_is_due: bool = False             # publish a True that renews the permission
    is_reset_requested: bool = False         # the reset button was pressed, so call the reset


class GamepadCore:
    """Drives a robot by a pad. Gives permission to move_to_goal and takes it back."""

    def __init__(self, config: PadConfig, model: RobotModel) -> None:
        self.holder = ControlHolder.NOBODY
        self._config = config
        self._model = model
        self.pad = PadListener()
        self.control_messages = ControlMessages()
        self._sleep = SleepMonitor()
        self._zero_until = 0.0    # the pad's command is zero until this time [s]
        self._command_is_due = False
        self._is_reset_requested = False    # Y was pressed after the last tick
        # Time [s] at which a warning about a pushed stick is due. The time is None if no stick is
        # pushed, and infinite if the warning was logged already.
        self._stick_warning_at: Optional[float] = None
        self._log = LogQueue()

    # -- inputs

    def on_joy(self, joy: 'IncomingMessage[PadState]') -> None:
        now = joy.arrived_at
        state = joy.content
        self._update_sleep(now)
        joy_node_hangs = joy.novelty is Novelty.SAME_STAMP
        self.pad.on_message(state, now, joy.sent_at, joy_node_hangs=joy_node_hangs)
        self._command_is_due = True
        self._obey_control_buttons(state, now)
        self._obey_sticks(state, now)
        if self.pad.presses.reset and self._accept_press('Y', MAX_RESET_AGE, now):
            self._is_reset_requested = True

    def _obey_control_buttons(self, state: PadState, now: float) -> None:
        presses = self.pad.presses
        if presses.regain:
            self.control_messages.stop(now - self.pad.lateness)
            self._change_holder(ControlEvent.REGAIN, now)
        elif presses.relinquish and not state.regain:
            if self._accept_press('A', RESUME_TIME, now) and not self.control_messages.must_renew:
                self.control_messages.grant(now, self.pad.lateness)
                self._change_holder(ControlEvent.RELINQUISH, now)

    def _obey_sticks(self, state: PadState, now: float) -> None:
        """Let a ready pad drive. Stop a pad that was silent, or whose stick was pushed before
        another node stopped the robot."""
        is_ready = self.pad.presses.hold if self._config.has_hold else state.is_at_rest
        if is_ready and self._is_current(now):
            self._change_holder(ControlEvent.READY, now)
        elif self.pad.came_after_loss and self.holder is ControlHolder.GAMEPAD:
            self._change_holder(ControlEvent.LOST, now)    # before this message, the pad was silent
        elif self._is_driving and now - self.pad.lateness < self.control_messages.stopped_at:
            self._change_holder(ControlEvent.STOPPED, now)    # the stick was pushed before the stop

    def on_has_control(self, has_control: 'IncomingMessage[bool]') -> None:
        """move_to_goal reports whether it has control."""
        now = has_control.arrived_at
        if has_control.content:
            self.control_messages.confirm_grant()
            self._change_holder(ControlEvent.GRANTED, now)
        elif now - self.control_messages.unconfirmed_since >= MAX_TRANSIT_TIME:
            self._change_holder(ControlEvent.TAKEN, now)

    def on_ctrl_relinq(self, message: 'IncomingMessage[bool]') -> None:
        """Another node gives or takes control. A False also stops a robot that this pad drives."""
        if not message.content:
            self._on_control_taken(message.arrived_at)

    def on_leave(self, now: float) -> None:
        """Take back the control that the pad gave to move_to_goal, since this node ends."""
        if self.control_messages.must_renew:
            self._on_control_taken(now)

    def _on_control_taken(self, now: float) -> None:
        self.control_messages.stopped_at = now
        if self.control_messages.must_renew:
            self._change_holder(ControlEvent.TAKEN, now)
        elif self._is_driving:
            self._change_holder(ControlEvent.STOPPED, now)

    # -- outputs

    def tick(self, now: float) -> PadOutput:
        self._update_sleep(now)
        self._become_ready_at_rest(now)
        self._stop_if_lost(now)
        command = self._next_command(now) if self._command_is_due else None
        waits_for_ready = self.pad.state is not None and self.holder is ControlHolder.NOBODY
        output = PadOutput(
            command, log_lines=self._log.pop_all(),
            needs_fast_ticks=waits_for_ready or self._needs_pad,
            holder=self.holder, is_reset_requested=self._is_reset_requested,
            control_messages=self.control_messages.waiting.pop_all(),
            renewal_is_due=self.control_messages.pop_renewal(now))
        self._is_reset_requested = False
        return output

    def _become_ready_at_rest(self, now: float) -> None:
        """Let the pad drive if its sticks rest. If a stick is pushed too long, log a warning."""
        state = self.pad.state
        waits_for_rest = self.holder is ControlHolder.NOBODY and not self._config.has_hold
        if state is None or not waits_for_rest:
            self._stick_warning_at = None
        elif state.is_at_rest:
            self._stick_warning_at = None
            if self._is_current(now):
                self._change_holder(ControlEvent.READY, now)
        elif self._stick_warning_at is None:
            self._stick_warning_at = now + STICK_WARNING_TIME
        elif now > self._stick_warning_at:
            self._stick_warning_at = math.inf
            axis = self._config.angular_axis if state.left else self._config.linear_axis
            self._log.warn(f'No stick drives: axis {axis} is at {state.axes[axis]:.2f}, beyond '
                           f'dead_zone {self._config.dead_zone:g}. Let go of it; if it rests '
                           'there, set a larger dead_zone')

    def _next_command(self, now: float) -> Twist2:
        self._command_is_due = False
        state = self.pad.state
        if state is None or now < self._zero_until or not self._is_driving:
            return Twist2()
        model = self._model
        linear = state.forward * min(self._config.linear_scale, model.max_linear)
        angular = state.left * min(self._config.angular_scale, model.max_angular)
        return saturate(Twist2(linear, angular), model.max_linear, model.max_angular, model)

    @property
    def _is_driving(self) -> bool:
        state = self.pad.state
        if self.holder is not ControlHolder.GAMEPAD or state is None:
            return False
        is_held = state.hold or not self._config.has_hold
        return is_held and not state.is_at_rest

    @property
    def _needs_pad(self) -> bool:
        return self._is_driving or self.control_messages.must_renew

    def _update_sleep(self, now: float) -> None:
        """After a sleep of this process, the pad must become ready before it drives. A long sleep
        also ends the permission that the pad gave to move_to_goal."""
        self._sleep.update(now)
        if self.control_messages.must_renew and self._sleep.slept_for > RESUME_TIME:
            self._log.warn(f'{self._sleep.as_text()}: press A to let move_to_goal drive again')
            self._on_control_taken(now)
        elif self._sleep.slept_for and self.holder is ControlHolder.GAMEPAD:
            self._change_holder(ControlEvent.LOST, now)

    def _is_current(self, now: float) -> bool:
        return self.pad.is_current(now) and not self._sleep.is_waking

    def _accept_press(self, button: str, max_lateness: float, now: float) -> bool:
        """Returns True if a press counts, else logs the reason. `max_lateness` is in [s]."""
        lateness = self.pad.lateness
        if self._sleep.reason_to_refuse:
            reason = self._sleep.reason_to_refuse
        elif not self.pad.knows_lateness(now):
            reason = 'it was pressed the moment the pad was first heard'
        elif lateness > max_lateness or now - lateness < self.control_messages.stopped_at:
            reason = f'it was pressed {lateness:.1f} s ago, or before something took control'
        else:
            return True
        self._log.warn(f'{button} does not count, {reason}: press it again')
        return False

    # -- who holds the robot

    def _change_holder(self, event: ControlEvent, now: float) -> None:
        previous_holder = self.holder
        if (previous_holder, event) not in NEXT_HOLDER:
            return
        self.holder = NEXT_HOLDER[previous_holder, event]
        self._command_is_due = True
        if previous_holder is ControlHolder.MOVE_TO_GOAL:
            self._zero_until = now + HAND_BACK_TIME
            if self.control_messages.must_renew:    # another node took control
                self.control_messages.stop(now)
        if event is ControlEvent.TAKEN:
            self._log.add('Control was taken from move_to_goal: press A to give it again')
        elif event is ControlEvent.STOPPED:
            self._log.warn(f'Another node stopped the robot: {self._remedy}')
        elif self.holder is ControlHolder.MOVE_TO_GOAL:
            self._log.add('move_to_goal drives: press B to take the robot back')
        elif self.holder is ControlHolder.GAMEPAD:
            self._log.add('The gamepad drives: press A to let move_to_goal drive')

    @property
    def _remedy(self) -> str:
        action = 'press the hold button' if self._config.has_hold else 'let go of the sticks'
        return action + ' to drive again'

    def _stop_if_lost(self, now: float) -> None:
        is_lost = self._needs_pad and not self.pad.freshness.is_fresh(now)
        if not is_lost:
            return
        advice = ''
        if self.pad.joy_node_hangs:
            advice = '. joy_node repeats one message: start it again'
        elif not self.pad.has_repeated_state:
            advice = ('. If the pad is there, start joy_node with autorepeat_rate 20, as '
                      'gamepad.launch does')
        silence = self.pad.freshness.silence_text(now).capitalize()
        self._log.warn(f'{silence}: robot stopped; {self._remedy}{advice}')
        self.pad.state = None      # the last state is not valid any more
        self._command_is_due = True
        self.control_messages.stop(now)
        self._change_holder(ControlEvent.LOST, now)
