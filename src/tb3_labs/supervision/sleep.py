"""Did this process sleep? It was stopped, swapped out, or its computer suspended.

A process can see its own sleep only by the clock: it looks at the clock repeatedly, and a long time
between two looks is a sleep. Units: seconds on a clock that does not stand still (`now`).
"""
from typing import Optional


class SleepWatch:
    """Looks at the clock for one node, or for one motion of it."""

    def __init__(self, longest_gap: float) -> None:
        """More than `longest_gap` [s] between two looks is a sleep."""
        #: Length of the sleep that the last update found [s]; 0 where it found none.
        self.slept_for = 0.0
        self._longest_gap = longest_gap
        self._updated_at: Optional[float] = None

    def update(self, now: float) -> None:
        """Look at the clock. To be called at least once a second."""
        gap = now - self._updated_at if self._updated_at else 0.0    # 0: the clock had not begun
        self._updated_at = now
        self.slept_for = gap if gap > self._longest_gap else 0.0

    def start(self) -> None:
        """Begin to look now: no time before counts."""
        self.slept_for = 0.0
        self._updated_at = None

    def in_words(self) -> str:
        """The sleep that the last update found: '' or 'this node did not run for 3.2 s'."""
        return 'this node did not run for {:.1f} s'.format(self.slept_for) if self.slept_for else ''
