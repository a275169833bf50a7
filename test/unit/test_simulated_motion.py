"""The simulated robot's motion, and its own reset, against physics and the firmware."""
import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated import MOTOR_STEP, QUIET, STIFF, TICK, close, drive, imu_of, odom_of

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.simulation.simulator import Simulator


def test_pose_while_the_speed_changes():
    """From straight ahead into a curve, against the integral of the same exponentials in 30,000
    steps."""
    robot = Simulator(QUIET)
    drive(robot, 1.0, 0.2, 0.0)
    before = robot.truth
    drive(robot, 0.5, 0.1, 1.3)
    left, right = (int((0.1 + s * 0.104) / MOTOR_STEP) * MOTOR_STEP for s in (-1, 1))
    straight = 252 * MOTOR_STEP
    x, y, yaw = straight / 30, 0.0, 0.0   # up to the board's next tick
    dt = (0.5 - 1 / 30) / 30000
    for k in range(30000):
        fading = math.exp(-(k + 0.5) * dt / 0.05)
        turn = (right - left) / 0.16 * (1 - fading) * dt
        way = ((left + right) / 2 * (1 - fading) + straight * fading) * dt
        x += way * math.cos(yaw + turn / 2)
        y += way * math.sin(yaw + turn / 2)
        yaw += turn
    assert close(before.inverse() @ robot.truth, Pose2(x, y, yaw), metres=1e-5, radians=1e-8)


@settings(max_examples=25, deadline=None)
@given(st.floats(-100, 100), st.floats(-100, 100), st.floats(-360, 360))
def test_the_start_only_moves_the_whole_drive(x, y, yaw_deg):
    moved = Simulator(replace(QUIET, start_x=x, start_y=y, start_yaw_deg=yaw_deg))
    plain = Simulator(QUIET)
    for robot in moved, plain:
        drive(robot, 2.0, 0.1, 0.7)
    start = Pose2(x, y, math.radians(yaw_deg))
    assert close(moved.truth, start @ plain.truth, metres=1e-9, radians=1e-9)


# Reset --------------------------------------------------------------------------------------------

RAW = math.radians(0.71)    # bias of a gyro that is not calibrated [rad/s]


def test_reset_at_rest_zeroes_the_place_and_moves_the_yaw_by_the_raw_gyros_bias():
    robot = Simulator(replace(QUIET, start_x=2.0, start_yaw_deg=30.0, imu_offset_deg=10.0,
                              gyro_bias_deg=5.0))
    drive(robot, 2.0, 0.1, 0.3)
    drive(robot, 0.5, 0.0, 0.0)
    before = imu_of(robot.step(0.1))[-1]
    assert before.yaw_rate == pytest.approx(math.radians(5.0), abs=1e-5)
    truth, moment = robot.truth, robot.now
    robot.reset()
    samples = robot.step(3.5)
    assert samples[0].stamp == pytest.approx(moment + 2.56, abs=0.01)
    # 0.6 s after the stop the wheels still turn by some nanometres.
    turned = Pose2(0.0, 0.0, RAW * 2.56)
    for sample in odom_of(samples)[-1], odom_of(samples)[-20]:
        assert close(sample.pose, turned, metres=1e-6, radians=math.radians(5.0) / 25.0)
    assert close(odom_of(samples)[-1].pose, odom_of(samples)[-20].pose, radians=1e-6)
    assert imu_of(samples)[-1].yaw_rate == pytest.approx(0.0, abs=1e-6)
    assert wrap(imu_of(samples)[-1].yaw - before.yaw) == pytest.approx(
        RAW * 2.56, abs=math.radians(5.0) / 150.0)
    assert robot.sensors.odometer.wheel_angles == (0.0, 0.0)
    assert close(robot.truth, truth, metres=1e-6, radians=1e-6)


def test_commands_and_resets_of_the_pause_are_obeyed_late_in_their_order():
    robot = Simulator(replace(STIFF, reset_pause=0.5))
    robot.reset()
    robot.step(0.3)
    robot.command(-0.1, 0.0)
    robot.reset()
    robot.command(0.1, 0.0)
    assert robot.step(0.65) == [] and robot.truth == Pose2()     # the second one is under way
    robot.step(0.1)
    assert robot.true_velocity[0] > 0.09    # 0.7 s after it was sent
    robot.step(0.4)
    assert robot.true_velocity[0] > 0.09    # as long as a command that is read in time
    robot.step(0.1)
    assert robot.true_velocity == (0.0, 0.0)


def test_the_odometry_stands_in_the_world_where_the_last_reset_ended():
    robot = Simulator(replace(STIFF, start_x=1.0, start_y=-2.0, start_yaw_deg=30.0,
                              reset_pause=0.31))
    assert robot.sensors.origin == Pose2()          # the odometry starts at the true pose
    for linear, angular in ((0.1, 0.5), (-0.1, 0.3)):
        drive(robot, 1.0, linear, angular)
        robot.step(0.6)                 # the command has timed out: it stands
        robot.reset()
        sample = odom_of(robot.step(0.4))[-1]
        assert close(robot.sensors.origin @ sample.pose, robot.truth)
    drive(robot, 1.0, 0.1, 0.4)
    sample = odom_of(robot.step(0.1))[-1]
    here = robot.sensors.origin @ sample.pose
    assert close(here, robot.truth, metres=3 * TICK + 0.1 / 30.0, radians=0.5 / 30.0)
    drive(robot, 0.5, 0.1, 0.0)
    robot.reset()                       # in motion
    sample = odom_of(drive(robot, 1.0, 0.1, 0.0))[-1]
    assert close(robot.sensors.origin @ sample.pose, robot.truth, metres=3 * TICK)


def test_the_wheels_are_as_old_as_their_lag_says():
    late = Simulator(replace(QUIET, wheel_lag=0.1))
    direct = Simulator(replace(QUIET, odom_rate=10.0))
    speeds = (0.1, 0.2, -0.1)
    directly = [drive(direct, 0.5, speed, 0.0) for speed in speeds]
    samples = [drive(late, 0.5, speed, 0.0) for speed in speeds]
    way = {round(sample.stamp, 3): sample.pose.x for sample in odom_of(sum(directly, []))}
    seen = {round(sample.stamp, 3): sample.pose.x for sample in odom_of(sum(samples, []))}
    for stamp in way:
        if stamp < 1.4:
            assert seen[round(stamp + 0.1, 3)] == pytest.approx(way[stamp], abs=1e-12)


def test_the_stamp_of_the_last_odometry_is_known_whether_or_not_it_has_arrived():
    robot = Simulator(replace(STIFF, sensor_latency=3.0))
    assert robot.sensors.odometry_stamp == 0.0
    assert robot.step(1.01) == [] and robot.sensors.odometry_stamp == pytest.approx(1.0)
