"""Fixes and resets of a robot whose true motion is known, its messages late and in any order."""
import math
import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from known_motion import SteadyRobot, Truth, angle_between, as_pose2, assert_pose, held_back
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.local_frame import LocalFrame
from tb3_labs.robot.samples import ImuSample
from tb3_labs.supervision.goal_requests import RequestedPose
from timed_part import TimedPart

SPINNING = SteadyRobot(angular=2.6, odometry_start=Truth(4.8 - 0.3j, -1.8),
                       imu_offset=math.radians(140.6), clock_ahead=0.775)
RESTING = replace(SPINNING, angular=0.0)
CURVING = replace(SPINNING, linear=0.1, angular=1.0)
STRAIGHT = replace(SPINNING, linear=0.2, angular=0.0)
DECLARED = Truth(1 - 2j, 2.5)
ZERO = Truth(0j, 0.0)


def late(seed, most=0.004):
    """A delay drawn at random for each message, short enough to keep each source's order."""
    chance = random.Random(seed)
    return lambda: chance.uniform(0.0, most)


def feed(localizer, messages):
    """(poses, resets carried out) of a localizer that gets `messages`."""
    poses, resets = [], []
    for arrival, sample in messages:
        take = localizer.on_imu if isinstance(sample, ImuSample) else localizer.on_odometry
        take(sample, arrival)
        resets += localizer.pop_ended_resets()
        stamped = localizer.pop_pose()
        if stamped is not None:
            poses.append(stamped)
    return poses, resets


def feed_with_a_reset(messages, requested_at, declared=DECLARED, sample_delay=0.0):
    """(localizer, reset, poses after the request) of a localizer that gets `messages`."""
    localizer = TimedPart.localizer()
    feed(localizer, [message for message in messages if message[0] <= requested_at])
    reset = localizer.reset(RequestedPose(as_pose2(declared)), requested_at, sample_delay)
    poses, resets = feed(localizer, [message for message in messages if message[0] > requested_at])
    assert resets == ([reset] if reset.is_over else [])
    return localizer, reset, poses


def assert_poses(poses, robot, declared, since, metres=1e-4, radians=1e-6):
    """Check that every pose is `declared` times the true motion since the instant `since`."""
    assert poses
    for stamped in poses:
        time = stamped.stamp - robot.clock_ahead
        assert_pose(stamped.local_T_base, declared.then(*robot.moved(time - since)),
                    metres, radians)


def drive_with_a_reset(robot, requested_at, declared=DECLARED, end=4.0, **delays):
    """(localizer, reset, poses after it) of a drive with one reset."""
    localizer, reset, poses = feed_with_a_reset(
        robot.messages(0.0, end, **delays), requested_at, declared)
    assert reset.is_done
    return localizer, reset, [stamped for stamped in poses
                              if stamped.stamp - robot.clock_ahead > requested_at + 0.01]


@pytest.mark.parametrize('silent', [ImuSample, object])
def test_a_dropout_does_not_change_the_frame(silent):
    messages = [(arrival, sample) for arrival, sample in CURVING.messages(0.0, 8.0)
                if not (isinstance(sample, silent) and 2.0 < arrival < 6.3)]
    poses, _ = feed(TimedPart.localizer(), messages)
    times = [stamped.stamp - CURVING.clock_ahead for stamped in poses]
    assert not [time for time in times if 2.01 < time < 6.29]
    assert max(times) > 7.9
    assert_poses(poses, CURVING, ZERO, since=0.0)


@pytest.mark.parametrize('seed', [1, 2, 3])
@pytest.mark.parametrize('robot', [
    RESTING, STRAIGHT, CURVING, SPINNING, replace(SPINNING, angular=-2.6)])
def test_a_reset_in_motion_is_as_exact_as_at_rest(robot, seed):
    """Messages come up to 4 ms late; only the sender's clock can show how late."""
    declared = (ZERO, DECLARED, Truth(-0.61 + 0.61j, -math.pi))[seed % 3]
    requested_at, most = random.Random(seed).uniform(1.0, 2.0), 0.004 * (seed > 2)
    localizer, reset, poses = drive_with_a_reset(robot, requested_at, declared,
                                                 imu_delay=late(seed, most),
                                                 odometry_delay=late(seed + 100, most))
    measured_at = reset.stamp - robot.clock_ahead
    assert -1e-9 <= requested_at - measured_at <= most + 1e-9
    if not most:
        assert_pose(reset.pose_before, Truth(*robot.moved(requested_at)), 1e-4, 1e-6)
    assert len(poses) >= 58
    assert_poses(poses, robot, declared, measured_at, metres=1e-4 if robot is CURVING else 1e-9)
    # Place and heading were taken at one and the same instant.
    frame = localizer.frame
    assert angle_between(frame.imu_yaw_at_zero - frame.odom_T_local.yaw, robot.imu_offset) < 1e-7


@pytest.mark.parametrize('sample_delay', [0.0135, 0.08])
def test_a_reset_allows_for_the_sample_delay(sample_delay):
    """Both sensors are read at one instant, in the middle of a spin."""
    older = replace(SPINNING, clock_ahead=SPINNING.clock_ahead + sample_delay)
    messages = [(arrival + sample_delay, sample) for arrival, sample in older.messages(0.0, 4.0)]
    _, reset, poses = feed_with_a_reset(messages, 2.0, sample_delay=sample_delay)
    assert reset.stamp == pytest.approx(2.0 + SPINNING.clock_ahead)
    assert_poses([stamped for stamped in poses if stamped.stamp > reset.stamp], older, DECLARED, since=2.0)


@pytest.mark.parametrize('stall, requested_at', [
    (0.3, 2.0), (0.3, 2.24), (0.9, 2.1), (1.2, 2.1), (3.0, 2.0)])
