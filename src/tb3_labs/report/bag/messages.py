"""Makes the samples of each topic from the messages of a recording.

At a reset, a node of the Transformation lab prints ``Local pose set to x=..., y=..., yaw=...``. The
handout's node prints the yaw in radians, other nodes print degrees. A yaw is in degrees if ``deg``
or a degree sign follows the number, or if the number is larger than a whole turn in radians.

Units: metres, radians, seconds since the recording's start on the recorder's clock.
"""
import math
import re
import struct
import sys
from dataclasses import dataclass, fields
from typing import Dict, Optional

import genpy
import numpy as np

from tb3_labs.geometry.angles import WHOLE_TURN, wrap, yaw_from_quaternion
from tb3_labs.geometry.arrays import yaws_from_quaternions
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.bag.clock import times_on_recorders_clock
from tb3_labs.report.run_data import (
    LogLines, MouseSamples, Numbers, OdometrySamples, Orientations, Poses, States, Twists,
    Variables)

#: The level of a log line for each value of rosgraph_msgs/Log.
LEVELS = {1: 'debug', 2: 'info', 4: 'warning', 8: 'error', 16: 'fatal'}

#: The line of a reset. Two neighbouring parts of this expression never match the same character, so
#: the search is fast even in a line of thousands of blanks.
NUMBER = r'([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)'
RESET_LINE = re.compile(
    r'local pose (?:set|reset) to\W*x\s*[=:]\s*{0}(?:\s*m)?\W+y\s*[=:]\s*{0}(?:\s*m)?\W+'
    r'(?:yaw|theta)\s*[=:]\s*{0}\s*(deg|\N{{DEGREE SIGN}})?'.format(NUMBER), re.IGNORECASE)
#: Only this many characters of a line are searched for a reset.
MAX_RESET_LENGTH = 500
#: A sample with a larger number is invalid [m, rad, m/s, rad/s]. The firmware's spikes are below
#: 1000 rad/s.
MAX_NUMBER = 1e5
#: The bytes of a message's stamp, and the bytes of a header without the name of its frame.
STAMP, HEADER_SIZE = slice(4, 12), 16


def declared_by(line: str) -> Optional[Pose2]:
    """Returns the robot's pose in ``local`` that the line of a reset declares; None for any other
    line."""
    found = RESET_LINE.search(line[:MAX_RESET_LENGTH])
    if found is None:
        return None
    x, y, yaw = (float(word) for word in found.groups()[:3])
    if not math.isfinite(x + y + yaw):      # a number like 1e999
        return None
    if found.group(4) is not None or abs(yaw) > WHOLE_TURN:
        yaw = math.radians(yaw)
    return Pose2(x, y, wrap(yaw))


def resets_in(log: LogLines) -> Poses:
    """Returns the poses that the lines of a log declare."""
    poses = [declared_by(text) for text in log.texts]
    lines = log.take([k for k, pose in enumerate(poses) if pose is not None])
    rows = [(pose.x, pose.y, pose.yaw) for pose in poses if pose is not None]
    return Poses(lines.arrival, lines.time, *np.array(rows).reshape(-1, 3).T)


@dataclass(frozen=True)
class Layout:
    """The layout of messages that end with `size` numbers of 8 bytes each. `index` has the index of
    the number for each field of the samples, apart from the yaw. The numbers from the index
    `quaternion` on are x, y, z, w."""

    size: int
    index: Dict[str, int]
    quaternion: Optional[int] = None
    has_header: bool = True


