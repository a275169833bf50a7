"""Simulates the IMU, which measures yaw and rate of turn with noise, drift and bias.

The yaw of the IMU is the true yaw plus a constant, a drift that grows with time, and white noise.
The rate of turn of the IMU is the true rate plus the rate of the drift, the bias of the last
calibration, and another white noise. In its dead zone, the gyro sends 0. The IMU measures the yaw
and the rate of turn of a sample `sample_age` [s] before the stamp of the sample.

Units: SI. The noise was measured on a real Burger at rest, whose yaw changes by a few thousandths
of a degree from one sample to the next.
"""
import math
from collections import deque
from typing import Deque, Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.angles import WHOLE_TURN
from tb3_labs.robot.samples import ImuSample

UNCALIBRATED_BIAS = math.radians(0.71)    # [rad/s], measured on one robot
#: The resolution of the gyro [rad/s]. 16 bits cover the range of +/-2000 deg/s.
GYRO_STEP = math.radians(2000.0 / 2 ** 15)
GYRO_DEAD_ZONE = 3.0 * GYRO_STEP    # the firmware sends 0 if the rate [rad/s] is not larger


class TurnCurve(NamedTuple):
    """The yaw at the start of a motion, and the rate of turn after the start. After t seconds the
    rate of turn is `steady_turn_rate` + `fading_turn_rate` exp(-t / `lag`) [rad/s]."""

    yaw: float                 # [rad], not wrapped
    steady_turn_rate: float    # [rad/s]
    fading_turn_rate: float    # [rad/s]
    lag: float                 # [s]


class ImuModel:
    """The IMU with its noise, drift and bias."""

    def __init__(self, yaw: float, offset: float, seed: int) -> None:
        """At the start the true yaw is `yaw` [rad], and the yaw of the IMU is `yaw` + `offset`."""
        self.yaw_error = offset    # yaw [rad] of the IMU minus true yaw, before the noise
        self._noise = _pairs_of_normal_numbers(seed)
        self.bias = 0.0    # bias [rad/s] of the gyro after the last calibration
        self.configure(yaw_noise=0.0, turn_rate_noise=0.0, drift=0.0, sample_age=0.0)
        self._error_until = 0.0    # until this time [s], `yaw_error` includes drift and bias
        #: (start [s], curve of the IMU) of each motion that measure() still needs, oldest first.
        self._motions: Deque[Tuple[float, TurnCurve]] = deque()
        self.add_motion(0.0, TurnCurve(yaw, 0.0, 0.0, 0.0))

    def configure(self, yaw_noise: float, turn_rate_noise: float, drift: float,
                  sample_age: float) -> None:
        """Set the standard deviations `yaw_noise` [rad] and `turn_rate_noise` [rad/s], the `drift`
        [rad/s] and the `sample_age` [s]. Call :meth:`add_motion` afterwards. A gyro that drifts,
        or that is noisier than the firmware's gyro, has no dead zone."""
        self._yaw_noise = yaw_noise
        self._turn_rate_noise = turn_rate_noise
        self._drift = drift
        self._sample_age = sample_age
        has_dead_zone = not drift and turn_rate_noise <= GYRO_STEP
        self._dead_zone = GYRO_DEAD_ZONE if has_dead_zone else -math.inf

    def add_motion(self, now: float, curve: TurnCurve) -> None:
        """End the last motion at `now` [s], and add a new motion with the turn `curve`."""
        self.yaw_error += (self._drift + self.bias) * (now - self._error_until)
        self._error_until = now
        if self._motions and self._motions[-1][0] >= now:
            self._motions.pop()
        imu_curve = curve._replace(
            yaw=curve.yaw + self.yaw_error,
            steady_turn_rate=curve.steady_turn_rate + self._drift + self.bias)
        self._motions.append((now, imu_curve))

    def measure(self, stamps: Sequence[float]) -> List[ImuSample]:
        """Returns an ImuSample for each of `stamps` [s], which are in order of time. The yaw is the
        integral of the rate of turn."""
        # The simulation spends most of its time in this loop, so it uses local names and few calls.
        motions, sample_age, dead_zone = self._motions, self._sample_age, self._dead_zone
        yaw_noise, rate_noise = self._yaw_noise, self._turn_rate_noise
        remainder, exp = math.remainder, math.exp
        samples = []
        for stamp, (yaw_deviation, rate_deviation) in zip(stamps, self._noise):
            moment = stamp - sample_age    # of the measurement
            while len(motions) > 1 and motions[1][0] <= moment:
                motions.popleft()
            begin, (yaw, rate, fading_rate, lag) = motions[0]
            dt = moment - begin
            yaw += rate * dt
            if fading_rate:
                faded_rate = fading_rate * exp(-dt / lag)
                yaw += lag * (fading_rate - faded_rate)
                rate += faded_rate
            yaw = remainder(yaw + yaw_noise * yaw_deviation, WHOLE_TURN)
            if yaw == -math.pi:
                yaw = math.pi
            if abs(rate) > dead_zone:
                rate += rate_noise * rate_deviation
            else:
                rate = 0.0
            samples.append(ImuSample(stamp, yaw, rate))
        return samples


def _pairs_of_normal_numbers(seed: int) -> Iterator[Tuple[float, float]]:
    generator = np.random.default_rng(seed)
    while True:
        yield from generator.standard_normal((1000, 2)).tolist()
