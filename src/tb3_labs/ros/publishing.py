"""How a message leaves: at once, by publish() itself; by private parts of rospy (1.15.15)."""
import socket
import threading
from collections import deque
from contextlib import suppress

from rospy.msg import serialize_message


def heard_by(publisher):
    """The names of the nodes that are connected to `publisher` (`endpoint_id`): a stop that no node
    hears is not shown as done (test/ros/panel.test)."""
    return {connection.endpoint_id for connection in list(publisher.impl.connections)}


def write_at_once(publisher, most=1):
    """Let ``publish()`` itself write to each subscriber, as far as its buffers are free; else the
    latest `most` messages wait for it.

    rospy's queue has a thread for each subscriber. To wake it costs more than the message, and what
    is in the queue is lost when the process ends (`impl`, its `add_connection`;
    test/unit/test_node.py).
    """
    topic, add = publisher.impl, publisher.impl.add_connection

    def add_writing(connection):
        connection.write_data = _Writer(connection, most).write
        return add(connection)

    topic.set_queue_size(None)
    topic.add_connection = add_writing


class _Writer:
    """Writes to one connection, and never waits for it."""

    def __init__(self, connection, most):
        self._connection = connection
        self._lock = threading.Lock()    # guards the next two
        self._waiting = deque(maxlen=most)
        self._is_full = False            # then a thread writes what waits

    def write(self, data):
        with self._lock:
            if self._is_full:
                self._waiting.append(data)
                return
            sent = 0
            with suppress(BlockingIOError):
                sent = self._connection.socket.send(data, socket.MSG_DONTWAIT)
            self._is_full = sent < len(data)
            if self._is_full:
                threading.Thread(target=self._write, args=(data[sent:],), daemon=True).start()

    def _write(self, data):
        while data:
            try:
                self._connection.socket.sendall(data)
            except (OSError, AttributeError):    # the subscriber is gone, or was removed
                self._connection.close()
                return
            with self._lock:
                data = b''.join(self._waiting)
                self._waiting.clear()
                self._is_full = bool(data)


def publish_together(publisher, messages):
    """Publish messages by one write, as what a network has delayed: a subscriber with queue_size=1
    drops all but the last (`impl.buff`, which is written, and `seq`; test/ros/fake_robot.test)."""
    topic, (*before, last) = publisher.impl, messages
    topic.buff.truncate(topic.buff.seek(0))    # what a subscriber that left has not got
    for message in before:
        topic.seq += 1
        serialize_message(topic.buff, topic.seq, message)
    publisher.publish(last)
