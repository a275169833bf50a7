"""The robot's clock as its messages show it: when was a sample measured?

Header stamps show intervals well, but come from the robot's clock, which may be a second off, step,
or stand at zero. Arrivals are on the receiver's clock, but a network delays messages. So samples
are ordered by their stamps. The *least delay* between stamp and arrival within the last seconds
converts one clock to the other, since it belongs to the fastest message. If the stamps are not
a clock, arrivals take their place for both sensors.

Units: seconds. Cases:

* An old stamp alone only shows that the message was delayed. The stamp counts.
* A stamp that goes back by less than `SMALL_STEP` shows a clock that is being corrected. Time
  stands still for this source until its stamps have caught up.
* A stamp that goes back further, comes from the future, or follows a long silence, begins a new
  *epoch*. Instants of different epochs cannot be compared.
* Stamps are not a clock if they are zero, stand still, or run back, or if only one of two sources
  is off by a clock step for long.

Source: the least delay as in NTP's clock filter (RFC 5905, section 10).
"""
import math
from typing import Dict, Optional, Tuple

from tb3_labs.supervision.freshness import Least

#: A clock that goes back by less than this is being corrected [s].
SMALL_STEP = 0.1
#: A stamp that is this far ahead of its arrival belongs to a new clock [s].
CLOCK_STEP = 1.0
#: A message after a silence of this length belongs to a new clock [s].
LONG_SILENCE = 1.5
#: A stamp that is repeated more often than this does not belong to a clock.
MAX_REPEATS = 3
#: A source that is off by a clock step for longer than this does not have a clock [s].
MAX_OFF = 1.0
#: A source whose stamps went back does not have a clock if they catch up later than this [s].
MAX_BEHIND = 0.5


class SenderClock:
    """Reads the stamps of one sender's several sources."""

    def __init__(self) -> None:
        #: Number of the epoch; the first is 0.
        self.epoch = -1
        #: False once the stamps have shown that they are not a clock.
        self.uses_stamps = True
        self._repeats: Dict[str, int] = {}
        self._last_arrival = math.nan    # before the first sample
        self._new_epoch()

    def time_of(self, source: str, stamp: float, arrival: float) -> float:
        """The time at which `source` measured a sample, on the sender's clock (or by arrival)."""
        if self.uses_stamps and self._is_no_clock(source, stamp, arrival):
            self.uses_stamps = False
            self._new_epoch()
        elif self._is_new_clock(source, stamp, arrival):
            self._new_epoch()
        time = arrival
        if self.uses_stamps:
            time = max(stamp, self._last[source][0]) if source in self._last else stamp
        self._last[source] = time, stamp, arrival
        self._last_arrival = arrival
        self._least.add(arrival, arrival - time)
        return time

    def stamp_of(self, now: float) -> Optional[float]:
        """`now` [receiver's clock] on the sender's clock; None before the first sample."""
        return None if self._least.value is None else now - self._least.value

    def measured_at(self, time: float, arrival: float) -> float:
        """When was a sample of `time` [sender's clock], which has just arrived, measured? Returns
        the time on the receiver's clock, as if the fastest message needed no time. Call
        :meth:`time_of` before."""
        assert self._least.value is not None
        return min(arrival, time + self._least.value)

    def _is_no_clock(self, source: str, stamp: float, arrival: float) -> bool:
        repeated = source in self._last and stamp == self._last[source][1]
        self._repeats[source] = self._repeats[source] + 1 if repeated else 0
        if stamp == 0.0 or self._repeats[source] >= MAX_REPEATS:
            return True
        if source not in self._last or stamp >= self._last[source][0]:
            self._behind_since.pop(source, None)
        elif arrival - self._behind_since.setdefault(source, arrival) > MAX_BEHIND:
            return True
        least = self._least.value
        if least is None or abs(arrival - stamp - least) < CLOCK_STEP:
            self._off_since.pop(source, None)
            return False
        return arrival - self._off_since.setdefault(source, arrival) > MAX_OFF

    def _is_new_clock(self, source: str, stamp: float, arrival: float) -> bool:
        if self._least.value is None:
            return False
        if abs(arrival - self._last_arrival) > LONG_SILENCE:
            return True
        if not self.uses_stamps:
            return arrival < self._last_arrival
        if source not in self._last:
            return False
        _, last_stamp, last_arrival = self._last[source]
        # Delayed messages arrive all at once, but their stamps go on evenly.
        ahead = (stamp - last_stamp) - (arrival - last_arrival)
        return stamp < last_stamp - SMALL_STEP or ahead > CLOCK_STEP

    def _new_epoch(self) -> None:
        self.epoch += 1
        self._least = Least()
        self._last: Dict[str, Tuple[float, float, float]] = {}    # by source: time, stamp, arrival
        self._off_since: Dict[str, float] = {}
        self._behind_since: Dict[str, float] = {}
