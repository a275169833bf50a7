"""Who may drive: the table, the pad that decides it, and both nodes together under fire."""
import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tb3_labs.motion import Twist2
from tb3_labs.ownership import Holder, PadEvent, who_holds
from tb3_labs.pad import PadConfig
from tb3_labs.pad_controller import HAND_OVER, PAD_TIMEOUT, PadController
from tb3_labs.permission import Permission
from tb3_labs.turtlebot3 import robot_model

NOBODY, GAMEPAD, GOAL = Holder.NOBODY, Holder.GAMEPAD, Holder.MOVE_TO_GOAL
BURGER = robot_model('burger')
PERIOD = 0.05      # of a pad that repeats itself

AFTER = {
    # event:              nobody   gamepad  move_to_goal   was holding
    PadEvent.READY:      (GAMEPAD, GAMEPAD, GOAL),
    PadEvent.RELINQUISH: (GOAL,    GOAL,    GOAL),
    PadEvent.REGAIN:     (NOBODY,  GAMEPAD, GAMEPAD),
    PadEvent.LOST:       (NOBODY,  NOBODY,  NOBODY),
}


@pytest.mark.parametrize('event', PadEvent)
def test_who_holds_after_each_event(event):
    assert tuple(who_holds(holder, event) for holder in (NOBODY, GAMEPAD, GOAL)) == AFTER[event]


def test_a_lost_pad_ends_with_nobody_after_any_history():
    for history in itertools.product(PadEvent, repeat=5):
        holder = NOBODY
        for event in history:
            holder = who_holds(holder, event)
        assert who_holds(holder, PadEvent.LOST) is NOBODY


class Pad:
    """A pad in a hand: repeats its state until it is unplugged."""

    def __init__(self, config=PadConfig(), repeats=True):
        self.controller = PadController(config, BURGER)
        self.now = 0.0
        self.sent = []                    # (time, command)
        self.sticks, self.pressed = (0.0, 0.0), ()
        self.plugged, self.repeats = True, repeats
        self._next, self._said = 0.0, None
        self.run(0.2)

    def run(self, seconds):
        """Let time pass; the commands of that time."""
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
        changed = (axes, buttons) != self._said
        if self.plugged and (changed or (self.repeats and self.now >= self._next)):
            self._said, self._next = (axes, buttons), self.now + PERIOD
            self.controller.on_joy(axes, buttons, self.now)
        if self.controller.due(self.now):
            self.sent.append((self.now, self.controller.command(self.now)))

    def press(self, *buttons):
        """Press and let go."""
        self.pressed = buttons
        self.run(0.02)
        self.pressed = ()
        self.run(0.02)

    @property
    def holder(self):
        return self.controller.holder


A, B, Y, HOLD = 0, 1, 2, 5
BURGER_FULL = Twist2(0.2108, 0.0)


@pytest.fixture
def pad():
    return Pad()


def test_full_stick_is_the_robots_own_limit(pad):
    pad.sticks = (1.0, 0.0)
    assert pad.run(0.3)[-1] == pytest.approx(BURGER_FULL)
    pad.sticks = (-1.0, 0.0)
    assert pad.run(0.3)[-1] == pytest.approx(Twist2(-0.2108, 0.0))
    pad.sticks = (0.0, 1.0)
    assert pad.run(0.3)[-1] == pytest.approx(Twist2(0.0, 2.635))
    pad.sticks = (1.0, 1.0)
    both = pad.run(0.3)[-1]
    assert both.linear + 0.08 * both.angular <= 0.21085
    pad.sticks = (0.0, 0.0)
    assert set(pad.run(0.3)[1:]) == {None}


def test_a_stick_that_is_not_in_the_middle_at_the_start_drives_nothing():
    fresh = PadController(PadConfig(), BURGER)
    for tick in range(20):
        fresh.on_joy([0.0, 1.0, 0.0, 0.0], [0] * 3, 0.05 * tick)
        assert fresh.command(0.05 * tick) is None
    assert fresh.holder is NOBODY


def test_a_gives_the_robot_away_and_b_takes_it_back(pad):
    assert pad.holder is GAMEPAD and not pad.controller.relinquished
    pad.press(A)
    assert pad.holder is GOAL and pad.controller.relinquished
    pad.sticks = (1.0, 1.0)
    assert set(pad.run(1.0)) == {None}
    pad.press(B)
    assert pad.holder is GAMEPAD
    taken = pad.now
    assert BURGER_FULL.linear > pad.run(0.5)[-1].linear > 0.0
    first = [time for time, command in pad.sent if command is not None][0]
    assert first - taken >= HAND_OVER - 0.06


def test_rising_edges_only(pad):
    pad.pressed = (A,)
    pad.run(1.0)
    pad.pressed = (A, B)
    pad.run(1.0)
    assert pad.holder is GAMEPAD            # B was pressed, A only held
    pad.pressed = (A,)
    pad.run(1.0)
    assert pad.holder is GAMEPAD


