"""Decides whether `move_to_goal` may drive, and with which command.

The robot moves only while the node has control, IMU and odometry are fresh, gyro and wheels agree,
and the pose is known. A long silence of the sensors ends a drive, and makes a new grant invalid.

The time `now` [s] is on the receiver's clock, and `steady_now` [s] on a steady clock
(:mod:`tb3_labs.nodes`). Poses are in the local frame, in metres and radians.
"""
import math
from typing import Dict, Optional

from tb3_labs.control.commands import IDLE_SAMPLE_PERIOD, Pace
from tb3_labs.control.drive_law import DriveLaw
from tb3_labs.control.goal_machine import GoalMachine
from tb3_labs.control.motor_response import MotorResponse
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import PRINTED_REACHED
from tb3_labs.localization.gyro_check import GyroMonitor
from tb3_labs.localization.localizer import Localizer, Reset
from tb3_labs.localization.odometry_jumps import POSE_LOST, EncoderMonitor
from tb3_labs.localization.sample_timing import SampleTiming
from tb3_labs.nodes.move_to_goal.status import DriveOutput, DriveStatus, StatusLogger
from tb3_labs.robot.samples import ImuSample, Motion, OdometrySample, WheelSample
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS, Twist2
from tb3_labs.supervision.events import IncomingMessage, LogQueue, SenderRequest
from tb3_labs.supervision.goal_requests import GoalOutcome, GoalRequest, GoalRequests
from tb3_labs.supervision.permission import Permission
from tb3_labs.supervision.motion_monitors import DriveSensors, SensorStatus

RIVAL_WARNING_TIME = 0.3    # [s]


