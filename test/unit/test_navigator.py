"""Who may drive, and what lost sensors do; samples are made in closed form for a standing robot."""
import math

import pytest

from tb3_labs.drive_laws import DriveConfig, PreciseLaw, make_law
from tb3_labs.freshness import RESUME_TIME, SENSOR_TIMEOUT
from tb3_labs.navigator import Navigator
from tb3_labs.pace import LONGEST_IDLE
from tb3_labs.se2 import Pose2
from tb3_labs.sensors import ImuSample, OdometrySample
from tb3_labs.turtlebot3 import robot_model

START = 100.0


class Robot:
    """A standing robot that feeds a navigator, and counts what it would be told."""

    def __init__(self, has_control=True, law='precise'):
        self.now = START
        self.navigator = Navigator(
            make_law(DriveConfig(law=law), robot_model('burger')), has_control)
        self.imu = self.odom = True
        self.imu_yaw, self.odom_pose = 1.0, Pose2(1.0, 2.0, 0.3)

    def run(self, seconds):
        """Let time pass; the commands that were due (None = silence)."""
        commands = []
        for _ in range(round(seconds / 0.01)):
            self.now += 0.01
            if self.imu:
                self.navigator.on_imu(ImuSample(self.now, self.imu_yaw, 0.0), self.now)
            if self.odom:
                self.navigator.on_odometry(
                    OdometrySample(self.now, self.odom_pose, 0.0, 0.0), self.now)
            self.navigator.localizer.take_fix()
            if self.navigator.due(self.now):
                commands.append(self.navigator.command(self.now))
        return commands


def driving(**kwargs):
    robot = Robot(**kwargs)
    robot.run(0.1)
    robot.navigator.set_goal(Pose2(-0.61, 0.61, 0.0))
    assert None not in robot.run(0.2)
    return robot


def test_without_control_there_is_silence():
    robot = Robot(has_control=False)
    robot.navigator.set_goal(Pose2(1.0, 1.0, 0.0))
    assert set(robot.run(0.5)) == {None}


def test_without_a_goal_there_is_silence():
    assert set(Robot().run(0.5)) == {None}


def test_control_lost_silences_and_control_back_begins_anew():
    robot = driving()
    assert robot.navigator.set_control(False, robot.now) is True
    assert robot.navigator.set_control(False, robot.now) is False
    assert set(robot.run(0.2)) == {None}
    robot.navigator.set_control(True, robot.now)
    commands = robot.run(0.1)
    assert None not in commands
    # from standing: the first command is what the acceleration allows in one period
    assert abs(commands[0].angular) == pytest.approx(
        DriveConfig().angular_acceleration * PreciseLaw.period)


def test_commands_come_at_the_laws_own_rate():
    assert len(driving().run(1.0)) == pytest.approx(30, abs=2)
    assert len(driving(law='lab').run(1.0)) == pytest.approx(10, abs=1)


def test_the_rate_is_kept_after_the_sensors_were_silent():
    robot = driving()
    robot.odom = False
    robot.run(1.0)
    robot.odom = True
    robot.run(0.1)
    assert len(robot.run(1.0)) == pytest.approx(30, abs=2)


@pytest.mark.parametrize('lost', [('imu',), ('odom',), ('imu', 'odom')])
def test_silent_sensors_stop_the_drive_in_time_and_say_which(lost):
    robot = driving()
    for name in lost:
        setattr(robot, name, False)
    before = robot.now
    while None not in robot.run(0.01):
        pass
    assert robot.now - before <= 0.3
    assert all(name in robot.navigator.hold_reason for name in lost)
    assert ('imu' in robot.navigator.hold_reason) is ('imu' in lost)


def test_a_short_silence_is_driven_on_after_by_itself():
    robot = driving()
    robot.imu = False
    assert None in robot.run(1.0)
    robot.imu = True
    assert None not in robot.run(0.3)[2:]
    assert robot.navigator.hold_reason == ''


