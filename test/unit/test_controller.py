"""Turns, mouse and keyboard together. The law returns the values of the test, and the IMU is in closed
form. Further tests use the simulated robot and its true heading."""
import math

import pytest

from known_motion import angle_between
from rollout import control, run
from tb3_labs.control.commands import IDLE_SAMPLE_PERIOD, LawStep
from tb3_labs.nodes.controller.core import ControllerCore
from tb3_labs.nodes.controller.mouse import MouseState
from tb3_labs.nodes.controller.turns import ActiveTurn, Driver, TurnConfig, accept_turn, make_turn_law
from tb3_labs.robot.samples import ImuSample
from tb3_labs.robot.turtlebot3 import Twist2, robot_model
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig
from tb3_labs.supervision.events import IncomingMessage, Novelty, SenderRequests
from tb3_labs.supervision.timeouts import MAX_REPEAT_GAP, SleepMonitor

BURGER = robot_model('burger')
MOUSE_PERIOD = 0.05


class GivenTurnLaw:
    """A law that returns the remaining angle; a turn is finished at 0."""

    MAX_ANGLE = 100.0

    def __init__(self, period=0.1):
        self.period = period
        self.remaining, self.ends_with = 1.0, 0.0
        self.requested, self.times = [], []    # angles of the starts, times between the steps

    def start(self, yaw, angle):
        self.requested.append(angle)

    def move_goal(self, angle):
        pass

    def step(self, yaw, rate, dt, age=0.0, noise=0.0):
        self.times.append(dt)
        finished = self.remaining == 0.0
        return LawStep(Twist2(0.0, 0.5), self.ends_with if finished else self.remaining, finished)


class Desk:
    """A controller with a GivenTurnLaw. A noisy IMU sends a sample in each step. A mouse repeats its
    message while the test holds the mouse."""

    step = 0.05      # [s]

    def __init__(self, law=None):
        self.law = law or GivenTurnLaw()
        self.core = ControllerCore(self.law)
        self.now, self.yaw, self.rate, self.tremble = 100.0, 0.0, 0.0, 1e-6
        self.mouse = None            # (active, x, y), or None: no messages
        self.log_lines = []
        self._next_mouse = 0.0
        self.core.on_mouse(IncomingMessage(MouseState(False, 0.0, 0.0), self.now))
        self.run(0.2)

    def run(self, seconds, imu=True):
        """Let time pass. Returns the commands of this time."""
        commands = []
        for _ in range(round(seconds / self.step)):
            self.now += self.step
            self.tremble = -self.tremble
            if imu:
                self.core.on_imu(ImuSample(self.now, self.yaw + self.tremble, self.rate), self.now)
            if self.mouse and self.now >= self._next_mouse:
                self._next_mouse = self.now + MOUSE_PERIOD - 1e-6
                self.core.on_mouse(IncomingMessage(MouseState(*self.mouse), self.now))
            commands += self.tick()
        return commands

    def tick(self):
        """Returns a list with the present command, or an empty list."""
        output = self.core.tick(self.now, self.now)
        self.needs_fast_ticks = output.needs_fast_ticks
        self.log_lines += output.log_lines
        return [] if output.command is None else [output.command]

    def hold(self, active, x=0.0, y=0.0):
        """Hold the mouse at this place from now on."""
        self.mouse, self._next_mouse = (active, x, y), 0.0

    def request_turn(self, degrees=90.0):
        self.core.request_turn(degrees, self.now)

    @property
    def asked_for(self):
        """The angle of the law's latest turn [deg]."""
        return math.degrees(self.law.requested[-1])

    def told(self, words, warning=False):
        """Was one line with these words logged?"""
        self.tick()
        return [line.is_warning for line in self.log_lines if words in line.text] == [warning]

    def finish(self, left=0.0):
        """End the turn with a robot at rest, and this remaining angle of the law [rad]."""
        self.law.remaining, self.law.ends_with = 0.0, left
        self.run(0.4)
        assert self.core.driver is Driver.NOBODY


@pytest.fixture
def desk():
    return Desk()


def test_the_node_is_watched_in_a_turn_and_while_the_mouse_is_active(desk):
    for _ in range(2):
        desk.tick()
        assert not desk.needs_fast_ticks and desk.core.problem_text(desk.now) == ''
        desk.law.remaining, desk.law.times, desk.log_lines = 1.0, [], []
        desk.request_turn()
        assert desk.core.idle_time(desk.now) < IDLE_SAMPLE_PERIOD
        desk.run(0.2)
        assert desk.needs_fast_ticks
        assert desk.told('Turning 90 degrees') and desk.law.times[0] == 0.1    # from standing
        desk.finish()
        desk.run(5.0)
    for active in (True, False):
        desk.core.on_mouse(IncomingMessage(MouseState(active, 0.0, 0.0), desk.now))
        desk.tick()
        assert desk.needs_fast_ticks is desk.core.mice.is_active is active


