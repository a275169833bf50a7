"""Simulates the robot's board, which computes motor speeds and the odometry.

This module copies the faults of the real firmware, because students' nodes have to work with them.

The board clips the linear and the angular speed of a command, then the speed of each wheel. So a
fast curve becomes slower and wider. The board rounds the speed of a motor towards zero to a whole
number of speed steps, at most `motor_steps`. The board's library rosserial reads infinity as 1, and
NaN as 1.5. The board obeys the newest command for half a second after reading it.

The heading of the odometry comes from the IMU, whose turn between two samples is *not* wrapped. So
when the IMU crosses +/-180 deg, the displacement of one sample points backwards. The yaw of this
sample is correct, but its rate of turn is wrong by a whole turn per sample, about 190 rad/s. If the
servos do not answer, the odometry repeats its last displacement, but no wheel angle changes.

After a `reset` the board first calibrates its gyro. Meanwhile the motors keep their speed, and
commands and further resets wait in order. The mean rate of turn during the calibration becomes the
gyro's bias. Then the board sets the odometry's pose to zero, but not the IMU's yaw. The next sample
of the odometry adds the turn that the IMU measured during the calibration.

Units: SI. Motor angles are in radians, positive forwards. Source: ROBOTIS OpenCR firmware 1.2.6
(turtlebot3_core.ino, turtlebot3_motor_driver.cpp). The times were measured with this firmware.
"""
import math
from collections import deque
from typing import Deque, Optional, Sequence, Tuple

from tb3_labs.geometry.angles import clamp, wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import OdometrySample
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT, RobotModel
from tb3_labs.simulation.network import Arrival

TICK_ANGLE = 2.0 * math.pi / 4096.0    # angle [rad] by which a wheel turns in one encoder tick
MOTOR_SPEED_STEP = 0.229 * 2.0 * math.pi / 60.0    # [rad/s]
#: A NetworkLink sends a reset as this text, and a command as (forward speed, rate of turn).
RESET_MESSAGE = 'reset'


def motor_speeds(linear: float, angular: float, model: RobotModel) -> Tuple[float, float]:
    """Returns the goal speeds (left, right) [rad/s] of the motors for a command."""
    linear = clamp(_as_rosserial_reads(linear), -model.max_linear, model.max_linear)
    angular = clamp(_as_rosserial_reads(angular), -model.max_angular, model.max_angular)
    rim_offset = angular * model.half_track
    return _motor_speed(linear - rim_offset, model), _motor_speed(linear + rim_offset, model)


def _as_rosserial_reads(speed: float) -> float:
    """Returns the speed that the board's rosserial reads if a node sends `speed`."""
    if math.isfinite(speed):
        return speed
    size = 1.5 if math.isnan(speed) else 1.0
    return math.copysign(size, speed)


def _motor_speed(rim_speed: float, model: RobotModel) -> float:
    rim_speed = clamp(rim_speed, -model.max_wheel_speed, model.max_wheel_speed)
    steps = int(rim_speed / model.wheel_radius / MOTOR_SPEED_STEP)
    return clamp(steps, -model.motor_steps, model.motor_steps) * MOTOR_SPEED_STEP


def encoder_ticks(motor_angle: float) -> int:
    return math.floor(motor_angle / TICK_ANGLE)


