"""The robot's own board and its motors: sums by hand, closed forms, and errors of its stamps."""
import math
from dataclasses import replace

import numpy as np
import pytest
from simulated import STIFF, close

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.simulation.drivetrain import Drivetrain
from tb3_labs.simulation.firmware import motor_speeds
from tb3_labs.simulation.simulator import Simulator

BURGER = robot_model('burger')
RADIUS, TRACK = 0.033, 0.16             # [m] radius of a wheel, distance between the wheels
TICK_ANGLE = 2.0 * math.pi / 4096             # [rad] of the motor's encoder
STEP = 0.229 * 2.0 * math.pi / 60.0     # [rad/s] of the motor's speed


@pytest.mark.parametrize('linear, angular, left, right', [
    (0.1, 0.0, 126, 126), (-0.1, 0.0, -126, -126),     # 0.1 m/s is 126.4 steps
    (0.0, 1.0, -101, 101), (0.0, -1.0, 101, -101),     # 0.08 m/s is 101.1 steps
    (0.1, 1.0, 25, 227), (9.0, 0.0, 265, 265), (0.0, -9.0, 265, -265),
    # after rosserial, on a real board: full speed, 1.494, 0.999 rad/s
    (math.nan, 0.0, 265, 265), (-math.inf, 0.0, -265, -265), (-math.nan, 0.0, -265, -265),
    (0.0, math.nan, -151, 151), (0.0, math.inf, -101, 101), (0.0, -math.inf, 101, -101)])
def test_a_command_is_whole_steps_of_both_motors(linear, angular, left, right):
    assert motor_speeds(linear, angular, BURGER) == pytest.approx((left * STEP, right * STEP))


def test_all_stamps_step_together_every_5_seconds():
    robot, true = Simulator(replace(STIFF, stamp_step=0.02)), Simulator(STIFF)
    errors = [[round(sample.stamp - right.stamp, 9) for sample, right in zip(
        robot.step(5.0), true.step(5.0))] for _ in range(8)]
    assert robot.sensors.wheel_readings[-1][0] == pytest.approx(
        true.sensors.wheel_readings[-1][0] + errors[-1][-2], abs=0.04)
    kinds = [set(error[:-2]) for error in errors]
    assert all(len(kind) <= 2 for kind in kinds) and len(set.union(*kinds)) >= 8
    assert 0.01 < max(map(abs, set.union(*kinds))) <= 0.02


def train(left=0.0, right=0.0, start=Pose2(), **physics):
    drivetrain = Drivetrain(BURGER, start)
    drivetrain.set_physics(**dict(dict(lag=0.0, mismatch=0.0, slip=0.0), **physics))
    drivetrain.set_goal_speeds(left, right)
    return drivetrain


@pytest.mark.parametrize('goals', [(4.0, 4.0), (0.0, 4.0), (-2.0, 0.0)])
def test_the_wheels_carry_the_robot_as_far_as_their_own_size_says(goals):
    drivetrain = train(*goals, mismatch=0.2, slip=0.5)
    left, right = RADIUS * 0.5 * goals[0], RADIUS * 0.5 * 0.8 * goals[1]     # over the floor [m/s]
    drivetrain.advance(2.0)
    turned = 2.0 * (right - left) / TRACK
    radius = TRACK / 2.0 * (right + left) / (right - left)
    assert close(drivetrain.pose, Pose2(
        radius * math.sin(turned), radius * (1.0 - math.cos(turned)), turned))
    assert drivetrain.angles == pytest.approx(np.multiply(2.0, goals))    # without slip and mismatch
