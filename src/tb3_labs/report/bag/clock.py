"""The times of a recording on one clock: the recorder's, as it was at the start.

A clock may be set while it is recorded, such as by NTP: the recorder's, a sender's, or both if they
share one. The messages are known in the order in which they were recorded; so a clock that was set
back shows. One that was set forward looks like a silence of all topics. It differs by the stamps of
a sender with another clock, or since no silence is longer than LONGEST_OUTAGE.

Units: seconds since the recording's start on the recorder's clock.
"""
import math
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

#: A topic's arrivals that run back by more than SET_BACK tell that the clock was set [s].
SET_BACK = 0.05
#: In a longer silence of all topics the clock was set, or the computer slept [s].
LONGEST_OUTAGE = 3600.0
#: A sender's lag is compared this long before and after a silence [s], for at most MOST_OUTAGES.
LAG_WINDOW, MOST_OUTAGES = 5.0, 100
#: A recording whose clock was set more often has no times.
MOST_SET = 20
#: If the clocks of two senders differ by less than this, the senders share one clock [s].
SAME_CLOCK = 0.1
#: A message is late if it comes this much later than others [s]. No recorder is busy for longer
#: than TOO_LATE [s].
LATE, TOO_LATE = 0.5, 10.0
#: A sender's clock can be used if at least this fraction of its messages is in time.
WITHIN = 0.25
#: If more than this fraction of the messages, all of them at the start or at the end of the
#: recording, is not in time, the sender's clock was set.
OTHER_CLOCK = 0.1


