"""Drives, permission and lost sensors of move_to_goal. The samples of a standing robot are in closed form."""
import math

import numpy as np
import pytest

from story_nodes import Ahead
from tb3_labs.control.commands import IDLE_SAMPLE_PERIOD
from tb3_labs.control.drive_law import DriveConfig, DriveLaw
from tb3_labs.control.goal_state import (
    DRIVING, WAITING_FOR_CONTROL, GoalState, is_over, is_stopped)
from tb3_labs.control.motor_response import MotorResponse
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.localizer import Reset
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.robot.turtlebot3 import Twist2, robot_model
from tb3_labs.supervision.events import IncomingMessage
from tb3_labs.supervision.goal_requests import STAYS_ENDED, GoalOutcome, GoalRequest, RequestedPose
from tb3_labs.supervision.timeouts import MAX_REPEAT_GAP, RESUME_TIME

START = 100.0


class CoreRobot:
    """A core, and a standing robot that sends samples to the core."""

    def __init__(self, has_control=True):
        self.now = START
        self.core = MoveToGoalCore(DriveLaw(DriveConfig(), robot_model('burger')), has_control)
        self.imu = self.odom = True
        self.imu_yaw, self.odom_pose = 1.0, Pose2(1.0, 2.0, 0.3)
        self.tremble = 1e-10           # noise: sensors that are not frozen never repeat themselves
        self.refused = []              # warnings
        self.heard = []                # (outcome, text) of the answers to clients

    def control(self, granted, sender='hand'):
        """A sender gives or takes control."""
        self.core.on_ctrl_relinq(IncomingMessage(granted, self.now, sender))
        self.tick()

    def ask(self, pose, sender='person', in_odom=False, **goal_id):
        """A goal of the action arrives."""
        request = GoalRequest(RequestedPose(pose, in_odom), sender, **goal_id)
        self.core.on_goal(request, self.now)
        return self.answers(request)

    def cancel(self, *which):
        """Cancel goals. Returns True if the present goal is canceled."""
        self.core.on_cancel(self.now, *which)
        return self.status.failure == 'canceled'

    def reset(self, pose=Pose2(), in_odom=False):
        reset = Reset(RequestedPose(pose, in_odom))
        self.core.on_reset(reset, self.now, self.now)
        return reset

    def tick(self):
        output = self.core.tick(self.now, self.now)
        self.stamped_pose = output.stamped_pose
        self.refused += [line.text for line in output.log_lines
                         if line.is_warning and not line.text.startswith('Goal')]
        return output

    def answers(self, request=None):
        """Returns the new answers to all clients, or to one: [(outcome, text)]."""
        return [(outcome, text) for client, outcome, text in self.tick().answers
                if client is (request or client)]

    @property
    def status(self):
        return self.core.status(self.now)

    def run(self, seconds):
        """Let time pass. Returns the commands that were due (None: no command)."""
        commands = []
        for _ in range(round(seconds / 0.01)):
            self.now += 0.01
            self.tremble = -self.tremble
            if self.imu:
                self.core.on_imu(
                    ImuSample(self.now, self.imu_yaw + self.tremble, 0.0), self.now)
            if self.odom:
                self.core.on_odometry(
                    OdometrySample(self.now, self.odom_pose, self.tremble, 0.0), self.now)
            output = self.tick()
            self.heard += [(outcome, text) for _, outcome, text in output.answers]
            if output.command is not None or output.must_stop_first:
                commands.append(output.command)
        return commands


def driving():
    robot = CoreRobot()
    robot.run(0.1)
    robot.core.set_goal(Pose2(-0.61, 0.61, 0.0))
    assert None not in robot.run(0.2)
    return robot


def test_a_reset_starts_the_drive_again_in_the_new_frame():
    robot = driving()
    reset = robot.reset(Pose2(5.0, -1.0, math.pi / 2.0))
    given_up = robot.reset(Pose2(3.0, 0.0, 0.0))
    given_up.give_up()
    robot.run(0.05)
    assert reset.is_done and not given_up.is_done
    pose = robot.stamped_pose.local_T_base
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((5.0, -1.0, math.pi / 2.0), abs=1e-9)
    assert robot.status.state.value == 'ROTATE_TO_GOAL' and robot.status.attempt == 2


@pytest.mark.parametrize('odom_pose, words', [
    (Pose2(), 'set to zero'), (Pose2(4.0, 2.0, 0.3), 'jumped by 3.00 m')])
