"""The holder of the robot after messages of a pad. test_story_search.py has both nodes together."""
import pytest

from tb3_labs.nodes.gamepad.core import GamepadCore
from tb3_labs.nodes.gamepad.pad import PadConfig, read_pad
from tb3_labs.robot.turtlebot3 import Twist2, robot_model
from tb3_labs.supervision.control_holder import ControlHolder
from tb3_labs.supervision.events import IncomingMessage, Novelty
from tb3_labs.supervision.timeouts import HAND_BACK_TIME

NOBODY, GAMEPAD, GOAL = ControlHolder.NOBODY, ControlHolder.GAMEPAD, ControlHolder.MOVE_TO_GOAL
BURGER = robot_model('burger')
PERIOD = 0.05      # of a pad that repeats itself
REST, PUSHED = (0.0, 0.0), (1.0, 0.0)      # its sticks


class Core(GamepadCore):
    """A core that keeps the outputs of its ticks until a test takes them."""

    def __init__(self, config=PadConfig()):
        super().__init__(config, BURGER)
        self.now = 0.0
        self.outputs = {'log_lines': [], 'control_messages': [], 'is_reset_requested': []}

    def on_joy(self, joy):
        self.now = joy.arrived_at
        super().on_joy(joy)

    def tick(self, now):
        self.now, output = now, super().tick(now)
        self.outputs['log_lines'] += output.log_lines
        self.outputs['control_messages'] += output.control_messages
        self.outputs['is_reset_requested'] += [True] if output.is_reset_requested else []
        return output

    def take(self, what):
        """Returns the outputs of this name since the last call."""
        self.tick(self.now)
        taken, self.outputs[what] = self.outputs[what], []
        return taken


class PluggedPad:
    """A pad that repeats its state until it is unplugged."""

    def __init__(self, config=PadConfig(), repeats=True):
        self.controller, self._config = Core(config), config
        self.now = 0.0
        self.sent = []                    # (time, command)
        self.sticks, self.pressed = REST, ()
        self.plugged, self.repeats = True, repeats
        self._next, self._sent_state = 0.0, None
        self.run(0.5)

    def run(self, seconds, **state):
        """Let time pass, with this state of the pad from now on; returns the commands of that time."""
        vars(self).update(state)
        since = len(self.sent)
        for _ in range(round(seconds / 0.01)):
            self.now += 0.01
            self._tick()
        return [command for _, command in self.sent[since:]]

    def _tick(self):
        axes, buttons = [0.0] * 6, [0] * 8
        axes[1], axes[3] = self.sticks
        for button in self.pressed:
            buttons[button] = 1
        changed = (axes, buttons) != self._sent_state
        if self.plugged and (changed or (self.repeats and self.now >= self._next)):
            self._sent_state, self._next = (axes, buttons), self.now + PERIOD
            self.controller.on_joy(IncomingMessage(read_pad(axes, buttons, self._config), self.now))
        command = self.controller.tick(self.now).command
        if command is not None:
            self.sent.append((self.now, command if command != Twist2() else None))

    def queued_messages(self):
        """Returns the messages on ctrl_relinq since the last call."""
        return self.controller.take('control_messages')

    def press(self, *buttons):
        """Press the buttons and let go of them."""
        for self.pressed in (buttons, ()):
            self.run(0.02)

    def rest_and_push(self):
        """Returns the command for a stick that is pushed after a rest."""
        self.run(0.2, sticks=REST)
        return self.run(0.2, sticks=PUSHED)[-1]

    @property
    def holder(self):
        return self.controller.holder


def receive(controller, now, stamp, *pressed, forward=0.0, novelty=Novelty.NEW):
    """A message of a pad with another clock."""
    buttons = [int(button in pressed) for button in range(8)]
    controller.on_joy(IncomingMessage(read_pad([0.0, forward] + [0.0] * 4, buttons, PadConfig()), now,
                                      novelty=novelty, sent_at=stamp))


def let_pass(controller, since, until):
    """Let the node run without a message of the pad."""
    for tick in range(int((until - since) / 0.1)):
        controller.tick(since + 0.1 * tick)
    controller.tick(until)


def warned(controller, words):
    return any(words in line.text and line.is_warning for line in controller.take('log_lines'))


