"""Reads IMU and wheels from messages as they come, and lets a GyroWatch compare them.

The doctor also runs where no message class can be imported, so the bytes are read here
(wiki.ros.org/msg: fields one after the other, little-endian, a length in front of each list).
"""
import os
import struct

from tb3_labs.config import NOT_GIVEN
from tb3_labs.robot.turtlebot3 import model_called

HEADER = struct.Struct('<III')    # number, stamp [s], [ns]
#: Of an Imu, after its header: the orientation, its covariances, the angular velocity.
MOTION = struct.Struct('<4d72x3d')


def imu_of(body):
    """The fields of an ImuSample, of a sensor_msgs/Imu. Its "yaw" only shows a repetition."""
    stamp, at = _header(body)
    motion = MOTION.unpack_from(body, at)
    return stamp, motion[2], motion[-1]


def wheels_of(body):
    """The fields of a WheelSample, of a sensor_msgs/JointState; None without these wheels."""
    stamp, at = _header(body)
    count, at = _length(body, at)
    names = []
    for _ in range(count):
        name, at = _text(body, at)
        names.append(name)
    count, at = _length(body, at)
    angles = dict(zip(names, struct.unpack_from('<{}d'.format(count), body, at)))
    if not {b'wheel_left_joint', b'wheel_right_joint'} <= set(angles):
        return None
    return stamp, angles[b'wheel_left_joint'], angles[b'wheel_right_joint']


def compare(imu, wheels, reset_topic):
    """The GyroWatch that heard both: [(arrival, fields or None)]; None without numpy."""
    try:
        from tb3_labs.localization.contradiction import GyroWatch
        from tb3_labs.robot.samples import ImuSample, WheelSample
    except ImportError:    # the line on Python tells it
        return None
    watch = GyroWatch(model_called(NOT_GIVEN, os.environ), reset_topic)
    heard = [(arrival, watch.on_imu, ImuSample(*fields)) for arrival, fields in imu] + [
        (arrival, watch.on_wheels, WheelSample(*fields)) for arrival, fields in wheels if fields]
    for arrival, hear, sample in sorted(heard, key=lambda entry: entry[0]):
        hear(sample, arrival)
    return watch


def _header(body):
    """(stamp [s], where the fields after the header begin)."""
    _, seconds, nanoseconds = HEADER.unpack_from(body)
    _, at = _text(body, HEADER.size)
    return seconds + 1e-9 * nanoseconds, at


def _text(body, at):
    """(text, where the next field begins)."""
    size, at = _length(body, at)
    return body[at:at + size], at + size


def _length(body, at):
    """(length of a list or text, where that begins)."""
    length, = struct.unpack_from('<I', body, at)
    return length, at + 4
