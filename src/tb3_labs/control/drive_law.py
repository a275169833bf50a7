"""The control law of a drive to a goal, and the settings of the law.

Units: metres, radians, seconds. Poses are in the local frame.
"""
import math
from dataclasses import dataclass
from typing import Optional

from tb3_labs.config import Config, setting
from tb3_labs.control.braking import Approach, ApproachConfig
from tb3_labs.control.commands import LawStep
from tb3_labs.control.motor_response import MotorResponse
from tb3_labs.control.turning import PreciseTurn
from tb3_labs.geometry.angles import difference, wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import MAX_ANG_Z
from tb3_labs.robot.samples import MAX_REST_SPEED, Motion
from tb3_labs.robot.turtlebot3 import RobotModel, Twist2, saturate


@dataclass(frozen=True)
class DriveConfig(Config):
    """Settings of a drive to a goal."""

    allow_reverse: bool = setting(False, 'drive backwards where that is the shorter way')
    distance_tolerance: float = setting(0.01, 'the goal is reached within this distance', unit='m',
                                        low=0.002, high=1.0)
    angle_tolerance_deg: float = setting(0.5, 'the heading is reached within this angle',
                                         unit='deg', low=0.2, high=45.0)
    max_linear: float = setting(0.26, "fastest drive; the robot's own limit holds as well",
                                unit='m/s', low=0.02, high=1.0)
    max_angular: float = setting(MAX_ANG_Z, "fastest turn; the robot's own limit holds as well",
                                 unit='rad/s', low=0.1, high=5.0)
    linear_acceleration: float = setting(4.0, 'speeding up; a fifth of it for braking',
                                         unit='m/s^2', low=0.1, high=10.0)
    angular_acceleration: float = setting(45.0, 'speeding up a turn; a quarter of it for braking',
                                          unit='rad/s^2', low=1.0, high=80.0)


def sum_of_turns(start: float, line: float, end: float) -> float:
    """Returns the sum [rad] of two turns: from yaw `start` to `line`, and from `line` to `end`."""
    return abs(difference(line, start)) + abs(difference(end, line))


