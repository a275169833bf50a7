"""A waking node ignores each act that moves the robot or its frame, and obeys each stop.

Each topic has a thread of its own. So a sample may arrive before an older request.
"""
from functools import partial
from pathlib import Path

import pytest

from story_nodes import Ahead
from tb3_labs.control.drive_law import DriveConfig, DriveLaw
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.localizer import Reset
from tb3_labs.nodes.controller.core import ControllerCore
from tb3_labs.nodes.controller.mouse import MouseState
from tb3_labs.nodes.gamepad.core import GamepadCore
from tb3_labs.nodes.gamepad.pad import PadConfig, PadState
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.robot.turtlebot3 import Twist2, robot_model
from tb3_labs.supervision.dead_man import DeadMan
from tb3_labs.supervision.events import IncomingMessage
from tb3_labs.supervision.goal_requests import GoalRequest, RequestedPose

BURGER = robot_model('burger')
WHILE_ASLEEP = 'while this node did not run'
STEP = 0.05


class SleepingCore:
    """A core, and a robot that stands."""

    def __init__(self):
        self.now, self.tremble, self.told = 1000.0, 1e-9, ''
        self.has_moved = False       # the robot, or its frame
        self.core = self.make()
        self.run(1.5)

    def run(self, seconds):
        for _ in range(round(seconds / STEP)):
            self.now += STEP
            self.live()
            self.look()

    def live(self):
        self.tremble = -self.tremble
        self.core.on_imu(ImuSample(self.now, self.tremble, self.tremble), self.now)

    def look(self):
        output = self.core.tick(self.now, self.now)
        self.tell(*[line.text for line in output.log_lines])
        self.has_moved = self.has_moved or output.command not in (None, Twist2())
        return output

    def tell(self, *lines):
        self.told += ' '.join(lines)

    def let_go(self):
        """Restore the state before the sleep: nothing is held, and control is given."""

    @property
    def is_driven(self):
        return self.core.tick(self.now, self.now).needs_fast_ticks

    def event(self, what):
        return IncomingMessage(what, self.now, 'person')

    def moves_by(self, act):
        """Does the robot, or its frame, move by an act of a person?"""
        self.has_moved, self.told = False, ''
        act(self)
        self.look()
        self.run(1.0)
        return self.has_moved

    def wakes_with(self, act, slept_for):
        """Does the robot, or its frame, move by an act whose message is the first after a sleep?"""
        self.now += slept_for
        self.live()
        return self.moves_by(act)


class SleepingMoveToGoal(SleepingCore):
    """move_to_goal, which has control and is at its goal."""

    def make(self):
        core = MoveToGoalCore(DriveLaw(DriveConfig(), BURGER), True)
        core.set_goal(Pose2())
        return core

    def live(self):
        super().live()
        self.core.on_odometry(OdometrySample(self.now, Pose2(), self.tremble, 0.0), self.now)

    def look(self):
        output = super().look()
        self.tell(*[text for _, _, text in output.answers])

    def let_go(self):
        """Give control again, which a long sleep has ended."""
        for word in (False, True):
            self.core.on_ctrl_relinq(self.event(word))

    def give(self):
        self.core.set_goal(Pose2(1.0))
        self.let_go()

    def goal(self):
        self.core.on_goal(GoalRequest(RequestedPose(Pose2(1.0)), 'person'), self.now)

    def reset(self):
        reset = Reset(RequestedPose(Pose2(-1.0)))
        self.core.on_reset(reset, self.now, self.now)
        self.tell(reset.reason)


class SleepingController(SleepingCore):
    """controller, with a mouse that is not active."""

    def make(self):
        core = ControllerCore(Ahead())
        core.on_mouse(self.event(MouseState(False, 0.0, 0.0)))
        return core

    def mouse(self, active, y):
        self.core.on_mouse(self.event(MouseState(active, 0.0, y)))

    def let_go(self):
        self.mouse(False, 0.0)


class SleepingGamepad(SleepingCore):
    """gamepad, with a pad that sends only changes."""

    def make(self):
        self.state = PadState()
        return GamepadCore(PadConfig(), BURGER)

    def live(self):
        self.core.on_joy(self.event(self.state._replace(axes=[self.now], buttons=[])))

    def look(self):
        output = self.core.tick(self.now)
        self.tell(*[line.text for line in output.log_lines])
        self.has_moved = (self.has_moved or output.command not in (None, Twist2())
                          or output.is_reset_requested or True in output.control_messages)

    def hold(self, **state):
        self.state = PadState(**state)
        self.live()

    let_go = hold

    @property
    def is_driven(self):
        return self.core.control_messages.must_renew


