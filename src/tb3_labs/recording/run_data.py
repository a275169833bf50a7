"""Contains the recorded data of one run in arrays.

Each sample has two times in seconds since the recording's start. `arrival` is the time at which the
sample arrived at the recorder. `time` is the stamp of the sample, converted from the sender's clock
to the recorder's clock, because the two clocks of a real robot differ by up to a second. If a
message has no stamp, `time` equals `arrival`.

Units: metres, radians, m/s, rad/s. Yaws are in [-pi, pi], as in the messages.
"""
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, List, Sequence, Tuple, Type, TypeVar

import numpy as np

from tb3_labs.geometry.arrays import wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

MIN_GAP = 0.3       # a longer time [s] between two messages of a topic is a gap
MIN_LEAP = 0.3      # a longer distance [m] between two successive poses is a leap

SamplesType = TypeVar('SamplesType', bound='Samples')


@dataclass(frozen=True)
class Samples:
    """Arrays with an element for each sample. They are empty if the topic was not recorded."""

    arrival: np.ndarray
    time: np.ndarray

    def __len__(self) -> int:
        return len(self.time)

    @property
    def columns(self) -> List[np.ndarray]:
        """All arrays. The arrays `arrival` and `time` are first."""
        return [getattr(self, field.name) for field in fields(self)]

    def take(self: SamplesType, index: Any) -> SamplesType:
        """Returns the samples at a numpy index, such as a mask or a slice."""
        return type(self)(*(column[index] for column in self.columns))

    def between(self: SamplesType, begin: float, end: float) -> SamplesType:
        """Returns the samples with `time` in [begin, end) [s]. The times must be in order."""
        return self.take(slice(*np.searchsorted(self.time, (begin, end))))

    def arrived_between(self: SamplesType, begin: float, end: float) -> SamplesType:
        """Returns the samples with `arrival` in [begin, end) [s]."""
        return self.take((self.arrival >= begin) & (self.arrival < end))

    @classmethod
    def joined(cls: Type[SamplesType], parts: Sequence['Samples']) -> SamplesType:
        if not parts:
            return cls.none()
        columns = zip(*(part.columns for part in parts))
        return cls(*map(np.concatenate, columns))

    @classmethod
    def from_rows(cls: Type[SamplesType], rows: Sequence[Sequence[Any]]) -> SamplesType:
        """Returns a sample for each row. The values of a row are in the order of the fields."""
        if not rows:
            return cls.none()
        types = [object if isinstance(value, str) else float for value in rows[0]]
        return cls(*map(np.array, zip(*rows), types))

    @classmethod
    def without_stamps(cls: Type[SamplesType], rows: Sequence[Sequence[Any]]) -> SamplesType:
        """Returns a sample for each row. A row has no `time`, so the sample's `arrival` is used."""
        return cls.from_rows([(row[0], *row) for row in rows])

    @classmethod
    def none(cls: Type[SamplesType]) -> SamplesType:
        return cls(*(np.empty(0) for _ in fields(cls)))


class Yaws(Samples):
    """Samples that each have a yaw."""

    yaw: np.ndarray

    def yaw_at(self, time: Any) -> np.ndarray:
        """Returns the unwrapped yaw [rad] at each time [s], interpolated between samples. Before
        the first sample and after the last, the nearest yaw is returned."""
        return np.interp(time, self.time, self._continuous_yaw)

    @cached_property
    def _continuous_yaw(self) -> np.ndarray:
        return np.unwrap(self.yaw)


@dataclass(frozen=True)
class ImuSamples(Yaws):
    """The heading and the rate of turn of each IMU message, and its quaternion w, x, y, z."""

    yaw: np.ndarray
    yaw_rate: np.ndarray
    w: np.ndarray
    x: np.ndarray
    y: np.ndarray
    z: np.ndarray