A, B, Y, HOLD = 0, 1, 2, 5
BURGER_FULL = Twist2(0.2108, 0.0)


@pytest.fixture
def pad():
    return PluggedPad()


SLOW = PadConfig(dead_zone=0.0, linear_scale=0.1, angular_scale=1.0)


@pytest.mark.parametrize('config, sticks, speed', [
    (PadConfig(), (1.0, 0.0), BURGER_FULL), (PadConfig(), (-1.0, 0.0), (-0.2108, 0.0)),
    (PadConfig(), (0.0, 1.0), (0.0, 2.635)), (SLOW, (0.5, 0.0), (0.05, 0.0)),
    (SLOW, (1.0, 0.0), (0.1, 0.0)), (SLOW, (0.0, -0.5), (0.0, -0.5)),
    (SLOW, (0.0, 1.0), (0.0, 1.0)),
    (PadConfig(), (1.0, 1.0), (0.1054, 1.3175))])    # each wheel within its limit
def test_a_full_stick_commands_the_robots_limit_or_the_scale(config, sticks, speed):
    pad = PluggedPad(config)
    assert pad.run(0.3, sticks=sticks)[-1] == pytest.approx(Twist2(*speed), rel=1e-4)
    assert set(pad.run(0.3, sticks=REST)[1:]) == {None}


def test_button_a_gives_control_and_button_b_takes_control(pad):
    pad.controller.on_has_control(IncomingMessage(False, pad.now))      # it had no control
    assert pad.holder is GAMEPAD and not pad.controller.control_messages.must_renew and pad.queued_messages() == []
    assert not pad.controller.take('is_reset_requested')
    assert [line.text for line in pad.controller.take('log_lines')] == [
        'The gamepad drives: press A to let move_to_goal drive']
    pad.press(A)
    assert pad.holder is GOAL and pad.controller.control_messages.must_renew and pad.queued_messages() == [True]
    assert set(pad.run(1.0, sticks=(1.0, 1.0))) == {None}
    pad.sticks = REST
    pad.press(B)
    assert pad.holder is GAMEPAD and pad.queued_messages() == [False]
    taken = pad.now
    assert BURGER_FULL.linear > pad.run(0.5, sticks=(1.0, 1.0))[-1].linear > 0.0
    first = [time for time, command in pad.sent if command is not None][0]
    assert first - taken >= HAND_BACK_TIME - 0.06


@pytest.mark.parametrize('repeats', [True, False])
def test_a_stick_that_rests_outside_the_dead_zone_is_named_once(repeats):
    pad = PluggedPad(repeats=repeats)
    pad.controller = Core()
    pad.run(2.9, sticks=(0.0, 0.12))
    assert pad.controller.take('log_lines') == []
    pad.run(10.0)
    line, = pad.controller.take('log_lines')
    assert line.text.startswith('No stick drives: axis 3 is at 0.12, beyond dead_zone 0.08.')
    assert pad.rest_and_push() == pytest.approx(BURGER_FULL)


@pytest.mark.parametrize('silence, drives', [(0.2, True), (0.3, False)])
def test_after_a_silence_the_sticks_of_a_pad_must_rest_again(pad, silence, drives):
    pad.run(silence, plugged=False)
    assert any(pad.run(1.0, plugged=True, sticks=PUSHED)) is drives
    assert pad.rest_and_push() == pytest.approx(BURGER_FULL)


def test_no_press_is_lost_if_messages_arrive_together(pad):
    """A person taps B between two messages that arrive together."""
    pad.press(A)
    pad.queued_messages()
    for pressed in (), (B,), (B, Y), (Y,), (), (A,), (), (B,), ():
        receive(pad.controller, pad.now, 0.0, *pressed)
    assert pad.controller.take('control_messages') == [False, True, False]
    assert pad.controller.take('is_reset_requested') and not pad.controller.take('is_reset_requested')
    assert pad.holder is GAMEPAD


@pytest.fixture
def stamped():
    """A core after 1 s of messages of a resting pad, until 101.0 s; the pad's clock shows 8.0 s."""
    controller = Core()
    for tick in range(20):
        receive(controller, 100.05 + 0.05 * tick, 7.05 + 0.05 * tick)
    controller.take('control_messages')
    return controller


