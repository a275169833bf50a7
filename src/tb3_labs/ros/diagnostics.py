"""Publishes `/diagnostics` of a driving node once a second, while another program subscribes to
them, such as rqt_robot_monitor or rostopic echo."""
import contextlib
import io
import threading
import time

import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_updater import Updater

from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import bytes_received

REPORT_PERIOD = 1.0    # [s, wall clock]


class Diagnostics:
    """Publishes the answer of `report()`: ``(problem or '', {name: value})``.

    `report` is called without a lock once a second, also without a subscriber, so that its rates
    are those of the last second.
    """

    def __init__(self, hardware, report):
        self._report = report
        self._latest = '', {}
        self._updater = Updater()
        self._updater.setHardwareID(hardware)
        self._updater.add('state', self._fill)    # the Updater puts the node's name before it
        self._ending = threading.Event()
        rospy.on_shutdown(self._ending.set)
        threading.Thread(target=guarded(self._run), name='diagnostics', daemon=True).start()

    def _run(self):
        while not self._ending.wait(REPORT_PERIOD):
            self._latest = self._report()
            if self._updater.publisher.get_num_connections():
                self._updater.force_update()

    def _fill(self, status):
        problem, values = self._latest
        status.summary(DiagnosticStatus.WARN if problem else DiagnosticStatus.OK, problem or 'OK')
        for name, value in values.items():
            status.add(name, str(value))
        return status


class SourceReport:
    """The age, the rate and the number of invalid messages of each source, for a report."""

    def __init__(self, *sources):
        """Each is (freshness.Freshness, topic, type, clock of its age); see also Traffic."""
        self._sources = [(source, Traffic(topic, kind), clock)
                         for source, topic, kind, clock in sources]

    def values(self):
        """Returns {'imu age [s]': '0.004', 'imu rate [1/s]': '200.1', ...}."""
        values = {}
        for source, traffic, clock in self._sources:
            values[source.name + ' age [s]'] = '{:.3f}'.format(source.age(clock()))
            values[source.name + ' rate [1/s]'] = '{:.1f}'.format(traffic.rate())
            values[source.name + ' dropped'] = source.dropped
        return values


class Traffic:
    """The rate of messages on a topic, including those that are dropped unread: the bytes that
    rospy receives on the topic's connections, divided by the size of the first message.

    Make this object after the node's own subscriber: both share the connections, and the first
    subscriber decides how to connect.
    """

    def __init__(self, topic, kind):
        self._subscriber = rospy.Subscriber(topic, kind)    # no callback: it costs nothing
        self._size = None                                   # of a message [bytes]
        self._counted = 0, time.monotonic()                 # bytes, time [s]
        self._first = rospy.Subscriber(topic, kind, self._on_first)

    def rate(self):
        """Messages a second [1/s] since the last call; 0 before the first message."""
        if self._size is None:
            return 0.0
        before, then = self._counted
        received, at = self._counted = bytes_received(self._subscriber), time.monotonic()
        return max(0, received - before) / self._size / (at - then) if at > then else 0.0

    def _on_first(self, message):
        buffer = io.BytesIO()
        message.serialize(buffer)
        self._size = 4 + len(buffer.getvalue())             # with the 4 bytes of its length
        with contextlib.suppress(KeyError):                 # already done, for another sender
            self._first.unregister()