class Odometer:
    """Computes the odometry from encoder ticks and the IMU's yaw."""

    def __init__(self, model: RobotModel, pose: Pose2, imu_yaw: float) -> None:
        self._radius = model.wheel_radius
        self._x, self._y, self._yaw = pose.x, pose.y, pose.yaw
        self._last_imu_yaw = imu_yaw
        self._ticks: Tuple[int, int] = (0, 0)
        self._ticks_at_reset = (0, 0)
        self._tick_change = (0, 0)    # new ticks (left, right) in the servos' last answer
        self._stamp = 0.0
        self.wheel_speeds = (0.0, 0.0)    # mean speeds (left, right) [rad/s] in the last interval

    @property
    def wheel_angles(self) -> Tuple[float, float]:
        """The angles (left, right) [rad] of the wheels since the start or the last reset."""
        left, right = self._ticks
        left_zero, right_zero = self._ticks_at_reset
        return TICK_ANGLE * (left - left_zero), TICK_ANGLE * (right - right_zero)

    def update(self, stamp: float, ticks: Optional[Tuple[int, int]],
               imu_yaw: float) -> OdometrySample:
        """Returns the sample at `stamp` [s], which must be later than the last stamp. `ticks` is
        (left, right), or None if the servos do not answer. `imu_yaw` [rad] is in (-pi, pi]."""
        interval = stamp - self._stamp
        if ticks is not None:
            (left, right), (last_left, last_right) = ticks, self._ticks
            self._tick_change = left - last_left, right - last_right
            self._ticks = ticks
        left_ticks, right_ticks = self._tick_change
        left_turn, right_turn = TICK_ANGLE * left_ticks, TICK_ANGLE * right_ticks
        self.wheel_speeds = (left_turn / interval, right_turn / interval)
        distance = self._radius * (left_turn + right_turn) / 2.0
        turn = imu_yaw - self._last_imu_yaw    # not wrapped, as in the real firmware
        self._x += distance * math.cos(self._yaw + turn / 2.0)
        self._y += distance * math.sin(self._yaw + turn / 2.0)
        self._yaw += turn
        self._stamp = stamp
        self._last_imu_yaw = imu_yaw
        return OdometrySample(stamp, Pose2(self._x, self._y, wrap(self._yaw)),
                              linear=distance / interval, angular=turn / interval)

    def reset(self, ticks: Optional[Tuple[int, int]]) -> None:
        """Set the pose and the wheel angles to zero. `ticks` is the same as in :meth:`update`."""
        self._x, self._y, self._yaw = 0.0, 0.0, 0.0
        if ticks is not None:
            self._ticks, self._ticks_at_reset = ticks, ticks


class Board:
    """Reads messages and obeys commands. The board reads nothing while it calibrates its gyro."""

    def __init__(self) -> None:
        self._unread: Deque[Arrival] = deque()
        self.calibration_end = math.inf           # time [s], infinite if no calibration runs
        self._last_calibration_end = -math.inf    # [s]
        self._calibration_duration = 0.0          # [s]
        self._yaw_at_begin = 0.0                  # true yaw [rad] when the calibration began
        # the latest command: (time of reading [s], forward speed [m/s], rate of turn [rad/s])
        self._command = -math.inf, 0.0, 0.0

    @property
    def is_calibrating(self) -> bool:
        """Returns True while the board calibrates its gyro. The board then sends no samples."""
        return self.calibration_end < math.inf

    def begin_calibration(self, now: float, seconds: float, yaw: float) -> None:
        """Calibrate the gyro for `seconds`. `yaw` is the current true yaw [rad], not wrapped."""
        self.calibration_end = now + seconds
        self._calibration_duration = seconds
        self._yaw_at_begin = yaw

    def end_calibration(self, yaw: float) -> float:
        """Returns the gyro's new bias [rad/s]. `yaw` is the current true yaw [rad], not wrapped."""
        self._last_calibration_end = self.calibration_end
        self.calibration_end = math.inf
        if not self._calibration_duration:
            return 0.0
        return (self._yaw_at_begin - yaw) / self._calibration_duration

    def read_up_to_reset(self, arrivals: Sequence[Arrival]) -> bool:
        """Read the arrived messages, up to the first reset. Returns True if there is a reset."""
        self._unread.extend(arrivals)
        while self._unread and not self.is_calibrating:
            arrival, message = self._unread.popleft()
            if message == RESET_MESSAGE:
                return True
            linear, angular = message
            self._command = max(arrival, self._last_calibration_end), linear, angular
        return False

    def command_in_force(self, now: float) -> Tuple[float, float]:
        """Returns the command (forward speed, rate of turn) that the board obeys at `now` [s]."""
        read_at, linear, angular = self._command
        if now - read_at > COMMAND_TIMEOUT:
            return 0.0, 0.0
        return linear, angular
