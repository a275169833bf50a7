"""The robot's own board: it turns commands into motor speeds, and encoders into odometry.

Its faults are copied, because the labs have to work with them:

- Linear and angular speed are clipped one by one, then each wheel again. So a fast curve becomes
  slower and wider.
- Motors take whole steps of speed, cut towards zero, and not more than `motor_steps`.
- A speed that is not finite arrives over rosserial as the largest number of its sign.
- The heading of the odometry is the IMU's: ``dyaw = theta - theta_last`` is *not* wrapped. Each
  time the IMU crosses +/-180 deg, one sample's displacement points backwards and its
  twist.angular has a spike of 2 pi times the odometry's rate, about 190 rad/s. The yaw itself
  stays correct.
- `reset` zeroes the odometry's pose, but not the IMU's yaw. From then on they differ. The next
  odometry adds the turn that the IMU saw meanwhile.

Units: SI; motor angles in radians, positive forwards. Source: ROBOTIS OpenCR firmware 1.2.6
(turtlebot3_core.ino, turtlebot3_motor_driver.cpp).
"""
import math
from typing import Tuple

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import OdometrySample
from tb3_labs.robot.turtlebot3 import MOTOR_SPEED_STEP, TICKS_PER_TURN, RobotModel

#: Angle of a wheel from one encoder step to the next [rad].
TICK = 2.0 * math.pi / TICKS_PER_TURN


def motor_speeds(linear: float, angular: float, model: RobotModel) -> Tuple[float, float]:
    """(left, right) goal speeds of the motors [rad/s] for a command [m/s], [rad/s]."""
    linear = _clip(_received(linear), model.max_linear)
    angular = _clip(_received(angular), model.max_angular)
    turning = angular * model.half_track
    return _whole_steps(linear - turning, model), _whole_steps(linear + turning, model)


def _received(speed: float) -> float:
    return speed if math.isfinite(speed) else math.copysign(math.inf, speed)


def _whole_steps(rim_speed: float, model: RobotModel) -> float:
    rim_speed = _clip(rim_speed, model.max_wheel_speed)
    steps = int(rim_speed / model.wheel_radius / MOTOR_SPEED_STEP)
    return _clip(steps, model.motor_steps) * MOTOR_SPEED_STEP


def _clip(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


def encoder(motor_angle: float) -> int:
    """The reading of the encoder at this angle of the motor [rad], in ticks."""
    return math.floor(motor_angle / TICK)


class Odometer:
    """Pose from encoder ticks and the IMU's yaw."""

    def __init__(self, model: RobotModel, pose: Pose2, imu_yaw: float) -> None:
        self._radius = model.wheel_radius
        self._x, self._y, self._yaw = pose.x, pose.y, pose.yaw
        self._theta_last = imu_yaw
        self._ticks: Tuple[int, int] = (0, 0)
        self._zero = self._ticks
        self._stamp = 0.0
        self._wheel_speeds = (0.0, 0.0)

    @property
    def wheel_angles(self) -> Tuple[float, float]:
        """(left, right) angle of the wheels since the start or the last reset [rad]."""
        left, right = (TICK * (ticks - zero) for ticks, zero in zip(self._ticks, self._zero))
        return left, right

    @property
    def wheel_speeds(self) -> Tuple[float, float]:
        """(left, right) mean speed of the wheels over the last interval [rad/s]."""
        return self._wheel_speeds

    def update(self, stamp: float, ticks: Tuple[int, int], imu_yaw: float) -> OdometrySample:
        """The sample at `stamp` [s], later than the one before; `ticks` is (left, right), and
        `imu_yaw` [rad] is in (-pi, pi]."""
        interval = stamp - self._stamp
        left = TICK * (ticks[0] - self._ticks[0])
        right = TICK * (ticks[1] - self._ticks[1])
        distance = self._radius * (left + right) / 2.0
        turn = imu_yaw - self._theta_last  # not wrapped: see above
        self._x += distance * math.cos(self._yaw + turn / 2.0)
        self._y += distance * math.sin(self._yaw + turn / 2.0)
        self._yaw += turn
        self._stamp, self._ticks, self._theta_last = stamp, ticks, imu_yaw
        self._wheel_speeds = (left / interval, right / interval)
        return OdometrySample(stamp, Pose2(self._x, self._y, wrap(self._yaw)),
                              distance / interval, turn / interval)

    def start(self, imu_yaw: float) -> None:
        """The board starts: its first update counts from this yaw of the IMU [rad]."""
        self._theta_last = imu_yaw

    def reset(self, ticks: Tuple[int, int]) -> None:
        """Set pose and wheel angles to zero; `ticks` is the present reading of the encoders."""
        self._x = self._y = self._yaw = 0.0
        self._ticks = self._zero = ticks
