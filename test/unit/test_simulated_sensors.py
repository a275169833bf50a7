"""The samples of the simulated robot, against physics and the firmware's known behaviour."""
import math
from dataclasses import replace

import pytest
from simulated import QUIET, STIFF, TICK, close, drive, imu_of, odom_of

from tb3_labs.geometry.angles import wrap
from tb3_labs.simulation.simulator import Simulator


def test_the_odometry_follows_the_truth_to_the_ticks():
    robot = Simulator(replace(QUIET, start_x=1.0, start_y=-2.0, start_yaw_deg=-100.0))
    for linear, angular in ((0.2, 0.0), (0.1, 0.6), (-0.1, -0.6), (0.0, 1.0)):
        sample = odom_of(drive(robot, 2.0, linear, angular))[-1]
        assert sample.stamp == pytest.approx(robot.now)
        assert close(sample.pose, robot.truth, metres=2 * TICK + 1e-4, radians=1e-9)
        v, w = robot.true_velocity
        assert sample.linear == pytest.approx(v, abs=TICK * 30)
        assert sample.angular == pytest.approx(w, abs=1e-6)


@pytest.mark.parametrize('offset', [0.0, 140.0, -105.5, 180.0, 360.0])
def test_imu_and_odometry_differ_by_the_offset(offset):
    robot = Simulator(replace(QUIET, start_yaw_deg=50.0, imu_offset_deg=offset))
    samples = drive(robot, 4.0, 0.0, -2.0)
    yaw_at = {round(s.stamp, 6): s.yaw for s in imu_of(samples)}
    pairs = [(yaw_at[round(s.stamp, 6)], s.pose.yaw) for s in odom_of(samples)
             if round(s.stamp, 6) in yaw_at]
    assert len(pairs) > 30
    for imu_yaw, odom_yaw in pairs:
        assert -math.pi < imu_yaw <= math.pi and -math.pi < odom_yaw <= math.pi
        assert wrap(imu_yaw - odom_yaw - math.radians(offset)) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize('direction', [-1, 1])
@pytest.mark.parametrize('offset', [0.0, 90.0])
def test_one_spike_where_the_imu_crosses_half_a_turn(direction, offset):
    config = replace(STIFF, start_yaw_deg=direction * 140.0, imu_offset_deg=offset)
    robot = Simulator(config)
    samples = odom_of(drive(robot, 6.0, 0.05, direction * 1.0))
    spikes = [s for s in samples if abs(s.angular) > 10.0]
    assert len(spikes) == 1
    # The board takes the crossing for a whole turn the other way within 1/30 s.
    rate = robot.true_velocity[1]
    assert spikes[0].angular == pytest.approx(rate - direction * 2 * math.pi * 30, abs=0.01)
    before = samples[samples.index(spikes[0]) - 1]
    moved = before.pose.inverse() @ spikes[0].pose
    assert moved.x == pytest.approx(-0.05 / 30, abs=2 * TICK)     # reversed
    assert samples[-1].pose.yaw == pytest.approx(robot.truth.yaw, abs=1e-9)
