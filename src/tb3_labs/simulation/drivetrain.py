"""Simulates the motors and the wheels, which move the robot.

A motor follows its goal speed with a first-order lag. The path of the robot is computed as a series
of arcs. At constant speed one arc is the exact path. While the speed changes, the arcs are short,
and each start or stop adds an error of some micrometres.

Units: SI. Motor angles are in radians, and grow when the robot drives forwards.
"""
import copy
import math
from collections import deque
from typing import Deque, Tuple

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import RobotModel
from tb3_labs.simulation.imu import ImuModel, TurnCurve

MAX_ARC_TIME = 1.0 / 60.0       # longest time [s] of an arc while the speed changes
ROUNDING_SLACK = 1e-9           # a time that exceeds MAX_ARC_TIME by rounding remains one arc
MOTOR_SPEED_TOLERANCE = 1e-6    # [rad/s]; a motor with a smaller error gets its goal speed


class Drivetrain:
    """Moves the robot by its motors and wheels. Time passes only in :meth:`advance`."""

    def __init__(self, model: RobotModel, pose: Pose2) -> None:
        self._model = model
        self._x, self._y, self._yaw = pose.x, pose.y, pose.yaw
        self._left_angle, self._right_angle = 0.0, 0.0
        self._left_speed, self._right_speed = 0.0, 0.0
        self._left_goal, self._right_goal = 0.0, 0.0
        self.set_physics(lag=0.0, mismatch=0.0, slip=0.0)

    def set_physics(self, lag: float, mismatch: float, slip: float) -> None:
        """Set the `lag` [s] of the motors. The right wheel is smaller by the fraction `mismatch`.
        The fraction `slip` of the wheels' travel does not move the robot."""
        self._lag = lag
        self._left_radius = self._model.wheel_radius * (1.0 - slip)
        self._right_radius = self._left_radius * (1.0 - mismatch)
        self.set_goal_speeds(self._left_goal, self._right_goal)

    def set_goal_speeds(self, left: float, right: float) -> None:
        """Set the goal speeds [rad/s] of the motors."""
        self._left_goal, self._right_goal = left, right
        self._update_turn_rates()

    def _update_turn_rates(self) -> None:
        """Compute the rates of turn. Motors that are near their goal speeds get these speeds."""
        left_excess, right_excess = self._excess_speeds()
        max_excess = max(abs(left_excess), abs(right_excess))
        self._is_steady = not self._lag or max_excess < MOTOR_SPEED_TOLERANCE
        if self._is_steady:
            self._left_speed, self._right_speed = self._left_goal, self._right_goal
            left_excess, right_excess = 0.0, 0.0
        left_ratio = self._left_radius / self._model.wheel_separation
        right_ratio = self._right_radius / self._model.wheel_separation
        self._steady_turn_rate = right_ratio * self._right_goal - left_ratio * self._left_goal
        self._fading_turn_rate = right_ratio * right_excess - left_ratio * left_excess

    def _excess_speeds(self) -> Tuple[float, float]:
        return self._left_speed - self._left_goal, self._right_speed - self._right_goal

    @property
    def turn_curve(self) -> TurnCurve:
        """The robot's current yaw, and its rate of turn from now on."""
        return TurnCurve(self._yaw, self._steady_turn_rate, self._fading_turn_rate, self._lag)

    @property
    def pose(self) -> Pose2:    # world_T_base
        return Pose2(self._x, self._y, wrap(self._yaw))

    @property
    def angles(self) -> Tuple[float, float]:
        """The angles (left, right) [rad] by which the motors have turned since the start."""
        return self._left_angle, self._right_angle

    def advance(self, dt: float) -> None:
        """Let `dt` seconds pass; `dt` >= 0."""
        if self._is_steady:
            self._roll(self._left_goal * dt, self._right_goal * dt)
            return
        arc_count = max(1, math.ceil(dt / MAX_ARC_TIME - ROUNDING_SLACK))
        dt /= arc_count
        decay = math.exp(-dt / self._lag)
        excess_time = self._lag * (1.0 - decay)
        for _ in range(arc_count):
            left_excess, right_excess = self._excess_speeds()
            self._roll(self._left_goal * dt + left_excess * excess_time,
                       self._right_goal * dt + right_excess * excess_time)
            self._left_speed = self._left_goal + left_excess * decay
            self._right_speed = self._right_goal + right_excess * decay
        self._update_turn_rates()

    def _roll(self, left: float, right: float) -> None:
        """Turn the motors by `left` and `right` [rad]. The robot drives one arc."""
        self._left_angle += left
        self._right_angle += right
        left_path = left * self._left_radius
        right_path = right * self._right_radius
        chord = (left_path + right_path) / 2.0
        half_turn = (right_path - left_path) / self._model.wheel_separation / 2.0
        if half_turn:
            chord *= math.sin(half_turn) / half_turn
        self._x += chord * math.cos(self._yaw + half_turn)
        self._y += chord * math.sin(self._yaw + half_turn)
        self._yaw += 2.0 * half_turn


class Body:
    """The drivetrain and the IMU of one robot."""

    def __init__(self, model: RobotModel, start: Pose2, imu_offset: float, seed: int) -> None:
        self.drivetrain = Drivetrain(model, start)
        self.imu = ImuModel(start.yaw, imu_offset, seed)
        self._moved_until = 0.0    # time [s] of the latest pose
        # (start [s], drivetrain at the start) of each motion that wheel_angles_at() still needs
        self._unread_motions: Deque[Tuple[float, Drivetrain]] = deque()

    @property
    def yaw(self) -> float:
        """The true yaw [rad] of the robot, not wrapped."""
        return self.drivetrain.turn_curve.yaw

    def advance_to(self, stamp: float) -> None:
        dt = stamp - self._moved_until
        if dt > 0.0:
            self.drivetrain.advance(dt)
            self._moved_until = stamp
            self.imu.add_motion(stamp, self.drivetrain.turn_curve)

    def pose_at(self, now: float) -> Pose2:
        """Returns the robot's pose at `now` [s], which must not be before the last advance_to()."""
        drivetrain = copy.copy(self.drivetrain)
        drivetrain.advance(now - self._moved_until)
        return drivetrain.pose

    def save_motion(self) -> None:
        """Save the motion that begins with a change of goal speeds, physics or IMU settings."""
        self.imu.add_motion(self._moved_until, self.drivetrain.turn_curve)
        self._unread_motions.append((self._moved_until, copy.copy(self.drivetrain)))

    def set_gyro_bias(self, bias: float) -> None:
        """From now on let the gyro be wrong by `bias` [rad/s]."""
        self.imu.bias = bias
        self.save_motion()

    def wheel_angles_at(self, moment: float) -> Tuple[float, float]:
        """Returns the angles (left, right) [rad] of the motors. `moment` [s] must not go back."""
        motions = self._unread_motions
        while len(motions) > 1 and motions[1][0] <= moment:    # the next motion has begun
            motions.popleft()
        start, drivetrain = motions[0]
        if moment > start:
            drivetrain.advance(moment - start)
            motions[0] = moment, drivetrain
        return drivetrain.angles