def test_the_result_has_the_remaining_angle_of_the_law(desk):
    desk.request_turn()
    desk.run(0.2)
    desk.yaw = 0.8                       # one sample has another yaw
    desk.finish(math.radians(2.0))
    assert desk.told('2.00 degrees short of')
    desk.run(1.0)
    desk.request_turn()
    assert desk.asked_for == pytest.approx(90.0, abs=0.01)


def test_after_a_short_silence_a_turn_begins_again_at_the_present_heading(desk):
    desk.request_turn()
    desk.run(0.2)
    desk.run(1.0, imu=False)
    desk.yaw, desk.law.remaining = 0.5, 3.0    # a person turned the robot by more than 0.8 rad
    assert Twist2() not in desk.run(0.5)
    assert desk.law.requested[-1] == pytest.approx(math.pi / 2.0 - 0.5, abs=1e-5)
    assert desk.told('Stopped: no imu', warning=True) and desk.told('Going on')


def test_a_jump_of_the_heading_in_a_silence_ends_the_turn(desk):
    desk.request_turn(180.0)
    desk.run(0.5)
    desk.run(0.5, imu=False)
    desk.yaw = 2.0
    assert set(desk.run(1.0)) <= {Twist2()}
    assert desk.told("the IMU's heading jumped by", warning=True)


def test_a_frozen_imu_ends_a_turn_and_the_time_before_does_not_count(desk):
    desk.request_turn()
    desk.tremble = 0.0
    assert Twist2() not in desk.run(0.5)
    desk.finish()
    desk.law.remaining = 1.0
    desk.request_turn()
    assert Twist2() not in desk.run(0.5)
    assert desk.run(0.5)[-1] == Twist2() and desk.told('imu repeats one reading', warning=True)


def test_a_new_law_starts_a_new_stall_check_with_a_new_period(desk):
    desk.request_turn()
    desk.run(1.0)
    desk.core.set_law(GivenTurnLaw(period=0.2))
    commands = desk.run(1.0)
    assert Twist2() not in commands and len(commands) == pytest.approx(5, abs=1)


@pytest.mark.parametrize('good, bad', [
    (None, (math.nan, math.inf, 40000.0)),
    (36000.0, (90.0,))])     # and the goal is not moved farther away
def test_an_invalid_angle_is_refused(good, bad):
    desk = Desk(make_turn_law(TurnConfig(), BURGER))
    if good:
        desk.request_turn(good)
    for degrees in bad:
        with pytest.raises(ValueError, match='from -36000 to 36000'):
            desk.request_turn(degrees)
    assert bool(desk.run(0.5)) is bool(good)


def test_refusals_of_turns_that_a_node_repeats_are_one_line_a_second():
    core = ControllerCore(GivenTurnLaw())
    for k in range(300):
        core.on_turn(IncomingMessage(90.0, 10.0 + 0.01 * k, 'script'), 10.0 + 0.01 * k)
    assert [line.is_warning for line in core.tick(13.0, 13.0).log_lines] == 3 * [True]
    for _ in range(3):         # typed: each is answered
        core.on_typed(IncomingMessage(90.0, 13.0), 13.0)
    assert len(core.tick(13.0, 13.0).log_lines) == 3


NEW, OLD, STOP = Novelty.NEW, Novelty.REPEATED, (0.0, None, Novelty.NEW)
LONG = MAX_REPEAT_GAP + 0.1


@pytest.mark.parametrize('is_waking, requests, accepted', [
    (False, [(0.0, 90.0, NEW), (0.5, 90.0, NEW), (1.0, 90.0, NEW)], [True, True, True]),
    (False, [(0.0, 90.0, OLD), (1.5, 90.0, NEW), (3.0, 90.0, NEW)], [False, False, False]),
    (False, [(0.0, 90.0, OLD), (0.5, 45.0, NEW), (1.0, 45.0, NEW)], [False, True, True]),     # another angle
    (False, [(0.0, 90.0, OLD), (LONG, 90.0, NEW)], [False, True]),
    (False, [(0.0, 90.0, NEW), STOP, (0.5, 90.0, NEW)], [True, True]),     # a person asks again
    (False, [(0.0, 90.0, NEW), (0.5, 90.0, NEW), STOP, (1.0, 90.0, NEW), (1.5, 90.0, NEW)], [True, True, False, False]),
    (False, [(0.0, 90.0, OLD), STOP, (0.5, 90.0, NEW)], [False, False]),
    (True, [(0.0, 90.0, NEW), (0.5, 90.0, NEW)], [True, False]),    # the core itself refuses the first turn
    (True, [(0.0, 90.0, OLD), (0.5, 90.0, NEW)], [False, False])])
def test_a_repeated_turn_is_refused_after_a_stop_or_a_sleep_or_if_doubtful(is_waking, requests, accepted):
    turns, found = SenderRequests(SleepMonitor()), []
    for at, degrees, novelty in requests:
        if degrees is None:
            turns.end_repetitions()
        else:
            found.append(accept_turn(turns, IncomingMessage(degrees, at, 'script', novelty), is_waking and at == 0.0))
            assert accept_turn(turns, IncomingMessage(degrees, at, str(at)))    # of another sender
    assert found == accepted


