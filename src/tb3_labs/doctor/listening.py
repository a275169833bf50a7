"""Listens to a topic by a connection to each of its publishers; the doctor is not a node.

The doctor asks the publisher's node for its port (requestTopic) and connects. The node sends its
messages as to any subscriber (wiki.ros.org/ROS/TCPROS). The master is not told. The fields of a
message are read from its bytes, because the doctor also runs if no message class can be imported
(wiki.ros.org/msg: fields one after the other, little-endian, a length in front of each list).
"""
import math
import os
import re
import socket
import struct
import threading
import time
from collections import defaultdict
from typing import DefaultDict

from tb3_labs.config import NOT_GIVEN
from tb3_labs.doctor.questions import ANSWERING, CALLER, Peer
from tb3_labs.robot.turtlebot3 import WHEEL_JOINTS, model_called

#: No message of these topics is longer than this [bytes].
LONGEST = 1 << 20
#: The doctor looks at the clock once in this time [s], to see if this computer stands still.
PERIOD = 0.02
#: {URI of a node: its lock}. The ears of a node connect one after the other: rospy lets only five
#: connections wait (tcpros_base.py), and the next try of a dropped one comes too late, after 1 s.
_TURNS: DefaultDict[str, threading.Lock] = defaultdict(threading.Lock)
HEADER = struct.Struct('<III')    # number, stamp [s], [ns]
#: The layout of an Imu after its header: orientation, its covariances, angular velocity.
MOTION = struct.Struct('<4d72x3d')


def stamp_of(body):
    """Returns (stamp [s],) of a message with a header."""
    return _header(body)[0],


def imu_of(body):
    """Returns the fields of an ImuSample, from a sensor_msgs/Imu."""
    stamp, at = _header(body)
    x, y, z, w, *_, rate = MOTION.unpack_from(body, at)
    return stamp, math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z), rate


def wheels_of(body):
    """Returns the fields of a WheelSample, from a sensor_msgs/JointState; None without wheels."""
    stamp, at = _header(body)
    count, at = _length(body, at)
    names = []
    for _ in range(count):
        name, at = _text(body, at)
        names.append(name)
    count, at = _length(body, at)
    angles = dict(zip(names, struct.unpack_from('<{}d'.format(count), body, at)))
    left, right = (angles.get(joint.encode()) for joint in WHEEL_JOINTS)
    return None if left is None or right is None else (stamp, left, right)


def voltage_of(body):
    """Returns (stamp [s], voltage [V]) of a sensor_msgs/BatteryState."""
    stamp, at = _header(body)
    return (stamp, *struct.unpack_from('<f', body, at))


def torque_of(body):
    """Returns (stamp [s], is the torque on?) of a turtlebot3_msgs/SensorState: the byte before the
    encoders and the battery, in all versions that have it."""
    return _header(body)[0], bool(body[-13])


def version_of(body):
    """Returns (version,) of a turtlebot3_msgs/VersionInfo."""
    _, at = _text(body, 0)
    return _text(body, at)[0].decode('utf-8', 'replace'),


def line_of(body):
    """Returns (stamp [s], line) of a rosgraph_msgs/Log."""
    stamp, at = _header(body)
    _, at = _text(body, at + 1)
    return stamp, _text(body, at)[0].decode('utf-8', 'replace')


def _header(body):
    """(stamp [s], the place of the fields after the header)."""
    _, seconds, nanoseconds = HEADER.unpack_from(body)
    _, at = _text(body, HEADER.size)
    return seconds + 1e-9 * nanoseconds, at


def _text(body, at):
    """(text, the place of the next field)."""
    size, at = _length(body, at)
    return body[at:at + size], at + size


def _length(body, at):
    """(length of a list or text, the place of its first byte)."""
    length, = struct.unpack_from('<I', body, at)
    return length, at + 4


