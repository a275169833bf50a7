"""The embedded robot's IMU: it turns the true heading into the samples of its filter.

The yaw is the true yaw plus a constant (the IMU is zeroed only when the board boots), a drift that
grows with time, and a little white noise. The rate is the true rate plus the drift's rate and white
noise of its own. Both are as old as the filter and the way to the stamp make them: `lag`.

The gyro shows the rate minus its calibration. A calibration that saw a motion takes it for bias,
and leaves that bias behind, with the other sign.

Units: seconds, radians. Noise: a Burger at rest shows 0.0008 rad/s and a few 0.001 deg from one
sample to the next.
"""
import math
from collections import deque
from typing import Any, Deque, Iterator, List, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.angles import TURN
from tb3_labs.robot.samples import ImuSample

#: Bias of a gyro that is not calibrated, as of the one that was measured [rad/s].
RAW_BIAS = math.radians(0.71)


class ImuModel:
    """`offset`: yaw of the IMU minus true yaw at the start, where the robot is at `yaw` [rad]."""

    def __init__(self, yaw: float, offset: float, seed: int) -> None:
        #: Yaw of the IMU minus true yaw [rad].
        self.error = offset
        self._noise = _pairs_of_normal_numbers(seed)
        self._yaw_noise = self._rate_noise = self._drift = self._lag = 0.0
        #: Rate that the calibration left behind [rad/s].
        self.bias = 0.0
        #: (since, yaw of the IMU, and `turning` but for its yaw): motions not yet measured to their
        #: end, oldest first.
        self._motions: Deque[Tuple[float, float, float, float, float]] = deque()
        self.follow(0.0, (yaw, 0.0, 0.0, 0.0))

    def configure(self, yaw_noise: float, rate_noise: float, drift: float, lag: float) -> None:
        """Standard deviations [rad], [rad/s]; `drift` [rad/s]; `lag` [s]. Then call `follow`."""
        self._yaw_noise, self._rate_noise = yaw_noise, rate_noise
        self._drift, self._lag = drift, lag

    def advance(self, dt: float) -> None:
        """Let `dt` seconds pass: drift and bias add up."""
        self.error += (self._drift + self.bias) * dt

    def follow(self, now: float, motion: Tuple[float, float, float, float]) -> None:
        """From `now` on the robot turns like that: the Drivetrain's `turning` [s]."""
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
        yaw_noise, rate_noise = self._yaw_noise, self._rate_noise
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
            samples.append(ImuSample(stamp, yaw if yaw > -math.pi else math.pi,
                                     rate + rate_noise * second))
        return samples


def _pairs_of_normal_numbers(seed: int) -> Iterator[Tuple[float, float]]:
    """An endless sequence of pairs of independent standard normal numbers."""
    generator = np.random.default_rng(seed)
    while True:
        pairs: Any = generator.standard_normal((1000, 2)).tolist()
        yield from pairs
