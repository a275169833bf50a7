"""The guarantees of the law of drives at each step."""
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.control.commands import LawStep
from tb3_labs.control.drive_law import DriveConfig, DriveLaw
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import Motion
from tb3_labs.robot.turtlebot3 import Twist2, robot_model

BURGER = robot_model('burger')


def at(x, y, yaw, linear=0.0, angular=0.0):
    return Motion(Pose2(x, y, yaw), linear, angular)


def begun(goal, **settings):
    """A DriveLaw that has begun a drive from the origin."""
    law = DriveLaw(DriveConfig(**settings), BURGER)
    law.start(Pose2(), goal)
    return law


def moves(law, move, motion, goal, times=10):
    """Returns the last one of this number of steps of a law, one in each period."""
    return [move(motion, goal, law.period) for _ in range(times)][-1]


yaws = st.floats(-math.pi, math.pi)
places = st.floats(-5.0, 5.0)


@given(places, places, yaws, places, places, yaws, st.floats(-0.3, 0.3), st.floats(-3.0, 3.0),
       st.sampled_from(['burger', 'waffle']), st.booleans())
def test_no_command_exceeds_a_limit(x, y, yaw, goal_x, goal_y, goal_yaw, linear, angular, name,
                                    reverse):
    model = robot_model(name)
    law = DriveLaw(DriveConfig(allow_reverse=reverse), model)
    goal = Pose2(goal_x, goal_y, goal_yaw)
    law.start(Pose2(x, y, yaw), goal)
    for move in (law.rotate_to_goal, law.move_forward, law.rotate_to_final):
        for _ in range(10):
            command = move(at(x, y, yaw, linear, angular), goal, 0.02).command
            assert abs(command.linear) <= model.max_linear + 1e-9
            assert abs(command.angular) <= min(1.5, model.max_angular) + 1e-9
            wheel = abs(command.linear) + model.half_track * abs(command.angular)
            assert wheel <= model.max_wheel_speed + 1e-9
            assert reverse or command.linear >= 0.0


@pytest.mark.parametrize('goal, backwards', [
    (Pose2(-1.0, 0.0, 0.0), True),            # right behind, to be faced as now
    (Pose2(1.0, 0.0, 0.0), False),
    (Pose2(-1.0, 0.0, math.pi), False),       # behind, to be faced backwards: same turns
    (Pose2(-0.61, 0.61, 0.0), True),          # 45 + 45 instead of 135 + 135 deg
])
def test_a_drive_is_reversed_only_if_shorter_and_allowed(goal, backwards):
    for allowed in (False, True):
        law = begun(goal, allow_reverse=allowed)
        step = moves(law, law.move_forward, at(0.0, 0.0, 0.0), goal)
        assert (step.command.linear < 0.0) is (allowed and backwards)


EITHER_WAY = [(Pose2(3.0, 0.0, 0.0), 1.0), (Pose2(-3.0, 0.0, 0.0), -1.0)]


@pytest.mark.parametrize('goal, forwards', EITHER_WAY)
def test_configured_limits_hold_forwards_and_backwards(goal, forwards):
    law = begun(goal, max_linear=0.1, max_angular=0.3, allow_reverse=True)
    # 4 m/s^2 over one period of 1/30 s is more than the limit
    assert moves(law, law.move_forward, at(0.0, 0.0, 0.0), goal).command.linear == pytest.approx(
        0.1 * forwards)
    assert moves(law, law.rotate_to_final, at(0.0, 0.0, 2.0), goal).command.angular == (
        pytest.approx(-0.3))


@pytest.mark.parametrize('distance, there', [(0.0049, True), (0.0051, False)])
def test_at_a_goal_within_half_the_tolerance_the_robot_only_turns(distance, there):
    goal = Pose2(0.0, distance, 0.0)
    law = begun(goal)
    step = law.rotate_to_goal(at(0.0, 0.0, 0.0), goal, law.period)
    if there:
        assert step == LawStep(Twist2(), 0.0, True)
    else:
        assert step.remaining == pytest.approx(math.pi / 2.0) and step.command.angular > 0.0
        assert not step.is_finished


@pytest.mark.parametrize('left, arrived', [(0.0035, False), (0.0015, True), (-0.0003, True),
                                           (-0.0006, False)])
def test_move_forward_ends_if_a_stop_now_ends_at_the_goal(left, arrived):
    """At 0.1 m/s it coasts on for 0.1 exp(-(1 / 30) / 0.05) 0.05 = 2.6 mm. A predicted rest from
    0.5 mm ahead to 3 mm (0.3 of the tolerance) beyond the goal is a rest; a robot that is farther has slipped."""
    goal = Pose2(1.0, 0.0, 0.0)
    law = begun(goal)
    step = law.move_forward(at(1.0 - left, 0.0, 0.0, 0.1), goal, law.period)
    assert step.is_finished is arrived