def test_no_turn_without_the_imu():
    with pytest.raises(ValueError, match='no imu yet'):
        ControllerCore(GivenTurnLaw()).request_turn(90.0, 1.0)


@pytest.mark.parametrize('requested, turned, words', [
    (90.0, 89.0, '89.00 degrees in 2.5 s: 1.00 degrees short of 90.00'),
    (-90.0, -91.0, '-91.00 degrees in 2.5 s: 1.00 degrees beyond -90.00')])
def test_the_result_of_a_turn(requested, turned, words):
    turn = ActiveTurn(math.radians(requested), 0.2, 5.0)
    turn.remaining_at_end = turn.remaining(0.2 + math.radians(turned))
    assert turn.result_text(7.5) == 'Turned ' + words


def test_the_mouse_drives_outside_the_middle_while_it_is_active(desk):
    desk.hold(True, 0.0, 1.0)
    assert set(desk.run(0.5)) == {Twist2(0.5, 0.0)}
    desk.hold(True, 0.1, 0.1)
    assert set(desk.run(0.5)) == {Twist2()}
    desk.hold(True, -1.0, 0.0)
    assert set(desk.run(0.5)) == {Twist2(0.0, 0.5)}
    desk.hold(False, -1.0, 0.0)
    assert desk.run(0.5) == [] and desk.core.driver is Driver.NOBODY
    assert desk.told('The mouse is active') and desk.told('The mouse was deactivated')


def test_the_mouse_pre_empts_a_turn_at_once(desk):
    desk.hold(True)
    desk.request_turn(180.0)
    desk.run(0.5)
    assert desk.core.driver is Driver.TURN
    desk.hold(True, 0.0, -0.6)
    assert desk.run(desk.step) == [Twist2(-0.3, 0.0)]
    desk.run(0.5)
    assert desk.told('the mouse took over', warning=True)
    with pytest.raises(ValueError, match='the mouse is driving'):
        desk.request_turn()
    desk.hold(True)
    desk.run(0.5)
    desk.request_turn(-90.0)
    desk.finish()
    assert desk.asked_for == pytest.approx(-90.0, abs=0.01) and desk.told('Turned')


def test_a_deactivated_mouse_stops_a_turn_after_another_mouse_was_lost(desk):
    desk.hold(True, 1.0, 0.0)
    desk.run(0.3)
    desk.mouse = None
    desk.run(0.5)
    desk.request_turn(180.0)
    desk.run(0.5)
    for active in (True, False):     # as a page's STOP
        desk.core.on_mouse(IncomingMessage(MouseState(active, 0.0, 0.0), desk.now, 'page'))
    assert desk.core.driver is Driver.NOBODY and set(desk.run(1.0)) <= {Twist2()}
    assert desk.told('the mouse was deactivated', warning=True)


def test_a_mouse_that_was_active_before_is_logged_once():
    core = ControllerCore(GivenTurnLaw())
    for now in 100.0, 100.1, 100.2:
        core.on_mouse(IncomingMessage(MouseState(True, 0.0, 1.0), now))
    output = core.tick(100.2, 100.2)
    assert output.command is None
    assert ['The mouse was active before: move' in line.text for line in output.log_lines] == [True]


def turn_that_is_changed(degrees, change, total):
    """Ask for a turn [deg], and `change(core, now)` after 0.4 s. The robot turns by `total` [deg].
    Returns the later commands, and the reports."""
    robot, log_lines = Simulator(SimulatorConfig(
        start_yaw_deg=170.0, imu_offset_deg=-47.7, command_latency=0.05)), []
    core, start = ControllerCore(make_turn_law(TurnConfig(), BURGER)), robot.truth.yaw
    hear = control(robot, core)
    run(robot, core, hear, 0.2)
    core.request_turn(degrees, robot.now)
    run(robot, core, hear, 0.4)
    change(core, robot.now)
    commands = run(robot, core, hear, 6.0, log_lines)
    assert math.degrees(angle_between(robot.truth.yaw, start + math.radians(total))) <= 0.5
    return commands, [line.text for line in log_lines if line.text.startswith('Turned')]


@pytest.mark.parametrize('second, total', [(90.0, 180.0), (-90.0, 0.0), (-180.0, -90.0)])
def test_a_turn_during_a_turn_moves_its_goal(second, total):
    _, reports = turn_that_is_changed(90.0, lambda core, now: core.request_turn(second, now), total)
    assert len(reports) == 1


def test_a_lower_limit_in_mid_turn_holds_from_the_next_command_on():
    slower = make_turn_law(TurnConfig(max_ang_z=0.6), BURGER)
    commands, _ = turn_that_is_changed(180.0, lambda core, now: core.set_law(slower), 180.0)
    assert max(abs(command.angular) for command in commands) <= 0.6 + 1e-9
