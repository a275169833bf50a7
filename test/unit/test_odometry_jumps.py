"""Odometry that jumps though the robot does not, judged by the robot's true pose."""
import math

import pytest

from known_motion import angle_between
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.localizer import Localizer
from tb3_labs.localization.odometry_jumps import POSE_KEPT, POSE_LOST, JumpFilter
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig

IMU = ImuSample(0.0, 1.0, 0.0)


def sample(x, y, yaw, stamp=0.0, linear=0.0, angular=0.0):
    return OdometrySample(stamp, Pose2(x, y, yaw), linear, angular)


def along_half_a_turn(noise_deg, offset_deg=180.0, seconds=8.0):
    """A robot that drives with its IMU at +/-180 deg: (true travel, odometry's, localizer's)."""
    robot = Simulator(SimulatorConfig(imu_offset_deg=offset_deg, imu_noise_deg=noise_deg))
    localizer = Localizer()
    said, spikes = [], 0
    while robot.now < seconds:
        if robot.now < seconds - 1.0:
            robot.command(0.2, 0.0)
        for seen in robot.step(0.05):
            if isinstance(seen, ImuSample):
                localizer.on_imu(seen, robot.now)
            else:
                localizer.on_odometry(seen, robot.now)
                said.append(seen.pose)
                spikes += abs(seen.angular) > 50.0
        localizer.take_fix()
    pose = localizer.motion(robot.now).pose
    return robot.truth, said[-1], pose, spikes


def test_the_firmwares_fault_is_in_the_robot_and_not_in_the_local_pose():
    truth, said, pose, spikes = along_half_a_turn(noise_deg=0.5)
    assert spikes > 50                                  # it crosses many times
    assert abs(said.x - truth.x) > 0.2                  # the error of the raw odometry
    # the rest: encoder ticks; across, the noise of the heading in which local was declared
    assert abs(pose.x - truth.x) < 0.002 and abs(pose.y) < truth.x * math.radians(3 * 0.5)


def test_a_sound_driver_is_left_alone():
    truth, said, pose, spikes = along_half_a_turn(noise_deg=0.5, offset_deg=90.0)
    assert spikes == 0
    assert math.hypot(pose.x, pose.y) == pytest.approx(math.hypot(said.x, said.y), abs=1e-9)


def test_a_spike_in_a_pose_that_is_right_changes_nothing():
    steady = JumpFilter()
    for k in range(20):
        seen = sample(0.01 * k, 0.0, 0.0, k / 30.0, 0.3, 140.0 if k == 7 else 0.0)
        assert steady.take(seen, k / 30.0, IMU) == (seen, None)


@pytest.mark.parametrize('linear', [0.2, -0.2])
@pytest.mark.parametrize('yaw', [0.0, 0.7, 2.5, -1.2])
def test_one_displacement_backwards_is_turned_round_either_way_of_driving(linear, yaw):
    steady, step = JumpFilter(), linear / 30.0
    way = 0.0
    for k in range(10):
        way += -step if k == 5 else step
        seen, jump = steady.take(
            sample(way * math.cos(yaw), way * math.sin(yaw), yaw, k / 30.0, linear,
                   -188.0 if k == 5 else 0.0), k / 30.0, IMU)
        assert jump is None
    assert (seen.pose.x, seen.pose.y) == pytest.approx(
        (10 * step * math.cos(yaw), 10 * step * math.sin(yaw)), abs=1e-12)


def test_backwards_is_told_by_the_part_of_a_displacement_along_the_heading():
    """0.010 cos 1.2 - 0.006 sin 1.2 is less than 0."""
    steady = JumpFilter()
    steady.take(sample(0.0, 0.0, 1.2, 0.0, 0.2), 0.0, IMU)
    seen, _ = steady.take(sample(0.010, -0.006, 1.2, 0.03, 0.2, -188.0), 0.03, IMU)
    assert (seen.pose.x, seen.pose.y) == pytest.approx((-0.010, 0.006))


BEFORE = Pose2(2.0, -1.0, 2.5)


@pytest.mark.parametrize('after, words', [
    (Pose2(0.0, 0.0, 0.0), 'set to zero'),
    (Pose2(5.0, -1.0, 2.5), 'jumped by 3.00 m'),
    (Pose2(2.0, -1.0, -2.0), '102 degrees'),
])
def test_a_jump_is_noticed_and_the_robot_keeps_its_pose(after, words):
    steady = JumpFilter()
    steady.take(sample(BEFORE.x, BEFORE.y, BEFORE.yaw), 0.0, IMU)
    seen, jump = steady.take(sample(after.x, after.y, after.yaw, 0.03), 0.03, IMU)
    assert words in jump.text and jump.outcome == POSE_KEPT
    assert (seen.pose.x, seen.pose.y, seen.pose.yaw) == pytest.approx((2.0, -1.0, 2.5))
    # 0.1 m forward from there, in the robot's heading
    seen, jump = steady.take(sample(after.x + 0.1 * math.cos(after.yaw),
                                    after.y + 0.1 * math.sin(after.yaw), after.yaw, 0.4), 0.4, IMU)
    assert jump is None
    assert (seen.pose.x, seen.pose.y) == pytest.approx(
        (2.0 + 0.1 * math.cos(2.5), -1.0 + 0.1 * math.sin(2.5)))


