"""Converts the times of a recording to one clock, the recorder's clock at the start.

A clock may be set during a recording, for example by NTP. If the arrivals of one topic run back,
the recorder's clock was set back. If all topics are silent for longer than LONGEST_OUTAGE, this
clock was set forward, or the computer slept. A smaller jump forward is not undone, since it looks
like a silence of all topics.

Units: seconds since the recording's start on the recorder's clock.
"""
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

#: The clock was set back if the arrivals of a topic run back by more than this [s].
LEAST_SET_BACK = 0.05
#: A silence of all topics is removed from the times if it is longer than this [s].
LONGEST_OUTAGE = 3600.0
#: A recording is refused if its clock was set more often than this.
MOST_JUMPS = 20
#: Two senders share one clock if their clocks differ by less than this [s].
SAME_CLOCK = 0.1
#: A message is late if its delay differs from its sender's usual delay by more than this [s].
LATE_BY = 0.5
#: A stamp is ignored if the delay of its message is longer than this [s], since no recorder is busy
#: so long.
LONGEST_BELIEVED_DELAY = 10.0
#: A sender's stamps are used if at least this share of its messages is not late.
LEAST_IN_TIME_SHARE = 0.25
#: The sender's clock was set if more than this share of its messages, at the recording's begin or
#: at its end, is late.
OTHER_CLOCK_SHARE = 0.1


@dataclass(frozen=True)
class RecordedClock:
    """The clock of a sender, which is `lag` behind the recorder's clock [s]. The sender's messages
    have these `stamps`."""

    lag: float
    stamps: np.ndarray

    @classmethod
    def of(cls, arrival: np.ndarray, stamp: np.ndarray) -> 'RecordedClock':
        """Returns the clock by the messages with the shortest delays, without outliers. At least
        one message is needed."""
        lags = np.sort(arrival - stamp)
        lags = lags[np.abs(lags - lags[(len(lags) - 1) // 2]) < LATE_BY]
        return cls(float(lags[len(lags) // 20]), stamp)

    def is_same_as(self, other: 'RecordedClock') -> bool:
        """Do both senders share one clock, or does this sender copy the stamps of the other?"""
        is_copied = np.isin(np.round(self.stamps, 6), np.round(other.stamps, 6))
        return abs(self.lag - other.lag) < SAME_CLOCK or is_copied.mean() > 0.5


def times_on_recorders_clock(arrival: np.ndarray, stamp: np.ndarray,
                             robot_clock: Optional[RecordedClock]) -> np.ndarray:
    """Returns the times at which a sender sent its messages, on the recorder's clock [s]. These
    times never run back.

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
    if len(in_time) < LEAST_IN_TIME_SHARE * len(stamp):
        return np.maximum.accumulate(arrival)
    by_stamp = delay < LONGEST_BELIEVED_DELAY
    most_late = OTHER_CLOCK_SHARE * len(stamp)
    first, last = in_time[0], in_time[-1]
    if first > most_late:       # the sender's clock was set at `first`
        by_stamp[:first] = False
    if len(stamp) - 1 - last > most_late:       # it was set after `last`
        by_stamp[last + 1:] = False
    return np.maximum.accumulate(np.where(by_stamp, stamp + clock.lag, arrival))


def undo_clock_jumps(collectors: Dict[str, Any]) -> Tuple[float, List[str]]:
    """Remove the jumps of clocks from the arrivals and stamps of `collectors`. These are {field of
    RunData: Collector}. Returns (the last arrival [s], a sentence for each jump)."""
    filled = [each for each in collectors.values() if len(each.arrival)]
    number = np.concatenate([each.number for each in filled])
    order = np.argsort(number, kind='stable')
    number = number[order]
    arrival = np.concatenate([each.arrival for each in filled])[order]
    topic = np.repeat(np.arange(len(filled)), [len(each.arrival) for each in filled])[order]
    jumps: List[Tuple[int, float]] = []
    while True:
        at = _first_set_back(arrival, topic)
        if at is None:
            at = _first_after_outage(arrival)
        if at is None:
            break
        if len(jumps) == MOST_JUMPS:
            raise ValueError(f'its clock was set more than {MOST_JUMPS} times')
        jump = arrival[at] - arrival[at - 1]
        jumps.append((at, jump))
        arrival[at:] -= jump
        for each in filled:
            _undo_jump(each, number[at], jump)
    sentences = []
    for at, jump in sorted(jumps):
        way = 'forward' if jump > 0.0 else 'back'
        sentences.append(
            f'the clock was set {way} by {_duration_text(abs(jump))}, {arrival[at]:.1f} s after '
            'the start; times go on without the jump')
    return float(arrival.max()), sentences


def _first_set_back(arrival: np.ndarray, topic: np.ndarray) -> Optional[int]:
    """Returns the index of the first message after the clock was first set back, or None.

    Only arrivals of the same topic are compared, because a file may have all messages of one topic
    behind all messages of another topic.
    """
    by_topic = np.argsort(topic, kind='stable')
    is_back = (np.diff(arrival[by_topic]) < -LEAST_SET_BACK) & (np.diff(topic[by_topic]) == 0)
    if not is_back.any():
        return None
    # messages of other topics may have come between the jump and this message
    shown_by = int(by_topic[1:][is_back].min())
    until = arrival[:shown_by + 1]
    is_before = until >= np.maximum.accumulate(until) - LEAST_SET_BACK
    return int(np.flatnonzero(is_before)[-1]) + 1


def _first_after_outage(arrival: np.ndarray) -> Optional[int]:
    """Returns the index of the first message after the first silence of all topics that is longer
    than LONGEST_OUTAGE, or None."""
    is_outage = np.diff(arrival) > LONGEST_OUTAGE
    return int(np.argmax(is_outage)) + 1 if is_outage.any() else None


def _undo_jump(collector: Any, number: int, jump: float) -> None:
    """Subtract `jump` [s] from the arrival of message `number` and of all later messages. If the
    sender's clock was set together with the recorder's, subtract it from their stamps too."""
    arrival, stamp, is_later = collector.arrival, collector.stamp, collector.number >= number
    lag = arrival - stamp
    arrival[is_later] -= jump
    if is_later.all() or not is_later.any():
        return
    # the lag changed by the jump, unless the sender's clock was set together with the recorder's
    lag -= np.median(lag[~is_later])
    if abs(np.median(lag[is_later])) < abs(jump) / 2.0:
        # a message that was sent before the jump may have arrived after it
        was_sent_before = np.abs(lag - jump) < np.abs(lag)
        stamp[is_later & ~was_sent_before] -= jump


def _duration_text(seconds: float) -> str:
    if seconds < 7200.0:
        return f'{seconds:.1f} s'
    hours = seconds / 3600.0
    return f'{hours:.1f} h' if hours < 48.0 else f'{hours / 24.0:.0f} days'