def test_odometry_that_jumps_stops_the_drive_and_leaves_the_pose(odom_pose, words):
    robot = driving()
    before = robot.stamped_pose.local_T_base
    robot.odom_pose = odom_pose
    assert set(robot.run(0.5)[1:]) == {None}
    assert words in robot.status.failure
    line, = robot.refused
    assert words in line and 'the local pose is kept' in line
    after = robot.stamped_pose.local_T_base
    assert (after.x, after.y, after.yaw) == pytest.approx((before.x, before.y, before.yaw))
    robot.core.set_goal(Pose2(1.0, 0.0, 0.0))
    assert None not in robot.run(0.2)[2:]


@pytest.mark.parametrize('silence, is_reached', [(2.6, False), (11.7, True)])
def test_after_a_loss_of_the_pose_the_robot_rests_until_a_reset(silence, is_reached):
    """The board is silent while the robot drives, or so long that a person may have moved the robot."""
    robot = driving()
    if is_reached:
        robot.core.set_goal(Pose2())
        robot.run(0.5)
        assert robot.status.text == 'GOAL_REACHED'
    robot.now += silence
    robot.odom_pose = Pose2()
    assert set(robot.run(0.5)) <= {None}
    lost = 'gave up: pose lost: reset_pose, or place the robot and reset'
    assert robot.status.text == lost and not robot.status.is_active
    assert robot.stamped_pose is None
    robot.control(False)
    robot.control(True)
    assert set(robot.run(0.5)) <= {None}
    robot.core.set_goal(Pose2(1.0, 0.0, 0.0))
    assert set(robot.run(0.5)) <= {None} and robot.status.text == lost
    robot.reset()
    assert None not in robot.run(0.3)[3:]


def test_while_a_reset_waits_every_sample_of_the_imu_is_read():
    robot = driving()
    robot.control(False)
    robot.imu = False
    robot.run(0.05)
    robot.reset()
    assert robot.core.idle_time(robot.now) == 0.0
    robot.imu = True
    robot.run(0.05)
    assert robot.core.idle_time(robot.now) == IDLE_SAMPLE_PERIOD


def test_a_reset_in_a_spin_waits_for_samples_of_the_moment_of_its_request(monkeypatch):
    """The node has learned that samples come 0.1 s late. The robot is turned at 1 rad/s, and reset 0.2 s ago."""
    monkeypatch.setattr(MotorResponse, 'sample_delay', 0.1)
    robot, resets = CoreRobot(), []
    for tick in range(1, 41):
        robot.imu_yaw += 0.01
        robot.run(0.01)
        resets += [robot.reset()] if tick == 20 else []
    assert resets[0].is_done and robot.stamped_pose.local_T_base.yaw == pytest.approx(0.1, abs=1e-6)


def test_a_new_grant_starts_a_given_up_drive_again():
    robot = driving()
    robot.run(3.0)                     # a robot that stands is stalled
    assert 'does not move' in robot.status.failure
    attempt = robot.status.attempt
    robot.control(True, 'another hand')
    assert robot.status.attempt == attempt + 1
    assert None not in robot.run(0.2)[2:]
    assert not robot.status.failure
    robot.run(3.0)
    assert robot.status.failure
    robot.control(False)
    assert set(robot.run(0.3)) == {None}
    assert robot.status.attempt == attempt + 1 and robot.status.failure


def test_a_new_grant_does_not_start_the_drive_to_a_reached_goal():
    robot = CoreRobot()
    robot.run(0.1)
    robot.core.set_goal(Pose2())       # the robot stands there
    robot.run(0.5)
    assert robot.status.state is GoalState.GOAL_REACHED and not robot.status.is_active
    robot.control(False)
    robot.control(True)
    assert set(robot.run(0.5)) == {None}


def test_the_status_text_from_waiting_to_the_end_of_a_drive():
    robot = CoreRobot(has_control=False)
    assert robot.status.goal is None and robot.tick().stamped_pose is None
    robot.core.set_goal(Pose2(0.5, 0.0, 0.0))
    assert robot.status.text == WAITING_FOR_CONTROL and not is_stopped(WAITING_FOR_CONTROL)
    robot.control(True)
    assert robot.status.text == 'waiting: no imu yet, no odom yet'
    assert robot.status.attempt == 2      # the robot may have been driven elsewhere meanwhile
    robot.run(0.1)
    assert robot.status.text == robot.status.state.name in DRIVING
    robot.imu = False
    robot.run(0.5)
    assert robot.status.text == 'stopped: no imu' and is_stopped(robot.status.text)
    assert robot.reset().reason.startswith('no imu for 0.5 s')
    robot.run(RESUME_TIME)
    assert robot.status.text == 'gave up: no imu for 2.0 s' and is_over(robot.status.text)
    robot.imu = True
    assert set(robot.run(0.5)) == {None}
    robot.core.set_goal(Pose2(1.0, 0.0, 0.0))
    assert None not in robot.run(0.2)[2:]


