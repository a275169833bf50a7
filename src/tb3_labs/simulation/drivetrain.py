"""Two driven wheels on a floor: the true pose of the robot.

A motor follows its goal speed with a first-order lag. So its speed and its angle are known in
closed form, for steps of any length. The pose follows by arcs, which are exact at constant speed.
While the speed changes, the arcs are short: the error is some micrometres per start or stop.

Units: SI; motor angles in radians, positive forwards.
"""
import copy
import math
from typing import Tuple

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import RobotModel

#: Longest arc while the speed changes [s].
LONGEST_ARC = 1.0 / 60.0
#: A motor this near to its goal speed has reached it [rad/s].
STEADY = 1e-6


class Drivetrain:
    """Motors, wheels and the pose that results. Time passes in :meth:`advance` only."""

    def __init__(self, model: RobotModel, pose: Pose2) -> None:
        self._model = model
        self._x, self._y, self._yaw = pose.x, pose.y, pose.yaw
        self._left_angle = self._right_angle = 0.0
        self._left_speed = self._right_speed = 0.0
        self._left_goal = self._right_goal = 0.0
        self.set_physics(lag=0.0, mismatch=0.0, slip=0.0)

    def set_physics(self, lag: float, mismatch: float, slip: float) -> None:
        """`lag` of the motors [s]; `mismatch`: fraction by which the right wheel is smaller;
        `slip`: fraction of the wheels' travel that does not move the robot."""
        self._lag = lag
        self._left_radius = self._model.wheel_radius * (1.0 - slip)
        self._right_radius = self._left_radius * (1.0 - mismatch)
        self.set_goals(self._left_goal, self._right_goal)

    def set_goals(self, left: float, right: float) -> None:
        """Goal speeds of the motors [rad/s]."""
        self._left_goal, self._right_goal = left, right
        self._settle()

    def _settle(self) -> None:
        """Compute what stays constant until speeds or goals change."""
        left_excess = self._left_speed - self._left_goal
        right_excess = self._right_speed - self._right_goal
        self._steady = not self._lag or (abs(left_excess) < STEADY and abs(right_excess) < STEADY)
        if self._steady:
            self._left_speed, self._right_speed = self._left_goal, self._right_goal
            left_excess = right_excess = 0.0
        left = self._left_radius / self._model.wheel_separation
        right = self._right_radius / self._model.wheel_separation
        self._steady_rate = right * self._right_goal - left * self._left_goal
        self._fading_rate = right * right_excess - left * left_excess

    @property
    def turning(self) -> Tuple[float, float, float, float]:
        """(yaw, a, b, lag): in t seconds the rate of turn will be a + b exp(-t / lag) [rad/s];
        b = 0 at constant speed. The yaw [rad] is not wrapped."""
        return self._yaw, self._steady_rate, self._fading_rate, self._lag

    @property
    def pose(self) -> Pose2:
        """The robot's pose in `world`."""
        return Pose2(self._x, self._y, wrap(self._yaw))

    @property
    def velocity(self) -> Tuple[float, float]:
        """(forward speed [m/s], rate of turn [rad/s]) over the floor."""
        left = self._left_radius * self._left_speed
        right = self._right_radius * self._right_speed
        return (left + right) / 2.0, (right - left) / self._model.wheel_separation

    @property
    def angles(self) -> Tuple[float, float]:
        """(left, right) angle of the motors since the start [rad]."""
        return self._left_angle, self._right_angle

    def ahead(self, dt: float) -> 'Drivetrain':
        """The drivetrain in `dt` seconds if the goals do not change."""
        later = copy.copy(self)
        later.advance(dt)
        return later

    def advance(self, dt: float) -> None:
        """Let `dt` seconds pass; `dt` >= 0."""
        if self._steady:
            if self._left_goal or self._right_goal:
                self._roll(self._left_goal * dt, self._right_goal * dt)
            return
        arcs = math.ceil(dt / LONGEST_ARC - 1e-9) or 1
        dt /= arcs
        decay = math.exp(-dt / self._lag)
        excess_time = self._lag * (1.0 - decay)
        for _ in range(arcs):
            left_excess = self._left_speed - self._left_goal
            right_excess = self._right_speed - self._right_goal
            self._roll(self._left_goal * dt + left_excess * excess_time,
                       self._right_goal * dt + right_excess * excess_time)
            self._left_speed = self._left_goal + left_excess * decay
            self._right_speed = self._right_goal + right_excess * decay
        self._settle()

    def _roll(self, left: float, right: float) -> None:
        """Turn the motors by these angles [rad]: the robot drives one arc."""
        self._left_angle += left
        self._right_angle += right
        left *= self._left_radius
        right *= self._right_radius
        chord = (left + right) / 2.0
        half = (right - left) / self._model.wheel_separation / 2.0
        if half:
            chord *= math.sin(half) / half
        self._x += chord * math.cos(self._yaw + half)
        self._y += chord * math.sin(self._yaw + half)
        self._yaw += 2.0 * half
