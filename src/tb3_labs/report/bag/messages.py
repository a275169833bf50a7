"""The messages of a recording: which topics it has, and how messages become samples.

The Transformation lab asks for a line ``Local pose set to x=..., y=..., yaw=...`` at each reset.
The handout prints the yaw in radians; other nodes print degrees. A yaw is treated as degrees if
``deg`` or a degree sign follows, or if its number is more than a whole turn in radians.

Units: metres, radians, seconds since the recording's start on the recorder's clock.
"""
import math
import re
import sys
from array import array
from dataclasses import fields
from typing import Optional

import numpy as np

from tb3_labs.geometry.angle_arrays import yaws_from_quaternions
from tb3_labs.geometry.angles import WHOLE_TURN, wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.bag.clock import RecordedClock, times_on_recorders_clock
from tb3_labs.report.run_data import (
    LogLines, MouseSamples, OdometrySamples, Orientations, PadSamples, Poses, States, Twists,
    Values, Variables, Yaws)

#: The levels of log lines, by the bits of rosgraph_msgs/Log.
LEVELS = {1: 'debug', 2: 'info', 4: 'warning', 8: 'error', 16: 'fatal'}

#: The line of a reset. No two parts side by side may match the same character: a line of thousands
#: of blanks would be tried in all ways to divide it.
NUMBER = r'([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)'
RESET_LINE = re.compile(
    r'local pose (?:set|reset) to\W*x\s*[=:]\s*{0}(?:\s*m)?\W+y\s*[=:]\s*{0}(?:\s*m)?\W+'
    r'(?:yaw|theta)\s*[=:]\s*{0}\s*(deg|\N{{DEGREE SIGN}})?'.format(NUMBER), re.IGNORECASE)

#: A reset is looked for in this many characters of a line; later resets are left out.
LONGEST_RESET, MOST_RESETS = 500, 1000
#: The most lines of a topic, characters of a line, and characters of all lines of a topic.
MOST_LINES, LONGEST_LINE, MOST_LETTERS = 20000, 4000, 2 ** 23
#: The most values of nodes' variables: 15 minutes of a node with fifteen.
MOST_VARIABLES = 300000
#: A line about a trial, by the marker, has at most this many characters.
LONGEST_EVENT = 200000
#: No number of a robot is larger: m, rad, m/s, rad/s. The firmware's spikes are below 1000.
LARGEST_NUMBER = 1e5
#: The place of a yaw in a row.
YAW = 0.0


def declared_by(line: str) -> Optional[Pose2]:
    """Returns the declared pose of the robot in ``local``; None if it is not a valid reset."""
    found = RESET_LINE.search(line[:LONGEST_RESET])
    if found is None:
        return None
    x, y, yaw = (float(word) for word in found.groups()[:3])
    if not math.isfinite(x + y + yaw):      # 1e999
        return None
    in_degrees = found.group(4) is not None or abs(yaw) > WHOLE_TURN
    return Pose2(x, y, wrap(math.radians(yaw) if in_degrees else yaw))


def resets_in(log: LogLines) -> Poses:
    """Returns the poses that were declared by resets, as the log lines have them."""
    declared = [(k, pose) for k, pose in enumerate(map(declared_by, log.texts))
                if pose is not None][:MOST_RESETS]
    lines = log.take([k for k, _ in declared])
    return Poses(lines.arrival, lines.time,
                 *np.array([(pose.x, pose.y, pose.yaw) for _, pose in declared]).reshape(-1, 3).T)


def presses_of(pad: PadSamples) -> Values:
    """The numbers of the buttons, each when it goes down."""
    before = np.vstack([np.zeros(PadSamples.BUTTONS), pad.buttons[:-1]])[:len(pad)]
    sample, number = np.nonzero((pad.buttons != 0.0) & (before == 0.0))
    return Values(pad.arrival[sample], pad.time[sample], number.astype(float))


def make_collectors(parts, prefix, limits):
    """Returns {field of RunData: Collector} for the robot in the namespace `prefix`. `limits`: the
    ReadLimits from which they take."""
    special = {
        'imu': (Orientations, lambda message: [
            (message.header, YAW, message.angular_velocity.z, *_wxyz(message.orientation))]),
        'odometry': (OdometrySamples, lambda message: [
            (message.header, message.pose.pose.position.x, message.pose.pose.position.y, YAW,
             message.twist.twist.linear.x, message.twist.twist.angular.z,
             *_wxyz(message.pose.pose.orientation))]),
        'commands': (Twists, lambda message: [
            (None, message.linear.x, message.angular.z, *map(_finite, (
                message.linear.y, message.linear.z, message.angular.x, message.angular.y)))]),
        'states': (States, _text), 'events': (States, _text, LONGEST_EVENT),
        'printed': (States, _text, LONGEST_EVENT),
        'turn_requests': (Values, lambda message: [(None, math.radians(message.data))]),
        'control': (Values, lambda message: [(None, float(message.data))]),
        'pad': (PadSamples, lambda message: [
            (None, *_filled(message.axes, PadSamples.AXES),
             *_filled(message.buttons, PadSamples.BUTTONS))]),
        'mouse': (MouseSamples, lambda message: [
            (message.header, message.xPos, message.yPos, float(message.status.data))]),
        'sender_index': (Values, None),    # by the connections' definitions, not by the messages
        'frames': (Poses, lambda message: (
            (each.header, each.transform.translation.x, each.transform.translation.y, YAW,
             *_wxyz(each.transform.rotation)) for each in message.transforms
            if each.child_frame_id.lstrip('/') == (prefix + 'local').strip('/'))),
        'log': (LogLines, _lines(prefix)),
        'variables': (
            Variables, _variables, LONGEST_LINE, MOST_VARIABLES)}
    return {part: Collector(limits, *special.get(part, (Poses, _pose))) for part in parts}


