"""Numbers that noisy samples show: their estimate, and the noise itself."""
import math
from typing import Optional, Tuple

from tb3_labs.geometry.angles import difference

#: In 95 of 100 cases the true value is within two standard deviations of the estimate.
STANDARD_ERRORS = 2.0
#: A sample that is this many standard deviations away contradicts the estimate.
CONTRADICTION = 4.0
#: Weight of each new sample in the variance, after the first ones.
SHARE = 0.02
#: An IMU whose samples are farther apart than this does not show its noise [s].
FARTHEST_SAMPLES = 0.1
#: A robot turns slowly if its rate is below this [rad/s].
SLOW_TURN = 0.2
#: A robot turns evenly if its rate changes by less than this between two samples [rad/s].
EVEN = 0.03


class Estimate:
    """An estimate of a number by samples: their mean, unless the number changes. Then later samples
    count more."""

    def __init__(self) -> None:
        #: The estimate; 0 before the first sample.
        self.value = 0.0
        self._variance = math.inf

    @property
    def uncertainty(self) -> float:
        """The likely bound of the estimate's error; see STANDARD_ERRORS."""
        return STANDARD_ERRORS * math.sqrt(self._variance)

    def shift(self, by: float, doubt: float = 0.0) -> None:
        """The number has changed by `by`; `doubt` is the standard deviation of `by`."""
        self.value += by
        self._variance += doubt * doubt    # for a large doubt ** would raise, * gives infinity

    def add(self, sample: float, noise: float) -> None:
        """Take in a sample with the standard deviation `noise`.

        A sample that contradicts the estimate, or has no noise, replaces the estimate.
        """
        spread = noise * noise
        surprise = abs(sample - self.value)
        known = spread > 0.0 and surprise <= CONTRADICTION * math.sqrt(self._variance + spread)
        share = 1.0
        if known and math.isfinite(self._variance):
            share = self._variance / (self._variance + spread)
        self.value += share * (sample - self.value)
        self._variance = share * spread


class YawNoise:
    """Learns the noise of one IMU.

    The yaw of a sample is predicted from the sample before and the gyro's rate. While the robot
    turns slowly and evenly, the measured yaw differs from this prediction by noise alone.
    """

    def __init__(self) -> None:
        #: Standard deviation of one sample's yaw [rad].
        self.deviation = 0.0
        self._count = 0
        self._before: Optional[Tuple[float, float]] = None    # yaw and rate of the last sample

    def learn(self, yaw: float, rate: float, step: float) -> None:
        """Take in a sample [rad, rad/s], `step` after the last one [s]."""
        before, self._before = self._before, (yaw, rate)
        if before is None or not 0.0 < step < FARTHEST_SAMPLES:
            return
        if abs(rate) > SLOW_TURN or abs(rate - before[1]) > EVEN:
            return
        turned = 0.5 * (before[1] + rate) * step
        # the difference of two samples has twice the variance of one
        square = 0.5 * (difference(yaw, before[0]) - turned) ** 2
        self._count += 1
        variance = self.deviation ** 2
        self.deviation = math.sqrt(
            variance + max(SHARE, 1.0 / self._count) * (square - variance))
