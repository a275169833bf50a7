"""Messages of strangers: absurd numbers, no sender's name, codes that a terminal obeys. Whatever numbers a
message has, it is refused with a reason, or read as numbers that a robot can have."""
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from genpy import Time
from geometry_msgs.msg import Pose
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Header

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.msg import MouseController
from tb3_labs.nodes.controller.mouse import to_mouse
from tb3_labs.nodes.move_to_goal.ros_goals_and_resets import to_requested_pose
from tb3_labs.ros.conversions import to_odometry_sample, to_pose2, to_pose_stamped, to_quaternion
from tb3_labs.ros.rospy_internals import sender_of
from tb3_labs.ros.sensor_topics import to_imu_sample, to_wheel_sample


def imu(rate=0.0, covariance=0.0, gyro_covariance=0.0):
    message = Imu()
    message.orientation.w = 1.0
    message.angular_velocity.z = rate
    message.orientation_covariance[0] = covariance
    message.angular_velocity_covariance[0] = gyro_covariance
    return message


def odometry(x=0.0, y=0.0, linear=0.0, angular=0.0):
    message = Odometry()
    message.pose.pose = to_pose_stamped(Pose2(x, y), 'odom', 0.0).pose
    message.twist.twist.linear.x, message.twist.twist.angular.z = linear, angular
    message.pose.covariance = message.twist.covariance = [math.nan] * 36    # is not read
    return message


def wheels(angle=0.0):
    return JointState(name=['wheel_left_joint', 'wheel_right_joint'], position=[angle, -angle])


ABSURD = [1.7e308, -1.7e308, 1e200, math.nan, math.inf]


@pytest.mark.parametrize('read, make, field, most', [
    (to_imu_sample, imu, 'rate', 34.9), (to_odometry_sample, odometry, 'x', 2e4),
    (to_odometry_sample, odometry, 'y', -2e4), (to_odometry_sample, odometry, 'linear', 3.0),
    (to_odometry_sample, odometry, 'angular', -2.0 * math.pi * 30.0),      # the firmware's spike
    (to_wheel_sample, wheels, 'angle', 3e6)])
def test_numbers_that_no_robot_can_have_are_refused(read, make, field, most):
    read(make(**{field: most}))
    for value in ABSURD + [5.0 * most, 6000.0 * most]:
        if abs(value) < 7e3 and field == 'angular':
            continue
        with pytest.raises(ValueError, match='more than a robot can have|finite'):
            read(make(**{field: value}))


@pytest.mark.parametrize('what, message', [
    ('orientation', imu(covariance=-1.0)), ('gyro', imu(gyro_covariance=-1.0))])
def test_an_imu_without_orientation_is_refused(what, message):
    with pytest.raises(ValueError, match='it has no ' + what):
        to_imu_sample(message)


@pytest.mark.parametrize('read, make', [
    (to_imu_sample, imu), (to_odometry_sample, odometry), (to_wheel_sample, wheels)])
def test_a_stamp_that_ros_could_not_send_again_is_refused(read, make):
    message = make()
    message.header.stamp = Time(2 ** 32 - 1, 999999999)
    with pytest.raises(ValueError, match='stamp = 4.29497e.09 s'):
        read(message)
    message.header.stamp = Time(2 ** 32 - 3, 0)     # absurd, but harmless
    read(message)


@pytest.mark.parametrize('frame, is_in_odom', [
    ('', False), ('local', False), ('/local', False), ('map', False), ('odom', True), ('/odom', True)])
def test_the_frames_of_a_goal(frame, is_in_odom):
    pose = to_pose_stamped(Pose2(1.0, 2.0, 0.5), '', 0.0).pose
    assert to_requested_pose(Header(frame_id=frame), pose).is_in_odom is is_in_odom


@pytest.mark.parametrize('frame', ['mars', 'base_link', 'local2', '\x1b[2J\x1b[31m', 'x' * 5000, '\u202e'])
def test_another_frame_is_refused_in_one_short_line_that_no_terminal_obeys(frame):
    with pytest.raises(ValueError) as refusal:
        to_requested_pose(Header(frame_id=frame), to_pose_stamped(Pose2(), '', 0.0).pose)
    line = str(refusal.value)
    assert line.isprintable() and len(line) < 200
    assert 'is not valid: local, odom, or map (or none), which means local' in line


@pytest.mark.parametrize('header, name', [
    ({}, ''), ({'callerid': '/pad'}, '/pad'), ({'callerid': '\x1b[2J/a\n'}, '[2J/a'),
    ({'callerid': 'x' * 5000}, 'x' * 100)])
def test_a_senders_name_is_short_and_plain_and_may_be_missing(header, name):
    message = Header()
    message._connection_header = header
    assert sender_of(message) == name


def numbers_in(value):
    if isinstance(value, (int, float)):
        return [value]
    return [number for part in (value if isinstance(value, tuple) else vars(value).values())
            for number in numbers_in(part)]


@given(st.tuples(*[st.floats(-3.0, 3.0) | st.floats()] * 6), st.booleans())
@settings(max_examples=100)
def test_a_message_is_read_as_finite_numbers_or_refused_with_a_reason(numbers, is_heading):
    imu, odometry, mouse, pose = Imu(), Odometry(), MouseController(), Pose()
    for place in odometry.pose.pose, pose:
        place.position.x, place.position.y = numbers[:2]
    for held in imu, odometry.pose.pose, pose:
        if is_heading:
            held.orientation = to_quaternion(math.fmod(numbers[2], math.pi)
                                             if math.isfinite(numbers[2]) else 0.0)
        else:
            held.orientation.w, held.orientation.x, held.orientation.z = numbers[2:5]
    imu.angular_velocity.z = odometry.twist.twist.angular.z = numbers[5]
    mouse.xPos, mouse.yPos = numbers[:2]
    for read, message in ((to_imu_sample, imu), (to_odometry_sample, odometry), (to_pose2, pose),
                          (to_mouse, mouse)):
        try:
            sample = read(message)
        except ValueError as error:
            assert str(error) and 'math domain' not in str(error)
        else:
            assert all(map(math.isfinite, numbers_in(sample)))