class MoveToGoalCore:
    """Joins the localizer, the goal machine and the permission of one robot."""

    def __init__(self, law: DriveLaw, has_control: bool = False,
                 response: Optional[MotorResponse] = None,
                 gyro: Optional[GyroMonitor] = None) -> None:
        """`law` measures the delays of this robot's motors and stores them in `response`."""
        self._response = response or MotorResponse()
        self._timing = SampleTiming()
        self.sensors = DriveSensors()
        self._localizer = Localizer(self._timing)
        self._machine = GoalMachine(law)
        self._log = LogQueue()
        self._permission = Permission(has_control, self._log)
        self._requests = GoalRequests(self._permission.sleep)
        self.may_drive = has_control    # at the last tick
        self._pace = Pace(law.period)
        self._gyro = gyro or GyroMonitor(MODELS[DEFAULT_MODEL])
        self._encoders = EncoderMonitor()
        #: {another node that drives the robot: time [s] of its first command}
        self._rivals_began_at: Dict[str, float] = {}
        self._status_logger = StatusLogger(self._log)

    # -- inputs

    def on_imu(self, sample: ImuSample, now: float, sends_wheels: bool = False) -> None:
        timed = self._timing.on_imu(sample, now)
        self.sensors.imu.on_message(now, sample.yaw)
        self._gyro.on_imu(timed, sends_wheels)
        self._localizer.on_imu(timed)
        self._obey_jumps_and_resets()

    def on_odometry(self, sample: OdometrySample, now: float) -> None:
        timed = self._timing.on_odometry(sample, now)
        self.sensors.odometry.on_message(now, (sample.pose, sample.linear, sample.angular))
        self._encoders.on_odometry(sample)
        self._localizer.on_odometry(timed)
        self._obey_jumps_and_resets()

    def on_wheels(self, sample: WheelSample) -> None:
        self._gyro.on_wheels(sample)
        self._encoders.on_wheels(sample)

    def on_command(self, command: Twist2, now: float, rival: str = '') -> None:
        """This node, or the node with the name `rival`, sent `command` at `now`. If both nodes
        drive for RIVAL_WARNING_TIME, log a warning."""
        if command == Twist2():
            return
        self._localizer.on_command(now)
        if self.sensors.last_command == Twist2():
            self._rivals_began_at.clear()
        elif rival:
            self._warn_of_rival(rival, now)

    def _warn_of_rival(self, rival: str, now: float) -> None:
        began_at = self._rivals_began_at.setdefault(rival, now)
        if now - began_at > RIVAL_WARNING_TIME:
            self._rivals_began_at[rival] = math.inf    # warn only once
            self._log.warn(f'{rival} drives the robot, too: stop one of the two (False on '
                           'ctrl_relinq stops this one)')

    def set_law(self, law: DriveLaw) -> None:
        """From now on use another control law. If a drive is active, begin this drive again."""
        self._machine.law = law
        self._pace = Pace(law.period)
        if self._machine.is_active:
            self._machine.begin_drive()

    def set_goal(self, goal: Pose2) -> None:
        self._machine.set_goal(goal)
        self._request_motion()

    def on_goal(self, request: GoalRequest, steady_now: float) -> None:
        """Drive to a goal. A refused goal, or a repetition of the current goal, changes nothing."""
        sender_request = self.register_goal(request, steady_now)
        requests = self._requests
        try:
            goal = requests.pose_of(request, sender_request, self.odom_T_local)
        except ValueError as error:
            requests.refuse(request, str(error))
            return
        is_current = self._machine.is_active and self._machine.goal == goal
        is_repetition = is_current and requests.repeats_current(sender_request)
        if not is_repetition:
            self.set_goal(goal)
        requests.accept(request)

    def register_goal(self, request: GoalRequest, steady_now: float) -> SenderRequest:
        """Store that a goal arrived, without a drive to this goal."""
        self._update_control(steady_now)    # the goal may have waited during a sleep
        self._answer_ended_goal()
        return self._requests.on_goal(request, steady_now)

    def on_cancel(self, steady_now: float, name: str = '', stamp: int = 0) -> None:
        """Cancel the goals for which GoalRequest.is_canceled_by() is true."""
        # without this update, a sleep of this process would look like a pause of the goals' sender
        self._update_control(steady_now)
        if self._requests.cancel(name, stamp):
            self._machine.cancel()
            self._forget_motion()

    def on_reset(self, reset: Reset, now: float, steady_now: float) -> None:
        """Declare that the robot is at `reset.requested_pose` now. `reset.is_over` becomes True
        when the reset is carried out or refused."""
        self._update_control(steady_now)
        sleep_refusal = self._permission.sleep.reason_to_refuse
        problem = self.sensors.problem_text(now, with_age=True)
        if sleep_refusal:
            reset.reason = sleep_refusal + ': ask again'
        elif problem:
            reset.reason = f'{problem}: is the robot running?'
        else:
            self._localizer.on_reset(reset, now, self._response.sample_delay)

    def on_ctrl_relinq(self, message: 'IncomingMessage[bool]') -> None:
        self._permission.on_message(message)

    def _update_control(self, steady_now: float) -> None:
        self._permission.update(steady_now)
        was_allowed = self.may_drive
        self.may_drive = self._permission.has_valid_grant
        has_new_grant = self._permission.pop_new_grant()
        if has_new_grant and (self._machine.failure or not was_allowed):
            self._begin_drive_by_grant()
        elif self.may_drive and not was_allowed:
            self._machine.restart_law()
        elif was_allowed and not self.may_drive:
            self._forget_motion()

    def _begin_drive_by_grant(self) -> None:
        """Begin a new drive, since another node may have moved the robot before the grant."""
        if self._machine.failure or self._machine.is_active:
            self._machine.begin_drive()
        self._request_motion()

    # -- outputs

    def tick(self, now: float, steady_now: float) -> DriveOutput:
        self._update_control(steady_now)
        command_is_due = self._pace.is_due(now) or not self.sensors.are_fresh(now)
        command = self._next_command(now) if command_is_due else None
        self._answer_ended_goal()
        # a drive continues by its last command until the next command is due
        must_stop = command is None if command_is_due else not self._is_driving
        status = self._log_new_status(now)
        return DriveOutput(
            command, must_stop_first=must_stop, status=status, log_lines=self._log.pop_all(),
            needs_fast_ticks=self._has_granted_goal,
            has_control=self._permission.has_grant, answers=self._requests.answers.pop_all(),
            stamped_pose=self._localizer.pop_pose(), odom_T_local=self.odom_T_local)

    def _next_command(self, now: float) -> Optional[Twist2]:
        self._update_sensors(now)
        failure = POSE_LOST if self._localizer.is_lost else self._sensor_conflict()
        if not self._is_driving:
            self._forget_motion()
        elif failure:
            self._machine.give_up(failure)
            self._forget_motion()
        elif self.sensors.status in (SensorStatus.FRESH, SensorStatus.RECOVERED):
            motion = self._localizer.motion(now)
            if motion is not None:
                return self._step(motion, now)
        self._pace.skip(now)
        return None

    def _step(self, motion: Motion, now: float) -> Optional[Twist2]:
        """Returns the next command of the drive; None if the drive was given up."""
        dt = self._pace.step(now)
        self._give_up_if_frozen(now)
        command = self._machine.step(motion, dt)
        self.sensors.last_command = command or Twist2()
        if command is not None:
            self.on_command(command, now)
        return command

    def _answer_ended_goal(self) -> None:
        """If the drive has ended, tell the client of the goal once how the drive ended."""
        machine = self._machine
        if machine.goal is None or machine.is_active:
            return
        if machine.failure:
            self._requests.end_repetitions()
            outcome = GoalOutcome.CANCELED if machine.is_canceled else GoalOutcome.GIVEN_UP
            self._requests.answer_client(outcome, machine.failure)
        else:
            self._requests.answer_client(GoalOutcome.REACHED, PRINTED_REACHED + '!')

    def _log_new_status(self, now: float) -> Optional[DriveStatus]:
        if self._machine.goal is None:
            return None
        status = self.status(now)
        is_new = self._status_logger.log_if_new(status, lambda: self._localizer.motion(now), now)
        return status if is_new else None

    # -- state

    @property
    def _is_driving(self) -> bool:
        return self.may_drive and self._machine.is_active

    @property
    def _has_granted_goal(self) -> bool:
        return self._permission.has_grant and self._machine.is_active

    @property
    def odom_T_local(self) -> Optional[Pose2]:
        """The pose of the frame ``local`` in ``odom``; None before the first StampedPose."""
        return self._localizer.odom_T_local

    def status(self, now: float) -> DriveStatus:
        machine = self._machine
        failure = POSE_LOST if self._localizer.is_lost else machine.failure
        return DriveStatus(
            state=machine.state, goal=machine.goal, attempt=machine.attempt,
            distance_tolerance=machine.law.distance_tolerance, has_begun=machine.has_begun,
            is_active=machine.is_active and not failure, failure=failure,
            reason_to_stand=self.sensors.reason_to_stand, may_drive=self.may_drive,
            sensor_problem=self.sensors.problem_text(now) or self._sensor_conflict())

    def idle_time(self, now: float) -> float:
        if self._localizer.waiting_resets:
            return 0.0
        return self._pace.idle_time(now) if self._is_driving else IDLE_SAMPLE_PERIOD

    # -- the drive

    def _sensor_conflict(self) -> str:
        return self._gyro.problem_text() or self._encoders.problem_text()

    def _update_sensors(self, now: float) -> None:
        sensors = self.sensors
        sensors.update(now, self._gyro.needs_comparison)
        self._permission.set_sensor_problem(sensors.problem_text(now))
        if sensors.status is not SensorStatus.FRESH:
            self._pace.restart()
        if sensors.status is SensorStatus.RECOVERED:
            self._machine.restart_law()
        elif sensors.status is SensorStatus.TIMED_OUT and self._has_granted_goal:
            reason = sensors.reason_to_stand or 'sensors were silent'
            self._machine.give_up(f'{reason} for {sensors.silent_for:.1f} s')

    def _give_up_if_frozen(self, now: float) -> None:
        """Give up the drive if a sensor repeats the same reading, though the robot should move."""
        odometry = self._timing.odometry
        assert odometry is not None
        previous = odometry.previous_sample
        has_turned = previous is None or previous.pose.yaw != odometry.sample.pose.yaw
        self.sensors.update_repetitions(has_turned, now)
        frozen_text = self.sensors.frozen_text()
        if frozen_text:
            self._machine.give_up(frozen_text)

    def _forget_motion(self) -> None:
        """The robot rests, or another node drives it. Let the next command begin a new motion."""
        self._pace.restart()
        self.sensors.forget_motion()

    def _request_motion(self) -> None:
        self._pace.restart()
        self.sensors.request_motion()

    def _obey_jumps_and_resets(self) -> None:
        """Give up the drive if yaw or odometry jumped. Begin the drive again after a reset."""
        for jump in self._localizer.jumps.pop_all():
            if jump.outcome:
                text = jump.text[0].upper() + jump.text[1:]
                self._log.warn(f'{text}: {jump.outcome}')
            if self._localizer.is_lost and self._machine.is_active:
                self._machine.give_up(POSE_LOST)
            elif self._has_granted_goal and self._machine.has_begun:
                self._machine.give_up(jump.text)
        for reset in self._localizer.pop_ended_resets():
            if not reset.is_done:
                continue
            self._machine.begin_drive()
            self._request_motion()
            if not self._machine.is_active:
                reset.note = '; no goal: send one'
            self._log.add(reset.answer)
