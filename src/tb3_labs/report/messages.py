"""The messages of a recording: which topics it has, and how their bytes become samples.

Each topic has a collector. The collector unpacks only the fields that are needed: a recording of an
hour holds a million messages, and to make an object of each would take minutes.

The Transformation lab asks for a line ``Local pose set to x=..., y=..., yaw=...`` at each reset.
The handout prints the yaw in radians; other nodes print degrees. A yaw counts as degrees if
``deg`` or a degree sign follows, or if its number is more than a whole turn in radians.

Units: metres, radians, seconds since the recording's start on the recorder's clock.
"""
import math
import re
import struct
from array import array
from dataclasses import dataclass
from typing import Optional

import numpy as np

from tb3_labs.geometry.angles import TURN, wrap
from tb3_labs.geometry.quaternions import yaws_from_quaternions
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.run_data import (
    Commands, ImuSamples, LogLines, OdometrySamples, Poses, States, Values)

#: The recorded topics: names in the robot's namespace, and names of the whole system.
RECORDED = ('imu', 'odom', 'cmd_vel', 'heading', 'ground_truth', 'local_pose', 'goal_state',
            'current_goal', 'ctrl_relinq', 'control_holder', 'joy', 'turn', 'mouse_info', 'reset',
            'initialpose', '/rosout', '/tf', '/tf_static', '/diagnostics')

#: The levels of log lines, by the bits of rosgraph_msgs/Log.
LEVELS = {1: 'debug', 2: 'info', 4: 'warning', 8: 'error', 16: 'fatal'}

#: Layouts of messages, or of their parts.
HEADER = struct.Struct('<4xIII')                # seq, secs, nsecs, length of frame_id
LENGTH = struct.Struct('<I')
ORIENTATION_RATE = struct.Struct('<4d88xd')     # x, y, z, w; covariance; angular_velocity.z
POSE_SPEEDS = struct.Struct('<2d8x4d288xd32xd')  # x, y; x, y, z, w; covariance; as in SPEEDS
PLACE_ORIENTATION = struct.Struct('<2d8x4d')    # x, y; x, y, z, w
SPEEDS = struct.Struct('<d32xd')                # linear.x, angular.z
DEGREES, SWITCH = struct.Struct('<d'), struct.Struct('<?')

#: The line of a reset.
NUMBER = r'([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)'
RESET_LINE = re.compile(
    r'local pose (?:set|reset) to\W*x\s*[=:]\s*{0}\s*m?\W+y\s*[=:]\s*{0}\s*m?\W+'
    r'(?:yaw|theta)\s*[=:]\s*{0}\s*(deg|\N{{DEGREE SIGN}})?'.format(NUMBER), re.IGNORECASE)

#: If the clocks of two senders differ by less than this, the senders share one clock [s].
SAME_CLOCK = 0.1
#: A message is late if it comes this much later than others [s]. No recorder is busy for longer
#: than TOO_LATE [s].
LATE, TOO_LATE = 0.5, 10.0
#: A sender's clock can be used if at least this fraction of its messages is in time.
IN_TIME = 0.25
#: If more than this fraction of the messages, all of them at the begin or at the end of the
#: recording, is not in time, the sender's clock was set.
OTHER_CLOCK = 0.1