class DriveLaw:
    """Drives as fast as the limits allow and stops at the goal.

    Each turn is a PreciseTurn. An Approach drives along the line from start to goal. Meanwhile the
    robot steers towards a point on the line, a little ahead of the robot. The law has one method
    for each driving state. `dt` is the time [s] since the previous step.
    """

    period = PreciseTurn.period
    FACING_ANGLE = 0.1           # [rad]; the robot drives when its heading is this near to the line
    ARRIVAL_DISTANCE = 0.0005    # [m]; a robot has arrived if it would stop this near to the goal
    #: A larger distance [m] calms the steering. A smaller distance keeps the robot near the line.
    LOOK_AHEAD_DISTANCE = 0.20
    AT_GOAL_SHARE = 0.5    # a robot that starts within this share of the tolerance only turns
    #: A robot that still moves may stop beyond the goal by at most this share of the tolerance.
    MAX_OVERSHOOT_SHARE_IN_MOTION = 0.3
    #: The robot backs up if it would stop farther beyond the goal than this share of the tolerance.
    MAX_OVERSHOOT_SHARE_AT_REST = 0.8

    def __init__(self, config: DriveConfig, model: RobotModel,
                 response: Optional[MotorResponse] = None) -> None:
        response = response or MotorResponse()
        self.distance_tolerance = config.distance_tolerance
        self._config = config
        self._model = model
        self._max_linear = min(config.max_linear, model.max_linear)
        self._max_angular = min(config.max_angular, model.max_angular)
        self._precise_turn = PreciseTurn(self._max_angular, config.angular_acceleration,
                                         math.radians(config.angle_tolerance_deg), response)
        self._max_overshoot_at_rest = self.MAX_OVERSHOOT_SHARE_AT_REST * config.distance_tolerance
        self._approach = Approach(ApproachConfig(
            period=self.period, acceleration=config.linear_acceleration,
            deceleration=0.2 * config.linear_acceleration, gain=15.0, min_speed=0.015,
            dead_band=self.ARRIVAL_DISTANCE, max_overshoot=self._max_overshoot_at_rest,
            nudge_time=self.period), response)

    def start(self, pose: Pose2, goal: Pose2) -> None:
        """Choose the line to the goal, and the direction of the drive along this line."""
        self._line_yaw = pose.bearing_to(goal)
        self._is_at_goal = pose.distance_to(goal) <= self.AT_GOAL_SHARE * self.distance_tolerance
        reversed_line = wrap(self._line_yaw + math.pi)
        turns = sum_of_turns(pose.yaw, self._line_yaw, goal.yaw)
        reverse_turns = sum_of_turns(pose.yaw, reversed_line, goal.yaw)
        self._is_reversed = self._config.allow_reverse and reverse_turns < turns
        self._start_turn(pose, self._heading_along(self._line_yaw))
        self._approach.start()
        self._has_started_final_turn = False

    def rotate_to_goal(self, motion: Motion, goal: Pose2, dt: float) -> LawStep:
        """Turn until the robot's heading is nearly along the line."""
        if self._is_at_goal:
            return LawStep(Twist2(), remaining=0.0, is_finished=True)
        turn_step = self._step_turn(motion, dt)
        is_facing = abs(turn_step.remaining) < self.FACING_ANGLE
        return self._limited_step(0.0, turn_step, turn_step.remaining, is_finished=is_facing)

    def move_forward(self, motion: Motion, goal: Pose2, dt: float) -> LawStep:
        """Drive along the line, until a command to stop would bring the robot to rest at the goal.

        If a command is delayed, the robot may drive past the goal. Then it comes to rest,
        and backs up straight if it is outside the tolerance.
        """
        line_T_base = Pose2(goal.x, goal.y, self._line_yaw).inverse() @ motion.pose
        remaining = -line_T_base.x
        direction = -1.0 if self._is_reversed else 1.0
        speed = direction * self._approach.step(
            remaining, direction * motion.linear, max_speed=self._max_linear, dt=dt)

        to_line = math.atan2(-line_T_base.y, self.LOOK_AHEAD_DISTANCE)
        self._precise_turn.aim(self._heading_along(wrap(self._line_yaw + to_line)))
        turn_step = self._step_turn(motion, dt)
        has_arrived = self._is_at_goal or self._has_arrived(motion.linear)
        return self._limited_step(speed, turn_step, remaining, is_finished=has_arrived)

    def rotate_to_final(self, motion: Motion, goal: Pose2, dt: float) -> LawStep:
        """Turn to the goal's heading, until the robot rests inside the tolerance."""
        if not self._has_started_final_turn:
            self._has_started_final_turn = True
            self._start_turn(motion.pose, goal.yaw)
        turn_step = self._step_turn(motion, dt)
        return self._limited_step(0.0, turn_step, turn_step.remaining, turn_step.is_finished)

    def shortfall_text(self, pose: Pose2, goal: Pose2) -> str:
        """Returns a text with the distance to the goal; '' inside the tolerance."""
        distance = pose.distance_to(goal)
        if distance <= self.distance_tolerance:
            return ''
        return (f'stopped {1000.0 * distance:.0f} mm from the goal (tolerance '
                f'{1000.0 * self.distance_tolerance:.0f} mm)')

    def _has_arrived(self, linear: float) -> bool:
        remaining = self._approach.predicted_remaining.value
        max_overshoot = self._max_overshoot_at_rest
        if abs(linear) > MAX_REST_SPEED:    # a moving robot may stop later than predicted
            max_overshoot = self.MAX_OVERSHOOT_SHARE_IN_MOTION * self.distance_tolerance
        return -max_overshoot <= remaining <= self.ARRIVAL_DISTANCE

    def _heading_along(self, direction: float) -> float:
        return wrap(direction + math.pi) if self._is_reversed else direction

    def _start_turn(self, pose: Pose2, goal_yaw: float) -> None:
        self._precise_turn.start(pose.yaw, difference(goal_yaw, pose.yaw))

    def _step_turn(self, motion: Motion, dt: float) -> LawStep:
        measured_yaw = motion.pose.yaw - motion.extrapolated_turn
        return self._precise_turn.step(
            measured_yaw, motion.angular, dt, age=motion.imu_age, noise=motion.yaw_noise)

    def _limited_step(self, linear: float, turn_step: LawStep, remaining: float,
                      is_finished: bool) -> LawStep:
        command = saturate(Twist2(linear, turn_step.command.angular), self._max_linear,
                           self._max_angular, self._model)
        return LawStep(command, remaining, is_finished)
