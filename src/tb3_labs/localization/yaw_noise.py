"""How noisy is the IMU's heading?

Each sample is compared with a prediction from the sample before and the gyro's rate. This is done
only while the robot turns slowly and evenly, since the difference is then only noise.

Units: radians, rad/s, seconds on the sender's clock.
"""
import math
from typing import Optional, Tuple

from tb3_labs.geometry.angles import difference
from tb3_labs.robot.samples import ImuSample

#: A robot turns slowly and evenly if its rate, and the change of its rate, are below these [rad/s].
SLOW = 0.2
EVEN = 0.03
#: Samples farther apart than this are not compared [s].
FARTHEST = 0.1
#: Weight of each new sample in the variance, after the first ones.
SHARE = 0.02


class YawNoise:
    """Learns from the samples of one IMU."""

    def __init__(self) -> None:
        #: Standard deviation of one sample's yaw [rad].
        self.deviation = 0.0
        self._count = 0
        self._before: Optional[Tuple[ImuSample, float]] = None    # the last, and its time

    def learn(self, sample: ImuSample, time: float) -> None:
        """Take in an ImuSample that was measured at `time`."""
        before, self._before = self._before, (sample, time)
        if before is None or not 0.0 < time - before[1] < FARTHEST:
            return
        first, begin = before
        if abs(sample.yaw_rate) > SLOW or abs(sample.yaw_rate - first.yaw_rate) > EVEN:
            return
        turned = 0.5 * (first.yaw_rate + sample.yaw_rate) * (time - begin)
        # the difference of two samples has twice the variance of one
        square = 0.5 * (difference(sample.yaw, first.yaw) - turned) ** 2
        self._count += 1
        variance = self.deviation ** 2
        self.deviation = math.sqrt(
            variance + max(SHARE, 1.0 / self._count) * (square - variance))