def test_after_a_long_silence_the_robot_waits_to_be_told():
    robot = driving()
    robot.odom = False
    robot.run(RESUME_TIME + SENSOR_TIMEOUT + 1.0)
    robot.odom = True
    assert set(robot.run(0.5)) == {None}
    assert 'silent' in robot.navigator.machine.failure
    robot.navigator.set_goal(Pose2(1.0, 0.0, 0.0))
    assert None not in robot.run(0.2)[2:]


def test_a_goal_may_wait_long_for_the_first_samples():
    robot = Robot()
    robot.navigator.set_goal(Pose2(1.0, 1.0, 0.0))
    robot.imu = robot.odom = False
    assert set(robot.run(5.0)) == {None}
    robot.imu = robot.odom = True
    assert None not in robot.run(0.3)[2:]


def test_a_reset_starts_the_drive_anew_in_the_new_frame():
    robot = driving()
    reset = robot.navigator.localizer.reset(Pose2(5.0, -1.0, math.pi / 2.0), robot.now)
    robot.run(0.05)
    assert reset.done
    pose = robot.navigator.localizer.motion(robot.now).pose
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((5.0, -1.0, math.pi / 2.0), abs=1e-9)
    assert robot.navigator.machine.state.value == 'ROTATE_TO_GOAL'


def test_a_clock_that_goes_back_neither_drives_wild_nor_hangs():
    robot = driving()
    robot.now -= 50.0
    commands = robot.run(1.0)
    assert all(c is None or (math.isfinite(c.angular) and abs(c.angular) <= 1.5) for c in commands)
    assert any(c is not None for c in commands)


@pytest.mark.parametrize('odom_pose, words', [
    (Pose2(), 'set to zero'), (Pose2(4.0, 2.0, 0.3), 'jumped by 3.00 m')])
def test_odometry_that_jumps_stops_the_drive_and_leaves_the_pose(odom_pose, words):
    robot = driving()
    before = robot.navigator.localizer.motion(robot.now).pose
    robot.odom_pose = odom_pose
    assert set(robot.run(0.5)[1:]) == {None}
    assert words in robot.navigator.machine.failure
    news, = robot.navigator.take_news()
    assert words in news.text and 'the local pose is kept' in news.text and news.warning
    after = robot.navigator.localizer.motion(robot.now).pose
    assert (after.x, after.y, after.yaw) == pytest.approx((before.x, before.y, before.yaw))
    robot.navigator.set_goal(Pose2(1.0, 0.0, 0.0))
    assert None not in robot.run(0.2)[2:]


def test_odometry_that_jumps_where_nothing_is_driven_is_only_told():
    robot = Robot(has_control=False)
    robot.navigator.set_goal(Pose2(1.0, 1.0, 0.0))
    robot.run(0.2)
    robot.odom_pose = Pose2()
    robot.run(0.2)
    assert len(robot.navigator.take_news()) == 1
    robot.navigator.set_control(True, robot.now)
    assert None not in robot.run(0.2)[2:]


def test_a_heading_that_jumped_in_a_short_silence_stops_the_drive():
    robot = driving()
    robot.imu = False
    robot.run(0.6)
    robot.imu, robot.imu_yaw = True, -1.5
    assert set(robot.run(0.5)) == {None}
    assert "the IMU's heading jumped by 143 degrees" == robot.navigator.machine.failure


def test_a_reset_wants_every_sample_of_the_imu():
    robot = driving()
    assert robot.navigator.idle_for(robot.now) >= 0.0
    robot.navigator.set_control(False, robot.now)
    assert robot.navigator.idle_for(robot.now) == LONGEST_IDLE
    robot.imu = False
    robot.run(0.05)
    robot.navigator.reset(Pose2(), robot.now)
    assert robot.navigator.idle_for(robot.now) == 0.0
    robot.imu = True
    robot.run(0.05)
    assert robot.navigator.idle_for(robot.now) == LONGEST_IDLE
