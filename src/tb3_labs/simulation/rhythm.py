"""Moments at a fixed rate, counted from one of them, so that rounding errors do not add up.

Units: seconds, and 1/s for rates.
"""
from typing import List


class Rhythm:
    """The moments 1/rate, 2/rate, ... after `start`; each is taken once, in order."""

    def __init__(self, rate: float, start: float = 0.0) -> None:
        self._rate, self._base, self._count = rate, start, 1
        #: The next moment [s]. An attribute, for speed.
        self.due = start + 1.0 / rate

    def take(self) -> float:
        """Take the moment that is due [s]; the next one becomes due."""
        due = self.due
        self._count += 1
        self.due = self._base + self._count / self._rate
        return due

    def take_until(self, end: float) -> List[float]:
        """Take all moments before `end` [s]; one at `end` itself stays due."""
        moments, due, count = [], self.due, self._count
        while due < end:
            moments.append(due)
            count += 1
            due = self._base + count / self._rate
        self.due, self._count = due, count
        return moments

    def set_rate(self, rate: float, now: float) -> None:
        """Use another rate, counted from `now` on; the same rate changes nothing."""
        if rate != self._rate:
            self._rate, self._base, self._count = rate, now, 1
            self.due = now + 1.0 / rate
