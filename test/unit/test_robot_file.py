"""A robot's numbers are those of the simulated robot, and the laws begin with them."""
import math
from dataclasses import fields

import pytest
from rollout import drive, turns

from tb3_labs.control.motor_response import FIRST_DELAY, FIRST_LAG, MAX_DELAY, MAX_LAG
from tb3_labs.control.robot_file import (
    RobotFileConfig, RobotNumbers, read_response, response_of)
from tb3_labs.control.turning import PreciseTurn
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import MODELS
from tb3_labs.simulation.simulator_config import SimulatorConfig

BURGER = MODELS['burger']
SLOW = dict(motor_lag=0.15, command_latency=0.1, sensor_latency=0.1)


def test_each_number_is_a_setting_of_the_simulated_robot():
    settings = {item.name: item for item in fields(SimulatorConfig)}
    for item in fields(RobotNumbers):
        if item.name in settings:
            theirs = settings[item.name]
            assert item.default == theirs.default
            for bound in ('low', 'high', 'unit'):
                assert item.metadata[bound] == theirs.metadata[bound]
    assert len(set(settings) & {item.name for item in fields(RobotNumbers)}) >= 5


def test_the_delay_is_that_of_the_round_trip():
    slow = response_of(dict(SLOW, seed=7, yaw_lag=0.01, command_jitter=0.02), BURGER)
    assert (slow.delay, slow.lag) == pytest.approx((1.0 / 60.0 + 0.23, 0.15))
    assert (slow.gain, slow.turn_scale) == (1.0, 1.0)
    late = response_of({'command_latency': 3, 'motor_lag': 2.0}, BURGER)
    assert (late.delay, late.lag) == (MAX_DELAY, MAX_LAG)


@pytest.mark.parametrize('given, words', [
    ({'motor_lag': 'slow'}, "motor_lag = 'slow' is not valid: a number from 0 to 2 s"),
    ({'sensor_latency': math.nan}, 'sensor_latency'), ({'motor_lag': -0.1}, 'motor_lag'),
    ({'wheel_separation': 0.287}, 'the burger has 0.16 m'), ({'wheel_separation': 0.1}, 'burger')])
def test_a_bad_number_is_refused(given, words):
    with pytest.raises(ValueError, match=words):
        response_of(given, BURGER)


@pytest.mark.parametrize('text, words', [
    (None, 'No such file'), (b'', 'motor_lag: 0.05'), (b'- 1', 'motor_lag: 0.05'), (b'\xff: 1', 'utf-8'),
    (b'a: [', 'flow'), (b'motor_lag: -1\n', 'motor_lag = -1.0'), (b'{[1]: 2}', 'unhashable')])
def test_a_bad_file_is_one_line(tmp_path, text, words):
    path = tmp_path / 'robot3.yaml'
    if text is not None:
        path.write_bytes(text)
    with pytest.raises(ValueError, match=words) as caught:
        read_response(RobotFileConfig(str(path)), BURGER)
    assert len(str(caught.value).splitlines()) == 1 and str(path) in str(caught.value)


def test_a_file_of_the_simulated_robot_is_read_and_without_one_all_is_usual(tmp_path, monkeypatch):
    (tmp_path / 'robot3.yaml').write_text('motor_lag: 0.12\nimu_rate: 115.0\n')
    monkeypatch.setenv('PWD', str(tmp_path))    # the folder of the terminal
    assert read_response(RobotFileConfig('robot3.yaml'), BURGER).lag == 0.12
    usual = read_response(RobotFileConfig(), BURGER)
    assert (usual.delay, usual.lag, usual.turn_scale) == (FIRST_DELAY, FIRST_LAG, 1.0)


def test_a_robot_with_wider_wheels_is_told_to_turn_faster():
    for separation, scale in ((0.16, 1.0), (0.176, 1.1), (0.144, 0.9)):
        response = response_of({'wheel_separation': separation}, BURGER)
        turn = PreciseTurn(1.0, 45.0, 0.01, response)
        turn.start(0.0, 3.0)
        assert turn.step(0.0, 0.0, 1.0 / 30.0).command.angular == pytest.approx(scale)


def test_the_first_drive_of_a_slow_robot_stops_nearer_to_its_goal():
    """A straight drive: its odometry does not show the lag."""
    robot, goal = SimulatorConfig(motor_lag=0.15), Pose2(1.0)
    known = response_of({'motor_lag': 0.15}, BURGER)
    assert drive(goal, robot).distance_error > 0.004
    assert drive(goal, robot, response=known).distance_error < 0.001
    turn, = turns([90.0], SimulatorConfig(**SLOW), response=response_of(SLOW, BURGER))
    assert math.degrees(turn.turned) == pytest.approx(90.0, abs=0.12)