@dataclass(frozen=True)
class Poses(Yaws):
    """Poses in the plane. All poses of a topic are in the same frame."""

    x: np.ndarray
    y: np.ndarray
    yaw: np.ndarray

    @property
    def length(self) -> float:
        """The length [m] of the path. A path back counts like a path forwards."""
        return float(np.hypot(np.diff(self.x), np.diff(self.y)).sum())

    @property
    def leap_indices(self) -> np.ndarray:
        """The index of the first pose after each leap."""
        return np.flatnonzero(np.hypot(np.diff(self.x), np.diff(self.y)) > MIN_LEAP) + 1

    def pose(self, index: int) -> Pose2:
        return Pose2(float(self.x[index]), float(self.y[index]), float(self.yaw[index]))

    def at(self, times: np.ndarray) -> 'Poses':
        """Returns the interpolated poses at the `times` [s], as in `yaw_at`."""
        x = np.interp(times, self.time, self.x)
        y = np.interp(times, self.time, self.y)
        return Poses(times, times, x, y, wrap_all(self.yaw_at(times)))

    def pose_at(self, time: float) -> Pose2:
        return self.at(np.array([time])).pose(0)

    def inverse(self) -> 'Poses':
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return Poses(self.arrival, self.time, -cos * self.x - sin * self.y,
                     sin * self.x - cos * self.y, wrap_all(-self.yaw))

    def __matmul__(self, other: 'Poses') -> 'Poses':
        """Returns A_T_B @ B_T_C = A_T_C for each pair of poses, with the times of A_T_B."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return Poses(self.arrival, self.time, self.x + cos * other.x - sin * other.y,
                     self.y + sin * other.x + cos * other.y, wrap_all(self.yaw + other.yaw))

    def in_parent(self, parent_T_frame: Pose2) -> 'Poses':
        """Returns the poses, converted from `frame` to `parent`."""
        x, y = parent_T_frame.act(np.column_stack([self.x, self.y])).T
        return Poses(self.arrival, self.time, x, y, wrap_all(self.yaw + parent_T_frame.yaw))


@dataclass(frozen=True)
class OdometrySamples(Poses):
    """Poses in ``odom``, and the robot's speeds. The firmware's spikes in `angular` are kept."""

    linear: np.ndarray
    angular: np.ndarray


@dataclass(frozen=True)
class Commands(Samples):
    """Commanded speeds. `sideways`, `upward`, `rolling` and `pitching` move no wheel. `sender` is
    the name of the node that sent the command, or '' if the name is unknown."""

    linear: np.ndarray
    angular: np.ndarray
    sideways: np.ndarray    # linear.y
    upward: np.ndarray      # linear.z
    rolling: np.ndarray     # angular.x
    pitching: np.ndarray    # angular.y
    sender: np.ndarray

    def with_timeouts(self) -> 'Commands':
        """Returns the commands with an additional command for each timeout of the robot. The
        additional command comes when the robot stops by the timeout, and its speeds are NaN."""
        next_times = np.append(self.time[1:], np.inf)
        timed_out = self.take(next_times > self.time + COMMAND_TIMEOUT)
        nans = np.full(len(timed_out), np.nan)
        ends = replace(timed_out, time=timed_out.time + COMMAND_TIMEOUT, linear=nans, angular=nans)
        commands = Commands.joined([self, ends])
        return commands.take(np.argsort(commands.time, kind='stable'))


@dataclass(frozen=True)
class MouseSamples(Samples):
    """Places of the mouse. `x` (to the right) and `y` (up) are in [-1, 1]. `active` is 1 or 0."""

    x: np.ndarray
    y: np.ndarray
    active: np.ndarray


@dataclass(frozen=True)
class Texts(Samples):
    """One text for each message, such as a state of move_to_goal."""

    text: np.ndarray


@dataclass(frozen=True)
class LogLines(Samples):
    """Lines on /rosout, each with a level, the name of a node, and a text."""

    level: np.ndarray
    node: np.ndarray
    text: np.ndarray


@dataclass(frozen=True)
class Numbers(Samples):
    """One number for each message."""

    value: np.ndarray


@dataclass(frozen=True)
class Variables(Samples):
    """Readings of variables, each with the node, the variable's name, and the value as a text."""

    node: np.ndarray
    name: np.ndarray
    value: np.ndarray


@dataclass(frozen=True, eq=False)
class RunData:
    """The run of one robot. Only `imu` and `odometry` always have samples. Two RunData objects are
    never equal (eq=False), so lru_cache can keep a result for each run."""

    name: str
    start: float                                     # [s since 1970]
    duration: float                                  # [s]
    imu: ImuSamples
    odometry: OdometrySamples
    commands: Commands = Commands.none()
    local_pose: Poses = Poses.none()                 # robot in local
    ground_truth: Poses = Poses.none()               # robot in world
    goals: Poses = Poses.none()                      # goals in local
    frames: Poses = Poses.none()                     # origin of local in odom
    states: Texts = Texts.none()
    resets: Poses = Poses.none()                     # declared poses in local
    turn_requests: Numbers = Numbers.none()          # [rad], positive to the left
    board_resets: Samples = Samples.none()           # each calibrates the board's gyro
    control: Numbers = Numbers.none()                # 1 if ctrl_relinq lets a node drive
    mouse: MouseSamples = MouseSamples.none()
    log: LogLines = LogLines.none()                  # lines of nodes in the robot's namespace
    devices: Tuple[str, ...] = ()                    # recorded device topics
    starts: Tuple[float, ...] = ()                   # times [s] at which a trial's node started
    letters: Numbers = Numbers.none()                # l is 1, r is -1, other letters are 0
    events: Texts = Texts.none()                     # messages on the topic trial
    printed: Texts = Texts.none()                    # texts that the node printed in a trial
    variables: Variables = Variables.none()          # readings of the probe
    derived: Tuple[str, ...] = ()                    # fields that were computed, not recorded
    notes: Tuple[str, ...] = ()                      # sentences about the recording
