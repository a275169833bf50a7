"""The demonstration judges its drives, prints them as a table, and gives control."""
import math
import os
import runpy
import socket
import subprocess
from types import SimpleNamespace

import pytest

from pages import SCRIPTS, needs_setup
from tb3_labs.geometry.se2 import Pose2

PROGRAM = runpy.run_path(str(SCRIPTS / 'demo.py'))
DemoDrive, drives_table = PROGRAM['DemoDrive'], PROGRAM['drives_table']
GOAL = Pose2(-0.61, 0.61, 0.0)


def drive(reached=GOAL, believed=GOAL, state='GOAL_REACHED', goal=GOAL):
    return DemoDrive(state, goal, believed, reached, 7.834)


def test_the_table_has_a_row_for_each_drive():
    one = drive(Pose2(-0.61, 0.6092, math.radians(0.09)), Pose2(-0.61, 0.609, math.radians(0.1)))
    two = drive(Pose2(-0.6084, 0.61, math.radians(-0.09)), Pose2(-0.609, 0.609, math.radians(0.1)))
    assert drives_table([one, two]).split('\n') == [
        '',
        '        asked [m, m, deg] believed to be at     truly off by     time',
        'drive 1  -0.610 0.610 0.0  -0.610 0.609 0.1  0.8 mm 0.09 deg   7.83 s  ok',
        'drive 2  -0.610 0.610 0.0  -0.609 0.609 0.1  1.6 mm 0.09 deg   7.83 s  ok']


@pytest.mark.parametrize('reached, good', [
    (Pose2(0.0, 0.01, math.pi), True), (Pose2(0.008, 0.008, math.pi), False),      # 0.01 m is good
    (Pose2(0.0, 0.0, math.radians(-179.51)), True), (Pose2(0.0, 0.0, math.radians(-179.49)), False),
    (Pose2(math.nan, 0.0, math.pi), False)])
def test_the_true_pose_decides(reached, good):
    goal = Pose2(0.0, 0.0, math.pi)
    assert drive(reached, goal=goal, believed=goal).is_good is good
    assert drive(goal, goal=goal, believed=reached).is_good


@pytest.fixture
def demo(monkeypatch):
    """A Demo without a node, which is also its own publisher. move_to_goal takes control at a True after a False, but
    ignores the first `ignored` such messages."""
    kind = PROGRAM['Demo']
    monkeypatch.setitem(kind._give_control.__globals__, 'wait_until',
                        lambda condition, seconds: any(condition() for _ in range(3)))
    made = object.__new__(kind)
    made._received = {'has_control': [(1.0, False)], 'goal_state': []}
    made._has_granted = made._is_control_taken = False
    made.sent, made.ignored, made._permission = [], 0, made

    def publish(value):
        made.sent.append(value)
        is_taken = made.sent[-2:] == [False, True] and made.sent.count(True) > made.ignored
        made._received['has_control'] = [(1.0, is_taken)]
    made.publish = publish
    return made


@needs_setup
def test_a_second_master_is_refused_with_the_keys_that_end_the_first():
    with socket.create_server(('127.0.0.1', 0)) as master:
        uri = 'http://localhost:{}'.format(master.getsockname()[1])
        done = subprocess.run([str(SCRIPTS / 'demo.sh')], env=dict(os.environ, ROS_MASTER_URI=uri), timeout=600.0,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True)
    assert (done.returncode, done.stdout, done.stderr.count('\n')) == (1, '', 1)
    assert 'a ROS master is running at ' + uri in done.stderr
    assert all(words in done.stderr for words in ('Ctrl+C', 'fg', 'export ROS_MASTER_URI='))


def message(value, sender):
    return SimpleNamespace(data=value, _connection_header={'callerid': sender})


@pytest.mark.parametrize('ignored', [0, 2])
def test_control_is_given_until_move_to_goal_takes_it(demo, ignored):
    demo.ignored = ignored
    demo._give_control()
    assert demo.sent == [False, True] * (ignored + 1)


def test_a_false_of_another_node_is_a_stop_only_after_control_was_given(demo):
    demo._on_control(message(False, '/gamepad'))    # the pad starts
    demo._give_control()
    demo._received['goal_state'].append((2.0, 'ROTATE_TO_GOAL'))
    demo._on_control(message(False, '/unnamed'))    # the demonstration's own False
    demo._on_control(message(True, '/gamepad'))
    assert demo._wait_for_arrival('goal_state') == (2.0, 'ROTATE_TO_GOAL')
    demo._on_control(message(False, '/gamepad'))
    with pytest.raises(demo._wait_for_arrival.__globals__['ControlTaken']):
        demo._wait_for_arrival('goal_state')
    demo._received['has_control'] = [(3.0, False)]
    demo._give_control()    # before the next drive
    assert demo.sent == [False, True]
