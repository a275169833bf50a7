"""The embedded robot's IMU: it turns the true heading into the samples of its filter.

The yaw is the true yaw plus a constant (the IMU is zeroed only when the board boots), a drift that
grows with time, and a little white noise. The rate is the true rate plus the drift's rate and white
noise of its own.

Units: seconds, radians. Noise: a Burger at rest shows 0.0008 rad/s and a few 0.001 deg from one
sample to the next.
"""
import math
from typing import Any, Iterator, List, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.angles import TURN
from tb3_labs.robot.samples import ImuSample


class ImuModel:
    """`offset`: yaw of the IMU minus true yaw at the start [rad]."""

    def __init__(self, offset: float, seed: int) -> None:
        self._error = offset
        self._noise = _pairs_of_normal_numbers(seed)
        self._yaw_noise = self._rate_noise = self._drift = 0.0

    def configure(self, yaw_noise: float, rate_noise: float, drift: float) -> None:
        """Standard deviations [rad], [rad/s]; `drift` [rad/s]."""
        self._yaw_noise, self._rate_noise, self._drift = yaw_noise, rate_noise, drift

    def advance(self, dt: float) -> None:
        """Let `dt` seconds pass: the drift adds up."""
        self._error += self._drift * dt

    def measure(self, stamps: Sequence[float], now: float,
                motion: Tuple[float, float, float, float]) -> List[ImuSample]:
        """An ImuSample at each of `stamps` [s], none before `now` [s].

        `motion` is the Drivetrain's `turning` at `now`. The loop runs for every IMU sample and
        decides the speed of the simulation, hence local names and few calls.
        """
        yaw_now, steady_rate, fading_rate, lag = motion
        yaw_now += self._error
        steady_rate += self._drift
        yaw_noise, rate_noise = self._yaw_noise, self._rate_noise
        remainder, exp = math.remainder, math.exp
        samples = []
        for stamp, (first, second) in zip(stamps, self._noise):
            dt = stamp - now
            yaw = yaw_now + steady_rate * dt
            rate = steady_rate
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
