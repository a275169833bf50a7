"""Where does the robot face, by its IMU alone?

For a node that only turns: the yaw, continuous over whole turns, the rate of turn, their age and
their noise.

Frame: the IMU's own; its zero direction is any constant. Units: radians, rad/s, seconds on the
receiver's clock (`now`).
"""
import math
from typing import Optional

from tb3_labs.geometry.angles import continuous
from tb3_labs.geometry.estimate import Estimate
from tb3_labs.localization.sender_clock import SenderClock
from tb3_labs.localization.yaw_noise import YawNoise
from tb3_labs.robot.samples import ImuSample, heading_jump

#: The yaw of a robot at rest may change by this from one sample to the next: it drifts [rad].
STEADY_DOUBT = math.radians(0.02)


class Heading:
    """Follows the samples of one IMU."""

    def __init__(self) -> None:
        #: Continuous over whole turns [rad]; None before the first sample.
        self.yaw: Optional[float] = None
        #: Rate of turn [rad/s].
        self.rate = 0.0
        self._measured_at = 0.0
        self._clock = SenderClock()
        self._noise = YawNoise()
        self._steady = Estimate()

    def jump_to(self, sample: ImuSample) -> str:
        """'' or the fault of the IMU that `sample` shows, if it comes next."""
        return '' if self.yaw is None else heading_jump(self.yaw, sample.yaw)

    def on_imu(self, sample: ImuSample, now: float) -> None:
        """Take in a sample."""
        self.yaw = sample.yaw if self.yaw is None else continuous(sample.yaw, self.yaw)
        self.rate = sample.yaw_rate
        time = self._clock.time_of('imu', sample.stamp, now)
        measured_at = self._clock.measured_at(time, now)
        self._noise.learn(sample, time)
        self._look_steadily(measured_at - self._measured_at)
        self._measured_at = measured_at

    def _look_steadily(self, dt: float) -> None:
        """Take the latest sample, `dt` [s] after the one before, into the yaw at rest."""
        assert self.yaw is not None
        if self.noise:
            self._steady.shift(0.0, STEADY_DOUBT + abs(self.rate * dt))
            self._steady.add(self.yaw, self.noise)
        else:    # it is not known yet
            self._steady = Estimate()
            self._steady.shift(self.yaw)

    def age(self, now: float) -> float:
        """Time since the latest sample was measured, by the least delay [s]."""
        return max(0.0, now - self._measured_at)

    @property
    def steady_yaw(self) -> float:
        """The yaw of a robot at rest, with less noise than one sample has [rad]."""
        return self._steady.value

    @property
    def noise(self) -> float:
        """Standard deviation of one sample's yaw [rad]."""
        return self._noise.deviation
