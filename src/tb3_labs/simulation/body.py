"""The robot's body: wheels that move it, and an IMU that measures its turning.

The yaw is the true yaw plus a constant (the IMU is zeroed only when the board boots), a drift that
grows with time, and a little white noise. The rate is the true rate plus the drift's rate and white
noise of its own. Both are as old as the filter and the way to the stamp make them: `lag`.

The gyro shows the rate minus its calibration. A calibration that saw a motion takes it for bias,
and leaves that bias behind, with the other sign. The firmware's gyro has a dead zone.

Units: seconds, radians. Noise: a Burger at rest shows a few 0.001 deg from one sample to the next.
"""
import copy
import math
from collections import deque
from typing import Any, Deque, Iterator, List, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.angles import TURN
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import ImuSample
from tb3_labs.robot.turtlebot3 import RobotModel
from tb3_labs.simulation.drivetrain import Drivetrain

#: Bias of a gyro that is not calibrated, as of the one that was measured [rad/s].
RAW_BIAS = math.radians(0.71)
#: One step of the gyro's reading: 2000 deg/s over 16 bit with a sign [rad/s].
GYRO_STEP = math.radians(2000.0 / 2 ** 15)
#: The firmware shows a rate of at most this as 0 [rad/s].
DEAD_ZONE = 3.0 * GYRO_STEP


class ImuModel:
    """`offset`: yaw of the IMU minus true yaw at the start, where the robot is at `yaw` [rad]."""

    def __init__(self, yaw: float, offset: float, seed: int) -> None:
        #: Yaw of the IMU minus true yaw [rad].
        self.error = offset
        self._noise = _pairs_of_normal_numbers(seed)
        #: Rate that the calibration left behind [rad/s].
        self.bias = 0.0
        self.configure(0.0, 0.0, 0.0, 0.0)
        self._now = 0.0         # up to then drift and bias are in the error
        #: (since, yaw of the IMU, and `turning` but for its yaw): motions not yet measured to their
        #: end, oldest first.
        self._motions: Deque[Tuple[float, float, float, float, float]] = deque()
        self.follow(0.0, (yaw, 0.0, 0.0, 0.0))

    def configure(self, yaw_noise: float, rate_noise: float, drift: float, lag: float) -> None:
        """Standard deviations [rad], [rad/s]; `drift` [rad/s]; `lag` [s]. Then call `follow`.

        A gyro that drifts, or is noisier than the firmware's, has no dead zone.
        """
        self._yaw_noise, self._rate_noise = yaw_noise, rate_noise
        self._drift, self._lag = drift, lag
        self._dead_zone = -math.inf if drift or rate_noise > GYRO_STEP else DEAD_ZONE

    def follow(self, now: float, motion: Tuple[float, float, float, float]) -> None:
        """From `now` on the robot turns like that: the Drivetrain's `turning` [s]."""
        self.error += (self._drift + self.bias) * (now - self._now)
        self._now = now
        yaw, steady_rate, fading_rate, lag = motion
        if self._motions and self._motions[-1][0] >= now:
            self._motions.pop()
        self._motions.append((now, yaw + self.error, steady_rate + self._drift + self.bias,
                              fading_rate, lag))

    def measure(self, stamps: Sequence[float]) -> List[ImuSample]:
        """An ImuSample at each of `stamps` [s], in order of time.

        The loop runs for every IMU sample and decides the speed of the simulation, hence local
        names and few calls.
        """
        motions, age = self._motions, self._lag
        yaw_noise, rate_noise, dead_zone = self._yaw_noise, self._rate_noise, self._dead_zone
        remainder, exp = math.remainder, math.exp
        samples = []
        for stamp, (first, second) in zip(stamps, self._noise):
            seen = stamp - age
            while len(motions) > 1 and motions[1][0] <= seen:
                motions.popleft()
            since, yaw, rate, fading_rate, lag = motions[0]
            dt = seen - since
            yaw += rate * dt
            if fading_rate:
                fading = fading_rate * exp(-dt / lag)
                yaw += lag * (fading_rate - fading)
                rate += fading
            yaw = remainder(yaw + yaw_noise * first, TURN)
            rate = rate + rate_noise * second if abs(rate) > dead_zone else 0.0
            samples.append(ImuSample(stamp, yaw if yaw > -math.pi else math.pi, rate))
        return samples


def _pairs_of_normal_numbers(seed: int) -> Iterator[Tuple[float, float]]:
    """An endless sequence of pairs of independent standard normal numbers."""
    generator = np.random.default_rng(seed)
    while True:
        pairs: Any = generator.standard_normal((1000, 2)).tolist()
        yield from pairs


class Body:
    """Drivetrain and IMU, which pass through time together."""

    def __init__(self, model: RobotModel, start: Pose2, imu_offset: float, seed: int) -> None:
        """`imu_offset`: yaw of the IMU minus true yaw at the start [rad]."""
        self.drivetrain = Drivetrain(model, start)
        self.imu = ImuModel(start.yaw, imu_offset, seed)
        self._moved = 0.0           # time up to which the drivetrain has moved
        # (since, drivetrain): motions whose wheels are not yet read to their end, oldest first
        self._past: Deque[Tuple[float, Drivetrain]] = deque()

    @property
    def yaw(self) -> float:
        """The true yaw [rad], not wrapped."""
        return self.drivetrain.turning[0]

    def move_to(self, stamp: float) -> None:
        """Advance the drivetrain, and the error of the IMU, to `stamp`."""
        dt = stamp - self._moved
        if dt > 0.0:
            self.drivetrain.advance(dt)
            self._moved = stamp
            self.imu.follow(stamp, self.drivetrain.turning)

    def at(self, now: float) -> Drivetrain:
        """The drivetrain at `now`, which is not before the last :meth:`move_to`."""
        return self.drivetrain.ahead(now - self._moved)

    def motion_changed(self) -> None:
        """Goals or physics of the drivetrain are others now, or the IMU's settings."""
        self.imu.follow(self._moved, self.drivetrain.turning)
        self._past.append((self._moved, copy.copy(self.drivetrain)))

    def use_bias(self, bias: float) -> None:
        """The gyro's error from now on [rad/s]."""
        self.imu.bias = bias
        self.motion_changed()

    def wheel_angles_at(self, moment: float) -> Tuple[float, float]:
        """(left, right) angle of the motors at `moment` [s], in order of time [rad]."""
        past = self._past
        while len(past) > 1 and past[1][0] <= moment:
            past.popleft()
        since, drivetrain = past[0]
        if moment > since:
            drivetrain.advance(moment - since)
            past[0] = moment, drivetrain
        return drivetrain.angles