@dataclass(frozen=True)
class SenderClock:
    """A sender's clock, by the stamps of its messages: `lag` [s] behind the recorder's clock."""

    lag: float
    stamps: np.ndarray

    @classmethod
    def of(cls, arrival: np.ndarray, stamp: np.ndarray) -> 'SenderClock':
        """Returns the clock by the fastest messages, without outliers. It needs one message."""
        lags = np.sort(arrival - stamp)
        lags = lags[np.abs(lags - lags[(len(lags) - 1) // 2]) < LATE]
        return cls(float(lags[len(lags) // 20]), stamp)

    def is_same_as(self, other: 'SenderClock') -> bool:
        """Do both senders share one clock, or does one copy the other's stamps?"""
        shared = np.isin(np.round(self.stamps, 6), np.round(other.stamps, 6))
        return abs(self.lag - other.lag) < SAME_CLOCK or shared.mean() > 0.5


def times_on_recorders_clock(arrival: np.ndarray, stamp: np.ndarray,
                             robot_clock: Optional[SenderClock]) -> np.ndarray:
    """Returns the sender's times on the recorder's clock [s]; they never run back.

    `robot_clock` is the odometry's SenderClock, or None. It is used for all senders that share this
    clock, so that their stamps stay comparable to the microsecond. Messages come late while the
    recorder is busy, and early while its simulated clock stands still: their stamps count. If all
    messages before some moment, or all after it, are not in time, the sender's clock was set: their
    arrivals count.
    """
    if not len(stamp):
        return arrival
    clock = SenderClock.of(arrival, stamp)
    if robot_clock is not None and clock.is_same_as(robot_clock):
        clock = robot_clock
    delay = np.abs(arrival - stamp - clock.lag)
    in_time, few = np.flatnonzero(delay < LATE), OTHER_CLOCK * len(stamp)
    if len(in_time) < IN_TIME * len(stamp):
        return np.maximum.accumulate(arrival)
    first, last = in_time[0], in_time[-1]
    by_stamp = delay < TOO_LATE
    by_stamp[:first if first > few else 0] = False
    by_stamp[last + 1 if len(stamp) - 1 - last > few else len(stamp):] = False
    return np.maximum.accumulate(np.where(by_stamp, stamp + clock.lag, arrival))


def declared_by(line: str) -> Optional[Pose2]:
    """Returns the declared pose of the robot in ``local``; None if the line tells no reset."""
    found = RESET_LINE.search(line)
    if found is None:
        return None
    x, y, yaw = (float(word) for word in found.groups()[:3])
    in_degrees = found.group(4) is not None or abs(yaw) > TURN
    return Pose2(x, y, wrap(math.radians(yaw) if in_degrees else yaw))


def resets_in(log: LogLines) -> Poses:
    """Returns the poses that were declared by resets, as the log lines tell them."""
    said = [(k, pose) for k, pose in enumerate(map(declared_by, log.texts)) if pose is not None]
    lines = log.take([k for k, _ in said])
    return Poses(lines.arrival, lines.time,
                 *np.array([(pose.x, pose.y, pose.yaw) for _, pose in said]).reshape(-1, 3).T)


def make_collectors(kinds, prefix):
    """Returns {field of RunData: collector} for the robot in the namespace `prefix`. `kinds` is
    {field: message type}."""
    special = {
        'imu': lambda: _Collector(ImuSamples, ORIENTATION_RATE, _imu_columns),
        'odometry': lambda: _Collector(OdometrySamples, POSE_SPEEDS, _pose_columns, strings=2),
        'commands': lambda: _Collector(Commands, SPEEDS, strings=0),
        'states': _StateCollector,
        'asked': lambda: _Collector(
            Values, DEGREES, lambda degrees: (np.radians(degrees),), strings=0),
        'control': lambda: _Collector(Values, SWITCH, strings=0),
        'presses': _PressCollector,
        'frames': lambda: _FrameCollector((prefix + 'local').strip('/')),
        'log': lambda: _LogCollector(prefix)}
    return {part: special[part]() if part in special else _Collector(
        Poses, PLACE_ORIENTATION, _pose_columns) for part in kinds}


def _imu_columns(x, y, z, w, rate):
    return yaws_from_quaternions(w=w, x=x, y=y, z=z), rate


def _pose_columns(x, y, qx, qy, qz, qw, *speeds):
    return (x, y, yaws_from_quaternions(w=qw, x=qx, y=qy, z=qz)) + speeds


class _Collector:
    """Gathers one topic's numbers, row after row.

    `columns` turns these numbers into the columns of the samples. `strings`: the number of strings
    before the numbers in a message, with the string in the header; 0 if there is no header.
    """

    def __init__(self, kind, layout, columns=lambda *numbers: numbers, strings=1):
        self._kind, self._layout, self._columns, self._strings = kind, layout, columns, strings
        self.arrival, self.stamp, self.rows, self.bad = array('d'), array('d'), array('d'), 0

    def add(self, data, arrival, start):
        """Take in a serialized message; times in seconds since `start`."""
        try:
            stamp, offset = arrival, 0
            if self._strings:
                secs, nsecs, length = HEADER.unpack_from(data)
                stamp, offset = (secs - start) + 1e-9 * nsecs, 16 + length
                for _ in range(self._strings - 1):
                    offset += 4 + LENGTH.unpack_from(data, offset)[0]
            row = self._layout.unpack_from(data, offset)
        except struct.error:
            self.bad += 1
            return
        self.keep(row, arrival, stamp)

    def keep(self, row, arrival, stamp):
        """Append the numbers of one sample."""
        self.rows.extend(row)
        self.arrival.append(arrival)
        self.stamp.append(stamp)

    def samples(self, robot_clock):
        """Returns the gathered samples, without samples that have a NaN or infinite number."""
        arrival, stamp = np.array(self.arrival), np.array(self.stamp)
        width = len(self._layout.unpack(bytes(self._layout.size)))
        columns = self._columns(*np.array(self.rows).reshape(-1, width).T)
        good = np.logical_and.reduce([np.isfinite(column) for column in columns])
        self.bad += int(np.count_nonzero(~good))
        arrival, stamp = arrival[good], stamp[good]
        return self._kind(arrival, times_on_recorders_clock(arrival, stamp, robot_clock),
                          *(column[good] for column in columns))


class _StateCollector:
    def __init__(self):
        self.arrival, self.words, self.bad = [], [], 0

    def add(self, data, arrival, start):
        self.words.append(data[4:].decode('utf-8', 'replace'))
        self.arrival.append(arrival)

    def samples(self, robot_clock):
        arrival = np.array(self.arrival)
        return States(arrival, arrival, np.array(self.words, dtype=object))


class _FrameCollector(_Collector):
    """Gathers the pose of ``local`` in ``odom`` from all transforms."""

    def __init__(self, child):
        super().__init__(Poses, PLACE_ORIENTATION, _pose_columns)
        self._child = child.encode()

    def add(self, data, arrival, start):
        offset = 4
        for _ in range(LENGTH.unpack_from(data)[0]):
            secs, nsecs, length = HEADER.unpack_from(data, offset)
            name, numbers = _text(data, offset + 16 + length)
            if name.lstrip(b'/') == self._child:
                self.keep(PLACE_ORIENTATION.unpack_from(data, numbers), arrival,
                          (secs - start) + 1e-9 * nsecs)
            offset = numbers + 56


class _PressCollector(_Collector):
    """The number of each button of a pad, whenever it goes down."""

    def __init__(self):
        super().__init__(Values, DEGREES, strings=0)
        self._held = set()

    def add(self, data, arrival, start):
        try:
            axes = 16 + HEADER.unpack_from(data)[2]
            buttons = axes + 4 + 4 * LENGTH.unpack_from(data, axes)[0]
            count, = LENGTH.unpack_from(data, buttons)
            states = struct.unpack_from('<{}i'.format(count), data, buttons + 4)
        except struct.error:
            self.bad += 1
            return
        held = {number for number, is_down in enumerate(states) if is_down}
        for number in sorted(held - self._held):
            self.keep((float(number),), arrival, arrival)
        self._held = held


class _LogCollector(_Collector):
    """The log lines of the nodes in one namespace."""

    def __init__(self, prefix):
        super().__init__(LogLines, struct.Struct(''))
        self._prefix, self._lines = prefix.encode(), []

    def add(self, data, arrival, start):
        secs, nsecs, length = HEADER.unpack_from(data)
        level = 16 + length                         # after the frame's name
        node, offset = _text(data, level + 1)
        if node.startswith(self._prefix):
            words = (part.decode('utf-8', 'replace') for part in (node, _text(data, offset)[0]))
            self._lines.append((LEVELS.get(data[level], ''), *words))
            self.keep((), arrival, (secs - start) + 1e-9 * nsecs)

    def samples(self, robot_clock):
        arrival = np.array(self.arrival)
        columns = np.array(self._lines, dtype=object).reshape(-1, 3).T
        return LogLines(arrival, times_on_recorders_clock(arrival, np.array(self.stamp),
                                                          robot_clock), *columns)


def _text(data, offset):
    """(text, offset of the next field)."""
    begin = offset + 4
    end = begin + LENGTH.unpack_from(data, offset)[0]
    return data[begin:end], end
