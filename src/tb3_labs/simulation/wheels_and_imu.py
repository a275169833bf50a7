"""The wheels that move the robot, and the IMU that measures its turning.

A motor follows its goal speed with a first-order lag. So its speed and its angle have a closed
form, for steps of any length. The robot drives in arcs, which are exact at constant speed. While
the speed changes, the arcs are short, and their error is some micrometres per start or stop.

The yaw of the IMU is the true yaw plus a constant, a drift that grows with time, and white noise.
The rate of turn of the IMU is the true rate plus the drift's rate, the bias that the last
calibration of the gyro left, and another white noise. The gyro has a dead zone. Yaw and rate were
measured earlier than their stamp, by the `lag`.

Units: SI. Motor angles are in radians, positive forwards. Source of the noise: the yaw of a Burger
at rest changes by a few 0.001 deg from one sample to the next.
"""
import copy
import math
from collections import deque
from typing import Any, Deque, Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.angles import WHOLE_TURN, wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import ImuSample
from tb3_labs.robot.turtlebot3 import RobotModel

#: Longest arc while the speed changes [s].
LONGEST_ARC = 1.0 / 60.0
#: A motor has reached its goal speed if it differs by less than this [rad/s].
STEADY_SPEED = 1e-6
#: Bias of a gyro that is not calibrated, measured on one robot [rad/s].
UNCALIBRATED_BIAS = math.radians(0.71)
#: The resolution of the gyro, whose range of 2000 deg/s has 16 bit with a sign [rad/s].
GYRO_STEP = math.radians(2000.0 / 2 ** 15)
#: The firmware shows a rate of at most this as 0 [rad/s].
GYRO_DEAD_ZONE = 3.0 * GYRO_STEP


class TurnCurve(NamedTuple):
    """The yaw now, and the rate of turn from now on. In t seconds the rate of turn will be
    `steady_rate` + `fading_rate` exp(-t / `lag`) [rad/s]."""

    yaw: float            # not wrapped [rad]
    steady_rate: float    # [rad/s]
    fading_rate: float    # 0 at constant speed [rad/s]
    lag: float            # [s]


class Drivetrain:
    """The motors, the wheels, and the robot's pose. Time passes only in :meth:`advance`."""

    def __init__(self, model: RobotModel, pose: Pose2) -> None:
        self._model = model
        self._x, self._y, self._yaw = pose.x, pose.y, pose.yaw
        self._left_angle = self._right_angle = 0.0
        self._left_speed = self._right_speed = 0.0
        self._left_goal = self._right_goal = 0.0
        self.set_physics(lag=0.0, mismatch=0.0, slip=0.0)

    def set_physics(self, lag: float, mismatch: float, slip: float) -> None:
        """Set the `lag` of the motors [s]. The right wheel is smaller by the share `mismatch`. The
        share `slip` of the wheels' travel does not move the robot."""
        self._lag = lag
        self._left_radius = self._model.wheel_radius * (1.0 - slip)
        self._right_radius = self._left_radius * (1.0 - mismatch)
        self.set_goals(self._left_goal, self._right_goal)

    def set_goals(self, left: float, right: float) -> None:
        """Set the goal speeds of the motors [rad/s]."""
        self._left_goal, self._right_goal = left, right
        self._update_rates()

    def _update_rates(self) -> None:
        """Compute the values that stay constant until speeds or goals change."""
        left_excess = self._left_speed - self._left_goal
        right_excess = self._right_speed - self._right_goal
        self._steady = not self._lag or (
            max(abs(left_excess), abs(right_excess)) < STEADY_SPEED)
        if self._steady:
            self._left_speed, self._right_speed = self._left_goal, self._right_goal
            left_excess = right_excess = 0.0
        left = self._left_radius / self._model.wheel_separation
        right = self._right_radius / self._model.wheel_separation
        self._steady_rate = right * self._right_goal - left * self._left_goal
        self._fading_rate = right * right_excess - left * left_excess

    @property
    def turn_curve(self) -> TurnCurve:
        """The robot's turn from now on."""
        return TurnCurve(self._yaw, self._steady_rate, self._fading_rate, self._lag)

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
        self._update_rates()

    def _roll(self, left: float, right: float) -> None:
        """Turn the motors by `left` and `right` [rad], so that the robot drives one arc."""
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


