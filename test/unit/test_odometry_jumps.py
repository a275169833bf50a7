"""Odometry that jumps though the robot does not, judged by the robot's true pose."""
import math

import pytest

from known_motion import angle_between, odometry_sample
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.odometry_jumps import POSE_KEPT, POSE_LOST, JumpFinder
from tb3_labs.localization.sample_timing import SampleTiming
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig
from tb3_labs.supervision.goal_requests import RequestedPose
from timed_part import TimedPart

IMU = ImuSample(0.0, 1.0, 0.0)


class DrivenRobot:
    def __init__(self, **settings):
        self.robot, self.localizer = Simulator(SimulatorConfig(**settings)), TimedPart.localizer()
        self._start, self.jumps = self.robot.truth, []
        self.odometry = []                # as the robot sent it

    def run(self, seconds, linear=None, angular=0.0):
        """Let time pass, with this command in force, or with none."""
        robot, localizer, end = self.robot, self.localizer, self.robot.now + seconds
        while robot.now < end:
            if linear is not None:
                robot.command(linear, angular)
            for seen in robot.step(0.01):
                if isinstance(seen, ImuSample):
                    localizer.on_imu(seen, robot.now)
                else:
                    localizer.on_odometry(seen, robot.now)
                    self.odometry.append(seen)
            localizer.pop_pose()
            self.jumps.extend(localizer.jumps.pop_all())

    @property
    def pose(self):
        return self.localizer.motion(self.robot.now).pose

    def errors(self):
        """Returns the errors of place [m] and heading [deg]."""
        truth, pose = self._start.inverse() @ self.robot.truth, self.pose
        return (math.hypot(pose.x - truth.x, pose.y - truth.y),
                math.degrees(angle_between(pose.yaw, truth.yaw)))


class Steady:
    """Adds up what a JumpFinder finds: where the robot is in the first frame of the odometry."""

    def __init__(self):
        self.timing, self.finder, self.first_T_odom = SampleTiming(), JumpFinder(), Pose2()

    def take(self, seen, arrival, *driven):
        """Returns (pose in the first frame, Jump or None)."""
        jump = self.finder.find(self.timing.on_odometry(seen, arrival), *driven)
        if jump:
            self.first_T_odom = self.first_T_odom @ jump.shift.inverse()
        return self.first_T_odom @ seen.pose, jump


def test_the_local_pose_does_not_have_the_firmwares_fault():
    driven = DrivenRobot(imu_offset_deg=180.0, imu_noise_deg=0.5)
    driven.run(7.0, 0.2)
    driven.run(1.0)
    truth, pose = driven.robot.truth, driven.pose
    assert sum(abs(seen.angular) > 50.0 for seen in driven.odometry) > 50
    assert abs(driven.odometry[-1].pose.x - truth.x) > 0.2     # the error of the raw odometry
    # the rest: encoder ticks; across, the noise of the heading in which local was declared
    assert abs(pose.x - truth.x) < 0.002 and abs(pose.y) < truth.x * math.radians(3 * 0.5)


@pytest.mark.parametrize('linear', [0.2, -0.2])
@pytest.mark.parametrize('yaw', [0.0, 0.7, 2.5, -1.2])
def test_a_reversed_displacement_is_mirrored_forwards_and_backwards(linear, yaw):
    steady, step = Steady(), linear / 30.0
    way = 0.0
    for k in range(10):
        way += -step if k == 5 else step
        at, jump = steady.take(
            odometry_sample(way * math.cos(yaw), way * math.sin(yaw), yaw, k / 30.0, linear,
                            -188.0 if k == 5 else 0.0), k / 30.0, IMU)
        assert (jump is None) is (k != 5)
    assert jump is None or not jump.text
    assert (at.x, at.y) == pytest.approx(
        (10 * step * math.cos(yaw), 10 * step * math.sin(yaw)), abs=1e-12)


ZERO, HERE, THERE = (0.0, 0.0, 0.0), (2.0, 1.0, 0.5), (2.0, -1.0, 2.5)


@pytest.mark.parametrize('before, after, gap, how, outcome, words', [
    # in a silence a robot can stand at its place, or near it, or drive at full speed
    (ZERO, ZERO, 3.0, {}, None, ''), ((0.01, 0.0, 0.03), (0.01, 0.0, 0.031), 3.0, {}, None, ''),
    *[((1.0, 0.0, 0.0), (1.0 + 0.26 * gap, 0.0, min(2.84 * gap, 3.0)), gap, {}, None, '')
      for gap in (0.03, 0.5, 3.0)],
    # a network that holds messages up, a clock that is set, while a robot turns at the origin
    *[((0.0, 0.0, -0.4), (0.0, 0.0, -0.05), gap, {'rate': 1.5, 'arrived': arrived}, None, '')
      for gap, arrived in ((1.0 / 30.0, 1.5), (3600.0, 1.0 / 30.0))],
    (THERE, ZERO, 0.03, {}, POSE_KEPT, 'set to zero'),
    (THERE, (5.0, -1.0, 2.5), 0.03, {}, POSE_KEPT, 'jumped by 3.00 m'),
    (THERE, (2.0, -1.0, -2.0), 0.03, {}, POSE_KEPT, '102 degrees'),
    ((0.02, 0.0, 0.0), ZERO, 4.0, {}, POSE_KEPT, 'zero'),
    ((0.0, 0.0, 1.5), ZERO, 0.03, {}, POSE_KEPT, 'zero'),                 # it only turned before
    ((0.5, 0.0, 0.0), (0.002, 0.0, -0.02), 2.6, {}, POSE_KEPT, 'zero'),   # the first message of
    ((0.0, 0.0, 2.0), (0.002, 0.0, -0.02), 2.6, {}, POSE_KEPT, 'zero'),   # it is lost
    (HERE, ZERO, 4.0, {'turned': -1.0}, POSE_LOST, 'zero'),               # a board restarts
    (HERE, ZERO, 2.6, {'commanded_at': 9.9}, POSE_LOST, 'zero'),             # told to move before
    (HERE, (0.0, 0.0, 0.066), 11.7, {}, POSE_LOST, 'zero'),               # it may be carried
    # at 1 rad/s it comes to rest within half a second, and what a robot at rest may turn: 0.6 rad
    *[(HERE, ZERO, 0.6, {'rate': rate, 'turned': 0.5 * rate}, POSE_KEPT, 'zero')
      for rate in (1.0, -1.0)],
    (HERE, ZERO, 0.6, {'rate': 1.0, 'turned': 0.7}, POSE_LOST, 'zero')])
