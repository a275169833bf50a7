"""The demonstration's judgement, and its table word for word."""
import math
import runpy
import threading

import pytest

from pages import SCRIPTS
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.nodes.demonstration import DemoDrive, table

GOAL = Pose2(-0.61, 0.61, 0.0)


def drive(reached=GOAL, believed=GOAL, state='GOAL_REACHED', goal=GOAL):
    return DemoDrive(state, goal, believed, reached, 7.834, 7.226)


def test_the_table_is_the_readmes():
    one = drive(Pose2(-0.61, 0.6092, math.radians(0.09)), Pose2(-0.61, 0.609, math.radians(0.1)))
    two = drive(Pose2(-0.6084, 0.61, math.radians(-0.09)), Pose2(-0.609, 0.609, math.radians(0.1)))
    assert table([one, two]).split('\n') == [
        '',
        '        asked [m, m, deg] believed to be at     truly off by  time, at best',
        'drive 1  -0.610 0.610 0.0  -0.610 0.609 0.1  0.8 mm 0.09 deg   7.83, 7.23 s  ok',
        'drive 2  -0.610 0.610 0.0  -0.609 0.609 0.1  1.6 mm 0.09 deg   7.83, 7.23 s  ok']


def test_a_bad_drive_says_how_it_ended():
    row = table([drive(state='gave up: no way')]).split('\n')[-1]
    assert row.endswith('  NOT GOOD: gave up: no way')    # though the true error is zero


@pytest.mark.parametrize('yaw', [-0.0, -1e-9, 1e-9])
def test_no_heading_is_minus_zero(yaw):
    row = table([drive(believed=Pose2(0.0, 0.0, yaw))]).split('\n')[-1]
    assert '-0.0 ' not in row and '0.000 0.000 0.0' in row


@pytest.mark.parametrize('reached, good', [
    (Pose2(0.0, 0.01, math.pi), True),                     # the bound itself
    (Pose2(0.008, 0.008, math.pi), False),
    (Pose2(0.0, 0.0, math.radians(-179.51)), True),        # across the half turn
    (Pose2(0.0, 0.0, math.radians(-179.49)), False),
    (Pose2(math.nan, 0.0, math.pi), False)])
def test_the_true_pose_judges(reached, good):
    goal = Pose2(0.0, 0.0, math.pi)
    assert drive(reached, goal=goal, believed=goal).is_good is good
    assert drive(goal, goal=goal, believed=reached).is_good is True


class MoveToGoal:
    """Stands in for the node, for the Observer of its topics, and for the publisher to it."""

    def __init__(self, demo, refuses, taken_at=None):
        self._demo, self._refuses, self._taken_at = demo, refuses, taken_at
        self.has_control, self.said = False, []

    def latest(self, topic):
        assert topic == 'has_control'
        return self.has_control

    def publish(self, word):
        self.said.append(word)
        # a True counts after a False only, and not while the node is just waking up
        self.has_control = word and self.said[-2:] == [False, True] and (
            len(self.said) > 2 * self._refuses)
        if len(self.said) == self._taken_at:
            self._demo._taken.set()


@pytest.fixture
def script(monkeypatch):
    demo = runpy.run_path(str(SCRIPTS / 'demo.py'))['Demo']
    parts = demo._give_control.__globals__
    monkeypatch.setitem(parts, 'wait_until', lambda condition, seconds: condition())
    return parts


def give_control(script, **how):
    """What a Demo says to a MoveToGoal."""
    demo = object.__new__(script['Demo'])
    demo._taken = threading.Event()
    demo._observer = demo._control = node = MoveToGoal(demo, **how)
    demo._give_control()
    return node


def test_control_is_given_until_it_counts(script):
    assert give_control(script, refuses=0).said == [False, True]
    node = give_control(script, refuses=2)
    assert node.has_control and node.said == [False, True] * 3


def test_a_stop_of_a_person_is_not_undone(script):
    node = give_control(script, refuses=99, taken_at=4)
    assert not node.has_control and node.said == [False, True] * 2


def test_no_background_job_of_the_script_computes_its_words():
    """Ctrl+C would end what computes them, and the job would run without them, and complain."""
    jobs = [line for line in (SCRIPTS / 'demo.sh').read_text(encoding='utf-8').splitlines()
            if line.endswith(' &')]
    assert len(jobs) > 2 and not [line for line in jobs if '$(' in line]
