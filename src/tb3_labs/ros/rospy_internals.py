"""The private parts of rospy that the nodes read or change, each behind one function.

They are those of rospy and rosgraph 1.15.15 (Debian 12). Each docstring names the part, the defect
of rospy, and the test that fails if the part changes. If it names no test, an AttributeError shows
the change: a node does not start, or ends at once.
"""
import logging
import os
import select
import threading
import time
from functools import partial
from io import BytesIO

import genpy
import rospy
from rosgraph.roslogging import RosStreamHandler
from rospy.impl import registration
from rospy.impl.rosout import RosOutHandler
from rospy.impl.tcpros_pubsub import QueuedConnection
from rospy.msg import serialize_message


# ----- messages that arrive -----

def connection_of(message):
    """The header of a message's connection: a dict of strings, the same object for all messages of
    one connection. 'callerid' is the sender. 'latching' is '1' if the sender's last message is sent
    to each new connection first.
    """
    return message._connection_header


def connected_for():
    """Returns the time since rospy began to connect to the sender of the present message [s]. Call
    it in the callback.

    Each connection has a thread of its own (`robust_connect_subscriber`), which calls the callback;
    the age of that thread is returned. If this changes, a stop from before the start of a node
    counts as new: test/ros/stops.test shows it.
    """
    with open('/proc/self/task/{}/stat'.format(threading.get_native_id())) as status:
        started_at = int(status.read().rpartition(')')[2].split()[19]) / os.sysconf('SC_CLK_TCK')
    return time.clock_gettime(time.CLOCK_BOOTTIME) - started_at


def stop_hearing_oneself(subscriber):
    """Close the connection from this node's own publisher to `subscriber`.

    rospy connects a node to itself as well, and each message then wakes two threads: driving costs
    more (`impl.connections`, `callerid_pub`; test/benchmark/nodes.py).
    """
    topic = subscriber.impl
    for connection in topic.connections:
        if connection.callerid_pub == rospy.get_name():
            topic.remove_connection(connection)


def bytes_received(subscriber):
    """Returns the number of bytes received so far on all connections of `subscriber`, with the
    length before each message: the second numbers of `impl.get_stats()` (test/ros/live.test).
    """
    _, connections = subscriber.impl.get_stats()
    return sum(received for _, received, *_ in connections)


# ----- messages that leave -----

#: Linux says that a socket has room if a third of its buffer is free. This number of bytes fits
#: into that third on every connection.
SURELY_TAKEN = 1024


def messages_written(publisher):
    """Returns {rospy's number of a connection: number of messages written to it}, the first and
    third numbers of `impl.get_stats()`.

    A node that ends waits for its last zero by these numbers: rospy may drop a message that is not
    written (test/ros/faults.test).
    """
    return {link[0]: link[2] for link in publisher.impl.get_stats()[2]}


def heard_by(publisher):
    """The names of the nodes that are connected to `publisher` (`endpoint_id`)."""
    return {connection.endpoint_id for connection in list(publisher.impl.connections)}


def publish_now(publisher, *messages):
    """Publish in the caller's own thread: one write to each subscriber's socket for all messages.

    ``publish()`` puts each message into a queue, and wakes a thread of each subscriber to write it:
    that costs more than the message. Here queue and thread are used only if a subscriber's
    socket is full or nearly full: the caller never waits.

    One write has the effect of a network that delivers delayed messages together: a subscriber with
    queue_size=1 finds all of them in one read, and drops all but the last.

    Raises what ``publish()`` raises. The publisher needs a queue_size (`impl`, `QueuedConnection`;
    test/unit/test_rospy_internals.py).
    """
    topic = publisher.impl
    if topic is None:
        raise rospy.ROSException('publish_now() to an unregistered handle')
    topic.acquire()
    try:
        if topic.closed:
            raise rospy.ROSException('publish_now() to a closed topic')
        if topic.is_latch:
            topic.latch = messages[-1]
        if topic.has_connections():
            _give_queues(topic)
            data = _serialised(topic, messages)
            for connection in topic.connections:
                _write(connection, data, len(messages))
            topic.message_data_sent += len(data)
    except genpy.SerializationError as problem:
        raise rospy.ROSSerializationException(str(problem)) from None
    finally:
        topic.release()


def _give_queues(topic):
    """Give a queue to each connection that has none.

    rospy tells the master about a topic before it knows the size of the topic's queues. A
    subscriber that connects before that has no queue, and its socket may block the publisher.
    """
    topic.connections = [each if isinstance(each, QueuedConnection) else
                         QueuedConnection(each, topic.queue_size) for each in topic.connections]