def test_two_messages_show_a_jump_or_none(before, after, gap, how, outcome, words):
    """The place is kept, with the heading of the IMU. From this pose the robot drives on."""
    turned, arrived = how.get('turned', 0.0), 10.0 + how.get('arrived', gap)
    imu = ImuSample(0.0, 1.0, how.get('rate', 0.0))
    imu_after, steady = imu._replace(yaw=1.0 + turned), Steady()
    steady.take(odometry_sample(*before), 10.0, imu)
    at, jump = steady.take(odometry_sample(*after, stamp=gap), arrived, imu_after,
                           how.get('commanded_at', -math.inf))
    assert (jump and jump.outcome) == outcome
    if jump:
        assert words in jump.text and jump.imu_turn == 0.0
    if outcome != POSE_KEPT:
        assert at == Pose2(*after)
        return
    x, y, yaw = before[:2] + (before[2] + turned,)
    assert (at.x, at.y, at.yaw) == pytest.approx((x, y, yaw))
    ahead = Pose2(*after) @ Pose2(0.1, 0.0, 0.0)
    at, jump = steady.take(OdometrySample(gap + 0.4, ahead, 0.0, 0.0), arrived + 0.4, imu_after)
    assert jump is None and (at.x, at.y) == pytest.approx(
        (x + 0.1 * math.cos(yaw), y + 0.1 * math.sin(yaw)))


@pytest.mark.parametrize('speed, turn', [(0.2, 0.0), (0.2, 1.2), (0.0, 0.0)])
def test_the_robots_own_reset_at_rest_leaves_the_local_pose(speed, turn):
    """Driven, told to reset itself, driven on. The IMU's 1.8 deg are gone. At the odometry's origin only the IMU's turn
    shows the reset."""
    driven = DrivenRobot(start_x=speed, start_yaw_deg=200.0 * speed, imu_offset_deg=-105.5)
    driven.run(0.2)
    driven.run(2.0, speed, turn)
    driven.run(1.0)
    driven.robot.reset()
    driven.run(3.5)
    assert [jump.outcome for jump in driven.jumps] == [POSE_KEPT]
    driven.run(2.0, 0.2, -turn)
    driven.run(1.0)
    metres, degrees = driven.errors()
    assert metres < 0.003 and degrees < 0.1
    # and the published frame moved along in odom
    in_odom = driven.localizer.odom_T_local @ driven.pose
    assert in_odom.distance_to(Pose2()) < 0.51     # 2.5 s at 0.2 m/s


@pytest.mark.parametrize('heard_before', [30, 1])
def test_after_a_silence_the_odometry_waits_for_the_imu(heard_before):
    """The firmware's stamps may go back by 4 ms, also just after the robot was connected."""
    localizer, turn = TimedPart.localizer(), 0.033

    def hear(now, x, odom_yaw, imu_yaw):
        localizer.on_odometry(odometry_sample(x, 0.0, odom_yaw, now), now)
        localizer.on_imu(ImuSample(now, imu_yaw, 0.0), now + 0.004)
        localizer.pop_pose()
    for k in range(-heard_before, 30):
        if k < 0:
            hear(10.0 + 0.033 * k, 0.2, 0.873, 0.905)
        else:
            hear(12.7 + 0.033 * k, 0.0, turn, 0.905 + turn)
    pose = localizer.motion(13.7).pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    # forward is where the robot faces, also for the odometry
    localizer.on_odometry(odometry_sample(0.1 * math.cos(turn), 0.1 * math.sin(turn), turn, 13.8), 13.8)
    pose = localizer.motion(13.8).pose
    assert (pose.x, pose.y) == pytest.approx((0.1, 0.0), abs=1e-9)


@pytest.mark.parametrize('linear, angular', [(0.2, 0.0), (0.0, -1.0)])
def test_after_a_reset_in_motion_the_pose_is_lost_until_it_is_declared(linear, angular):
    driven = DrivenRobot()
    driven.run(0.3)
    driven.run(1.8, linear, angular)
    driven.robot.reset()
    driven.run(4.0)
    assert {jump.outcome for jump in driven.jumps} - {''} == {POSE_LOST}
    assert driven.localizer.is_lost and driven.localizer.motion(driven.robot.now) is None
    assert driven.localizer.odom_T_local is None
    reset = driven.localizer.reset(RequestedPose(Pose2(1.0, 2.0, 0.5)), driven.robot.now)
    driven.run(0.1)
    assert reset.is_done and not driven.localizer.is_lost
    assert driven.pose.distance_to(Pose2(1.0, 2.0)) < 0.001
