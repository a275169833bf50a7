"""Faults of the embedded robot's samples.

Units: seconds. Source: recordings of real TurtleBot3s (dropouts of 0.3 to 4.3 s; a driver that
went on sending one sample with new stamps for half a minute).
"""
import math
import random
from typing import Generic, List, Optional

from tb3_labs.robot.samples import AnySample, Sample, with_stamp

#: Shortest and longest dropout [s].
DROPOUT = (0.3, 4.3)
#: Time from one time sync of the serial node to the next [s].
SYNC_PERIOD = 5.0


class Dropouts:
    """Random intervals of silence, `rate` of them per second outside them. Ask in order of time."""

    def __init__(self, rate: float, start: float, seed: int) -> None:
        self.rate = rate
        self._random = random.Random(seed)
        self._plan(start)

    def _plan(self, after: float) -> None:
        self._start = after + (self._random.expovariate(self.rate) if self.rate else math.inf)
        self._end = self._start + self._random.uniform(*DROPOUT)

    def cover(self, stamp: float) -> bool:
        """Is there silence at `stamp` [s]? Both ends of a dropout belong to it."""
        while stamp > self._end:
            self._plan(self._end)
        return stamp >= self._start


class SensorFaults(Generic[AnySample]):
    """The faults of one sensor. `silent`: no samples; `frozen`: one sample, with new stamps."""

    def __init__(self, silent: bool, frozen: bool, dropouts: Dropouts) -> None:
        self._silent = silent
        self._frozen = frozen
        self._dropouts = dropouts
        self._kept: Optional[AnySample] = None

    def outcome(self, samples: List[AnySample]) -> List[AnySample]:
        """The samples that are sent instead of `samples`."""
        if self._silent:
            return []
        if self._frozen and samples:
            self._kept = self._kept or samples[0]
            samples = [with_stamp(self._kept, sample.stamp) for sample in samples]
        if self._dropouts.rate:
            samples = [sample for sample in samples if not self._dropouts.cover(sample.stamp)]
        return samples


class TimeSyncs:
    """The error of the board's clock: up to `largest` [s], another one from each sync on."""

    def __init__(self, largest: float, seed: int) -> None:
        self.largest, self._seed = largest, seed
        self._number, self._error = -1, 0.0

    def error(self, now: float) -> float:
        """The error [s] of a stamp taken at `now` [s]."""
        number = int(now / SYNC_PERIOD)
        if number != self._number:
            source = random.Random('time sync {} {}'.format(number, self._seed))
            self._number, self._error = number, source.uniform(-self.largest, self.largest)
        return self._error

    def stamped(self, samples: List[Sample]) -> List[Sample]:
        """The samples with the stamps of that clock; `samples` have true ones."""
        if not self.largest:
            return samples
        return [with_stamp(sample, sample.stamp + self.error(sample.stamp)) for sample in samples]
