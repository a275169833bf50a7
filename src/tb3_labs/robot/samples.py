"""The samples of the robot's sensors, without ROS.

Units: seconds, metres, radians. A `stamp` is on the sender's clock, which may be wrong by a second.
"""
import math
from typing import Any, NamedTuple, Optional, Union

from tb3_labs.geometry.angles import difference

#: The robot turns by at most this [rad] between two samples of the IMU. It could turn farther in a
#: long gap between two samples, but a node stops the robot before.
MAX_TURN_PER_SAMPLE = 1.0
MAX_ODOMETRY_DISTANCE = 2e4     # [m]; the odometry counts at most this in a drive of one day
MAX_ODOMETRY_SPEED = 3.0        # [m/s]; if a person spins the wheels, they are not faster
MAX_ODOMETRY_TURN_RATE = 7e3    # [rad/s]; a spike is a wrong turn by 2 pi in at least 1 ms
MAX_GYRO_RATE = 35.0            # [rad/s]; the board's gyro measures up to 2000 deg/s
MAX_WHEEL_ANGLE = 3.5e6         # [rad]; the encoder counts to 2^31
MAX_STAMP = 2.0 ** 32 - 2.0     # [s]; the latest stamp that ROS can send, in the year 2106
#: The samples of a robot at rest have at most this speed [m/s], and this rate of turn [rad/s].
MAX_REST_SPEED = 0.005
MAX_REST_TURN_RATE = 0.03


class ImuSample(NamedTuple):    # a NamedTuple is faster than a dataclass
    """One message of the IMU. The zero of the yaw is arbitrary."""

    stamp: float
    yaw: float            # [rad], in (-pi, pi]
    yaw_rate: float       # [rad/s]


class OdometrySample(NamedTuple):
    """One message of the odometry. The wheels and the IMU's yaw give the pose."""

    stamp: float
    pose: Any             # odom_T_base, a geometry.se2.Pose2
    linear: float         # forward speed [m/s]
    angular: float        # rate of turn [rad/s]; it is wrong when the heading crosses +/-180 deg


class WheelSample(NamedTuple):
    stamp: float
    left: float           # angle [rad] of the left wheel, positive forwards
    right: float          # angle [rad] of the right wheel, positive forwards


class Motion(NamedTuple):
    """The robot's motion, for a control law."""

    pose: Any                         # local_T_base, a Pose2 that is extrapolated to now
    linear: float                     # speed [m/s] that the wheels show
    angular: float                    # rate of turn [rad/s] that the gyro shows
    imu_age: float = 0.0              # time [s] since the latest sample of the IMU was measured
    odometry_age: float = 0.0         # time [s] since the latest odometry was measured
    yaw_noise: float = 0.0            # standard deviation [rad] of a sample's yaw
    extrapolated_turn: float = 0.0    # part [rad] of the pose's yaw that is extrapolated


Sample = Union[ImuSample, OdometrySample]


def checked_number(name: str, value: float, bound: float, unit: str) -> float:
    """Returns `value`. Raises ``ValueError`` if `value` is beyond `bound`, NaN or infinite."""
    is_possible = abs(value) <= bound    # False for NaN
    if not is_possible:
        raise ValueError(
            f'{name} = {value:.6g} {unit} is more than a robot can have ({bound:g})')
    return value


def is_at_rest(linear: float, angular: float) -> bool:
    """Returns True if a robot with these speeds [m/s, rad/s] is at rest."""
    return abs(linear) <= MAX_REST_SPEED and abs(angular) <= MAX_REST_TURN_RATE


def heading_jump_text(previous: Optional[ImuSample], sample: ImuSample) -> str:
    """Returns a text about a jump of the heading between two samples, or ''."""
    turn = difference(sample.yaw, previous.yaw) if previous else 0.0
    if abs(turn) <= MAX_TURN_PER_SAMPLE:
        return ''
    return f"the IMU's heading jumped by {abs(math.degrees(turn)):.0f} degrees"
