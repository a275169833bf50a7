"""The recorded data of one run, as arrays: no ROS, no analysis.

Each sample has two times, both in seconds since the recording's start. `arrival` is its arrival at
the recorder. `time` is its stamp, converted from the sender's clock (on a real robot up to a second
off) to the recorder's: as even as the stamps, and comparable between topics as the arrivals are.
Messages without a stamp have their arrival in both.

Units: metres, radians, m/s, rad/s. Yaws are in [-pi, pi] as the sender sent them.
Edge cases: a topic that was not recorded has samples of length 0; an invalid quaternion (see
:mod:`tb3_labs.geometry.quaternions`) or a number that is not finite is no sample, only counted.
"""
from dataclasses import dataclass, field, fields
from typing import Any, Dict, Optional, Tuple, Type, TypeVar

import numpy as np

from tb3_labs.geometry.angles import wrap_all
from tb3_labs.geometry.se2 import Pose2, interpolate

#: Two senders whose clocks differ by less than this share one [s].
SAME_CLOCK = 0.1
#: A message that comes this much later than others is late [s]; no recorder is busy for longer than
#: the second of these [s].
LATE, TOO_LATE = 0.5, 10.0
#: A sender's clock can be used if at least this fraction of its messages is in time.
IN_TIME = 0.25
#: If more than this fraction of the messages is not in time, all up to one or all from one on, the
#: clock was set.
OTHER_CLOCK = 0.1

#: One kind of Samples.
Kind = TypeVar('Kind', bound='Samples')


@dataclass(frozen=True)
class Samples:
    """Arrays of equal length; subclasses add those of the messages' contents."""

    arrival: np.ndarray
    time: np.ndarray

    def __len__(self) -> int:
        return len(self.time)

    def take(self: Kind, index: Any) -> Kind:
        """The samples at a numpy index (mask, slice, integers)."""
        return type(self)(*(getattr(self, part.name)[index] for part in fields(self)))

    @classmethod
    def none(cls: Type[Kind]) -> Kind:
        """No samples."""
        return cls(*(np.empty(0) for _ in fields(cls)))


@dataclass(frozen=True)
class ImuSamples(Samples):
    """IMU: heading and rate of turn."""

    yaw: np.ndarray
    yaw_rate: np.ndarray


@dataclass(frozen=True)
class Poses(Samples):
    """Poses in the plane, each topic in a frame of its own."""

    x: np.ndarray
    y: np.ndarray
    yaw: np.ndarray

    @property
    def points(self) -> np.ndarray:
        """Places, shape (n, 2) [m]."""
        return np.column_stack([self.x, self.y])

    def pose(self, index: int) -> Pose2:
        """The pose at `index`."""
        return Pose2(float(self.x[index]), float(self.y[index]), float(self.yaw[index]))

    def at(self, time: float) -> Pose2:
        """The pose at `time` [s], interpolated; outside of the samples the first or last one."""
        after = int(np.searchsorted(self.time, time))
        if after in (0, len(self)):
            return self.pose(min(after, len(self) - 1))
        begin, end = self.time[after - 1:after + 1]
        return interpolate(self.pose(after - 1), self.pose(after), (time - begin) / (end - begin))

    def inverse(self) -> 'Poses':
        """The pose of the parent frame in each pose's own frame."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return Poses(self.arrival, self.time, -cos * self.x - sin * self.y,
                     sin * self.x - cos * self.y, wrap_all(-self.yaw))

    def __matmul__(self, other: 'Poses') -> 'Poses':
        """A_T_B @ B_T_C = A_T_C, one by one, at the times of the first."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return Poses(self.arrival, self.time, self.x + cos * other.x - sin * other.y,
                     self.y + sin * other.x + cos * other.y, wrap_all(self.yaw + other.yaw))

    def seen_from(self, parent_T_frame: Pose2) -> 'Poses':
        """The same poses in the parent of their frame."""
        x, y = parent_T_frame.act(self.points).T
        return Poses(self.arrival, self.time, x, y,
                     wrap_all(self.yaw + parent_T_frame.yaw))


@dataclass(frozen=True)
class OdometrySamples(Poses):
    """Odometry: pose in ``odom``, forward speed, rate of turn with the firmware's spikes."""

    linear: np.ndarray
    angular: np.ndarray


