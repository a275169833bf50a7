"""How a node subscribes: it uses only the latest sample, but every event.

A permission, a turn or a goal is an event: a person sends it at one moment. Events are used in
their order, each once, and only if they are new (supervision/events.py). A subscriber that keeps
only the latest message loses events: a node reads delayed messages all at once.
"""
import threading
import time
from collections import Counter

import rosgraph
import rospy

from tb3_labs.ros.clocks import ros_time, steady_time
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import connection_of, is_wall_time, sender_of
from tb3_labs.supervision.events import Event, MessageAges, SenderConnection

#: In the header of a sender that renews its permission: if it dies, the permission expires.
RENEWS = {'renewed': '1'}
#: {topic: number of its invalid messages, which were dropped}
DROPPED = Counter()
#: Time between two warnings of one kind [s, wall clock].
WARNING_PERIOD = 1.0
#: Time before the first reminder of missing topics, and between later ones [s, wall clock].
FIRST_REMINDER, NEXT_REMINDER = 2.0, 10.0


class WarningThrottle:
    """Logs one warning in WARNING_PERIOD; rospy's own throttle stops with a simulated clock."""

    def __init__(self):
        self._warned_at = -WARNING_PERIOD

    def warn(self, text, *arguments):
        """Log a warning, unless there was one a moment ago."""
        if time.monotonic() - self._warned_at >= WARNING_PERIOD:
            self._warned_at = time.monotonic()
            rospy.logwarn(text, *arguments)


def subscribe(topic, kind, callback, read=None, queue_size=1, idle_for=None):
    """Returns a guarded subscriber. If several messages come at once, it gets the latest
    `queue_size`; with None it gets all. Older messages are dropped, and not even deserialised.

    `read` turns the message into the argument of `callback`. If it raises ``ValueError``, the
    message is dropped with one warning a second, and counted in `DROPPED`.

    After each message the topic is not read for the time `idle_for(now)` [s], if it is given: this
    saves most of a rospy node's cost. With simulated time every message is read.
    """
    in_rhythm = idle_for is not None and is_wall_time()
    warnings = WarningThrottle()

    def handle(message):
        try:
            value = message if read is None else read(message)
        except ValueError as problem:
            warnings.warn('invalid message on %s dropped: %s', topic, problem)
            DROPPED[topic] += 1
            return
        callback(value)
        if in_rhythm:
            time.sleep(idle_for(ros_time()))

    return rospy.Subscriber(topic, kind, guarded(handle), queue_size=queue_size,
                            buff_size=65536, tcp_nodelay=True)


def subscribe_events(topic, kind, callback, read=lambda message: message.data):
    """Returns a guarded subscriber whose `callback` gets every message, as `read` reads it, as an
    events.Event; see :func:`subscribe`."""
    to_age = ages(topic)

    def to_event(message):
        connection, at = sender_connection(message), steady_time()
        sent = _stamp_of(message) if is_wall_time() else 0.0    # a simulated clock has another pace
        return Event(read(message), at, connection.sender, to_age(message), connection.renews, sent)

    return subscribe(topic, kind, callback, to_event, queue_size=None)


def ages(topic):
    """Returns a function for the events.Age of a message; call it once for each message."""
    message_ages = MessageAges(publishers_of(rospy.resolve_name(topic)), steady_time())
    return lambda message: message_ages.age_of(
        sender_connection(message), steady_time(), _stamp_of(message), ros_time())


def _stamp_of(message):
    return message.header.stamp.to_sec() if hasattr(message, 'header') else 0.0


def sender_connection(message):
    """Returns the events.SenderConnection on which a message arrived."""
    header = connection_of(message)
    return SenderConnection(sender_of(header), header['process'], header['connected_at'],
                            header.get('latching') == '1', RENEWS.items() <= header.items())


def require_master():
    """Raises ``ValueError`` if no ROS master answers, or if ROS_MASTER_URI is not an address."""
    uri = rosgraph.get_master_uri()
    try:
        answers = rosgraph.is_master_online()
    except ValueError:
        raise ValueError(f'ROS_MASTER_URI {uri} is not an address such as '
                         'http://192.168.0.5:11311') from None
    if not answers:
        raise ValueError(f'no ROS master answers at {uri}: start a launch file first')


def publishers_of(topic):
    published, _, _ = rosgraph.Master(rospy.get_name()).getSystemState()
    return {node for name, nodes in published if name == topic for node in nodes}


def log_missing_topics(received, hint='is the robot running?'):
    """Log reminders while /clock, or another topic, has no message. `received`: {topic: function
    that returns whether a message has arrived}; `hint`: the thing to check."""
    def run():
        time.sleep(FIRST_REMINDER)
        while not rospy.is_shutdown():
            missing = [rospy.resolve_name(topic) for topic, is_received in received.items()
                       if not is_received()]
            if rospy.get_time() == 0.0:
                rospy.logerr('/use_sim_time is true, but nobody publishes /clock: start a '
                             'simulation, or: rosparam set /use_sim_time false, and start again')
            elif missing:
                rospy.loginfo('Waiting for %s: %s', ' and '.join(missing), hint)
            else:
                return
            time.sleep(NEXT_REMINDER)

    threading.Thread(target=guarded(run), name='reminder', daemon=True).start()
