"""The private parts of rospy that are changed: messages published past its queues arrive whole and in
order and keep no publisher waiting; no publisher is overlooked that registers with a subscriber."""
import math
import socket
import struct
import threading
import time
from types import SimpleNamespace

import pytest

rospy = pytest.importorskip('rospy')
from rospy.impl.registration import RegManager    # noqa: E402
from rospy.impl.tcpros_base import TCPROSTransport    # noqa: E402
from rospy.impl.tcpros_pubsub import QueuedConnection, TCPROSPub    # noqa: E402
from rospy.topics import _PublisherImpl    # noqa: E402
from std_msgs.msg import String    # noqa: E402

from tb3_labs.ros.rospy_internals import SURELY_TAKEN, join_updates, publish_now    # noqa: E402

#: Messages that rospy's queue holds.
QUEUE = 3
#: A text that is awaited arrives within [s].
DEADLINE = 60.0


class Line:
    """A topic with one subscriber: `read_until(text)` gives the texts that have arrived with it."""

    def __init__(self, is_early=False):
        """`is_early`: the subscriber connects before rospy knows the size of the queue."""
        self.topic = _PublisherImpl('/line', String)
        if not is_early:
            self.topic.set_queue_size(QUEUE)
        self.publisher = SimpleNamespace(impl=self.topic)
        ours, self.theirs = socket.socketpair()
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4608)
        self.connection = TCPROSTransport(TCPROSPub('/line', String), '/line')
        self.connection.set_socket(ours, 'subscriber')
        self.topic.add_connection(self.connection)
        if is_early:
            self.topic.set_queue_size(QUEUE)
            publish_now(self.publisher, String('first'))
        queue, = self.topic.connections
        assert isinstance(queue, QueuedConnection)
        while not queue._cond_data_available._waiters:
            time.sleep(0.001)
        self._data = b''

    def publish(self, *texts):
        publish_now(self.publisher, *map(String, texts))

    def read_until(self, last):
        self.theirs.settimeout(DEADLINE)
        texts = []
        while not texts or texts[-1] != last:
            data = self.theirs.recv(1000000)
            assert data, 'the connection was closed after {} texts'.format(len(texts))
            texts += self._whole(data)
        return texts

    def _whole(self, data):
        self._data += data
        while len(self._data) >= 8:
            length, = struct.unpack_from('<I', self._data)
            if len(self._data) < 4 + length:
                return
            yield String().deserialize(self._data[4:4 + length]).data
            self._data = self._data[4 + length:]

    def close(self):
        self.connection.close()
        self.theirs.close()


@pytest.fixture
def line():
    line = Line()
    yield line
    line.close()


def test_messages_together_are_one_write_before_the_call_returns(line):
    line.publish('one', 'two', 'three')
    line.theirs.setblocking(False)
    assert list(line._whole(line.theirs.recv(1000))) == ['one', 'two', 'three']
    assert line.connection.stat_num_msg == 3


@pytest.mark.parametrize('size', [100, SURELY_TAKEN - 100, 2 * SURELY_TAKEN, 20 * SURELY_TAKEN])
def test_who_does_not_read_gets_whole_messages_in_order_and_the_newest(line, size):
    sent = ['%06d' % number + 'x' * (size - 6) for number in range(2000)]
    publisher = threading.Thread(target=lambda: [line.publish(text) for text in sent], daemon=True)
    publisher.start()
    publisher.join(DEADLINE)
    assert not publisher.is_alive()     # nobody reads: one write that waits would wait for ever
    got = line.read_until(sent[-1])
    assert sorted(got) == got and set(got) < set(sent)
    assert got[-QUEUE:] == sent[-QUEUE:]
    line.publish('and', 'on')
    assert line.read_until('on') == ['and', 'on']


def test_a_subscriber_that_connects_before_the_queues_size_is_known_gets_a_queue():
    line = Line(is_early=True)
    line.publish('second')
    assert line.read_until('second') == ['first', 'second']
    line.close()


def test_what_the_queue_is_about_to_write_is_not_overtaken(line):
    begun, go_on = threading.Event(), threading.Event()
    write_data = line.connection.write_data

    def write_when_told(data):
        begun.set()
        go_on.wait()
        write_data(data)
    line.connection.write_data = write_when_told
    line.publish('x' * SURELY_TAKEN)
    assert begun.wait(DEADLINE)
    line.publish('short')
    go_on.set()
    assert line.read_until('short') == ['x' * SURELY_TAKEN, 'short']


def test_a_subscriber_that_is_gone_is_closed_at_once_and_hangs_nobody(line):
    line.theirs.close()
    line.publish('into the void')
    assert line.connection.done
    line.publish('nobody is left')
    assert not line.topic.has_connections()


def test_what_is_closed_or_of_the_wrong_type_is_refused(line):
    with pytest.raises(rospy.ROSSerializationException):
        publish_now(line.publisher, String(math.pi))
    line.topic.close()
    with pytest.raises(rospy.ROSException, match='closed'):
        publish_now(line.publisher, String('late'))
    with pytest.raises(rospy.ROSException, match='unregistered'):
        publish_now(SimpleNamespace(impl=None), String('late'))


# Lists of publishers ------------------------------------------------------------------------------

def test_an_answer_without_a_publisher_does_not_hide_one_of_its_topic_that_was_told_before():
    manager = RegManager(None)
    join_updates(manager)
    manager.publisher_update('/odom', ['http://robot:1/'])
    manager.publisher_update('/odom', [])
    assert manager.updates[-1] == ('/odom', ['http://robot:1/'])
    manager.publisher_update('/imu', ['http://robot:2/', 'http://robot:3/'])
    assert manager.updates[-1] == ('/imu', ['http://robot:2/', 'http://robot:3/'])