def _serialised(topic, messages):
    """All messages as they go over the wire, each after its length in 4 bytes."""
    buffer = BytesIO()
    for message in messages:
        topic.seq += 1
        serialize_message(buffer, topic.seq, message)
    return buffer.getvalue()


def _write(queue, data, count):
    """Write the data to a connection in one piece at once, or put it into its queue."""
    connection = queue._connection
    try:
        if _write_past(queue, connection.socket, data):
            connection.stat_bytes += len(data)
            connection.stat_num_msg += count
        else:
            queue.write_data(data)
            connection.stat_num_msg += count - 1    # the write counts as one message
    except (rospy.exceptions.TransportException, OSError):
        connection.close()      # this subscriber is gone; publish() does the same


def _write_past(queue, stream, data):
    """Write without the queue, if the queue is idle and the socket takes all of the data at once.
    Returns True if the data were written."""
    descriptor = -1 if stream is None else stream.fileno()    # read once: it may be closed
    if descriptor < 0 or len(data) > SURELY_TAKEN:
        return False
    room = select.poll()
    room.register(descriptor, select.POLLOUT)
    with queue._lock:
        # the queue's thread waits for data, and can do nothing else until this lock is free
        is_idle = queue._cond_data_available._waiters and not queue._queue
        if not (is_idle and room.poll(0)):
            return False
        stream.sendall(data)
        return True


# ----- log lines, time, the end -----

def print_by(put):
    """Print each log line by ``put(job)``, which calls `job()` later, in any thread. The line shows
    the time at which it was logged.

    rospy's own way hangs if the terminal blocks (RosStreamHandler's `_write`;
    test/ros/stops.test).
    """
    def write_later(write, *words):
        put(lambda: write(*words))

    for handler in _log_handlers(RosStreamHandler):
        handler._write = partial(write_later, handler._write)


def publish_log_by(put):
    """Publish each log line on /rosout by ``put(job)``, which calls `job()` later, in any thread.

    rospy's RosOutHandler asks the master for a parameter with each line (``get_param_cached`` asks
    again each time if it is not set), and hangs if the master cannot be reached (its `emit`;
    test/ros/network.test).
    """
    def emit_later(emit, record):
        record.msg, record.args = record.getMessage(), ()    # formatted now, published later
        put(lambda: emit(record))

    for handler in _log_handlers(RosOutHandler):
        handler.emit = partial(emit_later, handler.emit)


def _log_handlers(kind):
    return [each for each in logging.getLogger('rosout').handlers if isinstance(each, kind)]


def is_wall_time():
    """Is ROS time the computer's time, and not that of a simulated /clock?"""
    return rospy.rostime.is_wallclock()


def is_ending():
    """Has the shutdown begun? ``rospy.is_shutdown()`` is true only after its hooks."""
    return rospy.core.is_shutdown_requested()


def after_hooks(callback):
    """Call `callback()` at shutdown, after all hooks of ``rospy.on_shutdown()``, in their thread.
    If it were called before them, the process might end without its last zero velocity."""
    rospy.core.add_preshutdown_hook(lambda reason: callback())


_mended = []


def mend_registration():
    """Mend two defects of the thread that registers topics; to be called after init_node().

    First, if a publisher registers just after a subscriber, the subscriber gets two lists of
    publishers: the answer to its own registration, without that publisher, and the master's update
    with it. The update may come first. rospy uses the list that comes last, and drops the other:
    the two never connect. Here lists that wait are joined. A publisher that has ended refuses the
    connection, which is harmless.

    Second, rospy wakes the thread just before it sets the flag that ends the thread. So the
    shutdown waits 0.5 s for it, and the XML-RPC server, whose socket is closed, uses 0.2 s of
    computing. Here the thread is also woken after the flag is set.

    The parts are RegManager's `cond`, `updates` and `publisher_update`
    (test/unit/test_rospy_internals.py).
    """
    for manager in registration.get_registration_listeners().listeners:
        if isinstance(manager, registration.RegManager) and manager not in _mended:
            _mended.append(manager)
            rospy.core.add_shutdown_hook(lambda _reason, waker=manager: _wake(waker))
            join_updates(manager)


def _wake(manager):
    with manager.cond:
        manager.cond.notify_all()


def join_updates(manager):
    """Make a RegManager join the lists of publishers that wait. rospy drops all but the last."""
    update = manager.publisher_update

    def joined(name, addresses):
        with manager.cond:
            update(name, sorted(set(addresses).union(
                *(others for topic, others in manager.updates if topic == name))))

    manager.publisher_update = joined