class SleepingPage(SleepingCore):
    """The panel's dead man switch, with a page."""

    def make(self):
        return DeadMan()

    def live(self):
        pass

    def look(self):
        self.core.driving_page_lost_for(self.now)

    def ask(self, question, *details):
        try:
            self.has_moved = question(self.core.stops, self.now, *details) is not False
        except ValueError as error:
            self.tell(str(error))


#: Inputs that a person holds. No line is logged for them.
HANDS = [partial(SleepingController.mouse, active=True, y=1.0), partial(SleepingGamepad.hold, forward=1.0)]
#: Acts that move the robot, or its frame.
GIVES = [
    (SleepingMoveToGoal, SleepingMoveToGoal.give), (SleepingMoveToGoal, SleepingMoveToGoal.goal),
    (SleepingMoveToGoal, SleepingMoveToGoal.reset),
    (SleepingController, lambda core: core.core.on_turn(core.event(90.0), core.now)),
    (SleepingController, lambda core: core.core.on_typed(core.event(90.0), core.now)),
    (SleepingController, HANDS[0]),
    (SleepingGamepad, partial(SleepingGamepad.hold, relinquish=True)),
    (SleepingGamepad, partial(SleepingGamepad.hold, reset=True)), (SleepingGamepad, HANDS[1]),
    (SleepingPage, lambda page: page.ask(partial(page.core.hold, 'page'), 0.0, True)),
    (SleepingPage, lambda page: page.ask(page.core.refuse_if_old, 0.0, 1.0))]    # a turn, a goal, a reset
#: (class, act that moves the robot, act that stops the robot).
STOPS = [
    (SleepingMoveToGoal, SleepingMoveToGoal.goal, lambda core: core.core.on_ctrl_relinq(core.event(False))),
    (SleepingMoveToGoal, SleepingMoveToGoal.goal, lambda core: core.core.on_cancel(core.now)),
    (SleepingController, lambda core: core.core.on_turn(core.event(90.0), core.now),
     lambda core: core.mouse(True, 0.0) or core.let_go()),
    *[(SleepingGamepad, partial(SleepingGamepad.hold, relinquish=True), stop) for stop in (
        partial(SleepingGamepad.hold, regain=True), lambda pad: pad.core.on_ctrl_relinq(pad.event(False)),
        lambda pad: pad.core.on_has_control(pad.event(False)))]]


@pytest.mark.parametrize('slept_for, counts', [(0.9, True), (1.1, False), (7.0, False)])
@pytest.mark.parametrize('kind, act', GIVES)
def test_a_waking_node_ignores_each_act_that_moves_the_robot_or_its_frame(
        kind, act, slept_for, counts):
    """If the person repeats the act later, the robot moves."""
    bench = kind()
    assert bench.wakes_with(act, slept_for) is counts
    assert (WHILE_ASLEEP in bench.told) is not (counts or act in HANDS)
    bench.let_go()
    bench.run(2.5)
    assert counts or bench.moves_by(act)


@pytest.mark.parametrize('slept_for', [1.1, 7.0])
@pytest.mark.parametrize('kind, act, stop', STOPS)
def test_a_waking_node_obeys_each_stop(kind, act, stop, slept_for):
    bench = kind()
    assert bench.moves_by(act) and bench.is_driven
    bench.wakes_with(stop, slept_for)
    bench.has_moved = False
    bench.run(1.0)
    assert not bench.has_moved and not bench.is_driven


def test_a_repeated_turn_is_refused_after_a_sleep():
    bench, turn = SleepingController(), lambda core: core.core.on_turn(core.event(90.0), core.now)
    assert not bench.wakes_with(turn, 7.0)
    for _ in range(3):      # once a second
        assert not bench.moves_by(turn)
    bench.run(2.5)
    assert bench.moves_by(turn)


def test_each_input_of_a_core_is_tried_or_moves_nothing():
    text = Path(__file__).read_text(encoding='utf-8')
    inputs = {name for core in (MoveToGoalCore, ControllerCore, GamepadCore) for name in dir(core)
              if name.startswith('on_') and '.' + name + '(' not in text}
    assert inputs == {'on_wheels', 'on_command', 'on_leave'}
