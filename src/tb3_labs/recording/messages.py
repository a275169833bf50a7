"""Makes the samples of each topic from the messages of a recording.

The times of all samples are converted to one clock, the recorder's clock.
Units: metres, radians, seconds since the recording's start on the recorder's clock.
"""
import math
import struct
import sys
from dataclasses import dataclass, fields
from typing import Dict, Optional

import genpy
import numpy as np

from tb3_labs.geometry.angles import yaw_from_quaternion
from tb3_labs.geometry.arrays import yaws_from_quaternions
from tb3_labs.recording.run_data import (
    Commands, ImuSamples, LogLines, MouseSamples, Numbers, OdometrySamples, Poses, States,
    Variables)
from tb3_labs.watch.printed_pose import declared_by

#: The level of a log line for each value of rosgraph_msgs/Log.
LEVELS = {1: 'debug', 2: 'info', 4: 'warning', 8: 'error', 16: 'fatal'}

#: A sample with a larger number is invalid [m, rad, m/s, rad/s]. The firmware's spikes are below
#: 1000 rad/s.
MAX_NUMBER = 1e5
#: The bytes of a message's stamp, and the bytes of a header without the name of its frame.
STAMP, HEADER_SIZE = slice(4, 12), 16

#: Two senders share one clock if their clocks differ by less than this [s].
SAME_CLOCK = 0.1
#: A message is late if its delay differs from its sender's usual delay by more than this [s].
LATE_BY = 0.5
#: No recorder is busy for longer than this. If the delay of a message is longer, its stamp is
#: ignored [s].
MAX_BELIEVED_DELAY = 10.0
#: A sender's stamps are used if at least this share of its messages is not late.
MIN_IN_TIME_SHARE = 0.25


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
        median = lags[(len(lags) - 1) // 2]
        lags = lags[np.abs(lags - median) < LATE_BY]
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
    if (delay < LATE_BY).mean() < MIN_IN_TIME_SHARE:
        return np.maximum.accumulate(arrival)
    by_stamp = delay < MAX_BELIEVED_DELAY
    return np.maximum.accumulate(np.where(by_stamp, stamp + clock.lag, arrival))


@dataclass(frozen=True)
class Layout:
    """The layout of messages that end with `size` numbers of 8 bytes each. Names of frames may
    precede the numbers. `index` gives the index of the number for each field of the samples,
    apart from the yaw. The numbers from the index `quaternion` on are x, y, z, w."""

    size: int
    index: Dict[str, int]
    quaternion: Optional[int] = None
    has_header: bool = True


POSES = Poses, Layout(7, {'x': 0, 'y': 1}, 3)
#: {field of RunData: (class of its samples, layout of its messages)}
LAYOUTS = {
    'imu': (ImuSamples, Layout(37, {'x': 0, 'y': 1, 'z': 2, 'w': 3, 'yaw_rate': 15}, 0)),
    'odometry': (OdometrySamples, Layout(85, {'x': 0, 'y': 1, 'linear': 43, 'angular': 48}, 3)),
    'commands': (Commands, Layout(6, {
        'linear': 0, 'sideways': 1, 'upward': 2, 'rolling': 3, 'pitching': 4, 'angular': 5},
        has_header=False)),
    'local_pose': POSES, 'ground_truth': POSES, 'goals': POSES}
#: No wheel follows these parts of a command. So a command is kept, whatever they are.
IGNORED_SPEEDS = 'sideways', 'upward', 'rolling', 'pitching'


def _rows_of_frames(message, prefix):
    for each in message.transforms:
        if each.child_frame_id.strip('/') == (prefix + 'local').strip('/'):
            place, q = each.transform.translation, each.transform.rotation
            yaw = yaw_from_quaternion(w=q.w, x=q.x, y=q.y, z=q.z)
            return each.header, [(place.x, place.y, yaw)]
    return None, []


def _rows_of_log(message, prefix):
    if not message.name.startswith(prefix):
        return None, []
    return message.header, [(LEVELS.get(message.level, ''), message.name, message.msg)]


def _rows_of_variables(message, prefix):
    return message.header, [(status.name, sys.intern(each.key), each.value)
                            for status in message.status for each in status.values]


def _rows_of_mouse(message, prefix):
    return message.header, [(message.xPos, message.yPos, float(message.status.data))]


def _rows_of_text(message, prefix):
    return None, [(message.data,)]


#: {field of RunData: (class of its samples, function)} for messages of other layouts.
#: ``function(message, prefix)`` returns the header with the stamp, or None, and a row of values for
#: each sample of the robot in the namespace `prefix`.
ROWS = {
    'states': (States, _rows_of_text), 'events': (States, _rows_of_text),
    'printed': (States, _rows_of_text), 'frames': (Poses, _rows_of_frames),
    'log': (LogLines, _rows_of_log), 'variables': (Variables, _rows_of_variables),
    'mouse': (MouseSamples, _rows_of_mouse),
    'turn_requests': (Numbers, lambda message, prefix: (None, [(math.radians(message.data),)])),
    'control': (Numbers, lambda message, prefix: (None, [(float(message.data),)]))}


class Table:
    """The samples of a topic: the arrays `arrival` and `stamp`, and an array for each field of the
    class `kind` in `columns`. `dropped` is the number of invalid samples and messages."""

    def __init__(self, part, made, prefix, start, arrival, messages):
        """`part` is a field of RunData, `made` the class of the messages, and `prefix` the robot's
        namespace. `start` is the arrival of the first message [s since 1970]."""
        self._start = start
        self.dropped = 0
        if part in LAYOUTS:
            self.kind, layout = LAYOUTS[part]
            self._read_numbers(layout, arrival, messages)
        else:
            self.kind, rows_of = ROWS[part]
            self._read_rows(made(), lambda message: rows_of(message, prefix), arrival, messages)
        self._drop_invalid()

    def _read_numbers(self, layout, arrival, messages):
        size = 8 * layout.size
        least = size + HEADER_SIZE * layout.has_header
        is_whole = np.array([len(message) >= least for message in messages], bool)
        whole = [message for message in messages if len(message) >= least]
        self.dropped += len(messages) - len(whole)
        self.arrival = self.stamp = arrival[is_whole]
        if layout.has_header:
            stamps = np.frombuffer(b''.join([message[STAMP] for message in whole]), '<u4')
            self.stamp = self._seconds(stamps[::2], stamps[1::2])
        numbers = np.frombuffer(b''.join([message[-size:] for message in whole]), '<f8')
        numbers = numbers.reshape(-1, layout.size).T
        columns = {name: numbers[index].copy() for name, index in layout.index.items()}
        if layout.quaternion is not None:
            x, y, z, w = numbers[layout.quaternion:layout.quaternion + 4]
            columns['yaw'] = yaws_from_quaternions(w, x, y, z)
        for name in set(columns) & set(IGNORED_SPEEDS):
            speeds = np.where(np.isnan(columns[name]), MAX_NUMBER, columns[name])
            columns[name] = speeds.clip(-MAX_NUMBER / 2.0, MAX_NUMBER / 2.0)
        self.columns = [columns[each.name] for each in fields(self.kind)[2:]]

    def _read_rows(self, message, rows_of, arrival, messages):
        """Read the messages, one after the other, into the same `message`."""
        rows, times = [], []
        for at, data in zip(arrival.tolist(), messages):
            try:
                message.deserialize(data)
                header, found = rows_of(message)
            except (genpy.DeserializationError, struct.error, ValueError):
                self.dropped += 1
                continue
            stamp = at
            if header is not None:
                stamp = self._seconds(header.stamp.secs, header.stamp.nsecs)
            times += [(at, stamp)] * len(found)
            rows += found
        self.arrival, self.stamp = np.array(times).reshape(-1, 2).T
        width = len(fields(self.kind)) - 2
        kind = object if self.kind in (States, LogLines, Variables) else float
        self.columns = [*np.array(rows, kind).reshape(-1, width).T]

    def _seconds(self, seconds, nanoseconds):
        # first the difference: a float of the seconds since 1970 has steps of 0.2 us
        return (seconds - self._start) + 1e-9 * nanoseconds

    def _drop_invalid(self):
        """Drop the samples with a number that is NaN or too large."""
        is_valid = np.ones(len(self.arrival), bool)
        for column in self.columns:
            if column.dtype != object:
                is_valid &= np.abs(column) < MAX_NUMBER
        self.dropped += int((~is_valid).sum())
        self.arrival, self.stamp = self.arrival[is_valid], self.stamp[is_valid]
        self.columns = [column[is_valid] for column in self.columns]

    def samples(self, robot_clock):
        """Returns the samples. `robot_clock` is the odometry's RecordedClock."""
        time = times_on_recorders_clock(self.arrival, self.stamp, robot_clock)
        return self.kind(self.arrival, time, *self.columns)


def resets_in(log: LogLines) -> Poses:
    """Returns the poses that the lines of a log declare."""
    poses = [declared_by(text) for text in log.texts]
    lines = log.take([k for k, pose in enumerate(poses) if pose is not None])
    rows = [(pose.x, pose.y, pose.yaw) for pose in poses if pose is not None]
    return Poses(lines.arrival, lines.time, *np.array(rows).reshape(-1, 3).T)
