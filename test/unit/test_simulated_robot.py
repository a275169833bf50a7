"""The simulated robot's motion, its own reset, faults and network, against physics and firmware."""
from dataclasses import replace

import pytest
from simulated import QUIET, STIFF, TICK, close, drive, imu_of, odom_of, switch

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig


# Reset --------------------------------------------------------------------------------------------

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


# Network and faults -------------------------------------------------------------------------------

@pytest.mark.parametrize('fault, frozen_of', [('imu_frozen', imu_of), ('odom_frozen', odom_of)])
def test_a_frozen_sensor_repeats_itself_with_new_stamps(fault, frozen_of):
    robot = Simulator()
    drive(robot, 1.0, 0.1, 0.5)
    switch(robot, **{fault: True})
    frozen = frozen_of(drive(robot, 1.0, 0.1, 0.5))
    assert len(frozen) >= 29 and len({s.stamp for s in frozen}) == len(frozen)
    assert all(s[1:] == frozen[0][1:] for s in frozen)
    for is_frozen in (False, True):     # and the next time it repeats another sample
        switch(robot, **{fault: is_frozen})
        other = frozen_of(drive(robot, 0.1, 0.1, 0.5))[-1]
        assert other[1:] != frozen[0][1:]


def test_a_change_of_what_is_no_fault_leaves_a_frozen_sensor_alone():
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
