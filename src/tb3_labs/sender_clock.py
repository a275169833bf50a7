"""The robot's clock as its messages show it: when was a sample measured?

Header stamps tell intervals well, but come from the robot's clock, which may be a second off,
step, or stand at zero. Arrivals are on the receiver's clock, but a network holds messages up. So
samples are ordered by their stamps, and the usual delay between stamp and arrival translates the
receiver's "now", which is late by that delay: milliseconds on a quiet network. Where the stamps
are no clock, arrivals take their place for both sensors.

Units: seconds. What is what:

* a stamp that is merely old is a message that was held up, and counts;
* one that goes back, comes from the future, or follows a long silence, begins a new *epoch*:
  instants of different epochs cannot be compared;
* stamps of zero, stamps that stand still, and a source that is off by a clock step for long while
  the other is not, are no clock.
"""
from collections import deque
from statistics import median

#: The usual delay is the median of the last so many, looked at anew after every few.
DELAYS = 101
DELAYS_REFRESH = 10
#: A stamp that runs this far ahead of its arrival is a new clock; so is what follows a silence
#: of this length [s].
CLOCK_STEP = 1.0
LONG_SILENCE = 1.5
#: This many repeats of one stamp, or a source off by a clock step for this long [s]: no clock.
MAX_REPEATS = 3
MAX_OFF = 1.0


class SenderClock:
    """Reads the stamps of one sender's several sources."""

    def __init__(self):
        #: Counts the epochs.
        self.epoch = 0
        #: False once the stamps turned out to be no clock.
        self.uses_stamps = True
        self._begin()
        self._repeats = {}
        self._last_arrival = None

    def time_of(self, source, stamp, arrival):
        """When `source` measured a sample, on the sender's clock (or by arrival: see above)."""
        if self.uses_stamps and self._is_no_clock(source, stamp, arrival):
            self.uses_stamps = False
            self._new_epoch()
        elif self._is_new_clock(source, stamp, arrival):
            self._new_epoch()
        self._last[source] = stamp, arrival
        self._last_arrival = arrival
        time = stamp if self.uses_stamps else arrival
        self._delays.append(arrival - time)
        self._seen += 1
        if self._usual is None or self._seen % DELAYS_REFRESH == 0:
            self._usual = median(self._delays)
        return time

    def stamp_of(self, now):
        """`now` [receiver's clock] on the sender's clock; None before the first sample."""
        return now - median(self._delays) if self._delays else None

    def _is_no_clock(self, source, stamp, arrival):
        repeated = source in self._last and stamp == self._last[source][0]
        self._repeats[source] = self._repeats.get(source, 0) + 1 if repeated else 0
        if stamp <= 0.0 or self._repeats[source] >= MAX_REPEATS:
            return True
        if self._usual is None or abs(arrival - stamp - self._usual) < CLOCK_STEP:
            self._off_since.pop(source, None)
            return False
        return arrival - self._off_since.setdefault(source, arrival) > MAX_OFF

    def _is_new_clock(self, source, stamp, arrival):
        if self._usual is None:
            return False
        if abs(arrival - self._last_arrival) > LONG_SILENCE:
            return True
        if not self.uses_stamps:
            return arrival < self._last_arrival
        if source not in self._last:
            return False
        last_stamp, last_arrival = self._last[source]
        # Messages that were held up come all at once, but their stamps go on evenly.
        ahead = (stamp - last_stamp) - (arrival - last_arrival)
        return stamp < last_stamp or ahead > CLOCK_STEP

    def _new_epoch(self):
        self.epoch += 1
        self._begin()

    def _begin(self):
        self._delays = deque(maxlen=DELAYS)
        self._usual = None
        self._seen = 0
        self._last = {}               # of each source: (stamp, arrival)
        self._off_since = {}