def test_a_reset_during_a_stall_is_exact_or_not_carried_out(stall, requested_at):
    """Nothing is lost: messages from 2.0 s on are delayed, then delivered at once."""
    messages = held_back(SPINNING.messages(0.0, 8.0), 2.0, 2.0 + stall)
    _, reset, poses = feed_with_a_reset(messages, requested_at)
    if reset.is_done:
        assert_poses(poses[-30:], SPINNING, DECLARED, requested_at)
    else:
        assert_poses(poses[-30:], SPINNING, ZERO, since=0.0)
    assert reset.is_done or stall > 1.0


@pytest.mark.parametrize('imu, odometry, problem', [
    ({'stamp': 1007.01}, None, "the robot's clock was set"),
    ({'yaw': 0.0}, {'pose': Pose2()}, 'the robot started anew at that moment')])
def test_a_new_clock_or_board_ends_a_waiting_reset(
        imu, odometry, problem):
    robot, localizer = replace(RESTING, clock_ahead=1000.0), TimedPart.localizer()
    feed(localizer, robot.messages(0.0, 2.0))
    reset = localizer.reset(RequestedPose(Pose2()), 2.02)
    assert localizer.waiting_resets and reset.reason == ''
    localizer.on_imu(robot.imu(2.01)._replace(**imu), 2.01)
    if odometry:
        localizer.on_odometry(robot.odometry(2.01)._replace(**odometry), 2.01)
        assert localizer.motion(2.01) is None
    assert reset.reason.startswith(problem) and not reset.is_done and not localizer.waiting_resets


def test_a_reset_before_the_first_message_waits():
    _, reset, poses = feed_with_a_reset(SPINNING.messages(1.0, 3.0), 0.5)
    assert not reset.is_over
    assert_poses(poses, SPINNING, ZERO, since=1.0)


def test_a_reset_may_be_the_first_frame():
    localizer = TimedPart.localizer()
    for time in (0.0, 0.1):
        localizer.on_imu(SPINNING.imu(time), time)
        localizer.on_odometry(SPINNING.odometry(time), time)
        if not time:
            reset = localizer.reset(RequestedPose(as_pose2(DECLARED)), 0.05)
    assert localizer.pop_ended_resets() == [reset]
    assert reset.pose_before is None and reset.is_done
    assert_pose(localizer.pop_pose().local_T_base, DECLARED.then(0j, 2.6 * 0.05), radians=1e-6)


@pytest.mark.parametrize('robot', [STRAIGHT, SPINNING])
@pytest.mark.parametrize('later', [0.0, 0.04])
def test_motion_extrapolates_the_latest_samples(robot, later):
    """The last sample of the IMU arrived at 3.02 s, the last message of the odometry at 3.0 s."""
    now = 3.02 + later
    localizer, _, _ = drive_with_a_reset(robot, 2.0, end=3.02)
    motion = localizer.motion(now)
    assert_pose(motion.pose, DECLARED.then(*robot.moved(now - 2.0)), radians=1e-6)
    assert (motion.linear, motion.angular) == (robot.linear, robot.angular)


def test_the_rate_of_turn_comes_from_the_gyro():
    localizer = TimedPart.localizer()
    feed(localizer, SPINNING.messages(0.0, 1.0))
    localizer.on_odometry(SPINNING.odometry(1.05)._replace(angular=-143.6), 1.05)
    assert localizer.motion(1.06).angular == 2.6


@pytest.mark.parametrize('age', [0.08, 3.0])
def test_motion_is_extrapolated_for_two_control_periods_at_most(age):
    localizer = TimedPart.localizer()
    feed(localizer, CURVING.messages(0.0, 3.0))
    motion = localizer.motion(3.0 + age)
    assert_pose(motion.pose, Truth(*CURVING.moved(3.0 + 2.0 / 30.0)), 1e-3, 1e-6)


def test_an_age_is_counted_from_the_measurement():
    """The latest samples were delayed by 50 ms, all earlier samples by 10 ms."""
    messages = STRAIGHT.messages(0.0, 2.0, imu_delay=lambda: 0.01, odometry_delay=lambda: 0.01)
    localizer = TimedPart.localizer()
    feed(localizer, messages)
    feed(localizer, [(2.15, STRAIGHT.imu(2.1)), (2.15, STRAIGHT.odometry(2.1))])
    motion = localizer.motion(2.15)
    # all are late by the least delay, which cannot be measured
    assert motion.imu_age == motion.odometry_age == pytest.approx(0.04)
    assert_pose(motion.pose, Truth(*STRAIGHT.moved(2.14)), 1e-6, 1e-6)


# The local frame: declared pose times true motion, for any zero of odometry and IMU ---------------

METRES, TURNS = st.floats(-10.0, 10.0), st.floats(-7.0, 7.0)
TRUTHS = st.builds(Truth, st.builds(complex, METRES, METRES), TURNS)


@given(TRUTHS, TRUTHS, TRUTHS, TURNS)
@settings(max_examples=20)
def test_the_transform_maps_the_local_place_to_the_odometry(start, declared, motion, imu_yaw):
    frame = LocalFrame.declare(as_pose2(declared), as_pose2(start), imu_yaw)
    odom_T_base = as_pose2(start.then(*motion))
    place = frame.pose(odom_T_base, 0.0)
    assert frame.odom_T_local.act((place.x, place.y)) == pytest.approx(
        (odom_T_base.x, odom_T_base.y), abs=1e-9)


def test_the_heading_comes_from_the_imu():
    frame = LocalFrame.declare(Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0), 1.0)
    assert frame.pose(Pose2(0.0, 0.0, 0.5), 1.25).yaw == pytest.approx(0.25)
    assert frame.heading(1.25) == pytest.approx(0.25)
