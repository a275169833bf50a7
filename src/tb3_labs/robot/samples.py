"""The samples of the robot's sensors, without ROS.

Units: seconds, metres, radians. `stamp` is on the sender's clock, which may be off by a second.
"""
import math
from typing import Any, NamedTuple, Optional, Union

from tb3_labs.geometry.angles import difference

#: A robot turns at most this far between two samples of the IMU [rad]. If the IMU is silent for
#: longer, a node that drives by the IMU stops the robot.
MAX_TURN_PER_SAMPLE = 1.0
#: The odometry's place is at most this distance [m] from zero, which is a day of driving.
MAX_ODOMETRY_DISTANCE = 2e4
#: The largest speed of the odometry [m/s]. A person who spins the wheels may reach this speed.
MAX_DRIVE_SPEED = 3.0
#: The largest rate of turn in the odometry [rad/s]. The firmware's spike is 2 pi in at least 1 ms.
MAX_SPIKE_RATE = 7e3
#: The board's gyro measures at most this rate [rad/s], which is 2000 deg/s.
MAX_GYRO_RATE = 35.0
#: The angle of a wheel is at most this [rad], since the encoder counts to 2^31.
MAX_WHEEL_ANGLE = 3.5e6
#: The latest stamp [s] that ROS can send, in the year 2106.
LAST_STAMP = 2.0 ** 32 - 2.0
#: A robot at rest has at most this forward speed [m/s] in its samples.
REST_LINEAR = 0.005
#: A robot at rest has at most this rate of turn [rad/s] in its samples.
REST_ANGULAR = 0.03


class ImuSample(NamedTuple):    # a NamedTuple is made faster than a dataclass
    """One message of the IMU. The zero of the yaw is arbitrary."""

    stamp: float
    yaw: float            # [rad], (-pi, pi]
    yaw_rate: float       # [rad/s]


class OdometrySample(NamedTuple):
    """One message of the wheels' odometry."""

    stamp: float
    pose: Any             # odom_T_base, a geometry.se2.Pose2
    linear: float         # forward speed [m/s]
    angular: float        # [rad/s]; has a spike when the heading crosses +/-180 deg


class WheelSample(NamedTuple):
    """One message of the wheels' joints."""

    stamp: float
    left: float           # angle [rad] of the left wheel, positive forwards
    right: float          # angle [rad] of the right wheel, positive forwards


class Motion(NamedTuple):
    """The robot's motion, for a control law."""

    pose: Any                   # local_T_base now, a Pose2 extrapolated from the samples
    linear: float               # [m/s], from the wheels
    angular: float              # [rad/s], from the gyro
    imu_age: float = 0.0        # time [s] since the latest sample of the IMU was measured
    odometry_age: float = 0.0   # time [s] since the latest odometry was measured
    yaw_noise: float = 0.0      # standard deviation [rad] of a sample's yaw
    extrapolated: float = 0.0   # part [rad] of the pose's yaw that was not measured


#: A sample of either sensor.
Sample = Union[ImuSample, OdometrySample]


def bounded(name: str, value: float, bound: float, unit: str) -> float:
    """Returns `value`. ``ValueError`` for a value beyond `bound`, NaN or infinity."""
    is_possible = abs(value) <= bound    # False for NaN
    if not is_possible:
        raise ValueError(
            f'{name} = {value:.6g} {unit} is more than a robot can have ({bound:g})')
    return value


def is_at_rest(linear: float, angular: float) -> bool:
    """Is a robot with these speeds [m/s, rad/s] at rest?"""
    return abs(linear) <= REST_LINEAR and abs(angular) <= REST_ANGULAR


def heading_jump(previous: Optional[ImuSample], sample: ImuSample) -> str:
    """Returns a text about a jump of the heading between two samples, or ''."""
    turned = difference(sample.yaw, previous.yaw) if previous else 0.0
    if abs(turned) <= MAX_TURN_PER_SAMPLE:
        return ''
    return f"the IMU's heading jumped by {abs(math.degrees(turned)):.0f} degrees"
