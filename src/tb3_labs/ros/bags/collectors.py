"""From serialized messages to RunData's samples, one collector for each topic.

Only the fields that are needed are unpacked from the bytes: a recording of an hour holds a million
messages, and an object for each would take minutes.
"""
import struct
from array import array

import numpy as np

from tb3_labs.geometry.quaternions import yaws_from_quaternions
from tb3_labs.report.declared import declared_by
from tb3_labs.report.run_data import (
    Commands, ImuSamples, OdometrySamples, Poses, States, Values, times_on_recorders_clock)
from tb3_labs.ros.bags.topics import LOG

HEADER = struct.Struct('<4xIII')                # seq, secs, nsecs, length of frame_id
LENGTH = struct.Struct('<I')
ORIENTATION_RATE = struct.Struct('<4d88xd')     # x, y, z, w; covariance; angular_velocity.z
POSE_SPEEDS = struct.Struct('<2d8x4d288xd32xd')  # x, y; x, y, z, w; covariance; as in SPEEDS
PLACE_ORIENTATION = struct.Struct('<2d8x4d')    # x, y; x, y, z, w
SPEEDS = struct.Struct('<d32xd')                # linear.x, angular.z
DEGREES, SWITCH = struct.Struct('<d'), struct.Struct('<?')
POSE_OF_LINE = struct.Struct('<3d')             # as a reset's line says it: x, y, yaw


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
    """Gathers one topic's numbers, row after row."""

    kind, layout, stamped, strings = None, None, True, 1   # strings before the numbers

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


class _ImuCollector(_Collector):
    kind, layout = ImuSamples, ORIENTATION_RATE

    @staticmethod
    def columns(x, y, z, w, rate):
        return yaws_from_quaternions(w=w, x=x, y=y, z=z), rate


class _PoseCollector(_Collector):
    kind, layout = Poses, PLACE_ORIENTATION

    @staticmethod
    def columns(x, y, qx, qy, qz, qw, *more):
        return (x, y, yaws_from_quaternions(w=qw, x=qx, y=qy, z=qz)) + more


class _OdometryCollector(_PoseCollector):
    kind, layout, strings = OdometrySamples, POSE_SPEEDS, 2


class _CommandCollector(_Collector):
    kind, layout, stamped = Commands, SPEEDS, False

    @staticmethod
    def columns(linear, angular):
        return linear, angular


class _AngleCollector(_Collector):
    kind, layout, stamped = Values, DEGREES, False

    @staticmethod
    def columns(degrees):
        return np.radians(degrees),


class _SwitchCollector(_Collector):
    kind, layout, stamped = Values, SWITCH, False

    @staticmethod
    def columns(on):
        return on,


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

    @staticmethod
    def columns(x, y, yaw):
        return x, y, yaw

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
