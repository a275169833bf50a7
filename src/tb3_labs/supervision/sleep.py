"""Did this process sleep? It was stopped, swapped out, or its computer suspended.

A process can see its own sleep only by the clock: it looks at the clock repeatedly, and a long time
between two looks is a sleep. Units: seconds on a clock that does not stand still (`now`).
"""
import math
from typing import Optional

#: More than this between two looks is a sleep [s]; a busy machine makes a process wait for less.
LONGEST_GAP = 1.0
#: Messages within this time after a sleep may be as old as the sleep, and their order is lost, since
#: each topic is read by a thread of its own [s].
WAKING = 0.3


class SleepWatch:
    """Looks at the clock for one node."""

    def __init__(self) -> None:
        #: Length of the sleep that the last update found [s]; 0 if it found none.
        self.slept_for = 0.0
        #: True if messages that are heard now may be as old as a sleep: a stop counts, nothing else.
        self.is_waking = False
        self._updated_at: Optional[float] = None
        self._woke_at = -math.inf

    def update(self, now: float) -> None:
        """Look at the clock. To be called ten times a second, and before each message counts."""
        gap = now - self._updated_at if self._updated_at else 0.0    # 0: the clock had not begun
        self._updated_at = now
        self.slept_for = gap if gap > LONGEST_GAP else 0.0
        if self.slept_for:
            self._woke_at = now
        self.is_waking = now - self._woke_at < WAKING

    def start(self, now: float) -> None:
        """Begin to look now: no time before counts."""
        self.slept_for, self.is_waking = 0.0, False
        self._updated_at, self._woke_at = now, -math.inf

    def in_words(self) -> str:
        """The sleep that the last update found: '' or 'this node did not run for 3.2 s'."""
        return 'this node did not run for {:.1f} s'.format(self.slept_for) if self.slept_for else ''