def test_a_tick_returns_a_stop_at_once_and_each_status_once():
    robot = driving()
    robot.now += 0.001
    for act, drives in ((robot.tick, True), (lambda: robot.control(False), False),
                        (lambda: robot.control(True), True), (robot.cancel, False)):
        act()
        output = robot.tick()
        assert output.command is None and output.must_stop_first is not drives    # no step is due
        assert output.needs_fast_ticks is drives
    words = [robot.tick().status for _ in range(2)]
    assert output.status.text == 'gave up: canceled' and words == [None, None]
    assert [line.text for line in output.log_lines] == [
        'Goal (x=-0.610, y=0.610, yaw=0.0 deg) given up: canceled']


def test_a_client_gets_one_answer_at_the_start_and_one_at_the_end():
    robot = driving()
    first = GoalRequest(RequestedPose(Pose2(3.0)), 'client', 'first', 5)
    robot.core.on_goal(first, robot.now)
    assert robot.tick().answers == [(first, GoalOutcome.ACCEPTED, 'driving')]
    second = GoalRequest(RequestedPose(Pose2(2.0)), 'client', 'second', 6)
    robot.core.on_goal(second, robot.now)
    assert robot.tick().answers == [(first, GoalOutcome.CANCELED, 'replaced by a newer goal'),
                                    (second, GoalOutcome.ACCEPTED, 'driving')]
    robot.cancel('second')
    assert robot.answers() == [(GoalOutcome.CANCELED, 'canceled')] and robot.answers() == []
    assert robot.ask(Pose2(), name='home') == [(GoalOutcome.ACCEPTED, 'driving')]
    robot.run(0.5)
    assert robot.heard == [(GoalOutcome.REACHED, 'Goal reached!')]
    robot.heard.clear()
    robot.reset(Pose2(1.0))            # the robot drives to the ended goal again, but the client had its answer
    robot.run(0.5)
    assert robot.status.is_active and robot.cancel('home') and robot.answers() == []
    robot.ask(Pose2(3.0))
    robot.run(0.2)
    robot.odom_pose = Pose2(4.0, 2.0, 0.3)
    robot.run(0.1)
    (outcome, reason), = robot.heard
    assert outcome is GoalOutcome.GIVEN_UP and 'jumped by' in reason


@pytest.mark.parametrize('moved, told', [
    ((Pose2(), 1.0), 1), ((Pose2(1.3, 2.0, 1.8), 2.5), 0), ((Pose2(1.3, 2.0, -1.2), -0.5), 0)])
def test_after_a_jump_without_control_a_new_grant_starts_the_drive(moved, told):
    """A person presses B, drives by stick, during which a sensor jumps, and presses A."""
    robot = driving()
    robot.control(False)
    robot.run(0.2)
    robot.odom_pose, robot.imu_yaw = moved
    robot.run(0.2)
    assert robot.status.failure == '' and len(robot.refused) == told
    robot.control(True)
    assert None not in robot.run(0.2)[2:]


@pytest.mark.parametrize('in_odom', [False, True])
def test_a_goal_and_a_reset_far_away_are_refused(in_odom):
    """A pose in odom is used as a place in local."""
    robot = driving()
    edge, far = Pose2(70.0, -100.0), Pose2(-71.0, 100.5)
    if in_odom:
        edge, far = (robot.core.odom_T_local @ pose for pose in (edge, far))
        edge = Pose2(np.float64(edge.x), np.float64(edge.y + 1e-9))    # as a transformed pose has them
    robot.ask(edge, in_odom=in_odom)
    refused, reset = robot.reset(far, in_odom), robot.reset(edge, in_odom)
    robot.run(0.05)
    assert reset.is_done and not refused.is_done
    assert 'is not valid: a number from -100 to 100 m' in refused.reason
    (outcome, reason), = robot.ask(
        robot.core.odom_T_local @ Pose2(-71.0, 100.5) if in_odom else far, in_odom=in_odom)
    assert outcome is GoalOutcome.REJECTED
    assert reason.endswith('is not valid: a number from -100 to 100 m')


