"""The local frame: declared pose times true motion, for any zero of odometry and IMU."""
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from known_motion import SteadyRobot, Truth, as_pose2, assert_pose
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.local_frame import LocalFrame

METRES, TURNS = st.floats(-10.0, 10.0), st.floats(-7.0, 7.0)
TRUTHS = st.builds(Truth, st.builds(complex, METRES, METRES), TURNS)
OFFSETS_DEG = [0.0, -1.3, -34.6, -47.7, 59.1, -105.5, 140.6, 180.0, -180.0]   # of real robots


def sensors(robot, time):
    """(odom_T_base, IMU yaw) of a SteadyRobot."""
    return robot.odometry(time).pose, robot.imu(time).yaw


@given(TRUTHS, TRUTHS, TRUTHS, st.one_of(TURNS, st.sampled_from(OFFSETS_DEG).map(math.radians)))
def test_the_pose_is_the_declared_one_times_the_true_motion(start, declared, motion, imu_offset):
    end = start.then(*motion)
    frame = LocalFrame.declared(as_pose2(declared), as_pose2(start),
                                as_pose2(start).yaw + imu_offset)
    pose = frame.pose(as_pose2(end), as_pose2(end).yaw + imu_offset)
    assert_pose(pose, declared.then(*motion))


@given(TRUTHS, TRUTHS, TRUTHS, TURNS)
def test_the_transform_shown_in_tf_puts_the_robot_where_odometry_has_it(start, declared, motion,
                                                                        imu_yaw):
    frame = LocalFrame.declared(as_pose2(declared), as_pose2(start), imu_yaw)
    odom_T_base = as_pose2(start.then(*motion))
    place = frame.pose(odom_T_base, 0.0)
    assert frame.odom_T_local.act((place.x, place.y)) == pytest.approx(
        (odom_T_base.x, odom_T_base.y), abs=1e-9)


def test_the_heading_is_the_imus_also_where_odometry_slipped():
    frame = LocalFrame.declared(Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0), 1.0)
    assert frame.pose(Pose2(0.0, 0.0, 0.5), 1.25).yaw == pytest.approx(0.25)
    assert frame.heading(1.25) == pytest.approx(0.25)


def test_both_sensors_cross_half_a_turn_at_different_times():
    """Two rounds each way: odometry crosses +/-180 deg 140.6 deg of turning after the IMU."""
    declared = Truth(0.2 - 0.1j, 3.0)
    for rate in (0.5, -0.5):
        robot = SteadyRobot(0.2, rate, Truth(4.8 - 0.3j, 1.0), math.radians(140.6))
        frame = LocalFrame.declared(as_pose2(declared), *sensors(robot, 0.0))
        for k in range(1000):
            time = 4.0 * math.pi / abs(rate) * k / 1000
            assert_pose(frame.pose(*sensors(robot, time)), declared.then(*robot.moved(time)))


def test_knows_by_how_much_imu_and_odometry_differ():
    frame = LocalFrame.declared(Pose2(1.0, -2.0, 0.4), Pose2(4.8, -0.3, -1.84), 0.6)
    assert frame.imu_minus_odometry == pytest.approx(0.6 + 1.84)