@dataclass(frozen=True)
class Commands(Samples):
    """Commanded speeds."""

    linear: np.ndarray
    angular: np.ndarray


@dataclass(frozen=True)
class States(Samples):
    """The states of move_to_goal: `words`, an array of str."""

    words: np.ndarray


@dataclass(frozen=True)
class Values(Samples):
    """One number a message."""

    value: np.ndarray


@dataclass(frozen=True)
class RunData:
    """One robot's run. Only `imu` and `odometry` are always there."""

    name: str
    start: float                 # of the recording [s since 1970]
    duration: float              # [s]
    imu: ImuSamples
    odometry: OdometrySamples
    commands: Commands = field(default_factory=Commands.none)
    local_pose: Poses = field(default_factory=Poses.none)      # of the robot in local
    ground_truth: Poses = field(default_factory=Poses.none)    # of the robot in world
    goals: Poses = field(default_factory=Poses.none)           # in local
    frames: Poses = field(default_factory=Poses.none)          # of local in odom
    states: States = field(default_factory=States.none)
    resets: Poses = field(default_factory=Poses.none)          # of the robot in local, as declared
    asked: Values = field(default_factory=Values.none)         # turns [rad], left positive
    control: Values = field(default_factory=Values.none)       # ctrl_relinq: 1 = a node may drive
    devices: Tuple[str, ...] = ()                              # those that sent: joy, mouse_info
    derived: Tuple[str, ...] = ()                              # fields that were not recorded
    topics: Dict[str, str] = field(default_factory=dict)       # field's name: topic
    dropped: Dict[str, int] = field(default_factory=dict)      # field's name: invalid messages

    def recorded(self) -> Tuple[str, ...]:
        """Names of the fields that hold recorded samples, `imu` first."""
        return tuple(part.name for part in fields(self)
                     if isinstance(getattr(self, part.name), Samples)
                     and len(getattr(self, part.name)) and part.name not in self.derived)


@dataclass(frozen=True)
class SenderClock:
    """The clock of messages' stamps: it is `lag` [s] behind the recorder's."""

    lag: float
    stamps: np.ndarray

    @classmethod
    def of(cls, arrival: np.ndarray, stamp: np.ndarray) -> 'SenderClock':
        """The clock by the fastest messages except outliers; at least one message is needed."""
        lags = np.sort(arrival - stamp)
        lags = lags[np.abs(lags - lags[(len(lags) - 1) // 2]) < LATE]
        return cls(float(lags[len(lags) // 20]), stamp)

    def is_same_as(self, other: 'SenderClock') -> bool:
        """Do both senders share one clock, or does one copy the other's stamps?"""
        shared = np.isin(np.round(self.stamps, 6), np.round(other.stamps, 6))
        return abs(self.lag - other.lag) < SAME_CLOCK or shared.mean() > 0.5


def times_on_recorders_clock(arrival: np.ndarray, stamp: np.ndarray,
                             robot_clock: Optional[SenderClock]) -> np.ndarray:
    """The sender's times on the recorder's clock [s], never running back.

    `robot_clock`, the odometry's SenderClock or None, is used for all senders that share it, so
    that their stamps stay comparable to the microsecond. Messages come late while the recorder is
    busy, and early while its simulated clock stands still; their stamps count. But if no message is
    in time up to some moment, or from then on, the sender's clock was set, and the arrivals count.
    """
    if not len(stamp):
        return arrival
    clock = SenderClock.of(arrival, stamp)
    if robot_clock is not None and clock.is_same_as(robot_clock):
        clock = robot_clock
    delay = np.abs(arrival - stamp - clock.lag)
    in_time, few = np.flatnonzero(delay < LATE), OTHER_CLOCK * len(stamp)
    if len(in_time) < IN_TIME * len(stamp):
        return np.maximum.accumulate(arrival)
    first, last = in_time[0], in_time[-1]
    by_stamp = delay < TOO_LATE
    by_stamp[:first if first > few else 0] = False
    by_stamp[last + 1 if len(stamp) - 1 - last > few else len(stamp):] = False
    return np.maximum.accumulate(np.where(by_stamp, stamp + clock.lag, arrival))
