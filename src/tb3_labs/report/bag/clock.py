"""Converts the times of a recording to one clock, the recorder's clock.

Units: seconds since the recording's start on the recorder's clock.
"""
from dataclasses import dataclass
from typing import Optional

import numpy as np

#: Two senders share one clock if their clocks differ by less than this [s].
SAME_CLOCK = 0.1
#: A message is late if its delay differs from its sender's usual delay by more than this [s].
LATE_BY = 0.5
#: No recorder is busy for longer than this. If the delay of a message is longer, its stamp is
#: ignored [s].
MAX_BELIEVED_DELAY = 10.0
#: A sender's stamps are used if at least this share of its messages is not late.
MIN_IN_TIME_SHARE = 0.25
#: If more than this share of a sender's messages is late, and all these messages are at the begin
#: or at the end of the recording, the sender's clock was set.
OTHER_CLOCK_SHARE = 0.1


@dataclass(frozen=True)
class RecordedClock:
    """The clock of a sender, which is `lag` behind the recorder's clock [s]. `stamps` are the
    stamps of the sender's messages."""

    lag: float
    stamps: np.ndarray

    @classmethod
    def of(cls, arrival: np.ndarray, stamp: np.ndarray) -> 'RecordedClock':
        """Returns the clock of a sender with at least one message. The clock is computed from the
        messages with the shortest delays, without outliers."""
        lags = np.sort(arrival - stamp)
        lags = lags[np.abs(lags - lags[(len(lags) - 1) // 2]) < LATE_BY]
        return cls(float(lags[len(lags) // 20]), stamp)

    def is_same_as(self, other: 'RecordedClock') -> bool:
        """Do the stamps of this sender come from the clock of the `other` sender?"""
        is_copied = np.isin(np.round(self.stamps, 6), np.round(other.stamps, 6))
        return abs(self.lag - other.lag) < SAME_CLOCK or is_copied.mean() > 0.5


def times_on_recorders_clock(arrival: np.ndarray, stamp: np.ndarray,
                             robot_clock: Optional[RecordedClock]) -> np.ndarray:
    """Returns the times at which a sender sent its messages, on the recorder's clock [s]. Each time
    is at least the previous time.

    `robot_clock` is the odometry's RecordedClock, or None. All senders that share this clock get
    the same lag, so that their stamps stay comparable to the microsecond. A stamp is more exact
    than an arrival: messages arrive late while the recorder is busy, and early while a simulated
    clock stands still. The arrival is used only if the stamp is not plausible.
    """
    if not len(stamp):
        return arrival
    clock = RecordedClock.of(arrival, stamp)
    if robot_clock is not None and clock.is_same_as(robot_clock):
        clock = robot_clock
    delay = np.abs(arrival - stamp - clock.lag)
    in_time = np.flatnonzero(delay < LATE_BY)
    if len(in_time) < MIN_IN_TIME_SHARE * len(stamp):
        return np.maximum.accumulate(arrival)
    by_stamp = delay < MAX_BELIEVED_DELAY
    most_late = OTHER_CLOCK_SHARE * len(stamp)
    first, last = in_time[0], in_time[-1]
    if first > most_late:       # the sender's clock was set at `first`
        by_stamp[:first] = False
    if len(stamp) - 1 - last > most_late:       # the sender's clock was set after `last`
        by_stamp[last + 1:] = False
    return np.maximum.accumulate(np.where(by_stamp, stamp + clock.lag, arrival))