@dataclass(frozen=True)
class RecordedClock:
    """A sender's clock, by the stamps of its messages: `lag` [s] behind the recorder's clock."""

    lag: float
    stamps: np.ndarray

    @classmethod
    def of(cls, arrival: np.ndarray, stamp: np.ndarray) -> 'RecordedClock':
        """Returns the clock by the fastest messages, without outliers. It needs one message."""
        lags = np.sort(arrival - stamp)
        lags = lags[np.abs(lags - lags[(len(lags) - 1) // 2]) < LATE]
        return cls(float(lags[len(lags) // 20]), stamp)

    def is_same_as(self, other: 'RecordedClock') -> bool:
        """Do both senders share one clock, or does one copy the other's stamps?"""
        shared = np.isin(np.round(self.stamps, 6), np.round(other.stamps, 6))
        return abs(self.lag - other.lag) < SAME_CLOCK or shared.mean() > 0.5


def times_on_recorders_clock(arrival: np.ndarray, stamp: np.ndarray,
                             robot_clock: Optional[RecordedClock]) -> np.ndarray:
    """Returns the sender's times on the recorder's clock [s]; they never run back.

    `robot_clock` is the odometry's RecordedClock, or None. It is used for all senders that share
    this clock, so that their stamps stay comparable to the microsecond. Messages come late while
    the recorder is busy, and early while its simulated clock stands still: their stamps count. If
    all messages before some moment, or all after it, are not in time, the sender's clock was set:
    their arrivals are used.
    """
    if not len(stamp):
        return arrival
    clock = RecordedClock.of(arrival, stamp)
    if robot_clock is not None and clock.is_same_as(robot_clock):
        clock = robot_clock
    delay = np.abs(arrival - stamp - clock.lag)
    in_time, few = np.flatnonzero(delay < LATE), OTHER_CLOCK * len(stamp)
    if len(in_time) < WITHIN * len(stamp):
        return np.maximum.accumulate(arrival)
    first, last = in_time[0], in_time[-1]
    by_stamp = delay < TOO_LATE
    by_stamp[:first if first > few else 0] = False
    by_stamp[last + 1 if len(stamp) - 1 - last > few else len(stamp):] = False
    return np.maximum.accumulate(np.where(by_stamp, stamp + clock.lag, arrival))


def one_clock(collectors: Dict[str, Any]) -> Tuple[float, List[str]]:
    """Correct the arrivals and stamps of the collectors ({field of RunData: Collector}) as if no
    clock had been set. Returns (the last arrival [s], a sentence each time that one was set)."""
    filled = [each for each in collectors.values() if len(each.arrival)]
    number = np.concatenate([each.number for each in filled])
    order = np.argsort(number, kind='stable')
    number = number[order]
    arrival = np.concatenate([each.arrival for each in filled])[order]
    topic = np.repeat(np.arange(len(filled)), [len(each.arrival) for each in filled])[order]
    found: List[Tuple[int, float]] = []
    sensors = [collectors[part] for part in ('odometry', 'imu')]
    while len(found) <= MOST_SET:
        at = _set_back(arrival, topic)
        jump = math.nan if at is None else arrival[at] - arrival[at - 1]
        if at is None:
            at, jump = _set_forward(arrival, number, sensors)
        if at is None:
            break
        arrival[at:] -= jump
        found.append((at, jump))
        for each in filled:
            _correct(each, number[at], jump)
    if len(found) > MOST_SET:
        raise ValueError(f'its clock was set more than {MOST_SET} times')
    return float(arrival.max()), [
        'the clock was set {} by {}, {:.1f} s after the start; times go on without the jump'.format(
            'forward' if jump > 0.0 else 'back', _amount(abs(jump)), arrival[at])
        for at, jump in sorted(found)]


def _set_back(arrival: np.ndarray, topic: np.ndarray) -> Optional[int]:
    """Returns the index of the first message after the clock was first set back, or None. A file
    may hold one topic behind another: only the arrivals of one topic must be in order."""
    by_topic = np.argsort(topic, kind='stable')
    is_back = (np.diff(arrival[by_topic]) < -SET_BACK) & (np.diff(topic[by_topic]) == 0)
    if not is_back.any():
        return None
    hit = int(by_topic[1:][is_back].min())
    is_low = arrival[:hit + 1] < np.maximum.accumulate(arrival[:hit + 1]) - SET_BACK
    return hit + 1 - int(np.argmin(is_low[::-1]))


def _set_forward(arrival: np.ndarray, number: np.ndarray,
                 sensors: List[Any]) -> Tuple[Optional[int], float]:
    """Returns (the index of the first message after the clock was set forward, by how much [s]);
    (None, 0.0) if it was not."""
    steps = np.diff(arrival)
    for before in np.flatnonzero(steps > LATE)[:MOST_OUTAGES]:
        step = float(steps[before])
        if step > LONGEST_OUTAGE:
            return int(before) + 1, step
        for each in sensors:
            by = _lag_change(each, number[before + 1], arrival[before], arrival[before + 1])
            if LATE < by < step + SAME_CLOCK:
                return int(before) + 1, by
    return None, 0.0


def _lag_change(sensor: Any, number: int, last: float, first: float) -> float:
    """Returns by how much the arrivals of a sensor came later than its stamps say, after the
    message with this number. Those that waited in a queue come late, too: the quickest decide."""
    at, lag, is_later = sensor.arrival, sensor.arrival - sensor.stamp, sensor.number >= number
    before = lag[~is_later & (at > last - LAG_WINDOW)]
    later = lag[is_later & (at < first + LAG_WINDOW)]
    return float(later.min() - np.median(before)) if len(before) and len(later) else 0.0


def _correct(collector: Any, number: int, jump: float) -> None:
    """Take `jump` [s] from the arrivals from message `number` on; also from the stamps, if the
    sender's clock was set with the recorder's."""
    arrival, stamp = collector.arrival, collector.stamp
    lag, is_later = arrival - stamp, collector.number >= number
    arrival[is_later] -= jump
    usual = np.median(lag[~is_later]) if not is_later.all() else 0.0
    if is_later.any() and abs(np.median(lag[is_later]) - usual) < abs(jump) / 2.0:
        # a message may be sent before its clock was set, and arrive after it
        stamp[is_later & (np.abs(lag - jump - usual) > abs(jump) / 4.0)] -= jump


def _amount(seconds: float) -> str:
    if seconds < 7200.0:
        return f'{seconds:.1f} s'
    hours = seconds / 3600.0
    return f'{hours:.1f} h' if hours < 48.0 else f'{hours / 24.0:.0f} days'
