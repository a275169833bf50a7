"""A controller or page that wakes from a sleep: what moves the robot, or its frame, is ignored; a stop counts.
test_story_search.py has move_to_goal and the gamepad.

Each topic has a thread of its own: the sensors may be heard before a request that is older.
"""
from functools import partial

import pytest

from story_nodes import Ahead
from tb3_labs.nodes.controller.core import ControllerCore
from tb3_labs.nodes.controller.mouse import MouseState
from tb3_labs.robot.samples import ImuSample
from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.supervision.dead_man import DeadMan
from tb3_labs.supervision.events import Event

WHILE_ASLEEP = 'while this node did not run'
STEP = 0.05


class SleepingCore:
    """A core, with a robot that stands."""

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
        return self.core.tick(self.now, self.now).watched

    def event(self, what):
        return Event(what, self.now, 'person')

    def moves_by(self, act):
        """Does the robot, or its frame, move by an act of a person?"""
        self.has_moved, self.told = False, ''
        act(self)
        self.look()
        self.run(1.0)
        return self.has_moved

    def wakes_with(self, act, slept_for):
        """Does it move by an act whose message is the first one after a sleep, apart from samples?"""
        self.now += slept_for
        self.live()
        return self.moves_by(act)


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


class SleepingPage(SleepingCore):
    """The panel's dead man switch, with a page."""

    def make(self):
        return DeadMan()

    def live(self):
        pass

    def look(self):
        self.core.silence(self.now)

    def ask(self, question, *details):
        try:
            self.has_moved = question(self.core.stops, self.now, *details) is not False
        except ValueError as problem:
            self.tell(str(problem))


def turn(core):
    core.core.on_turn(core.event(90.0), core.now)


#: What moves the robot, or its frame; and is it held, so that it must be let go first?
GIVES = [
    (SleepingController, turn), (SleepingController, lambda core: core.core.on_typed(core.event(90.0), core.now)),
    (SleepingController, lambda core: core.mouse(True, 1.0)),
    (SleepingPage, lambda page: page.ask(partial(page.core.hold, 'page'), 0.0, True)),
    (SleepingPage, lambda page: page.ask(page.core.check, 0.0, 1.0))]    # a turn, a goal, a reset


@pytest.mark.parametrize('slept_for, counts', [(0.9, True), (1.1, False), (7.0, False)])
@pytest.mark.parametrize('kind, act', GIVES)
def test_what_moves_the_robot_or_its_frame_does_not_count_as_the_node_wakes(
        kind, act, slept_for, counts):
    """If a person asks again, the robot moves. No line says that a mouse that is held must be let go first."""
    bench = kind()
    assert bench.wakes_with(act, slept_for) is counts
    assert (WHILE_ASLEEP in bench.told) is not (counts or act is GIVES[2][1])
    bench.let_go()
    bench.run(2.5)
    assert counts or bench.moves_by(act)


@pytest.mark.parametrize('slept_for', [1.1, 7.0])
def test_a_stop_counts_also_as_the_node_wakes(slept_for):
    bench = SleepingController()
    assert bench.moves_by(turn) and bench.is_driven
    bench.wakes_with(lambda core: core.mouse(True, 0.0) or core.let_go(), slept_for)
    bench.has_moved = False
    bench.run(1.0)
    assert not bench.has_moved and not bench.is_driven
