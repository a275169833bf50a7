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
from typing import Optional, Type

import numpy as np

from tb3_labs.geometry.angles import TURN, wrap
from tb3_labs.geometry.quaternions import yaws_from_quaternions
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.run_data import (
    Commands, ImuSamples, OdometrySamples, Poses, Samples, States, Values)

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
    special = {'imu': _ImuCollector, 'odometry': _OdometryCollector,
               'commands': _CommandCollector, 'states': _StateCollector,
               'asked': _AngleCollector, 'control': _SwitchCollector,
               'frames': lambda: _FrameCollector((prefix + 'local').strip('/'))}
    if kinds.get('resets') == LOG:
        special['resets'] = lambda: _ResetLineCollector(prefix)
    return {part: special.get(part, _PoseCollector)() for part in kinds}


class _Collector:
    """Gathers one topic's numbers, row after row. `strings` stand before them in a message."""

    kind: Type[Samples]
    layout: struct.Struct
    stamped, strings = True, 1

    def __init__(self):
        self.arrival, self.stamp, self.rows, self.bad = array('d'), array('d'), array('d'), 0

    def add(self, data, arrival, start):
        """Take in a serialized message; times in seconds since `start`."""
        try:
            stamp, offset = arrival, 0
            if self.stamped:
                secs, nsecs, length = HEADER.unpack_from(data)
                stamp, offset = (secs - start) + 1e-9 * nsecs, 16 + length
                for _ in range(self.strings - 1):
                    offset += 4 + LENGTH.unpack_from(data, offset)[0]
            row = self.layout.unpack_from(data, offset)
        except struct.error:
            self.bad += 1
            return
        self.rows.extend(row)
        self.arrival.append(arrival)
        self.stamp.append(stamp)

    def samples(self, robot_clock):
        """The samples gathered, without those in which a number is not finite."""
        arrival, stamp = np.array(self.arrival), np.array(self.stamp)
        width = len(self.layout.unpack(bytes(self.layout.size)))
        columns = self.columns(*np.array(self.rows).reshape(-1, width).T)
        good = np.logical_and.reduce([np.isfinite(column) for column in columns])
        self.bad += int(np.count_nonzero(~good))
        arrival, stamp = arrival[good], stamp[good]
        return self.kind(arrival, times_on_recorders_clock(arrival, stamp, robot_clock),
                         *(column[good] for column in columns))

    @staticmethod
    def columns(*numbers):
        """The columns of the samples, out of the numbers of the messages."""
        return numbers


class _ImuCollector(_Collector):
    kind, layout = ImuSamples, ORIENTATION_RATE

    @staticmethod
    def columns(x, y, z, w, rate):
        return yaws_from_quaternions(w=w, x=x, y=y, z=z), rate


class _PoseCollector(_Collector):
    kind: Type[Samples] = Poses
    layout = PLACE_ORIENTATION

    @staticmethod
    def columns(x, y, qx, qy, qz, qw, *more):
        return (x, y, yaws_from_quaternions(w=qw, x=qx, y=qy, z=qz)) + more


class _OdometryCollector(_PoseCollector):
    kind, layout, strings = OdometrySamples, POSE_SPEEDS, 2


class _CommandCollector(_Collector):
    kind, layout, stamped = Commands, SPEEDS, False


class _AngleCollector(_Collector):
    kind, layout, stamped = Values, DEGREES, False

    @staticmethod
    def columns(degrees):
        return np.radians(degrees),


class _SwitchCollector(_Collector):
    kind, layout, stamped = Values, SWITCH, False


class _StateCollector(_Collector):
    def __init__(self):
        super().__init__()
        self.words = []

    def add(self, data, arrival, start):
        self.words.append(data[4:].decode('utf-8', 'replace'))
        self.arrival.append(arrival)

    def samples(self, robot_clock):
        arrival = np.array(self.arrival)
        return States(arrival, arrival, np.array(self.words, dtype=object))


class _FrameCollector(_PoseCollector):
    """The pose of ``local`` in ``odom``, out of all transforms."""

    def __init__(self, child):
        super().__init__()
        self._child = child.encode()

    def add(self, data, arrival, start):
        offset = 4
        for _ in range(LENGTH.unpack_from(data)[0]):
            begin = offset
            length = LENGTH.unpack_from(data, begin + 12)[0]
            name = begin + 16 + length
            length = LENGTH.unpack_from(data, name)[0]
            numbers = name + 4 + length
            if data[name + 4:numbers].lstrip(b'/') == self._child:
                secs, nsecs, _ = HEADER.unpack_from(data, begin)
                self.rows.extend(PLACE_ORIENTATION.unpack_from(data, numbers))
                self.arrival.append(arrival)
                self.stamp.append((secs - start) + 1e-9 * nsecs)
            offset = numbers + 56


class _ResetLineCollector(_Collector):
    """The poses that nodes of one namespace say they were reset to, out of all log lines."""

    kind, layout = Poses, POSE_OF_LINE

    def __init__(self, prefix):
        super().__init__()
        self._prefix = prefix

    def add(self, data, arrival, start):
        secs, nsecs, length = HEADER.unpack_from(data)
        offset, words = 17 + length, []          # after the frame's name and the level
        for _ in range(2):                       # the node's name, and the line
            size, = LENGTH.unpack_from(data, offset)
            words.append(data[offset + 4:offset + 4 + size].decode('utf-8', 'replace'))
            offset += 4 + size
        pose = declared_by(words[1])
        if pose is not None and words[0].startswith(self._prefix):
            self.rows.extend((pose.x, pose.y, pose.yaw))
            self.arrival.append(arrival)
            self.stamp.append((secs - start) + 1e-9 * nsecs)
