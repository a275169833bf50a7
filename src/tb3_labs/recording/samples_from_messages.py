"""Makes the samples of each topic from the messages of a recording.

The times of all samples are converted to one clock, the recorder's clock. Units: as in RunData.
"""
import math
import struct
import sys
from dataclasses import dataclass

import genpy
import numpy as np

from tb3_labs.geometry.angles import clamp, yaw_from_quaternion
from tb3_labs.recording.run_data import (
    Commands, ImuSamples, LogLines, MouseSamples, Numbers, OdometrySamples, Poses, Samples, Texts,
    Variables)
from tb3_labs.watch.printed_pose import declared_pose

LOG_LEVELS = {1: 'debug', 2: 'info', 4: 'warning', 8: 'error', 16: 'fatal'}
#: A sample with a larger number [m, rad, m/s, rad/s] is invalid. The firmware's spikes are smaller.
MAX_NUMBER = 1e5
#: A speed that no wheel follows is limited to this speed [m/s, rad/s].
MAX_UNUSED_SPEED = MAX_NUMBER / 2.0
#: Two senders are assumed to share one clock if their clocks differ by less than this time [s].
MAX_CLOCK_DIFFERENCE = 0.1
#: A message is late if its delay differs by more than this time [s] from its sender's usual delay.
MIN_LATENESS = 0.5
#: A recorder delays a message by at most this time [s]. A stamp that shows a longer delay is wrong.
MAX_BELIEVED_DELAY = 10.0
#: A sender's stamps are used if at least this share of the sender's messages is not late.
MIN_IN_TIME_SHARE = 0.25
OUTLIER_SHARE = 0.05        # this share of the smallest offsets may be too small


