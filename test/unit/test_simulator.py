"""The simulated robot: its clock, settings that may change later, its own reset, and faults."""
import math
from dataclasses import astuple, fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated import QUIET, STIFF, TICK, close, drive, imu_of, odom_of, switch

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import FIXED_FIELDS, SimulatorConfig


def test_a_long_step_gives_every_sample_that_is_due():
    samples = Simulator(QUIET).step(10.0)
    assert [s.stamp for s in imu_of(samples)] == pytest.approx([k / 200 for k in range(1, 2001)])
    assert [s.stamp for s in odom_of(samples)] == pytest.approx([k / 30 for k in range(1, 301)])
    assert [s.stamp for s in samples] == sorted(s.stamp for s in samples)


def test_the_imu_shows_the_true_yaw_plus_its_offset_and_its_drift():
    robot = Simulator(replace(QUIET, start_yaw_deg=30.0, imu_offset_deg=40.0, imu_drift_deg_per_min=6.0))
    assert math.degrees(imu_of(robot.step(10.0))[-1].yaw) == pytest.approx(71.0, abs=0.01)


def numbers(sample):
    return np.hstack([astuple(part) if isinstance(part, Pose2) else part for part in sample])


def same(samples, others):
    """Are the samples of the same sensors in the same order, and equal but for the last digits? Times that
    are cut add up to others in these."""
    return ([type(sample) for sample in samples] == [type(other) for other in others]
            and all(numbers(sample) == pytest.approx(numbers(other), rel=1e-12, abs=1e-12)
                    for sample, other in zip(samples, others)))


@settings(max_examples=12)
@given(st.lists(st.floats(0.0, 0.3), min_size=1, max_size=20), st.integers(0, 1000),
       st.sampled_from([{'sensor_latency': 0.02}, NETWORKS['good'], NETWORKS['bad'],
                        {'stalls_per_min': 120.0}]))
def test_small_steps_give_the_samples_of_large_steps(cuts, seed, network):
    config = SimulatorConfig(seed=seed, **network)
    fine, coarse = Simulator(config), Simulator(config)
    for robot in fine, coarse:
        robot.command(0.15, 1.0)
    samples = [sample for cut in cuts for sample in fine.step(cut)]
    assert same(samples, coarse.step(sum(cuts)))
    assert close(fine.truth, coarse.truth)
    # the same is true after a change of the network
    other = replace(config, network_cut=False, **NETWORKS['busy'])
    samples = []
    for robot in fine, coarse:
        robot.configure(replace(other, network_cut=True))
        robot.command(-0.1, 0.5)
        samples.append(robot.step(0.0))
    assert samples == [[], []]
    samples = [[sample for _ in range(10) for sample in fine.step(0.05)], coarse.step(0.5)]
    assert samples == [[], []]
    for robot in fine, coarse:
        robot.configure(other)
    samples = [sample for _ in range(40) for sample in fine.step(0.025)]
    assert same(samples, coarse.step(1.0))
    assert close(fine.truth, coarse.truth)


@pytest.mark.parametrize('name', sorted(
    {item.name for item in fields(SimulatorConfig)} - set(FIXED_FIELDS)
    - {'imu_silent', 'imu_frozen', 'odom_silent', 'odom_frozen', 'network_cut'}))
def test_physics_may_change_while_the_robot_drives(name):
    """A change of settings keeps the motion so far: no pose jumps."""
    robot = Simulator(QUIET)
    drive(robot, 1.0, 0.1, 0.5)
    robot.step(0.013)   # between two ticks of the board
    truth = robot.truth
    value = getattr(robot.config, name)
    changed = 20.0
    if isinstance(value, bool):
        changed = not value
    elif value < 1.0:
        changed = 0.3 + value / 2.0
    changed = {'reset_pause': 1.0, 'stamp_step': 0.1}.get(name, changed)
    switch(robot, **{name: changed})
    assert close(robot.truth, truth, metres=1e-6, radians=1e-6)
    assert drive(robot, 1.0, 0.1, 0.5)


def test_the_odometry_stands_in_the_world_where_the_last_reset_ended():
    robot = Simulator(replace(STIFF, start_x=1.0, start_y=-2.0, start_yaw_deg=30.0,
                              reset_pause=0.31))
    assert robot.sensors.world_T_odom == Pose2()          # the odometry starts at the true pose
    for linear, angular in ((0.1, 0.5), (-0.1, 0.3)):
        drive(robot, 1.0, linear, angular)
        robot.step(0.6)                 # the command has timed out, so the robot stands
        robot.reset()
        sample = odom_of(robot.step(0.4))[-1]
        assert close(robot.sensors.world_T_odom @ sample.pose, robot.truth)
    drive(robot, 1.0, 0.1, 0.4)
    sample = odom_of(robot.step(0.1))[-1]
    here = robot.sensors.world_T_odom @ sample.pose
    assert close(here, robot.truth, metres=3 * TICK + 0.1 / 30.0, radians=0.5 / 30.0)
    drive(robot, 0.5, 0.1, 0.0)
    robot.reset()                       # in motion
    sample = odom_of(drive(robot, 1.0, 0.1, 0.0))[-1]
    assert close(robot.sensors.world_T_odom @ sample.pose, robot.truth, metres=3 * TICK)


def test_another_setting_does_not_thaw_a_frozen_sensor():
    robot, yaws = Simulator(SimulatorConfig(imu_rate=60.0, imu_frozen=True)), set()
    for k in range(20):
        switch(robot, motor_lag=0.001 * k)
        yaws.update(sample.yaw for sample in imu_of(robot.step(0.1)))
    assert len(yaws) == 1


def test_without_battery_the_odometry_repeats_its_last_step_and_the_wheels_stand():
    """The firmware does so, also after a reset. The speeds in joint_states go on, too."""
    robot = Simulator(STIFF)
    before, wheels = odom_of(drive(robot, 1.0, 0.2, 0.0))[-1], robot.sensors.odometer
    angles, speeds = wheels.wheel_angles, wheels.wheel_speeds
    switch(robot, battery_cut=True)
    place, last = robot.truth, odom_of(drive(robot, 5.0, 0.0, 0.0))[-1]
    assert robot.truth.distance_to(place) < 0.01
    assert last.pose.x - before.pose.x == pytest.approx(5.0 * before.linear, abs=0.01)
    robot.reset()
    last = odom_of(drive(robot, 3.0, 0.0, 0.0))[-1]
    assert last.linear == pytest.approx(before.linear) and last.pose.x > 0.05
    assert wheels.wheel_angles == angles and wheels.wheel_speeds == pytest.approx(speeds)
    switch(robot, battery_cut=False)
    assert odom_of(drive(robot, 1.0, 0.0, 0.0))[-1].linear == 0.0
