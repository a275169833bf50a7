"""The law of a drive to a goal: a command for each state. It brakes by
:mod:`tb3_labs.control.approach`.

Units: metres, radians, seconds; poses in the local frame.
"""
import math
from typing import Optional

from tb3_labs.control.approach import Approach, ApproachConfig, PreciseTurn
from tb3_labs.control.braking import LawStep
from tb3_labs.control.goal_state import DriveConfig, GoalState, sum_of_turns
from tb3_labs.control.motor_response import Response
from tb3_labs.geometry.angles import difference, wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import Motion
from tb3_labs.robot.turtlebot3 import RobotModel, Twist2, saturate

#: A robot that would stop beyond the goal by more than this share of the tolerance backs up.
OUTSIDE = 0.8


def driving_approach(config: DriveConfig) -> ApproachConfig:
    """Returns the ApproachConfig of a precise drive along its line."""
    return ApproachConfig(
        period=PreciseTurn.period, acceleration=config.linear_acceleration,
        braking=0.2 * config.linear_acceleration, gain=15.0, slowest=0.015, close_enough=0.0005,
        backwards_from=OUTSIDE * config.distance_tolerance, nudge_time=PreciseTurn.period)


class DriveLaw:
    """Drives as fast as the limits allow, and stops at the goal.

    Each turn is a PreciseTurn. The way along the line from start to goal is an Approach. While
    driving, the robot steers towards a point of the line a little ahead. Each driving state has a
    method, whose `dt` is the time since the last step [s].
    """

    period = PreciseTurn.period
    #: The robot begins to drive at this angle from the line, and ends its turn while it drives.
    FACING = 0.1                  # [rad]
    #: An interrupted drive continues along its line if the robot faces within this angle of it.
    ALONG = 0.3                   # [rad]
    #: The drive ends when the robot would come to rest this far before the goal.
    STOP_AHEAD = 0.0005           # [m]
    #: The robot steers towards a point of the line this far ahead. A larger distance is calmer, a
    #: smaller one keeps nearer to the line.
    LOOK_AHEAD = 0.20             # [m]
    #: At full speed, with less steering than this, every second step is skipped.
    CALM = 0.05                   # [rad/s]
    #: A robot that is slower stands.
    REST_SPEED = 0.01             # [m/s]

    def __init__(self, config: DriveConfig, model: RobotModel,
                 response: Optional[Response] = None) -> None:
        response = response or Response()
        self.distance_tolerance = config.distance_tolerance
        self._config = config
        self._model = model
        self._max_linear = min(config.max_linear, model.max_linear)
        self._max_angular = min(config.max_angular, model.max_angular)
        self._turning = PreciseTurn(self._max_angular, config.angular_acceleration,
                                    math.radians(config.angle_tolerance_deg), response)
        self._outside = OUTSIDE * config.distance_tolerance
        self._driving = Approach(driving_approach(config), response)

    def start(self, pose: Pose2, goal: Pose2) -> None:
        """Choose the line to the goal, and whether to drive it forwards or backwards."""
        self._line = pose.bearing_to(goal)
        self._is_at_goal = pose.distance_to(goal) <= 0.5 * self.distance_tolerance
        backwards = wrap(self._line + math.pi)
        turns, reverse_turns = (sum_of_turns(pose.yaw, face, goal.yaw)
                                for face in (self._line, backwards))
        self._reverse = self._config.allow_reverse and reverse_turns < turns
        self._begin_turn(pose, backwards if self._reverse else self._line)
        self._driving.start()
        self._final_turn_begun = False

    def resume(self, state: GoalState, pose: Pose2, goal: Pose2) -> GoalState:
        """Returns the state in which an interrupted drive continues.

        If the robot still faces along its line, it drives on. If only the last turn remained, it
        makes this turn. Otherwise the drive begins again from here.
        """
        along = wrap(self._line + math.pi) if self._reverse else self._line
        off = difference(along, pose.yaw)
        if state is GoalState.MOVE_FORWARD and abs(off) <= self.ALONG:
            self._turning.start(pose.yaw, off)
            self._driving.start()
        elif state is GoalState.ROTATE_TO_FINAL:
            self._final_turn_begun = False
        else:
            state = GoalState.ROTATE_TO_GOAL
            self.start(pose, goal)
        return state

    def rotate_to_goal(self, motion: Motion, goal: Pose2, dt: float) -> LawStep:
        """Turn to face along the line, and brake so that the turn would end there."""
        if self._is_at_goal:
            return LawStep(Twist2(), 0.0, True)
        turn = self._turn(motion, dt)
        return self._step(0.0, turn, turn.remaining, abs(turn.remaining) < self.FACING)

    def move_forward(self, motion: Motion, goal: Pose2, dt: float) -> LawStep:
        """Drive along the line; ends when the robot would come to rest at the goal.

        A delayed command may let the robot drive past the goal. The robot then waits for rest, and
        backs up straight if it is outside the tolerance.
        """
        line_T_base = Pose2(goal.x, goal.y, self._line).inverse() @ motion.pose
        ahead, aside = -line_T_base.x, line_T_base.y    # remaining way; offset to the left [m]
        direction = -1.0 if self._reverse else 1.0
        speed = direction * self._driving.step(ahead, direction * motion.linear,
                                               self._max_linear, dt)
        at_rest = self._driving.at_rest.value
        slips = at_rest < -0.3 * self.distance_tolerance and abs(motion.linear) > self.REST_SPEED
        line_direction = wrap(self._line + math.atan2(-aside, self.LOOK_AHEAD))
        self._turning.aim(wrap(line_direction + math.pi) if self._reverse else line_direction)
        arrived = -self._outside <= at_rest <= self.STOP_AHEAD and not slips
        turn = self._turn(motion, dt)
        cruises = (self._driving.cruises(self._max_linear)
                   and abs(turn.command.angular) <= self.CALM)
        return self._step(speed, turn, ahead, self._is_at_goal or arrived, cruises)

    def rotate_to_final(self, motion: Motion, goal: Pose2, dt: float) -> LawStep:
        """Turn to the goal's heading; ends when settled: inside the tolerance and at rest."""
        if not self._final_turn_begun:
            self._final_turn_begun = True
            self._begin_turn(motion.pose, goal.yaw)
        turn = self._turn(motion, dt)
        return self._step(0.0, turn, turn.remaining, turn.finished)

    def shortfall(self, pose: Pose2, goal: Pose2) -> str:
        """Returns the distance from the goal in words if it is above the tolerance; else ''."""
        distance = pose.distance_to(goal)
        if distance <= self.distance_tolerance:
            return ''
        return (f'stopped {1000.0 * distance:.0f} mm from the goal (tolerance '
                f'{1000.0 * self.distance_tolerance:.0f} mm)')

    def _begin_turn(self, pose: Pose2, face: float) -> None:
        self._turning.start(pose.yaw, difference(face, pose.yaw))

    def _turn(self, motion: Motion, dt: float) -> LawStep:
        measured = motion.pose.yaw - motion.extrapolated
        return self._turning.step(measured, motion.angular, dt, motion.imu_age, motion.yaw_noise)

    def _step(self, linear: float, turn: LawStep, remaining: float, finished: bool,
              cruises: bool = False) -> LawStep:
        both = Twist2(linear, turn.command.angular)
        return LawStep(saturate(both, self._max_linear, self._max_angular, self._model),
                       remaining, finished, cruises)