@pytest.mark.parametrize('late, counts', [(0.0, True), (1.5, True), (2.5, False), (60.0, False)])
def test_a_press_of_a_that_the_network_delayed_for_long_is_rejected(stamped, late, counts):
    let_pass(stamped, 101.0, 101.04 + late)
    receive(stamped, 101.04 + late, 8.04)
    receive(stamped, 101.05 + late, 8.05, A)
    words = stamped.take('control_messages')
    # the renewals that were due since the press show the age of the grant
    assert words == ([True] * (1 + round(late / 0.1)) if counts else [])
    assert warned(stamped, 'press it again') is not counts
    receive(stamped, 101.06 + late, 8.06, B)
    assert stamped.take('control_messages') == [False]       # a stop is never too old


@pytest.mark.parametrize('late, counts', [(0.9, True), (1.1, False)])
def test_a_delayed_press_of_y_is_rejected(stamped, late, counts):
    let_pass(stamped, 101.0, 101.05 + late)
    receive(stamped, 101.05 + late, 8.04)
    receive(stamped, 101.05 + late, 8.05, Y)
    assert bool(stamped.take('is_reset_requested')) is counts
    assert warned(stamped, 'Y does not count') is not counts


@pytest.mark.parametrize('ring', [2, 10])
def test_a_pad_is_lost_if_its_driver_repeats_several_messages(stamped, ring):
    """The stamps of the messages differ: the pad drove while they arrived."""
    commands = []
    for tick in range(200):
        now = 101.05 + 0.05 * tick
        receive(stamped, now, 8.05 + 0.05 * min(tick, tick % ring), forward=1.0)
        commands.append(stamped.tick(now).command)
    assert commands[0] != Twist2() and set(commands[ring + 11:]) == {Twist2()}


@pytest.mark.parametrize('button, wanted', [(A, 'control_messages'), (Y, 'is_reset_requested')])
def test_a_press_is_accepted_in_the_second_message_with_one_stamp(stamped, button, wanted):
    receive(stamped, 101.05, 8.05, forward=1.0)
    receive(stamped, 101.0505, 8.05, button, forward=1.0, novelty=Novelty.SAME_STAMP)
    assert stamped.take(wanted) == [True]


@pytest.mark.parametrize('clock_runs', [True, False])
def test_a_pad_is_lost_if_its_driver_repeats_one_message(stamped, clock_runs):
    """The driver repeats its last message and stamp. With a simulated clock a stamp shows no delay."""
    def repeat(seconds, *pressed):
        commands = []
        for tick in range(round(seconds / 0.05)):
            now = stamped.now + 0.05
            receive(stamped, now, 8.05 * clock_runs, *pressed, forward=1.0, novelty=Novelty.SAME_STAMP)
            commands.append(stamped.tick(now).command)
        return set(commands)

    receive(stamped, 101.05, 8.05 * clock_runs, forward=1.0)
    assert stamped.tick(101.05).command != Twist2()
    repeat(0.3)
    assert stamped.holder is NOBODY and repeat(10.0) == {Twist2()}
    assert warned(stamped, 'joy_node repeats one message')
    repeat(0.1, A, Y)
    assert not stamped.take('is_reset_requested') and True not in stamped.take('control_messages')
    repeat(0.1, B)
    assert stamped.take('control_messages') == [False]        # a stop is obeyed


def test_a_stop_of_another_node_ends_a_drive_by_the_stick(pad):
    """The robot gets one zero. The stick drives again only after it was in its middle."""
    assert pad.rest_and_push()
    pad.controller.on_ctrl_relinq(IncomingMessage(False, pad.now))
    assert set(pad.run(1.0)) == {None} and pad.holder is NOBODY
    assert pad.rest_and_push()


@pytest.mark.parametrize('pushed_at, drives', [(8.15, False), (8.25, True)])
def test_a_stick_that_was_pushed_before_the_stop_of_another_node_does_not_drive(
        stamped, pushed_at, drives):
    receive(stamped, 101.1, 8.1)
    stamped.on_ctrl_relinq(IncomingMessage(False, 101.2))
    receive(stamped, 101.25, pushed_at, forward=1.0)
    assert (stamped.tick(101.25).command != Twist2()) is drives


