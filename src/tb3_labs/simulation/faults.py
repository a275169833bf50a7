"""What goes wrong with the embedded robot's samples on their way out.

Units: seconds. Source: recordings of real TurtleBot3s (dropouts of 0.3 to 4.3 s; a driver that
went on sending one sample with new stamps for half a minute).
"""
import math
import random

from tb3_labs.robot.samples import with_stamp

#: Shortest and longest dropout [s].
DROPOUT = (0.3, 4.3)


class Dropouts:
    """Stretches of silence at random, `rate` of them per second on average. Ask in order."""

    def __init__(self, rate, start, seed):
        self.rate = rate
        self._random = random.Random(seed)
        self._plan(start)

    def _plan(self, after):
        self._start = after + (self._random.expovariate(self.rate) if self.rate else math.inf)
        self._end = self._start + self._random.uniform(*DROPOUT)

    def cover(self, stamp):
        """Is it silent at `stamp`?"""
        while stamp > self._end:
            self._plan(self._end)
        return stamp >= self._start


class SensorFaults:
    """The faults of one sensor. `silent`: nothing; `frozen`: one sample, with new stamps."""

    def __init__(self, silent, frozen, dropouts):
        self._silent = silent
        self._frozen = frozen
        self._dropouts = dropouts
        self._kept = None

    def outcome(self, samples):
        """The samples that are sent instead of these."""
        if self._silent:
            return []
        if self._frozen and samples:
            self._kept = self._kept or samples[0]
            samples = [with_stamp(self._kept, sample.stamp) for sample in samples]
        if self._dropouts.rate:
            samples = [sample for sample in samples if not self._dropouts.cover(sample.stamp)]
        return samples