class ImuModel:
    """The IMU with its noise, drift and bias."""

    def __init__(self, yaw: float, offset: float, seed: int) -> None:
        """At the start the true yaw is `yaw` [rad], and the yaw of the IMU is `yaw` + `offset`."""
        #: Yaw of the IMU minus true yaw, without noise [rad].
        self.error = offset
        self._noise = _pairs_of_normal_numbers(seed)
        #: Error of the gyro's rate after the last calibration [rad/s].
        self.bias = 0.0
        self.configure(0.0, 0.0, 0.0, 0.0)
        self._error_until = 0.0    # `error` includes drift and bias up to this time [s]
        #: (start [s], turn of the IMU from then on), for motions that are not measured to their
        #: end yet, oldest first.
        self._motions: Deque[Tuple[float, TurnCurve]] = deque()
        self.follow(0.0, TurnCurve(yaw, 0.0, 0.0, 0.0))

    def configure(self, yaw_noise: float, rate_noise: float, drift: float, lag: float) -> None:
        """Set the standard deviations `yaw_noise` [rad] and `rate_noise` [rad/s], the `drift`
        [rad/s] and the `lag` [s]. Call :meth:`follow` afterwards. A gyro that drifts, or is noisier
        than the firmware's gyro, does not have a dead zone."""
        self._yaw_noise, self._rate_noise = yaw_noise, rate_noise
        self._drift, self._lag = drift, lag
        self._dead_zone = -math.inf if drift or rate_noise > GYRO_STEP else GYRO_DEAD_ZONE

    def follow(self, now: float, turn: TurnCurve) -> None:
        """Measure this turn of the robot from `now` [s] on."""
        self.error += (self._drift + self.bias) * (now - self._error_until)
        self._error_until = now
        if self._motions and self._motions[-1][0] >= now:
            self._motions.pop()
        self._motions.append((now, turn._replace(
            yaw=turn.yaw + self.error, steady_rate=turn.steady_rate + self._drift + self.bias)))

    def measure(self, stamps: Sequence[float]) -> List[ImuSample]:
        """Returns an ImuSample for each of `stamps` [s], which are in order of time. The yaw is the
        integral of the rate of a TurnCurve."""
        # local names and few calls, since this loop decides the speed of the simulation
        motions, age = self._motions, self._lag
        yaw_noise, rate_noise, dead_zone = self._yaw_noise, self._rate_noise, self._dead_zone
        remainder, exp = math.remainder, math.exp
        samples = []
        for stamp, (yaw_deviation, rate_deviation) in zip(stamps, self._noise):
            moment = stamp - age
            while len(motions) > 1 and motions[1][0] <= moment:
                motions.popleft()
            since, (yaw, rate, fading_rate, lag) = motions[0]
            dt = moment - since
            yaw += rate * dt
            if fading_rate:
                rest = fading_rate * exp(-dt / lag)
                yaw += lag * (fading_rate - rest)
                rate += rest
            yaw = remainder(yaw + yaw_noise * yaw_deviation, WHOLE_TURN)
            rate = rate + rate_noise * rate_deviation if abs(rate) > dead_zone else 0.0
            samples.append(ImuSample(stamp, yaw if yaw > -math.pi else math.pi, rate))
        return samples


def _pairs_of_normal_numbers(seed: int) -> Iterator[Tuple[float, float]]:
    """Yields pairs of independent standard normal numbers without end."""
    generator = np.random.default_rng(seed)
    while True:
        pairs: Any = generator.standard_normal((1000, 2)).tolist()
        yield from pairs


class Body:
    """The drivetrain and the IMU of one robot."""

    def __init__(self, model: RobotModel, start: Pose2, imu_offset: float, seed: int) -> None:
        self.drivetrain = Drivetrain(model, start)
        self.imu = ImuModel(start.yaw, imu_offset, seed)
        self._moved_until = 0.0    # the drivetrain has moved up to this time [s]
        # (start [s], drivetrain), for motions whose wheels are not read to their end yet
        self._unread_motions: Deque[Tuple[float, Drivetrain]] = deque()

    @property
    def yaw(self) -> float:
        """The true yaw [rad], not wrapped."""
        return self.drivetrain.turn_curve.yaw

    def move_to(self, stamp: float) -> None:
        """Advance the drivetrain, and the error of the IMU, to `stamp`."""
        dt = stamp - self._moved_until
        if dt > 0.0:
            self.drivetrain.advance(dt)
            self._moved_until = stamp
            self.imu.follow(stamp, self.drivetrain.turn_curve)

    def at(self, now: float) -> Drivetrain:
        """Returns the drivetrain at `now`, which is not before the last :meth:`move_to`."""
        later = copy.copy(self.drivetrain)
        later.advance(now - self._moved_until)
        return later

    def motion_changed(self) -> None:
        """Begin a new motion, after a change of goal speeds, physics or settings of the IMU."""
        self.imu.follow(self._moved_until, self.drivetrain.turn_curve)
        self._unread_motions.append((self._moved_until, copy.copy(self.drivetrain)))

    def use_bias(self, bias: float) -> None:
        """Let the gyro be wrong by `bias` [rad/s] from now on."""
        self.imu.bias = bias
        self.motion_changed()

    def wheel_angles_at(self, moment: float) -> Tuple[float, float]:
        """Returns the (left, right) angle of the motors [rad]. `moment` [s] never goes back."""
        motions = self._unread_motions
        while len(motions) > 1 and motions[1][0] <= moment:
            motions.popleft()
        since, drivetrain = motions[0]
        if moment > since:
            drivetrain.advance(moment - since)
            motions[0] = moment, drivetrain
        return drivetrain.angles
