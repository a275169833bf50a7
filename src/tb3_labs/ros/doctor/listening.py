"""Listens to a topic by a connection to each of its publishers, without a node of its own.

The publisher's node is asked for its port (requestTopic), and sends its messages from then on, as
to any subscriber (wiki.ros.org/ROS/TCPROS). The master is told nothing.
"""
import math
import socket
import struct
import threading
import time

from tb3_labs.ros.doctor.questions import ANSWERING, CALLER, Peer

#: No message of these topics is longer than this [bytes].
LONGEST = 1 << 20
#: The clock of this computer is looked at this often, to see whether it stands still [s].
PERIOD = 0.02


class Ear:
    """One publisher of one topic, heard by a thread of its own until it is closed. `read` makes a
    sample of a message's bytes."""

    def __init__(self, topic, node, uri, has_header=True, read=None):
        self.topic, self.node = topic, node
        self.samples = []                # (monotonic, what `read` made)
        self._read = read
        self._uri, self._has_header = uri, has_header
        self._lock = threading.Lock()    # guards all below
        self._arrivals = []              # (monotonic, wall clock, stamp) [s]
        self._problem = 'no connection to {}'.format(node)
        self._begun = self._ended = time.monotonic()
        self._is_closed = False
        threading.Thread(target=self._run, daemon=True).start()

    def close(self):
        """Take in nothing more."""
        with self._lock:
            self._is_closed, self._ended = True, time.monotonic()

    @property
    def problem(self):
        """'' or why nothing can be heard."""
        return self._problem

    @property
    def seconds(self):
        """For how long it was heard."""
        return max(0.0, self._ended - self._begun)

    @property
    def arrivals(self):
        """(monotonic, wall clock, stamp) of each message [s]."""
        return list(self._arrivals)

    def gap(self):
        """(longest time without a message; by how much the message after it was later than the
        fastest, nan if none came) [s]. The time after the last message, whose cause is unknown, is
        taken only if it is twice as long as any other."""
        least = min((wall - stamp for _, wall, stamp in self._arrivals), default=math.nan)
        worst, late, last = 0.0, math.nan, self._begun
        for at, wall, stamp in self._arrivals:
            if at - last > worst:
                worst, late = at - last, wall - stamp - least
            last = at
        if self._ended - last > 2.0 * worst:
            worst, late = self._ended - last, math.nan
        return worst, late

    def _run(self):
        try:
            self._listen()
        except (OSError, ValueError, TypeError, struct.error) as trouble:
            with self._lock:
                if not self._is_closed and not self._arrivals:
                    self._problem = '{} ({})'.format(self.node, trouble or 'connection lost')

    def _listen(self):
        peer = Peer(self._uri)
        found = peer.ask('requestTopic', self.topic, [['TCPROS']])
        if not found:
            raise ValueError('it does not offer the topic')
        _, host, port = found
        with socket.create_connection((host, port), ANSWERING) as link:
            link.sendall(_header(callerid=CALLER, topic=self.topic, type='*', md5sum='*'))
            data = _Reader(link)
            answer = data.take(data.length())
            if b'error=' in answer:
                raise ValueError(answer.partition(b'error=')[2].decode('utf-8', 'replace'))
            with self._lock:
                self._problem, self._begun = '', time.monotonic()
            link.settimeout(None)
            while not self._is_closed:
                body = data.take(data.length())
                self._heard(body)

    def _heard(self, body):
        stamp = math.nan
        if self._has_header:
            _, seconds, nanoseconds = struct.unpack_from('<III', body)
            stamp = seconds + 1e-9 * nanoseconds
        with self._lock:
            if not self._is_closed:
                if self._read:
                    self.samples.append((time.monotonic(), self._read(body)))
                self._arrivals.append((time.monotonic(), time.time(), stamp))


class _Reader:
    """Takes pieces of known length from a connection."""

    def __init__(self, link):
        self._link, self._data = link, b''

    def length(self):
        """The length in front of a piece."""
        size, = struct.unpack('<I', self.take(4))
        if size > LONGEST:
            raise ValueError('it sends something else than messages')
        return size

    def take(self, size):
        """The next `size` bytes."""
        while len(self._data) < size:
            more = self._link.recv(65536)
            if not more:
                raise ConnectionError('connection closed')
            self._data += more
        piece, self._data = self._data[:size], self._data[size:]
        return piece


def _header(**fields):
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