def test_set_to_zero_is_noticed_after_any_silence_and_where_the_robot_only_turned():
    steady = JumpFilter()
    steady.take(sample(0.02, 0.0, 0.0), 0.0, IMU)
    _, jump = steady.take(sample(0.0, 0.0, 0.0, 4.0), 4.0, IMU)
    assert 'zero' in jump.text
    steady = JumpFilter()
    steady.take(sample(0.0, 0.0, 1.5), 0.0, IMU)
    _, jump = steady.take(sample(0.0, 0.0, 0.0, 0.03), 0.03, IMU)
    assert 'zero' in jump.text


@pytest.mark.parametrize('before', [Pose2(0.5, 0.0, 0.0), Pose2(0.0, 0.0, 2.0)])
def test_set_to_zero_is_noticed_also_where_the_first_message_after_it_is_lost(before):
    steady = JumpFilter()
    steady.take(sample(before.x, before.y, before.yaw), 0.0, IMU)
    seen, jump = steady.take(sample(0.002, 0.0, -0.02, 2.6), 2.6, IMU)
    assert 'zero' in jump.text
    assert (seen.pose.x, seen.pose.y, seen.pose.yaw) == pytest.approx(
        (before.x, before.y, before.yaw))


def test_a_robot_that_stands_near_the_origin_may_be_silent():
    steady = JumpFilter()
    steady.take(sample(0.01, 0.0, 0.03), 0.0, IMU)
    assert steady.take(sample(0.01, 0.0, 0.031, 3.0), 3.0, IMU)[1] is None


@pytest.mark.parametrize('stamped, arrived', [(1.0 / 30.0, 1.5), (3600.0, 1.0 / 30.0)])
def test_a_network_that_holds_messages_up_and_a_clock_that_is_set_are_no_reset(stamped, arrived):
    """A robot that turns at the origin, its IMU heard a moment ago."""
    steady, imu = JumpFilter(), ImuSample(0.0, 1.0, 1.5)
    steady.take(sample(0.0, 0.0, -0.4, stamp=1.0, angular=1.5), 1.0, imu)
    _, jump = steady.take(sample(0.0, 0.0, -0.05, 1.0 + stamped, angular=1.5), 1.0 + arrived, imu)
    assert jump is None


def test_a_robot_at_the_origin_may_turn_through_zero():
    steady = JumpFilter()
    for k in range(100):
        _, jump = steady.take(sample(0.0, 0.0, 0.09 * (k - 50), k / 30.0), k / 30.0, IMU)
        assert jump is None


@pytest.mark.parametrize('gap', [0.03, 0.5, 3.0])
def test_full_speed_over_a_silence_is_no_jump(gap):
    steady = JumpFilter()
    steady.take(sample(1.0, 0.0, 0.0), 0.0, IMU)
    _, jump = steady.take(sample(1.0 + 0.26 * gap, 0.0, min(2.84 * gap, 3.0), gap), gap, IMU)
    assert jump is None


def test_a_board_that_restarts_loses_the_pose():
    steady = JumpFilter()
    steady.take(sample(2.0, 1.0, 0.5), 0.0, IMU)
    seen, jump = steady.take(sample(0.0, 0.0, 0.0, 4.0), 4.0, replace_yaw(IMU, 0.0))
    assert jump.outcome == POSE_LOST and seen.pose == Pose2()


def replace_yaw(imu, yaw):
    return imu._replace(yaw=yaw)


@pytest.mark.parametrize('turned, kept', [(0.5, True), (-0.5, True), (0.7, False)])
def test_a_robot_that_turns_at_1_rad_per_s_comes_to_rest_within_0_6_rad(turned, kept):
    """Half a second, and what a robot at rest may turn. Its pose is kept, but for that turn."""
    steady, imu = JumpFilter(), ImuSample(0.0, 1.0, math.copysign(1.0, turned))
    steady.take(sample(2.0, 1.0, 0.5), 0.0, imu)
    seen, jump = steady.take(sample(0.0, 0.0, 0.0, 0.6), 0.6, replace_yaw(imu, 1.0 + turned))
    assert jump.outcome == (POSE_KEPT if kept else POSE_LOST)
    assert (seen.pose.x, seen.pose.y, seen.pose.yaw) == pytest.approx(
        (2.0, 1.0, 0.5 + turned) if kept else (0.0, 0.0, 0.0))


