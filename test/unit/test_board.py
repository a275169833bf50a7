"""Faults of the robot's own board: its power, its serial link, the errors of its stamps."""
import math
from dataclasses import replace

import pytest
from simulated import STIFF, drive, imu_of, odom_of

from tb3_labs.simulation.simulator import Simulator


def switched(robot, **faults):
    robot.configure(replace(robot.config, **faults))


def spinning(**settings):
    robot = Simulator(replace(STIFF, **settings))
    drive(robot, 1.0, 0.0, 1.0)
    return robot


@pytest.mark.parametrize('seed', range(8))
def test_without_the_serial_node_the_wheels_stop_late_and_nothing_is_heard(seed):
    robot = spinning(seed=seed)
    begin = robot.now
    switched(robot, serial_dead=True)
    while robot.true_velocity != (0.0, 0.0):
        robot.command(0.2, 0.0)         # lost
        assert robot.step(0.01) == []
    assert 0.50 <= robot.now - begin <= 0.96 + 1 / 30


def test_a_serial_node_that_is_back_soon_finds_the_odometry_as_it_was():
    robot = spinning()
    switched(robot, serial_dead=True)
    robot.step(8.9)
    switched(robot, serial_dead=False)
    assert odom_of(robot.step(0.1))[-1].pose.yaw == pytest.approx(robot.truth.yaw, abs=1e-9)
    drive(robot, 0.5, 0.1, 0.0)
    assert robot.true_velocity[0] > 0.09


def test_a_serial_node_that_is_back_late_is_a_new_connection():
    robot = spinning()
    switched(robot, serial_dead=True)
    robot.step(9.1)
    switched(robot, serial_dead=False)
    assert robot.step(2.5) == []        # the board calibrates its gyro
    pose = odom_of(robot.step(0.2))[-1].pose
    assert (pose.x, pose.y, math.degrees(pose.yaw)) == pytest.approx((0.0, 0.0, 1.82), abs=0.01)


def test_a_board_without_power_stands_and_starts_from_zero():
    robot = spinning(gyro_bias_deg=3.0)
    switched(robot, board_off=True)
    robot.command(0.1, 0.0)
    assert robot.step(1.0) == [] and robot.true_velocity == (0.0, 0.0)
    switched(robot, board_off=False)
    samples = robot.step(9.0)
    assert len(imu_of(samples)) == 1 + 49   # one before the calibration, then 0.24 s of them
    assert imu_of(samples)[-1].yaw_rate == pytest.approx(0.0)
    assert robot.true_velocity == (0.0, 0.0)
    drive(robot, 0.5, 0.1, 0.0)
    assert robot.true_velocity[0] > 0.09


def test_a_cold_start_is_that_of_the_board():
    robot = Simulator(replace(STIFF, cold_start=True, start_x=2.0))
    robot.command(0.1, 0.0)
    assert robot.step(6.1) == [] and robot.truth.x == 2.0
    last = odom_of(robot.step(3.0))[-1].pose
    here = robot.odometry_origin @ last
    assert (here.x, here.y, here.yaw) == pytest.approx((robot.truth.x, robot.truth.y, 0.0))


def test_all_stamps_step_together_every_5_seconds():
    robot, true = Simulator(replace(STIFF, stamp_step=0.02)), Simulator(STIFF)
    errors = [[round(sample.stamp - right.stamp, 9) for sample, right in zip(
        robot.step(5.0), true.step(5.0))] for _ in range(8)]
    assert robot.odometry_stamp == pytest.approx(true.odometry_stamp + errors[-1][-2], abs=0.04)
    kinds = [set(error[:-2]) for error in errors]
    assert all(len(kind) <= 2 for kind in kinds) and len(set.union(*kinds)) >= 8
    assert 0.01 < max(map(abs, set.union(*kinds))) <= 0.02
