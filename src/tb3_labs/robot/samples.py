"""The samples of the robot's sensors, without ROS.

Units: seconds, metres, radians. `stamp` is the sender's clock, which may be off by a second.
"""
import math
from typing import Any, NamedTuple, Optional, Union

from tb3_labs.geometry.angles import difference

#: A robot does not turn farther than this between two samples of its IMU [rad]: a node that drives
#: by the IMU stops the robot when the IMU is silent.
FARTHEST_TURN = 1.0
#: The odometry shows no place farther away than this: a day of driving [m].
FARTHEST_PLACE = 2e4
#: The odometry shows no faster speed, even if a person spins the wheels by hand [m/s].
FASTEST_DRIVE = 3.0
#: Largest rate of turn of the odometry [rad/s]: the firmware's spike is two pi in one period, and a
#: period is at least 1 ms.
FASTEST_SPIKE = 7e3
#: The gyro of the board cannot measure a faster turn: 2000 deg/s [rad/s].
FASTEST_GYRO = 35.0
#: A wheel has turned no farther than this [rad]: its encoder counts 2^31 steps.
FARTHEST_WHEEL = 3.5e6
#: ROS cannot send a later stamp [s]; this one is in the year 2106.
LAST_STAMP = 2.0 ** 32 - 2.0
#: A robot at rest has at most this forward speed in its samples [m/s].
REST_LINEAR = 0.005
#: A robot at rest has at most this rate of turn in its samples [rad/s].
REST_ANGULAR = 0.03


class ImuSample(NamedTuple):    # a NamedTuple is made faster than a dataclass
    """One message of the IMU: heading in a frame of its own and the gyro's rate."""

    stamp: float
    yaw: float            # [rad], (-pi, pi]
    yaw_rate: float       # [rad/s]


class OdometrySample(NamedTuple):
    """One message of the wheels' odometry: pose and speed in the `odom` frame."""

    stamp: float
    pose: Any             # odom_T_base, a geometry.se2.Pose2; a node of the IMU alone has none
    linear: float         # forward speed [m/s]
    angular: float        # [rad/s]; a spike of 2 pi times the rate at each +/-180 deg crossing


class WheelSample(NamedTuple):
    """One message of the wheels' joints: how far each wheel has turned, positive forwards."""

    stamp: float
    left: float           # [rad]
    right: float          # [rad]


class Motion(NamedTuple):
    """The robot's motion, for a control law. An age is the time since the measurement."""

    pose: Any                   # local_T_base, now, a Pose2 extrapolated from the samples
    linear: float               # [m/s], from the wheels
    angular: float              # [rad/s], from the gyro
    imu_age: float = 0.0        # [s]
    odometry_age: float = 0.0   # [s]
    yaw_noise: float = 0.0      # standard deviation of a sample's yaw [rad]
    extrapolated: float = 0.0   # part of the pose's yaw that was not measured [rad]


#: A sample of either sensor.
Sample = Union[ImuSample, OdometrySample]


def bounded(name: str, value: float, bound: float, unit: str) -> float:
    """Returns `value`; ``ValueError`` if it is beyond `bound`, or not finite."""
    if not abs(value) <= bound:    # "not <=" also catches NaN
        raise ValueError(
            f'{name} = {value:.6g} {unit} is more than a robot can have ({bound:g})')
    return value


def is_slow(linear: float, angular: float) -> bool:
    """Is a robot with these speeds [m/s, rad/s] at rest?"""
    return abs(linear) <= REST_LINEAR and abs(angular) <= REST_ANGULAR


def heading_jump(before: Optional[ImuSample], after: ImuSample) -> str:
    """Returns the jump of the heading between two samples in words; '' if it did not jump."""
    turned = difference(after.yaw, before.yaw) if before else 0.0
    if abs(turned) <= FARTHEST_TURN:
        return ''
    return f"the IMU's heading jumped by {abs(math.degrees(turned)):.0f} degrees"