class Heard:
    """A robot that is driven, and its localizer."""

    def __init__(self, **settings):
        self.robot, self.localizer = Simulator(SimulatorConfig(**settings)), Localizer()
        self._start, self.jumps = self.robot.truth, []

    def run(self, seconds, linear=None, angular=0.0):
        """Let time pass, with this command in force, or with none."""
        robot, localizer, end = self.robot, self.localizer, self.robot.now + seconds
        while robot.now < end:
            if linear is not None:
                robot.command(linear, angular)
            for seen in robot.step(0.01):
                take = localizer.on_imu if isinstance(seen, ImuSample) else localizer.on_odometry
                take(seen, robot.now)
            localizer.take_fix()
            self.jumps.extend(localizer.take_jumps())

    @property
    def outcomes(self):
        return [jump.outcome for jump in self.jumps]

    def errors(self):
        """[m], [deg]"""
        truth, pose = self._start.inverse() @ self.robot.truth, self.localizer.motion(
            self.robot.now).pose
        return (math.hypot(pose.x - truth.x, pose.y - truth.y),
                math.degrees(angle_between(pose.yaw, truth.yaw)))


@pytest.mark.parametrize('turn', [0.0, 1.2])
def test_the_robots_own_reset_at_rest_leaves_the_local_pose(turn):
    """Driven, told to reset itself, driven on. Of the IMU's 1.8 deg nothing is left."""
    heard = Heard(start_x=1.0, start_yaw_deg=40.0, imu_offset_deg=-105.5)
    heard.run(0.2)
    heard.run(2.0, 0.2, turn)
    heard.run(1.0)
    heard.robot.reset()
    heard.run(3.5)
    assert heard.outcomes == [POSE_KEPT]
    heard.run(2.0, 0.2, -turn)
    heard.run(1.0)
    metres, degrees = heard.errors()
    assert metres < 0.003 and degrees < 0.1
    # and the published frame moved along in odom
    in_odom = heard.localizer.odom_T_local @ heard.localizer.motion(heard.robot.now).pose
    assert in_odom.distance_to(Pose2()) < 0.51     # 2.5 s at 0.2 m/s


def test_a_reset_at_rest_where_the_odometry_began_leaves_the_local_pose():
    """The place shows nothing of it there, only the IMU's turn."""
    heard = Heard()
    heard.run(1.0)
    heard.robot.reset()
    heard.run(3.5)
    assert heard.outcomes == [POSE_KEPT]
    metres, degrees = heard.errors()
    assert metres < 0.001 and degrees < 0.1


@pytest.mark.parametrize('heard_before', [30, 1])
def test_the_odometry_that_comes_before_the_imu_after_a_silence_waits_for_it(heard_before):
    """As the firmware sends them: by 4 ms; also where the robot has only just been connected."""
    localizer, turn = Localizer(), 0.033

    def hear(now, x, odom_yaw, imu_yaw):
        localizer.on_odometry(sample(x, 0.0, odom_yaw, now), now)
        localizer.on_imu(ImuSample(now, imu_yaw, 0.0), now + 0.004)
        localizer.take_fix()
    for k in range(-heard_before, 30):
        if k < 0:
            hear(10.0 + 0.033 * k, 0.2, 0.873, 0.905)
        else:
            hear(12.7 + 0.033 * k, 0.0, turn, 0.905 + turn)
    pose = localizer.motion(13.7).pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    # forward is where the robot faces, also for the odometry
    localizer.on_odometry(sample(0.1 * math.cos(turn), 0.1 * math.sin(turn), turn, 13.8), 13.8)
    pose = localizer.motion(13.8).pose
    assert (pose.x, pose.y) == pytest.approx((0.1, 0.0), abs=1e-9)


@pytest.mark.parametrize('linear, angular', [(0.2, 0.0), (0.0, 1.0), (0.0, -1.0), (0.15, 0.6)])
def test_after_a_reset_in_motion_the_pose_is_lost_until_it_is_declared(linear, angular):
    heard = Heard()
    heard.run(0.3)
    heard.run(1.8, linear, angular)
    heard.robot.reset()
    heard.run(4.0)
    assert POSE_LOST in heard.outcomes and POSE_KEPT not in heard.outcomes
    assert heard.localizer.is_lost and heard.localizer.motion(heard.robot.now) is None
    assert heard.localizer.odom_T_local is None
    reset = heard.localizer.reset(Pose2(1.0, 2.0, 0.5), heard.robot.now)
    heard.run(0.1)
    pose = heard.localizer.motion(heard.robot.now).pose
    assert reset.done and not heard.localizer.is_lost and pose.distance_to(Pose2(1.0, 2.0)) < 0.001


def test_a_robot_that_was_told_to_move_before_its_silence_may_have_moved():
    steady = JumpFilter()
    steady.take(sample(2.0, 1.0, 0.5), 10.0, IMU)
    _, jump = steady.take(sample(0.0, 0.0, 0.0, 2.6), 12.6, IMU, driven_at=9.9)
    assert jump.outcome == POSE_LOST


def test_nobody_knows_where_a_board_was_carried_that_was_silent_for_long():
    """A board reset takes 11.7 s, and the motors have no torque."""
    steady = JumpFilter()
    steady.take(sample(0.191, 0.224, 0.865), 10.0, replace_yaw(IMU, 0.897))
    _, jump = steady.take(sample(0.0, 0.0, 0.066, 11.7), 21.7, replace_yaw(IMU, 0.098))
    assert jump.outcome == POSE_LOST
