"""Reads and changes internals of rospy 1.15.15. The docstring of a function says what goes wrong
without the function and names a test that fails if the internals change.
"""
import select
import socket
import threading
import time
from collections import deque
from contextlib import suppress

import rospy
from rospy.impl import tcpros_base
from rospy.impl.paramserver import get_param_server_cache
from rospy.impl.registration import RegManager, get_registration_listeners
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.msg import serialize_message


def connection_of(message):
    """Returns the header of the connection on which a message arrived, a dict. `callerid` is the
    name of the sender. `latching` is '1' if the sender repeats the last message to each new
    connection. :func:`record_connections` adds `connected_at` and `process`."""
    return message._connection_header


def sender_of(message):
    """Returns the printable letters of the name of a message's sender; '' if it is unknown."""
    name = connection_of(message).get('callerid', '')
    return ''.join(filter(str.isprintable, name))[:100]


def record_connections():
    """Add 'connected_at' [s, steady_time] and the sender's address 'process' to the header of each
    later connection. Call this function before a node subscribes. Without these fields, a node
    that starts again would obey a repeated True, and drive the robot. Internals: `_validate_header`
    and `endpoint_id` of TCPROSTransport; test: test/ros/start_order.test."""
    validate = TCPROSTransport._validate_header

    def validate_and_record(self, header):
        header.update(connected_at=time.clock_gettime(time.CLOCK_BOOTTIME),
                      process=self.endpoint_id)
        validate(self, header)

    TCPROSTransport._validate_header = validate_and_record


def log_without_the_master():
    """From now on write log lines even if the master has ended. Without this function rospy would
    ask the master before each line. Internals: the parameter cache; test: test/ros/network.test."""
    get_param_server_cache().set('/rosout_disable_topics_generation', False)


def serve_connections_in_threads(server=None):
    """Serve each connection in a separate thread. Otherwise a browser that connects to a node would
    block all clients. Internals: `_tcpros_server`, `inbound_handler`; test: test/unit/test_node.py.

    Closed connections are not served. A subscriber that gets two lists of publishers at nearly the
    same time connects twice, and closes its first connection. If this connection were served last,
    rospy would keep only this one, and the subscriber would get no messages."""
    server = server or tcpros_base._tcpros_server.tcp_ros_server
    serve = server.inbound_handler
    serving_lock = threading.Lock()    # one connection at a time is checked and served

    def serve_node(connection, address):
        is_node = _begins_with_header(connection)    # waits for the first bytes
        with serving_lock:
            if is_node and not _is_hung_up(connection):
                serve(connection, address)
            else:
                connection.close()

    def serve_in_thread(*client):
        threading.Thread(target=serve_node, args=client, daemon=True).start()

    server.inbound_handler = serve_in_thread
    server.server_sock.listen(128)    # with rospy's own limit a seventh client waits for 1 s


def _begins_with_header(connection):
    """Returns True for the connection of a node. A node first sends the length of its header, which
    is a small number. A browser first sends letters."""
    length_bytes = b''
    with suppress(OSError):
        length_bytes = connection.recv(4, socket.MSG_PEEK | socket.MSG_WAITALL)
    return len(length_bytes) == 4 and int.from_bytes(length_bytes, 'little') < 2 ** 16


def _is_hung_up(connection):
    hangup_poll = select.poll()
    hangup_poll.register(connection, select.POLLRDHUP)
    return bool(hangup_poll.poll(0))


def is_wall_time():
    """Returns True if ROS time is the time of the computer, and not of a simulated /clock."""
    return rospy.rostime.is_wallclock()


def join_publisher_lists(manager=None):
    """From now on join all lists of publishers that wait. If a publisher registers just after a
    subscriber, the master sends two lists. rospy itself would use only the list that arrives last,
    even if the other list is newer. A publisher that has ended only refuses the connection.
    Internals: `updates`, `publisher_update` of RegManager; test: test/unit/test_node.py."""
    manager = manager or next(listener for listener in get_registration_listeners().listeners
                              if isinstance(listener, RegManager))
    update = manager.publisher_update

    def update_with_waiting(name, addresses):
        with manager.cond:
            waiting_lists = [waiting for topic, waiting in manager.updates if topic == name]
            update(name, sorted(set(addresses).union(*waiting_lists)))

    manager.publisher_update = update_with_waiting


def subscribers_of(publisher):
    """Returns the names of the nodes that are connected to `publisher`. Internals: `impl`,
    `endpoint_id`; test: test/ros/panel.test."""
    return {connection.endpoint_id for connection in list(publisher.impl.connections)}


def make_writes_immediate(publisher, max_waiting=1):
    """From now on ``publish()`` itself writes to each subscriber. Messages in rospy's own queue
    would be lost when the process ends. If a subscriber's buffers are full, the last `max_waiting`
    messages wait. Internals: `impl`, its `add_connection`; test: test/unit/test_node.py."""
    topic = publisher.impl
    add_connection = topic.add_connection

    def add_writing_connection(connection):
        connection.write_data = _Writer(connection, max_waiting).write
        return add_connection(connection)

    topic.set_queue_size(None)
    topic.add_connection = add_writing_connection


class _Writer:
    """Writes to one connection. The caller of `write` never waits."""

    def __init__(self, connection, max_waiting):
        self._connection = connection
        self._lock = threading.Lock()    # guards `_waiting` and `_is_full`
        self._waiting = deque(maxlen=max_waiting)
        self._is_full = False            # the socket's buffer is full, and a thread writes

    def write(self, data):
        with self._lock:
            if self._is_full:
                self._waiting.append(data)
                return
            sent_count = 0
            with suppress(BlockingIOError):
                sent_count = self._connection.socket.send(data, socket.MSG_DONTWAIT)
            rest = data[sent_count:]
            self._is_full = bool(rest)
            if self._is_full:
                threading.Thread(target=self._write_rest, args=(rest,), daemon=True).start()

    def _write_rest(self, data):
        while data:
            try:
                self._connection.socket.sendall(data)
            except (OSError, AttributeError):    # the connection is closed
                self._connection.close()
                return
            with self._lock:
                data = b''.join(self._waiting)
                self._waiting.clear()
                self._is_full = bool(data)


def publish_together(publisher, messages):
    """Publish `messages` in one write, so that they arrive together. A subscriber with queue_size=1
    reads only the last message. Internals: `buff`, `seq`; test: test/ros/fake_robot.test."""
    *first_messages, last = messages
    topic = publisher.impl
    topic.buff.seek(0)
    topic.buff.truncate()    # remove data for a subscriber that has ended
    for message in first_messages:
        topic.seq += 1
        serialize_message(topic.buff, topic.seq, message)
    publisher.publish(last)
