"""The messages of a recording: which topics it has, and how their bytes become samples.

There is one collector for each topic. It unpacks only the fields that are needed: a recording of an
hour holds a million messages, and an object for each would take minutes.

The Transformation lab asks for a line ``Local pose set to x=..., y=..., yaw=...`` at each reset.
The handout prints the yaw in radians; other nodes print degrees. It counts as degrees if ``deg`` or
a degree sign follows, or if it is more than a whole turn in radians.

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
    Commands, ImuSamples, OdometrySamples, Poses, States, Values)

#: The recorded topics: names in the robot's namespace, and names of the whole system.
RECORDED = ('imu', 'odom', 'cmd_vel', 'heading', 'ground_truth', 'local_pose', 'goal_state',
            'current_goal', 'ctrl_relinq', 'control_holder', 'joy', 'turn', 'mouse_info', 'reset',
            'initialpose', '/rosout', '/tf', '/tf_static', '/diagnostics')

#: The type of /rosout's messages.
LOG = 'rosgraph_msgs/Log'

#: Layouts of messages, or of their parts.
HEADER = struct.Struct('<4xIII')                # seq, secs, nsecs, length of frame_id
LENGTH = struct.Struct('<I')
ORIENTATION_RATE = struct.Struct('<4d88xd')     # x, y, z, w; covariance; angular_velocity.z
POSE_SPEEDS = struct.Struct('<2d8x4d288xd32xd')  # x, y; x, y, z, w; covariance; as in SPEEDS
PLACE_ORIENTATION = struct.Struct('<2d8x4d')    # x, y; x, y, z, w
SPEEDS = struct.Struct('<d32xd')                # linear.x, angular.z
DEGREES, SWITCH = struct.Struct('<d'), struct.Struct('<?')
POSE_OF_LINE = struct.Struct('<3d')             # as a reset's line says it: x, y, yaw

#: The line of a reset.
NUMBER = r'([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)'
RESET_LINE = re.compile(
    r'local pose (?:set|reset) to\W*x\s*[=:]\s*{0}\s*m?\W+y\s*[=:]\s*{0}\s*m?\W+'
    r'(?:yaw|theta)\s*[=:]\s*{0}\s*(deg|\N{{DEGREE SIGN}})?'.format(NUMBER), re.IGNORECASE)

#: Two senders whose clocks differ by less than this share one [s].
SAME_CLOCK = 0.1
#: A message that comes this much later than others is late [s]; no recorder is busy for longer than
#: the second of these [s].
LATE, TOO_LATE = 0.5, 10.0
#: A sender's clock can be used if at least this fraction of its messages is in time.
IN_TIME = 0.25
#: The clock was set if more than this fraction of the messages is not in time, all up to one or all
#: from one on.
OTHER_CLOCK = 0.1


@dataclass(frozen=True)
class SenderClock:
    """The clock of messages' stamps: it is `lag` [s] behind the recorder's."""

    lag: float
    stamps: np.ndarray

    @classmethod
    def of(cls, arrival: np.ndarray, stamp: np.ndarray) -> 'SenderClock':
        """The clock by the fastest messages except outliers; at least one message is needed."""
        lags = np.sort(arrival - stamp)
        lags = lags[np.abs(lags - lags[(len(lags) - 1) // 2]) < LATE]
        return cls(float(lags[len(lags) // 20]), stamp)

    def is_same_as(self, other: 'SenderClock') -> bool:
        """Do both senders share one clock, or does one copy the other's stamps?"""
        shared = np.isin(np.round(self.stamps, 6), np.round(other.stamps, 6))
        return abs(self.lag - other.lag) < SAME_CLOCK or shared.mean() > 0.5


def times_on_recorders_clock(arrival: np.ndarray, stamp: np.ndarray,
                             robot_clock: Optional[SenderClock]) -> np.ndarray:
    """The sender's times on the recorder's clock [s], never running back.

    `robot_clock`, the odometry's SenderClock or None, is used for all senders that share it, so
    that their stamps stay comparable to the microsecond. Messages come late while the recorder is
    busy, and early while its simulated clock stands still; their stamps count. But if no message is
    in time up to some moment, or from then on, the sender's clock was set, and the arrivals count.
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
    """The declared pose of the robot in ``local``, or None if the line is not that of a reset."""
    found = RESET_LINE.search(line)
    if found is None:
        return None
    x, y, yaw = (float(word) for word in found.groups()[:3])
    in_degrees = found.group(4) is not None or abs(yaw) > TURN
    return Pose2(x, y, wrap(math.radians(yaw) if in_degrees else yaw))


def make_collectors(kinds, prefix):
    """{RunData's field: collector} for the fields in `kinds`, {field: message type}, of the robot
    in the namespace `prefix`."""
    special = {
        'imu': lambda: _Collector(ImuSamples, ORIENTATION_RATE, _imu_columns),
        'odometry': lambda: _Collector(OdometrySamples, POSE_SPEEDS, _pose_columns, strings=2),
        'commands': lambda: _Collector(Commands, SPEEDS, strings=0),
        'states': _StateCollector,
        'asked': lambda: _Collector(
            Values, DEGREES, lambda degrees: (np.radians(degrees),), strings=0),
        'control': lambda: _Collector(Values, SWITCH, strings=0),
        'frames': lambda: _FrameCollector((prefix + 'local').strip('/'))}
    if kinds.get('resets') == LOG:
        special['resets'] = lambda: _ResetLineCollector(prefix)
    return {part: special[part]() if part in special else _Collector(
        Poses, PLACE_ORIENTATION, _pose_columns) for part in kinds}


def _imu_columns(x, y, z, w, rate):
    return yaws_from_quaternions(w=w, x=x, y=y, z=z), rate


def _pose_columns(x, y, qx, qy, qz, qw, *speeds):
    return (x, y, yaws_from_quaternions(w=qw, x=qx, y=qy, z=qz)) + speeds


class _Collector:
    """Gathers one topic's numbers, row after row.

    `columns` makes those of the samples. `strings` stand in the message before the numbers, the
    first one in the header; 0 if there is no header.
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
        """The samples gathered, without those in which a number is not finite."""
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
    """The pose of ``local`` in ``odom``, out of all transforms."""

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


class _ResetLineCollector(_Collector):
    """The poses that nodes of one namespace say they were reset to, out of all log lines."""

    def __init__(self, prefix):
        super().__init__(Poses, POSE_OF_LINE)
        self._prefix = prefix.encode()

    def add(self, data, arrival, start):
        secs, nsecs, length = HEADER.unpack_from(data)
        node, offset = _text(data, 17 + length)     # after the frame's name and the level
        line, _ = _text(data, offset)
        pose = declared_by(line.decode('utf-8', 'replace'))
        if pose is not None and node.startswith(self._prefix):
            self.keep((pose.x, pose.y, pose.yaw), arrival, (secs - start) + 1e-9 * nsecs)


def _text(data, offset):
    """(text, offset of the next field)."""
    begin = offset + 4
    end = begin + LENGTH.unpack_from(data, offset)[0]
    return data[begin:end], end