class Ear:
    """One publisher of one topic, heard by a thread of its own until it is closed.

    `messages` is a list of (monotonic clock [s], wall clock [s], fields). `problem` is '', or tells
    why nothing can be heard. `checksum` is that of the message's definition, '' if it is unknown.
    `read(bytes)` returns the fields of a message, the stamp first; None if they are not needed.
    """

    def __init__(self, topic, node, uri, read=lambda body: None):
        self.topic, self.node, self.messages, self.checksum = topic, node, [], ''
        self.problem = 'no connection to {}'.format(node)
        self._uri, self._read, self._turn = uri, read, _TURNS[uri]
        self._begun = self._ended = time.monotonic()
        self._is_closed = False
        threading.Thread(target=self._run, daemon=True).start()

    def close(self):
        """Take in nothing more."""
        self._is_closed, self._ended = True, time.monotonic()

    @property
    def seconds(self):
        """Time for which it was heard [s]."""
        return max(0.0, self._ended - self._begun)

    def gap(self):
        """Returns (longest time without a message, delay of the message after it beyond that of the
        fastest message, nan if none came) [s]. The time after the last message counts only if it is
        more than twice as long as any other, because its cause is unknown."""
        least = min((wall - fields[0] for _, wall, fields in self.messages), default=math.nan)
        worst, late, last = 0.0, math.nan, self._begun
        for at, wall, fields in self.messages:
            if at - last > worst:
                worst, late = at - last, wall - fields[0] - least
            last = at
        if self._ended - last > 2.0 * worst:
            worst, late = self._ended - last, math.nan
        return worst, late

    def _run(self):
        try:
            self._listen()
        except (OSError, ValueError, TypeError, struct.error) as trouble:
            if not self._is_closed and not self.messages:
                self.problem = '{} ({})'.format(self.node, trouble or 'connection lost')

    def _listen(self):
        with self._turn:
            stream = self._connected()
        with stream:
            while not self._is_closed:
                fields = self._read(_piece(stream))
                if not self._is_closed:
                    self.messages.append((time.monotonic(), time.time(), fields))

    def _connected(self):
        """Returns the stream of messages; it keeps the connection open."""
        found = Peer(self._uri).ask('requestTopic', self.topic, [['TCPROS']])
        if not found:
            raise ValueError('it does not offer the topic')
        _, host, port = found
        with socket.create_connection((host, port), ANSWERING) as link:
            link.sendall(_connection(callerid=CALLER, topic=self.topic, type='*', md5sum='*'))
            stream = link.makefile('rb')
            answer = _piece(stream)
            if b'error=' in answer:
                raise ValueError(answer.partition(b'error=')[2].decode('utf-8', 'replace'))
            self.checksum = (re.findall(rb'md5sum=(\w+)', answer) or [b''])[0].decode()
            self.problem, self._begun = '', time.monotonic()
            link.settimeout(None)
            return stream


def _piece(stream):
    """Returns the next piece of a stream: a length stands in front of each piece."""
    head = stream.read(4)
    size = struct.unpack('<I', head)[0] if len(head) == 4 else 0
    if size > LONGEST:
        raise ValueError('it sends something else than messages')
    piece = stream.read(size)
    if len(head) < 4 or len(piece) < size:
        raise ConnectionError('connection closed')
    return piece


def _connection(**fields):
    """Returns a connection header: a length stands in front of it, and in front of each field."""
    packed = b''
    for name, value in fields.items():
        field = '{}={}'.format(name, value).encode()
        packed += struct.pack('<I', len(field)) + field
    return struct.pack('<I', len(packed)) + packed


def listen(ears, seconds):
    """Let the ears listen for `seconds`. Returns how long this computer stood still at most [s]."""
    end = time.monotonic() + seconds
    longest, last = 0.0, time.monotonic()
    while last < end:
        time.sleep(PERIOD)
        now = time.monotonic()
        longest, last = max(longest, now - last - PERIOD), now
    for ear in ears:
        ear.close()
    return longest


def compare(imu, wheels, reset_topic):
    """Returns a GyroWatch that heard the messages of imu and joint_states; None without numpy."""
    try:
        from tb3_labs.localization.contradiction import GyroWatch
        from tb3_labs.robot.samples import ImuSample, WheelSample
    except ImportError:    # the line on Python tells this
        return None
    watch = GyroWatch(model_called(NOT_GIVEN, os.environ), reset_topic)
    heard = [(arrival, hear, kind(*fields))
             for ears, hear, kind in ((imu, watch.on_imu, ImuSample),
                                      (wheels, watch.on_wheels, WheelSample))
             for ear in ears for arrival, _, fields in ear.messages if fields]
    for arrival, hear, sample in sorted(heard, key=lambda entry: entry[0]):
        hear(sample, arrival)
    return watch