@dataclass(frozen=True)
class RecordedClock:
    """The clock of a sender, from which the `stamps` [s] were read. It is `offset` [s] behind the
    recorder's clock."""

    offset: float
    stamps: np.ndarray

    @classmethod
    def of(cls, arrival: np.ndarray, stamp: np.ndarray) -> 'RecordedClock':
        """Returns the clock of a sender, computed from the messages with the shortest delays.
        Outliers are ignored. The sender must have sent at least one message."""
        offsets = np.sort(arrival - stamp)      # each offset includes the delay of its message
        median = offsets[(len(offsets) - 1) // 2]
        usual_offsets = offsets[np.abs(offsets - median) < MIN_LATENESS]
        return cls(float(usual_offsets[int(OUTLIER_SHARE * len(usual_offsets))]), stamp)

    def is_same_as(self, other: 'RecordedClock') -> bool:
        """Returns True if the stamps of this sender come from the clock of the `other` sender."""
        is_copied = np.isin(np.round(self.stamps, 6), np.round(other.stamps, 6))
        return abs(self.offset - other.offset) < MAX_CLOCK_DIFFERENCE or is_copied.mean() > 0.5


def times_on_recorder_clock(arrival: np.ndarray, stamp: np.ndarray,
                            robot_clock: RecordedClock) -> np.ndarray:
    """Returns the time [s] on the recorder's clock at which each message was sent. The times never
    decrease.

    `robot_clock` is the clock of the odometry's sender. One offset is used for all senders that
    share this clock, so the differences between their stamps stay exact. A plausible stamp is more
    exact than the arrival, if the recorder is busy or a simulated clock stands still.
    """
    if not len(stamp):
        return arrival
    clock = RecordedClock.of(arrival, stamp)
    if clock.is_same_as(robot_clock):
        clock = robot_clock
    delay = np.abs(arrival - stamp - clock.offset)
    if (delay < MIN_LATENESS).mean() < MIN_IN_TIME_SHARE:
        return np.maximum.accumulate(arrival)
    is_plausible = delay < MAX_BELIEVED_DELAY
    return np.maximum.accumulate(np.where(is_plausible, stamp + clock.offset, arrival))


# -- Each function _read_... returns (header, rows). The header is None if the message has no stamp.
# Each row is a sample. `prefix` is the robot's namespace. An invalid quaternion raises ValueError.

def _yaw(q):
    return yaw_from_quaternion(w=q.w, x=q.x, y=q.y, z=q.z)


def _pose_row(pose):
    return pose.position.x, pose.position.y, _yaw(pose.orientation)


def _read_imu(message, sender, prefix):
    q = message.orientation
    return message.header, [(_yaw(q), message.angular_velocity.z, q.w, q.x, q.y, q.z)]


def _read_pose(message, sender, prefix):
    return message.header, [_pose_row(message.pose)]


def _read_odometry(message, sender, prefix):
    twist = message.twist.twist
    row = *_pose_row(message.pose.pose), twist.linear.x, twist.angular.z
    return message.header, [row]


def _read_command(message, sender, prefix):
    linear, angular = message.linear, message.angular
    # these speeds move no wheel, so a command is valid even if one of them is NaN or infinite
    limited_speeds = [MAX_UNUSED_SPEED if math.isnan(speed)
                      else clamp(speed, -MAX_UNUSED_SPEED, MAX_UNUSED_SPEED)
                      for speed in (linear.y, linear.z, angular.x, angular.y)]
    return None, [(linear.x, angular.z, *limited_speeds, sender)]


def _read_frames(message, sender, prefix):
    for stamped in message.transforms:
        if stamped.child_frame_id.strip('/') == (prefix + 'local').strip('/'):
            place = stamped.transform.translation
            return stamped.header, [(place.x, place.y, _yaw(stamped.transform.rotation))]
    return None, []


def _read_log(message, sender, prefix):
    if not message.name.startswith(prefix):
        return None, []
    return message.header, [(LOG_LEVELS.get(message.level, ''), message.name, message.msg)]


def _read_variables(message, sender, prefix):
    return message.header, [(status.name, sys.intern(variable.key), variable.value)
                            for status in message.status for variable in status.values]


def _read_mouse(message, sender, prefix):
    return message.header, [(message.xPos, message.yPos, message.status.data)]


def _read_turn_request(message, sender, prefix):
    return None, [(math.radians(message.data),)]


def _read_empty(message, sender, prefix):
    return None, [()]


def _read_data(message, sender, prefix):
    return None, [(message.data,)]


FIELD_READERS = {
    'imu': (ImuSamples, _read_imu), 'odometry': (OdometrySamples, _read_odometry),
    'commands': (Commands, _read_command), 'local_pose': (Poses, _read_pose),
    'ground_truth': (Poses, _read_pose), 'goals': (Poses, _read_pose),
    'frames': (Poses, _read_frames), 'log': (LogLines, _read_log),
    'variables': (Variables, _read_variables), 'mouse': (MouseSamples, _read_mouse),
    'turn_requests': (Numbers, _read_turn_request), 'control': (Numbers, _read_data),
    'board_resets': (Samples, _read_empty), 'states': (Texts, _read_data),
    'events': (Texts, _read_data), 'printed': (Texts, _read_data)}


def stamped_samples(field, message, prefix, start, received):
    """Returns the samples of a topic, and the number of invalid messages and samples. The `time` of
    a sample is its stamp on the sender's clock.

    `field` is a field of RunData, and `prefix` is the robot's namespace. `start` is the arrival of
    the recording's first message [s since 1970]. `received` contains (arrival [s], sender, bytes)
    of each message. All messages are read into the one object `message`.
    """
    samples_type, read = FIELD_READERS[field]
    rows = []
    dropped_count = 0
    for arrival, sender, data in received:
        try:
            message.deserialize(data)
            header, contents = read(message, sender, prefix)
        except (genpy.DeserializationError, struct.error, ValueError):
            dropped_count += 1
            continue
        stamp = arrival
        if header is not None:
            # `start` is subtracted first, since a float of seconds since 1970 is exact to 0.2 us
            stamp = (header.stamp.secs - start) + 1e-9 * header.stamp.nsecs
        rows += [(arrival, stamp, *row) for row in contents]
    samples = samples_type.from_rows(rows)
    is_valid = np.ones(len(samples), bool)
    for column in samples.columns[2:]:      # the first two columns are the times
        if column.dtype != object:
            is_valid &= np.abs(column) < MAX_NUMBER     # False for NaN
    return samples.take(is_valid), dropped_count + int((~is_valid).sum())


def resets_in(log: LogLines) -> Poses:
    """Returns the pose that each reset in a log declares."""
    rows = []
    for arrival, time, text in zip(log.arrival, log.time, log.text):
        pose = declared_pose(text)
        if pose is not None:
            rows.append((arrival, time, pose.x, pose.y, pose.yaw))
    return Poses.from_rows(rows)
