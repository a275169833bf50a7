"""All messages and commands of a test drive, as arrays.

Times: `stamp` is on the robot's clock, `arrival` on ours. The time of a sample on our clock, as
seen here, is its stamp plus the usual delay around that moment. Stamps come evenly, so a message
that was held up keeps its place.

Units: seconds, metres, radians, volts.
"""
import math
from dataclasses import dataclass, field
from typing import Any, Dict, List, NamedTuple, Optional

import numpy as np

from tb3_labs.robot.samples import ImuSample, OdometrySample, WheelSample

#: The columns of the samples, by their kind.
COLUMNS = {'imu': ('stamp', 'arrival', 'yaw', 'rate'),
           'odom': ('stamp', 'arrival', 'x', 'y', 'yaw', 'linear', 'angular'),
           'wheels': ('stamp', 'arrival', 'left', 'right')}


class Samples:
    """Samples of one kind: an array for each column."""

    def __init__(self, kind: str, rows: np.ndarray) -> None:
        for number, name in enumerate(COLUMNS[kind]):
            setattr(self, name, rows[:, number])
        self.kind, self._rows = kind, rows

    def __getattr__(self, name: str) -> np.ndarray:     # for the type checker
        raise AttributeError(name)

    def __len__(self) -> int:
        return len(self._rows)

    def between(self, begin: float, end: float) -> 'Samples':
        """The samples that arrived in [begin, end)."""
        chosen = slice(*np.searchsorted(self.arrival, (begin, end)))
        return Samples(self.kind, self._rows[chosen])

    @property
    def usual_delay(self) -> float:
        """The median time from stamp to arrival [s], with the difference of the clocks."""
        return float(np.median(self.arrival - self.stamp))

    @property
    def turned(self) -> np.ndarray:
        """The yaw without jumps [rad]."""
        return np.unwrap(self.yaw)

    @property
    def way(self) -> np.ndarray:
        """The way driven since the first sample of the odometry, backwards negative [m]. It does
        not use the heading, whose steps at +/-180 deg turn a sample's direction."""
        steps = np.hypot(np.diff(self.x), np.diff(self.y)) * np.sign(self.linear[1:])
        return np.append(0.0, np.cumsum(steps)) if len(self) else np.empty(0)


class Mark(NamedTuple):
    """A part of a step that was driven: its times on our clock, and its command."""

    step: str
    name: str
    begin: float
    end: float
    linear: float
    angular: float


@dataclass
class Recording:
    """`rows`: lists of samples by their kind. The arrays are made by :meth:`samples`."""

    rows: Dict[str, List[tuple]] = field(
        default_factory=lambda: {kind: [] for kind in COLUMNS})
    marks: List[Mark] = field(default_factory=list)
    told: List[tuple] = field(default_factory=list)     # commands: (time, forward speed, turn)
    answers: Dict[str, float] = field(default_factory=dict)     # step: the number typed in
    volts: List[float] = field(default_factory=list)            # of the battery, in order
    torque: Optional[bool] = None                               # is it on? None: not known
    round_trip: Optional[float] = None                          # of a question to the robot [s]
    ended: str = ''                                             # why it ended early
    lost: str = ''                                              # the sensors that were silent then
    _arrays: Dict[str, Samples] = field(default_factory=dict)   # made of all rows so far

    def add(self, sample: Any, arrival: float) -> None:
        """Keep a sample: an ImuSample, an OdometrySample or a WheelSample."""
        if isinstance(sample, ImuSample):
            self.rows['imu'].append((sample.stamp, arrival, sample.yaw, sample.yaw_rate))
        elif isinstance(sample, WheelSample):
            self.rows['wheels'].append((sample.stamp, arrival, sample.left, sample.right))
        elif isinstance(sample, OdometrySample):
            pose = sample.pose
            self.rows['odom'].append((sample.stamp, arrival, pose.x, pose.y, pose.yaw,
                                      sample.linear, sample.angular))

    def samples(self, kind: str) -> Samples:
        """The samples of a kind so far. Stamps that are not a clock are replaced by arrivals."""
        kept = self._arrays.get(kind)
        if kept is None or len(kept) != len(self.rows[kind]):
            rows = np.array(self.rows[kind], dtype=float).reshape(-1, len(COLUMNS[kind]))
            if len(rows) > 2 and not np.any(np.diff(rows[:, 0]) > 0.0):
                rows[:, 0] = rows[:, 1]
            kept = self._arrays[kind] = Samples(kind, rows)
        return kept

    def marked(self, name: str) -> List[Mark]:
        """The parts of this name that were driven to their end."""
        return [mark for mark in self.marks if mark.name == name and not math.isnan(mark.end)]