def test_what_is_pressed_at_first_was_not_pressed_now():
    controller = PadController(PadConfig(), BURGER)
    controller.on_joy([0.0] * 4, [1, 0, 1], 0.0)
    assert not controller.relinquished and not controller.take_reset()


def test_reset_is_asked_for_once_a_press(pad):
    pad.pressed = (Y,)
    pad.run(1.0)
    assert pad.controller.take_reset() and not pad.controller.take_reset()


@pytest.mark.parametrize('repeats', [True, False])
def test_a_pad_lost_with_its_stick_off_the_middle_stops_the_robot(repeats):
    pad = Pad(repeats=repeats)
    pad.sticks = (1.0, 0.0)
    pad.run(0.1)
    pad.plugged = False
    commands = pad.run(0.31)
    assert commands[-1] is None and pad.holder is NOBODY
    assert [time for time, command in pad.sent if command is None][-1] <= pad.now
    assert pad.run(5.0) == []
    hint = any('autorepeat_rate' in news.text for news in pad.controller.take_news())
    assert hint is not repeats
    # back: only after a rest
    pad.plugged = True
    pad.sticks = (0.9, 0.0)
    assert set(pad.run(0.5)) == {None}
    pad.sticks = (0.0, 0.0)
    pad.run(0.2)
    pad.sticks = (1.0, 0.0)
    assert pad.run(0.2)[-1] == pytest.approx(BURGER_FULL)


def test_a_silent_pad_in_its_middle_is_no_loss():
    pad = Pad(repeats=False)
    pad.run(60.0)
    assert pad.holder is GAMEPAD


@pytest.mark.parametrize('allowed', [False, True])
def test_a_pad_lost_while_move_to_goal_drives(allowed):
    pad = Pad(PadConfig(drive_without_pad=allowed))
    pad.press(A)
    pad.plugged = False
    pad.run(PAD_TIMEOUT + 0.05)
    assert pad.controller.relinquished is allowed


def test_hold_to_drive():
    pad = Pad(PadConfig(hold_button=HOLD))
    pad.sticks = (1.0, 0.0)
    assert set(pad.run(0.5)) == {None}
    pad.pressed = (HOLD,)
    assert pad.run(0.5)[-1] == pytest.approx(BURGER_FULL)
    pad.pressed = ()
    assert pad.run(0.5)[-1] is None
    pad.pressed = (HOLD,)
    pad.run(0.2)
    pad.plugged = False
    pad.run(0.5)
    pad.plugged = True
    assert set(pad.run(0.5)) == {None}          # held since before the loss
    pad.pressed = ()
    pad.run(0.2)
    pad.pressed = (HOLD,)
    assert pad.run(0.2)[-1] == pytest.approx(BURGER_FULL)


class Mover:
    """The other side: drives while it may, and hears of it late."""

    def __init__(self):
        self.permission = Permission()
        self.sent = []
        self._driving = False
        self._mail = []              # (arrival, granted)

    def post(self, granted, arrival):
        """A message under way; messages of one sender never overtake each other."""
        last = self._mail[-1][0] if self._mail else 0.0
        self._mail.append((max(arrival, last), granted))

    def tick(self, now):
        while self._mail and self._mail[0][0] <= now:
            self.permission.told(self._mail.pop(0)[1], now)
        self.permission.has_lapsed(now)
        if self.permission.granted:
            self._driving = True
            self.sent.append((now, 1.0))
        elif self._driving:
            self._driving = False
            self.sent.append((now, 0.0))


@settings(max_examples=150)
@given(st.lists(st.tuples(
    st.sampled_from(['A', 'B', 'AB', 'Y', 'stick', 'rest', 'unplug', 'plug']),
    st.floats(0.01, 0.6)), min_size=1, max_size=25), st.floats(0.0, 0.1))
def test_never_two_drivers_never_a_command_after_loss_always_a_zero(story, delay):
    pad, mover = Pad(), Mover()
    told = lost_at = None
    driving = False
    for what, seconds in story + [('unplug', 3.0)]:
        pad.pressed = {'A': (A,), 'B': (B,), 'AB': (A, B), 'Y': (Y,)}.get(what, ())
        pad.sticks = {'stick': (1.0, 0.3), 'rest': (0.0, 0.0)}.get(what, pad.sticks)
        pad.plugged = {'unplug': False, 'plug': True}.get(what, pad.plugged)
        lost_at = {'unplug': lost_at or pad.now, 'plug': None}.get(what, lost_at)
        for _ in range(round(seconds / 0.01)):
            commands = pad.run(0.01)
            if pad.controller.relinquished != told:
                told = pad.controller.relinquished
                mover.post(told, pad.now + delay)
            since = len(mover.sent)
            mover.tick(pad.now)
            if commands:
                driving = commands[-1] is not None
            moved = any(speed for _, speed in mover.sent[since:])
            assert not (driving and moved)
            if lost_at is not None and pad.now - lost_at > 0.3 + delay:
                assert not driving and not moved
    assert not driving
    assert not mover.sent or mover.sent[-1][1] == 0.0