@pytest.mark.parametrize('after, is_believed', [(0.1, False), (0.5, True)])
def test_has_control_false_may_cross_with_a_press_of_a(pad, after, is_believed):
    pad.press(A)
    pad.run(after - 0.04)
    pad.controller.on_has_control(IncomingMessage(False, pad.now))
    assert pad.controller.control_messages.must_renew is not is_believed
    pad.controller.on_has_control(IncomingMessage(True, pad.now))
    pad.controller.on_has_control(IncomingMessage(False, pad.now))       # it had control, and lost it
    assert not pad.controller.control_messages.must_renew


def test_a_grant_of_another_node_ends_a_drive_by_the_stick(pad):
    assert any(pad.run(0.3, sticks=PUSHED)) and pad.controller.tick(pad.now).command is None
    pad.controller.on_has_control(IncomingMessage(True, pad.now))
    assert pad.holder is GOAL and not pad.controller.control_messages.must_renew
    assert pad.controller.tick(pad.now).command == Twist2()    # without waiting for the pad
    assert set(pad.run(1.0)) == {None}
    pad.controller.on_has_control(IncomingMessage(False, pad.now))
    assert pad.holder is NOBODY
    assert set(pad.run(1.0)) == {None}              # still pushed


@pytest.mark.parametrize('repeats', [True, False])
def test_a_pad_lost_with_its_stick_off_the_middle_stops_the_robot(repeats):
    pad = PluggedPad(repeats=repeats)
    pad.run(10.0, plugged=repeats)      # a silent pad in its middle is not lost
    assert pad.holder is GAMEPAD
    pad.run(0.1, plugged=True, sticks=PUSHED)
    assert pad.run(0.31, plugged=False)[-1] is None and pad.holder is NOBODY
    assert pad.run(5.0) == []
    said, = [line.text for line in pad.controller.take('log_lines') if line.is_warning]
    assert said.startswith('No joy for 0.3 s: robot stopped; ')
    assert ('autorepeat_rate' in said) is not repeats
    # back: only after a rest
    assert set(pad.run(0.5, plugged=True, sticks=(0.9, 0.0))) == {None}
    assert pad.rest_and_push() == pytest.approx(BURGER_FULL)


def test_hold_to_drive():
    pad = PluggedPad(PadConfig(hold_button=HOLD))
    assert pad.holder is NOBODY             # its sticks are at rest
    assert set(pad.run(0.5, sticks=PUSHED)) == {None}
    assert pad.run(0.5, pressed=(HOLD,))[-1] == pytest.approx(BURGER_FULL)
    assert pad.run(0.5, pressed=())[-1] is None
    pad.run(0.2, pressed=(HOLD,))
    pad.run(0.5, plugged=False)
    assert set(pad.run(0.5, plugged=True)) == {None}          # the button was held before the loss, too
    pad.run(0.2, pressed=())
    assert pad.run(0.2, pressed=(HOLD,))[-1] == pytest.approx(BURGER_FULL)


@pytest.mark.parametrize('after, counts', [(0.1, False), (0.4, True)])
@pytest.mark.parametrize('stamped', [False, True])
@pytest.mark.parametrize('button, what', [(A, 'control_messages'), (Y, 'is_reset_requested')])
def test_a_press_just_after_the_first_message_is_rejected(
        after, counts, stamped, button, what):
    """The press may be as old as the first message. Or the button is held since the start of the
    pad, since joy_node sends all zeros first."""
    controller = Core()
    for now, *pressed in (100.0,), (100.0 + after, button):
        receive(controller, now, now - 90.0 if stamped else 0.0, *pressed)
    assert (True in controller.take(what)) is counts
    assert warned(controller, 'the moment the pad was first heard') is not counts


def test_the_node_is_watched_while_the_pad_drives_or_gives_control(pad):
    assert not Core().tick(0.0).needs_fast_ticks      # nothing was heard
    for sticks, buttons, watched in (
            (REST, (), False), (PUSHED, (), True), (REST, (), False), (REST, (A,), True),
            (PUSHED, (B,), True)):      # the node waits until the sticks rest
        pad.sticks = sticks
        pad.press(*buttons)
        assert pad.controller.tick(pad.now).needs_fast_ticks is watched
    assert pad.holder is NOBODY
    pad.controller.on_has_control(IncomingMessage(True, pad.now))
    assert not pad.controller.tick(pad.now).needs_fast_ticks           # another node gave control
