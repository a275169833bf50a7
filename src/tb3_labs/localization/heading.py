"""The heading of the robot by its IMU alone.

`Heading` serves a node that only turns. It knows the yaw, continuous over whole turns, and the rate
of turn, the age of both, and the noise of the yaw.

Frame: the IMU's own, with an arbitrary zero direction. Units: radians, rad/s, seconds. `now` is on
the receiver's clock.
"""
import math
from typing import Optional

from tb3_labs.geometry.angles import continuous
from tb3_labs.geometry.estimates import Estimate, YawNoise
from tb3_labs.localization.door import Heard
from tb3_labs.robot.samples import ImuSample, heading_jump

#: The yaw of a robot at rest may change by this from one sample to the next: it drifts [rad].
STEADY_DOUBT = math.radians(0.02)


class Heading:
    """Follows the samples of one IMU."""

    def __init__(self) -> None:
        #: The yaw, continuous over whole turns [rad]; None before the first sample.
        self.yaw: Optional[float] = None
        #: Rate of turn [rad/s].
        self.rate = 0.0
        self._heard: Optional[Heard] = None    # the latest sample
        self._noise = YawNoise()
        self._steady = Estimate()

    def jump_to(self, sample: ImuSample) -> str:
        """The fault of the IMU that `sample`, the next one, shows; '' if none."""
        return '' if self.yaw is None else heading_jump(self.yaw, sample.yaw)

    def on_imu(self, heard: Heard) -> None:
        """Take in a sample of the IMU."""
        sample, self._heard = heard.sample, heard
        self.yaw = sample.yaw if self.yaw is None else continuous(sample.yaw, self.yaw)
        self.rate = sample.yaw_rate
        self._noise.learn(sample.yaw, sample.yaw_rate, heard.step)
        if self.noise:
            self._steady.shift(0.0, STEADY_DOUBT + abs(self.rate * heard.step))
            self._steady.add(self.yaw, self.noise)
        else:    # the noise is not known yet
            self._steady = Estimate()
            self._steady.shift(self.yaw)

    def age(self, now: float) -> float:
        """Time since the latest sample was measured [s]; infinite before the first."""
        return math.inf if self._heard is None else self._heard.age(now)

    @property
    def steady_yaw(self) -> float:
        """The yaw of a robot at rest, with less noise than one sample has [rad]."""
        return self._steady.value

    @property
    def noise(self) -> float:
        """Standard deviation of one sample's yaw [rad]."""
        return self._noise.deviation
