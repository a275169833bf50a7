"""Makes the samples of each topic from the messages of a recording.

At a reset, a node of the Transformation lab prints ``Local pose set to x=..., y=..., yaw=...``. The
handout's node prints the yaw in radians, other nodes print degrees. A yaw is in degrees if ``deg``
or a degree sign follows the number, or if the number is larger than a whole turn in radians.

Units: metres, radians, seconds since the recording's start on the recorder's clock.
"""
import math
import re
import sys
from array import array
from dataclasses import fields
from typing import Optional

import numpy as np

from tb3_labs.geometry.arrays import yaws_from_quaternions
from tb3_labs.geometry.angles import WHOLE_TURN, wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.bag.clock import RecordedClock, times_on_recorders_clock
from tb3_labs.report.run_data import (
    LogLines, MouseSamples, OdometrySamples, Orientations, Poses, States, Twists, Numbers,
    Variables, Yaws)

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
#: A run has at most this many resets.
MAX_RESETS = 1000
#: The largest numbers of a topic's lines, of the characters of a line, and of all its characters.
MAX_LINES, MAX_LINE_LENGTH, MAX_LETTERS = 20000, 4000, 2 ** 23
#: At most this many readings of variables are kept. A node with 15 variables makes them in 15
#: minutes.
MAX_VARIABLES = 300000
#: An event of a trial, or a text that a node printed in a trial, has at most this many characters.
MAX_EVENT_LENGTH = 200000
#: A sample with a larger number is invalid [m, rad, m/s, rad/s]. The firmware's spikes are below
#: 1000 rad/s.
MAX_NUMBER = 1e5
#: A row has this yaw until the yaws of all rows are computed from their quaternions.
YAW_LATER = 0.0


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
    indices, rows = [], []
    for k, pose in enumerate(map(declared_by, log.texts)):
        if pose is not None:
            indices.append(k)
            rows.append((pose.x, pose.y, pose.yaw))
    lines = log.take(indices[:MAX_RESETS])
    return Poses(lines.arrival, lines.time, *np.array(rows[:MAX_RESETS]).reshape(-1, 3).T)


def make_collectors(parts, prefix, limits):
    """Returns {field of RunData: Collector} for the fields `parts` of the robot in the namespace
    `prefix`. Each sample is subtracted from the budget `limits`, a ReadLimits."""
    # {field: arguments of its Collector}; a field that is not in the table has poses
    kinds = {
        'imu': (Orientations, lambda message: [
            (message.header, YAW_LATER, message.angular_velocity.z, *_wxyz(message.orientation))]),
        'odometry': (OdometrySamples, lambda message: [
            (message.header, message.pose.pose.position.x, message.pose.pose.position.y, YAW_LATER,
             message.twist.twist.linear.x, message.twist.twist.angular.z,
             *_wxyz(message.pose.pose.orientation))]),
        'commands': (Twists, lambda message: [
            (None, message.linear.x, message.angular.z, *map(_finite, (
                message.linear.y, message.linear.z, message.angular.x, message.angular.y)))]),
        'states': (States, _text), 'events': (States, _text, MAX_EVENT_LENGTH),
        'printed': (States, _text, MAX_EVENT_LENGTH),
        'turn_requests': (Numbers, lambda message: [(None, math.radians(message.data))]),
        'control': (Numbers, lambda message: [(None, float(message.data))]),
        'mouse': (MouseSamples, lambda message: [
            (message.header, message.xPos, message.yPos, float(message.status.data))]),
        'sender_index': (Numbers, None),    # the reader of the bag knows the senders
        'frames': (Poses, lambda message: [
            (each.header, each.transform.translation.x, each.transform.translation.y, YAW_LATER,
             *_wxyz(each.transform.rotation)) for each in message.transforms
            if each.child_frame_id.lstrip('/') == (prefix + 'local').strip('/')]),
        'log': (LogLines, lambda message: [
            (message.header, LEVELS.get(message.level, ''), message.name, message.msg)]
            if message.name.startswith(prefix) else []),
        'variables': (Variables, lambda message: [
            (message.header, status.name, sys.intern(each.key), each.value)
            for status in message.status for each in status.values])}
    return {part: Collector(limits, *kinds.get(part, (Poses, _pose))) for part in parts}


