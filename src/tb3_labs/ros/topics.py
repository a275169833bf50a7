"""Subscribes a node to topics. A node needs only the latest sample of a sensor, but every event.

Permissions, turns and goals are events, because a person sends each of them at one moment. A node
uses each event once, in order, and only if the event is new (supervision/events.py). After a delay
several events arrive together, and a queue of one message would lose all but the last event.
"""
import threading
import time
from collections import Counter

import rosgraph
import rospy

from tb3_labs.ros.clocks import ros_time, steady_time
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import connection_of, is_wall_time, sender_of
from tb3_labs.supervision.events import IncomingMessage, NoveltyFinder, SenderConnection

#: A sender with this header in its connections announces that it will renew its permission.
RENEWAL_HEADER = {'renewed': '1'}
#: {topic: number of messages that were dropped because they were invalid}
INVALID_COUNTS = Counter()
WARNING_PERIOD = 1.0          # [s, wall clock]
FIRST_REMINDER_DELAY = 2.0    # [s, wall clock]
FIRST_REMINDER_PAUSE = 10.0   # [s, wall clock]


class WarningThrottle:
    """Logs at most one warning in WARNING_PERIOD. The throttle of rospy would use ROS time."""

    def __init__(self):
        self._warned_at = -WARNING_PERIOD

    def warn(self, text, *arguments):
        if time.monotonic() - self._warned_at >= WARNING_PERIOD:
            self._warned_at = time.monotonic()
            rospy.logwarn(text, *arguments)


def subscribe(topic, message_type, callback, read=None, queue_size=1, idle_time=None):
    """Returns a subscriber. If several messages arrive together, the subscriber reads only the
    latest `queue_size` messages, or all messages if `queue_size` is None.

    `read` converts a message to the argument of `callback`. If `read` raises ``ValueError``, the
    message is dropped and counted in INVALID_COUNTS.

    If `idle_time` is given, the topic is not read for `idle_time(now)` seconds after each message.
    This pause saves most of a node's computing time. If time is simulated, there is no pause.
    """
    may_idle = idle_time is not None and is_wall_time()
    warnings = WarningThrottle()

    def on_message(message):
        try:
            value = message if read is None else read(message)
        except ValueError as error:
            warnings.warn('invalid message on %s dropped: %s', topic, error)
            INVALID_COUNTS[topic] += 1
            return
        callback(value)
        if may_idle:
            time.sleep(idle_time(ros_time()))

    return rospy.Subscriber(topic, message_type, guarded(on_message), queue_size=queue_size,
                            buff_size=65536, tcp_nodelay=True)


def subscribe_events(topic, message_type, callback, read=lambda message: message.data):
    """Returns a subscriber that reads every message. `callback` gets an
    events.IncomingMessage, whose content is the result of `read`."""
    novelty_of = novelty_reader(topic)

    def to_incoming_message(message):
        arrived_at = steady_time()
        connection = sender_connection(message)
        # a delay is unknown if time is simulated, since this clock may run faster than real time
        sent_at = _stamp_of(message) if is_wall_time() else 0.0
        return IncomingMessage(read(message), arrived_at, connection.sender, novelty_of(message),
                               has_renewals=connection.has_renewals, sent_at=sent_at)

    return subscribe(topic, message_type, callback, to_incoming_message, queue_size=None)


def novelty_reader(topic):
    """Returns a function to call with each message, which returns the message's events.Novelty."""
    novelty_finder = NoveltyFinder(publishers_of(rospy.resolve_name(topic)), steady_time())
    return lambda message: novelty_finder.find(
        sender_connection(message), steady_time(), _stamp_of(message), ros_time())


def _stamp_of(message):
    return message.header.stamp.to_sec() if hasattr(message, 'header') else 0.0


def sender_connection(message):
    """Returns the events.SenderConnection on which a message arrived."""
    header = connection_of(message)
    has_renewals = RENEWAL_HEADER.items() <= header.items()
    return SenderConnection(
        sender=sender_of(message), process=header['process'], connected_at=header['connected_at'],
        is_latched=header.get('latching') == '1', has_renewals=has_renewals)


def require_master():
    """Raises ``ValueError`` if no ROS master answers, or if ROS_MASTER_URI is not an address."""
    if not rosgraph.is_master_online():
        raise ValueError(f'no ROS master answers at {rosgraph.get_master_uri()}: start a launch '
                         'file first')


def publishers_of(topic):
    published, _, _ = rosgraph.Master(rospy.get_name()).getSystemState()
    return set(dict(published).get(topic, []))


def log_missing_topics(freshness_of_topics, remedy='is the robot running?'):
    """Log reminders until a message has arrived on each topic of `freshness_of_topics`, a {topic:
    Freshness}, and from a simulated clock on /clock. Each reminder ends with `remedy`. The pause
    between two reminders doubles, because reminders must not hide other lines."""
    def remind():
        time.sleep(FIRST_REMINDER_DELAY)
        pause = FIRST_REMINDER_PAUSE
        while not rospy.is_shutdown():
            missing = [rospy.resolve_name(topic) for topic, freshness in freshness_of_topics.items()
                       if freshness.count == 0]
            if rospy.get_time() == 0.0:
                rospy.logerr('/use_sim_time is true, but nobody publishes /clock: start a '
                             'simulation, or: rosparam set /use_sim_time false, and start again')
            elif missing:
                rospy.loginfo('Waiting for %s: %s', ' and '.join(missing), remedy)
            else:
                return
            time.sleep(pause)
            pause *= 2.0

    threading.Thread(target=guarded(remind), name='reminder', daemon=True).start()
