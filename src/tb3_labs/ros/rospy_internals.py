"""What touches rospy's private parts.

Checked with rospy 1.15.15 (Debian 12); QueuedConnection is the same on ros_comm's noetic branch,
where the queues came with 1.9.51. If a publisher's `impl` changes, with its lock, its counters or
its connections, :func:`publish_together` ends the embedded robot by an AttributeError at the end
of a network stall, or messages no longer arrive together: test/ros/fake_robot.test shows both. If
RosStreamHandler no longer prints by its `_write`, nodes print as rospy does, and hang where a
terminal takes no text: test/ros/stops.test shows it.
"""
import logging
from io import BytesIO

import genpy
import rospy
from rosgraph.roslogging import RosStreamHandler
from rospy.msg import serialize_message


def publish_together(publisher, messages):
    """Publish several messages by one write to the socket of each subscriber.

    So they come out of a network that held them up: a subscriber of the newest only (queue_size=1)
    finds all of them in one read, and drops all but the last. ``publish()`` for each makes as many
    writes, and a reader that is awake hears one after the other.

    Raises what ``publish()`` raises.
    """
    topic = publisher.impl
    if topic is None:
        raise rospy.ROSException('publish_together() to an unregistered handle')
    topic.acquire()
    try:
        if topic.closed:
            raise rospy.ROSException('publish_together() to a closed topic')
        if topic.is_latch:
            topic.latch = messages[-1]
        if topic.has_connections():
            data = _serialised(topic, messages)
            for connection in topic.connections:
                _write(connection, data, len(messages))
            topic.message_data_sent += len(data)
    except genpy.SerializationError as problem:
        raise rospy.ROSSerializationException(str(problem)) from None
    finally:
        topic.release()


def _serialised(topic, messages):
    """All messages as they go over the wire, each after its length in 4 bytes."""
    buffer = BytesIO()
    for message in messages:
        topic.seq += 1
        serialize_message(buffer, topic.seq, message)
    return buffer.getvalue()


def _write(connection, data, count):
    """Hand the data to a connection, or to the queue in front of it, as one piece."""
    transport = getattr(connection, '_connection', connection)
    try:
        connection.write_data(data)
        transport.stat_num_msg += count - 1     # the write counts as one message
    except (rospy.exceptions.TransportException, OSError):
        connection.close()      # this subscriber is gone; publish() does the same


def stop_hearing_oneself(subscriber):
    """rospy connects a subscriber to its own node as well: two threads woken by each message."""
    topic = subscriber.impl
    for connection in topic.connections:
        if connection.callerid_pub == rospy.get_name():
            topic.remove_connection(connection)


def connection_of(message):
    """The header of the connection that brought a message: a dict of strings, the same object for
    all messages of one connection. 'callerid' is the sender, 'latching' is '1' where its last
    message is sent to each new connection first."""
    return message._connection_header


def print_by(put):
    """Have log lines printed by ``put(job)``, which calls `job()` when it likes; they are as of the
    moment of logging all the same."""
    for handler in logging.getLogger('rosout').handlers:
        if isinstance(handler, RosStreamHandler):
            _print_by(handler, put)


def _print_by(handler, put):
    write = handler._write
    handler._write = lambda stream, text, color: put(lambda: write(stream, text, color))