class Collector:
    """Gathers the samples of one topic.

    `rows_of` gives the samples in a message: rows of the header with the stamp, None without one,
    and the sample's numbers or words. A row of a kind with a yaw has YAW in its place, and the
    quaternion's four numbers at its end.
    """

    def __init__(self, limits, kind, rows_of, longest=LONGEST_LINE, most=None):
        """`longest`: characters of a word; `most`: samples with words, None: MOST_LINES."""
        self._kind, self._rows_of, self._limits, self._letters = kind, rows_of, limits, 0
        self._longest, self._most = longest, most or MOST_LINES
        self._has_words, self._width = kind in (States, LogLines, Variables), len(fields(kind)) - 2
        self._values = [] if self._has_words else array('d')
        self.arrival, self.stamp, self.number, self.bad = array('d'), array('d'), array('q'), 0
        self.is_full = False

    def add(self, message, arrival, start, number):
        """Take in a message. `arrival`: since `start` [s]; `start`: since 1970 [s]; `number`: of
        the message in the recording."""
        for header, *row in self._rows_of(message):
            # both parts apart: a float of today's time has steps of 0.2 microseconds
            self.keep(row, arrival, arrival if header is None else (
                header.stamp.secs - start) + 1e-9 * header.stamp.nsecs, number)

    def keep(self, row, arrival, stamp, number=0):
        """Append one sample, unless there are too many words. Raises TooLarge."""
        self._limits.spend('samples')
        if self._has_words:
            row = [word[:self._longest] for word in row]
            self._letters += sum(map(len, row))
            self.is_full = self.is_full or len(self.arrival) >= self._most or (
                self._letters > MOST_LETTERS)
            if self.is_full:
                return
        self._values.extend(row)
        self.arrival.append(arrival)
        self.stamp.append(stamp)
        self.number.append(number)

    def close(self):
        """Drop and count the samples with numbers that no robot has, when all are gathered."""
        kind = self._kind
        width = PadSamples.AXES + PadSamples.BUTTONS if kind is PadSamples else self._width + (
            4 if kind in (Poses, OdometrySamples) else 0)
        self.arrival, self.stamp, self.number = map(
            np.array, (self.arrival, self.stamp, self.number))
        self._values = np.array(self._values, object if self._has_words else float).reshape(
            -1, width)
        if self._has_words:
            return
        if issubclass(kind, Yaws):
            self._values[:, [each.name for each in fields(kind)].index('yaw') - 2] = \
                yaws_from_quaternions(*self._values[:, -4:].T)
        is_valid = (np.abs(self._values) < LARGEST_NUMBER).all(axis=1)      # NaN is not
        self.bad += int((~is_valid).sum())
        self.arrival, self.stamp, self.number, self._values = (
            each[is_valid] for each in (self.arrival, self.stamp, self.number, self._values))

    def samples(self, robot_clock):
        """Returns the gathered samples."""
        order = np.argsort(self.arrival, kind='stable')      # a file may hold topic after topic
        arrival, values = self.arrival[order], self._values[order]
        columns = np.split(values, [PadSamples.AXES], axis=1) if self._kind is PadSamples else \
            values.T[:self._width]
        return self._kind(arrival, times_on_recorders_clock(
            arrival, self.stamp[order], robot_clock), *columns)


def samples_of(collectors):
    """Returns {field of RunData: Samples} of all collectors, and the resets that a log shows."""
    odometry = collectors['odometry']
    clock = RecordedClock.of(odometry.arrival, odometry.stamp)
    samples = {part: collector.samples(clock) for part, collector in collectors.items()}
    if 'log' in samples:
        samples['resets'] = resets_in(samples['log'])
    if 'pad' in samples:
        samples['presses'] = presses_of(samples['pad'])
    return samples


def _filled(numbers, length):
    """The first numbers, filled up with zeros to this length."""
    return [*numbers[:length], *[0] * (length - len(numbers))]


def _finite(speed):
    """The speed [m/s] or [rad/s], clipped: a command with an infinite speed is kept."""
    return max(-LARGEST_NUMBER / 2.0, min(LARGEST_NUMBER / 2.0, speed))


def _wxyz(q):
    return q.w, q.x, q.y, q.z


def _text(message):
    return [(None, message.data)]


def _variables(message):
    for status in message.status:
        for each in status.values:
            yield message.header, status.name, sys.intern(each.key), each.value


def _pose(message):
    pose = getattr(message.pose, 'pose', message.pose)      # with a covariance, or without
    return [(message.header, pose.position.x, pose.position.y, YAW, *_wxyz(pose.orientation))]


def _lines(prefix):
    """The log lines of the nodes in one namespace."""
    def rows_of(message):
        if message.name.startswith(prefix):
            yield message.header, LEVELS.get(message.level, ''), message.name, message.msg
    return rows_of
