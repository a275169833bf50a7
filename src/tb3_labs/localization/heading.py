"""The heading of the robot by its IMU alone.

`Heading` serves a node that only turns. It knows the yaw, continuous over whole turns, and the rate
of turn, the age of both, and the noise of the yaw.

Frame: the IMU's own, with an arbitrary zero direction. Units: radians, rad/s, seconds. `now` is on
the receiver's clock; `time`, of a sample, is on the sender's clock.
"""
import math
from typing import Optional

from tb3_labs.geometry.angles import continuous
from tb3_labs.localization.sender_clock import SenderClock
from tb3_labs.robot.samples import Estimate, ImuSample, YawNoise, heading_jump

#: The yaw of a robot at rest may change by this from one sample to the next: it drifts [rad].
STEADY_DOUBT = math.radians(0.02)


class Heading:
    """Follows the samples of one IMU."""

    def __init__(self) -> None:
        #: The yaw, continuous over whole turns [rad]; None before the first sample.
        self.yaw: Optional[float] = None
        #: Rate of turn [rad/s].
        self.rate = 0.0
        self._measured_at = 0.0
        self._clock = SenderClock()
        self._noise = YawNoise()
        self._steady = Estimate()

    def jump_to(self, sample: ImuSample) -> str:
        """The fault of the IMU that `sample`, the next one, shows; '' if none."""
        return '' if self.yaw is None else heading_jump(self.yaw, sample.yaw)

    def on_imu(self, sample: ImuSample, now: float) -> None:
        """Take in a sample."""
        self.yaw = sample.yaw if self.yaw is None else continuous(sample.yaw, self.yaw)
        self.rate = sample.yaw_rate
        time = self._clock.time_of('imu', sample.stamp, now)
        measured_at = self._clock.measured_at(time, now)
        self._noise.learn(sample, time)
        if self.noise:
            turned = abs(self.rate * (measured_at - self._measured_at))
            self._steady.shift(0.0, STEADY_DOUBT + turned)
            self._steady.add(self.yaw, self.noise)
        else:    # the noise is not known yet
            self._steady = Estimate()
            self._steady.shift(self.yaw)
        self._measured_at = measured_at

    def age(self, now: float) -> float:
        """Time since the latest sample was measured [s], see SenderClock.measured_at."""
        return max(0.0, now - self._measured_at)

    @property
    def steady_yaw(self) -> float:
        """The yaw of a robot at rest, with less noise than one sample has [rad]."""
        return self._steady.value

    @property
    def noise(self) -> float:
        """Standard deviation of one sample's yaw [rad]."""
        return self._noise.deviation