def test_a_repeated_goal_stays_canceled_until_its_sender_pauses_or_changes_the_goal():
    robot, goal = driving(), Pose2(3.0, 1.0)

    def repeat(seconds, **goal_id):
        """Send the goal every 0.5 s; returns True if the robot drove."""
        drove = False
        for _ in range(round(2 * seconds)):
            robot.ask(goal, 'program', **goal_id)
            drove = any(robot.run(0.5)[1:]) or drove
        return drove
    attempt = robot.status.attempt
    assert repeat(2.0, name='first', stamp=5) and robot.status.attempt == attempt + 1    # it goes on
    assert not robot.cancel('another') and not robot.cancel('', 4)
    assert robot.cancel() and not repeat(3.0)
    robot.reset()
    robot.control(False)
    robot.control(True)
    assert not repeat(3.0)
    robot.ask(goal, 'person')
    assert any(robot.run(0.5)) and repeat(1.0)
    robot.cancel()
    robot.ask(goal, 'person')          # sent once again, by hand
    assert any(robot.run(0.5))
    robot.cancel()
    goal = Pose2(2.0, 1.0)             # changed
    assert repeat(1.0)
    robot.cancel()
    assert not repeat(1.0)
    robot.run(MAX_REPEAT_GAP)
    assert repeat(0.5)


@pytest.mark.parametrize('which', [('second', 0), ('', 7)])
def test_a_cancel_of_one_goal_ends_its_repetitions_with_other_names(which):
    robot = driving()
    for number, name in enumerate(('first', 'second')):
        robot.ask(Pose2(3.0), 'program', name=name, stamp=6 + number)
        robot.run(0.5)
    assert not robot.cancel('first') and robot.cancel(*which)
    assert robot.ask(Pose2(3.0), 'program', name='third', stamp=8) == [
        (GoalOutcome.REJECTED, STAYS_ENDED)]


def test_a_repeated_goal_stays_given_up_and_does_not_extend_the_wait_for_sensors():
    robot = driving()
    for seconds, are_heard in ((1.0, True), (3.0, False), (1.0, True)):
        robot.imu = robot.odom = are_heard
        for _ in range(round(2 * seconds)):
            robot.ask(Pose2(3.0), 'program')
            robot.run(0.5)
    assert robot.status.attempt == 2 and robot.status.text.startswith('gave up: no imu')


def test_a_jump_of_the_imu_ends_the_drive_with_the_message_that_shows_it():
    robot = driving()
    robot.odom, robot.imu_yaw = False, -1.5
    robot.run(0.01)
    assert 'jumped by' in robot.status.failure


@pytest.mark.parametrize('linear, angular, odometry_turns, frozen', [
    (0.1, 0.0, False, ['odom']),           # an odometry that goes straight does not show the IMU
    (-0.1, 0.0, True, ['imu']),            # it turns by the same IMU
    (0.0, -0.5, False, ['odom', 'imu']),
    (0.0, 0.05, False, []), (0.01, 0.0, True, [])])
def test_the_command_decides_which_sensors_must_change(linear, angular, odometry_turns, frozen):
    robot, law = CoreRobot(), Ahead()
    law.command = Twist2(linear, angular)
    robot.core.set_law(law)
    robot.core.set_goal(Pose2(50.0))
    robot.tremble = 0.0
    for k in range(100):
        robot.odom_pose = Pose2(1.0, 2.0, 0.3 + 1e-5 * k * odometry_turns)
        robot.run(0.01)
    assert [name for name in ('odom', 'imu') if name + ' repeats' in robot.status.failure] == frozen


@pytest.mark.parametrize('stand', ['silence', 'suspended'])
def test_after_a_stop_the_law_starts_at_the_present_pose(stand):
    robot, law, starts = CoreRobot(has_control=False), Ahead(), []
    law.start = lambda pose, goal: starts.append(pose)
    robot.core.set_law(law)
    robot.core.set_goal(Pose2(-0.61, 0.61, 0.0))

    def renewed():
        for _ in range(4):
            robot.core.on_ctrl_relinq(IncomingMessage(True, robot.now, 'pad', has_renewals=True))
            robot.run(0.1)
    renewed()
    assert len(starts) == 1
    attempt = robot.status.attempt
    robot.imu = stand != 'silence'
    if robot.imu:
        assert None in robot.run(0.8)
    else:
        renewed()
    robot.imu = True
    renewed()
    assert len(starts) == 2 and robot.status.attempt == attempt
