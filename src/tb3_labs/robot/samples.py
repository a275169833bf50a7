"""The samples of the robot's sensors, without ROS, and the noise of the IMU's yaw.

Units: seconds, metres, radians. `stamp` is the sender's clock, which may be off by a second.
"""
import math
from dataclasses import dataclass
from typing import NamedTuple, Optional, Tuple, Union

from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2

#: A robot does not turn farther than this between two samples of its IMU [rad]. In a silence of the
#: IMU, a node that drives by the IMU stops the robot.
FARTHEST_TURN = 1.0
#: The odometry of such a robot reaches no farther than this: a day of driving [m].
FARTHEST_PLACE = 2e4
#: No wheel turns this robot's odometry faster, not even one that is spun by hand [m/s].
FASTEST_DRIVE = 3.0
#: Largest rate of turn of the odometry [rad/s]: the firmware's spike, two pi for each period of at
#: least 1 ms.
FASTEST_SPIKE = 7e3
#: The gyro of the board measures no faster turn: 2000 deg/s [rad/s].
FASTEST_GYRO = 35.0
#: A wheel has turned no farther than this [rad]: its encoder counts 2^31 steps.
FARTHEST_WHEEL = 3.5e6
#: ROS cannot send a later stamp [s]: that of the year 2106.
LAST_STAMP = 2.0 ** 32 - 2.0
#: A robot at rest has at most this forward speed in its samples [m/s].
REST_LINEAR = 0.005
#: A robot at rest has at most this rate of turn in its samples [rad/s].
REST_ANGULAR = 0.03
#: A robot turns slowly if its rate is below this [rad/s].
SLOW_TURN = 0.2
#: A robot turns evenly if its rate changes by less than this between two samples [rad/s].
EVEN = 0.03
#: Samples farther apart than this are not compared [s].
FARTHEST_SAMPLES = 0.1
#: Weight of each new sample in the variance, after the first ones.
SHARE = 0.02
#: In 95 of 100 cases the true value is within two standard deviations of the estimate.
STANDARD_ERRORS = 2.0
#: A sample that is this many standard deviations away contradicts the estimate.
CONTRADICTION = 4.0


class ImuSample(NamedTuple):    # faster than a dataclass: hundreds are made in a second
    """One message of the IMU: heading in a frame of its own and the gyro's rate."""

    stamp: float
    yaw: float            # [rad], (-pi, pi]
    yaw_rate: float       # [rad/s]


@dataclass(frozen=True)
class OdometrySample:
    """One message of the wheels' odometry: pose and speed in the `odom` frame."""

    stamp: float
    pose: Pose2           # odom_T_base
    linear: float         # forward speed [m/s]
    angular: float        # [rad/s]; a spike of 2 pi times the rate at each +/-180 deg crossing


class WheelSample(NamedTuple):
    """One message of the wheels' joints: how far each wheel has turned, positive forwards."""

    stamp: float
    left: float           # [rad]
    right: float          # [rad]


@dataclass(frozen=True)
class Motion:
    """The robot's motion as a law needs it; ages count from the measurement, see SenderClock."""

    pose: Pose2                 # local_T_base, now, extrapolated from the samples
    linear: float               # [m/s], from the wheels
    angular: float              # [rad/s], from the gyro
    imu_age: float = 0.0        # [s]
    odometry_age: float = 0.0   # [s]
    yaw_noise: float = 0.0      # standard deviation of a sample's yaw [rad]
    extrapolated: float = 0.0   # part of the pose's yaw that was not measured [rad]


#: A sample of either sensor.
Sample = Union[ImuSample, OdometrySample]


def bounded(name: str, value: float, bound: float, unit: str) -> float:
    """`value`, which no robot exceeds; ``ValueError`` if it does, or is not finite."""
    if not abs(value) <= bound:    # "not <=" also catches NaN
        raise ValueError('{} = {:.6g} {} is more than a robot can have ({:g})'.format(
            name, value, unit, bound))
    return value


def is_slow(linear: float, angular: float) -> bool:
    """Are these speeds [m/s, rad/s] those of a robot at rest?"""
    return abs(linear) <= REST_LINEAR and abs(angular) <= REST_ANGULAR


def heading_jump(before: float, after: float) -> str:
    """The fault that the yaws of two successive samples of the IMU show [rad]; '' if none."""
    turned = difference(after, before)
    if abs(turned) <= FARTHEST_TURN:
        return ''
    return "the IMU's heading jumped by {:.0f} degrees".format(abs(math.degrees(turned)))


class YawNoise:
    """Learns the noise of one IMU.

    The yaw of a sample is predicted from the sample before and the gyro's rate. While the robot
    turns slowly and evenly, the measured yaw differs from this prediction by noise alone.
    """

    def __init__(self) -> None:
        #: Standard deviation of one sample's yaw [rad].
        self.deviation = 0.0
        self._count = 0
        self._before: Optional[Tuple[ImuSample, float]] = None    # the last sample, and its time

    def learn(self, sample: ImuSample, time: float) -> None:
        """Take in an ImuSample that was measured at `time`."""
        before, self._before = self._before, (sample, time)
        if before is None or not 0.0 < time - before[1] < FARTHEST_SAMPLES:
            return
        first, begin = before
        if abs(sample.yaw_rate) > SLOW_TURN or abs(sample.yaw_rate - first.yaw_rate) > EVEN:
            return
        turned = 0.5 * (first.yaw_rate + sample.yaw_rate) * (time - begin)
        # the difference of two samples has twice the variance of one
        square = 0.5 * (difference(sample.yaw, first.yaw) - turned) ** 2
        self._count += 1
        variance = self.deviation ** 2
        self.deviation = math.sqrt(
            variance + max(SHARE, 1.0 / self._count) * (square - variance))


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
