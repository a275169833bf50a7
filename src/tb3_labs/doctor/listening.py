"""Listens to a topic by a connection to each of its publishers, without a node of its own.

The publisher's node is asked for its port (requestTopic), and sends its messages from then on, as
to any subscriber (wiki.ros.org/ROS/TCPROS). The master is told nothing. The fields of a message are
read from its bytes, because the doctor also runs where no message class can be imported
(wiki.ros.org/msg: fields one after the other, little-endian, a length in front of each list).
"""
import math
import os
import socket
import struct
import threading
import time

from tb3_labs.config import NOT_GIVEN
from tb3_labs.doctor.questions import ANSWERING, CALLER, Peer
from tb3_labs.robot.turtlebot3 import WHEEL_JOINTS, model_called

#: No message of these topics is longer than this [bytes].
LONGEST = 1 << 20
#: The clock of this computer is looked at this often, to see whether it stands still [s].
PERIOD = 0.02
HEADER = struct.Struct('<III')    # number, stamp [s], [ns]
#: Of an Imu, after its header: the orientation, its covariances, the angular velocity.
MOTION = struct.Struct('<4d72x3d')


def stamp_of(body):
    """(stamp [s],) of a message with a header."""
    return _header(body)[0],


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
    left, right = (angles.get(joint.encode()) for joint in WHEEL_JOINTS)
    return None if left is None or right is None else (stamp, left, right)


def _header(body):
    """(stamp [s], the begin of the fields after the header)."""
    _, seconds, nanoseconds = HEADER.unpack_from(body)
    _, at = _text(body, HEADER.size)
    return seconds + 1e-9 * nanoseconds, at


def _text(body, at):
    """(text, the begin of the next field)."""
    size, at = _length(body, at)
    return body[at:at + size], at + size


def _length(body, at):
    """(length of a list or text, its begin)."""
    length, = struct.unpack_from('<I', body, at)
    return length, at + 4


class Ear:
    """One publisher of one topic, heard by a thread of its own until it is closed.

    `messages` is (monotonic [s], wall clock [s], fields) of each; `problem` is '', or tells why
    nothing can be heard. `read` gives the fields of a message's bytes, the stamp first; they are
    None if they are not to be read.
    """

    def __init__(self, topic, node, uri, read=lambda body: None):
        self.topic, self.node, self.messages = topic, node, []
        self.problem = 'no connection to {}'.format(node)
        self._uri, self._read = uri, read
        self._begun = self._ended = time.monotonic()
        self._is_closed = False
        threading.Thread(target=self._run, daemon=True).start()

    def close(self):
        """Take in nothing more."""
        self._is_closed, self._ended = True, time.monotonic()

    @property
    def seconds(self):
        """For how long it was heard."""
        return max(0.0, self._ended - self._begun)

    def gap(self):
        """(longest time without a message; by how much the message after it was later than the
        fastest, nan if none came) [s]. The time after the last message, whose cause is unknown, is
        taken only if it is twice as long as any other."""
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
            self.problem, self._begun = '', time.monotonic()
            link.settimeout(None)
            while not self._is_closed:
                fields = self._read(_piece(stream))
                if not self._is_closed:
                    self.messages.append((time.monotonic(), time.time(), fields))


def _piece(stream):
    """The next bytes, by the length in front of them."""
    head = stream.read(4)
    size = struct.unpack('<I', head)[0] if len(head) == 4 else 0
    if size > LONGEST:
        raise ValueError('it sends something else than messages')
    piece = stream.read(size)
    if len(head) < 4 or len(piece) < size:
        raise ConnectionError('connection closed')
    return piece


def _connection(**fields):
    """A connection header: each field, and the whole, after its length."""
    packed = b''
    for name, value in fields.items():
        field = '{}={}'.format(name, value).encode()
        packed += struct.pack('<I', len(field)) + field
    return struct.pack('<I', len(packed)) + packed


def listen(ears, seconds):
    """Let the ears listen for that time; the longest time that this computer stood still [s]."""
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
    """The GyroWatch that heard both, the ears of imu and of joint_states; None without numpy."""
    try:
        from tb3_labs.localization.contradiction import GyroWatch
        from tb3_labs.robot.samples import ImuSample, WheelSample
    except ImportError:    # the line on Python tells it
        return None
    watch = GyroWatch(model_called(NOT_GIVEN, os.environ), reset_topic)
    heard = [(arrival, hear, kind(*fields))
             for ears, hear, kind in ((imu, watch.on_imu, ImuSample),
                                      (wheels, watch.on_wheels, WheelSample))
             for ear in ears for arrival, _, fields in ear.messages if fields]
    for arrival, hear, sample in sorted(heard, key=lambda entry: entry[0]):
        hear(sample, arrival)
    return watch