class Collector:
    """Collects the samples of one topic.

    ``rows_of(message)`` returns a row for each sample in a message. A row begins with the header
    that has the stamp, or with None; the sample's numbers or words follow. A row has the
    placeholder YAW_LATER where the yaw belongs. The quaternion w, x, y, z is at the row's end.
    """

    def __init__(self, limits, kind, rows_of, longest=MAX_LINE_LENGTH):
        """`kind` is the class of the samples. A word is cut after `longest` characters."""
        self._limits, self._kind, self._rows_of, self._longest = limits, kind, rows_of, longest
        self._has_words = kind in (States, LogLines, Variables)
        self._letters = 0
        self._values = [] if self._has_words else array('d')
        self.arrival, self.stamp = array('d'), array('d')
        self.bad = 0
        self.is_full = False

    def add(self, message, arrival, start):
        """Append the samples of a message, which arrived `arrival` [s] after `start` [s since
        1970]."""
        for header, *row in self._rows_of(message):
            stamp = arrival
            if header is not None:
                # first the difference: a float of the seconds since 1970 has steps of 0.2 us
                stamp = (header.stamp.secs - start) + 1e-9 * header.stamp.nsecs
            self.keep(row, arrival, stamp)

    def keep(self, row, arrival, stamp):
        """Append one sample, unless there are too many words. May raise TooLarge."""
        self._limits.spend('samples')
        if self._has_words:
            row = [word[:self._longest] for word in row]
            self._letters += sum(map(len, row))
            most = MAX_VARIABLES if self._kind is Variables else MAX_LINES
            if len(self.arrival) >= most or self._letters > MAX_LETTERS:
                self.is_full = True
            if self.is_full:
                return
        self._values.extend(row)
        self.arrival.append(arrival)
        self.stamp.append(stamp)

    def close(self):
        """Make arrays of the samples. A sample with an invalid number is dropped and counted."""
        self.arrival, self.stamp = np.array(self.arrival), np.array(self.stamp)
        columns = [column.name for column in fields(self._kind)][2:]
        if self._has_words:
            self._values = np.array(self._values, object).reshape(-1, len(columns))
            return
        width = len(columns)
        if self._kind in (Poses, OdometrySamples):
            width += 4      # the quaternion, which is not a field of these samples
        self._values = np.array(self._values).reshape(-1, width)
        if issubclass(self._kind, Yaws):
            self._values[:, columns.index('yaw')] = yaws_from_quaternions(*self._values[:, -4:].T)
        is_valid = (np.abs(self._values) < MAX_NUMBER).all(axis=1)      # NaN is invalid
        self.bad += int((~is_valid).sum())
        self.arrival, self.stamp = self.arrival[is_valid], self.stamp[is_valid]
        self._values = self._values[is_valid]

    def samples(self, robot_clock):
        """Returns the collected samples. `robot_clock` is the odometry's RecordedClock."""
        order = np.argsort(self.arrival, kind='stable')      # a bag need not be sorted by time
        arrival, values = self.arrival[order], self._values[order]
        time = times_on_recorders_clock(arrival, self.stamp[order], robot_clock)
        return self._kind(arrival, time, *values.T[:len(fields(self._kind)) - 2])


def samples_of(collectors):
    """Returns {field of RunData: Samples} of all collectors. The resets are taken from the log if
    there is one."""
    odometry = collectors['odometry']
    clock = RecordedClock.of(odometry.arrival, odometry.stamp)
    samples = {part: collector.samples(clock) for part, collector in collectors.items()}
    if 'log' in samples:
        samples['resets'] = resets_in(samples['log'])
    return samples


def _finite(speed):
    """Returns the speed, cut to a finite number, so that the command is not dropped."""
    return max(-MAX_NUMBER / 2.0, min(MAX_NUMBER / 2.0, speed))


def _wxyz(q):
    return q.w, q.x, q.y, q.z


def _text(message):
    return [(None, message.data)]


def _pose(message):
    pose = getattr(message.pose, 'pose', message.pose)      # with a covariance, or without
    return [(message.header, pose.position.x, pose.position.y, YAW_LATER, *_wxyz(pose.orientation))]