POSE = Layout(7, {'x': 0, 'y': 1}, 3)
#: {field of RunData: (class of its samples, layout of its messages)}
LAYOUTS = {
    'imu': (Orientations, Layout(37, {'x': 0, 'y': 1, 'z': 2, 'w': 3, 'yaw_rate': 15}, 0)),
    'odometry': (OdometrySamples, Layout(85, {'x': 0, 'y': 1, 'linear': 43, 'angular': 48}, 3)),
    'commands': (Twists, Layout(6, {
        'linear': 0, 'sideways': 1, 'upward': 2, 'rolling': 3, 'pitching': 4, 'angular': 5},
        has_header=False)),
    'local_pose': (Poses, POSE), 'ground_truth': (Poses, POSE), 'goals': (Poses, POSE),
    'resets': (Poses, Layout(43, POSE.index, 3))}      # with a covariance
#: No wheel follows these parts of a command. So a command is kept, whatever they are.
IGNORED_SPEEDS = 'sideways', 'upward', 'rolling', 'pitching'


def _rows_of_frames(message, prefix):
    for each in message.transforms:
        if each.child_frame_id.strip('/') == (prefix + 'local').strip('/'):
            place, q = each.transform.translation, each.transform.rotation
            yield each.header, place.x, place.y, yaw_from_quaternion(w=q.w, x=q.x, y=q.y, z=q.z)


def _rows_of_log(message, prefix):
    if message.name.startswith(prefix):
        yield message.header, LEVELS.get(message.level, ''), message.name, message.msg


def _rows_of_variables(message, prefix):
    for status in message.status:
        for each in status.values:
            yield None, status.name, sys.intern(each.key), each.value


def _row_of_text(message, prefix):
    yield None, message.data


#: {field of RunData: (class of its samples, function)} for messages of other layouts.
#: ``function(message, prefix)`` yields a row for each sample of the robot in the namespace
#: `prefix`. A row has the header with the stamp, or None, and the values of the sample.
ROWS = {
    'states': (States, _row_of_text), 'events': (States, _row_of_text),
    'printed': (States, _row_of_text), 'frames': (Poses, _rows_of_frames),
    'log': (LogLines, _rows_of_log), 'variables': (Variables, _rows_of_variables),
    'turn_requests': (Numbers, lambda message, prefix: [(None, math.radians(message.data))]),
    'control': (Numbers, lambda message, prefix: [(None, float(message.data))]),
    'mouse': (MouseSamples, lambda message, prefix: [
        (message.header, message.xPos, message.yPos, float(message.status.data))])}


class Table:
    """The samples of a topic: `arrival`, `stamp`, `columns`. `dropped` is the number of messages
    that were invalid."""

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
        columns = {name: numbers[index] for name, index in layout.index.items()}
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
                found = [*rows_of(message)]
            except (genpy.DeserializationError, struct.error, ValueError):
                self.dropped += 1
                continue
            for header, *row in found:
                stamp = at
                if header is not None:
                    stamp = self._seconds(header.stamp.secs, header.stamp.nsecs)
                times.append((at, stamp))
                rows.append(row)
        self.arrival, self.stamp = np.array(times).reshape(-1, 2).T
        width = len(fields(self.kind)) - 2
        kind = object if self.kind in (States, LogLines, Variables) else float
        self.columns = [*np.array(rows, kind).reshape(-1, width).T]

    def _seconds(self, seconds, nanoseconds):
        # first the difference: a float of the seconds since 1970 has steps of 0.2 us
        return (seconds - self._start) + 1e-9 * nanoseconds

    def _drop_invalid(self):
        """Drop the samples with a number that is NaN or too large."""
        numbers = [column for column in self.columns if column.dtype != object]
        is_valid = np.ones(len(self.arrival), bool)
        for column in numbers:
            is_valid &= np.abs(column) < MAX_NUMBER
        if not is_valid.all():
            self.dropped += int((~is_valid).sum())
            self.arrival, self.stamp = self.arrival[is_valid], self.stamp[is_valid]
            self.columns = [column[is_valid] for column in self.columns]

    def samples(self, robot_clock):
        """Returns the samples. `robot_clock` is the odometry's RecordedClock."""
        time = times_on_recorders_clock(self.arrival, self.stamp, robot_clock)
        return self.kind(self.arrival, time, *self.columns)
