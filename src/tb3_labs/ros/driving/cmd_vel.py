"""The one way in which this package drives and stops a robot.

A node that drives publishes commands. When it stops, for any reason, it publishes exactly one zero
and is then silent, so that another node may drive. The zero is also sent when the node shuts down
(Ctrl+C, SIGTERM, a closed terminal, an exception that ended it), when the process is stopped by
Ctrl+Z, and when the node's clock stands still. A process that ends, or is stopped, waits until the
zero is written to each subscriber.
"""
import math
import threading
import time

import rospy
from geometry_msgs.msg import Twist

from tb3_labs.ros.clocks import ClockWatch, wait_until
from tb3_labs.ros.conversions import to_twist
from tb3_labs.ros.rospy_internals import messages_written, publish_now
from tb3_labs.ros.signals import when_stopped

#: Longest wait for the last zero to leave the process [s],
DELIVERY_TIME = 0.15
#: time between two looks [s],
LOOK_AGAIN = 0.002
#: and one more wait [s]: a command that was under way at the first look may be taken for the zero.
MARGIN = 0.01


class CmdVel:
    """Publishes `cmd_vel` (geometry_msgs/Twist)."""

    def __init__(self):
        self._lock = threading.Lock()  # guards the next two, and the order of publications
        self._driving_since = None     # [s, monotonic]; None while nothing is driven
        self._closed = False           # for good, or until the process goes on
        self._publisher = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        self._clock = ClockWatch(self.stop)
        rospy.on_shutdown(self._close)
        when_stopped(self._close, self._open)

    @property
    def is_heard(self):
        """Does a robot (or any node) listen?"""
        return self._publisher.get_num_connections() > 0

    @property
    def driving_for(self):
        """Time for which this node has been driving without a stop [s]; 0 while it is not."""
        since = self._driving_since
        return time.monotonic() - since if since is not None else 0.0

    def drive(self, linear, angular):
        """Send one command: forward speed [m/s], rate of turn [rad/s]. 0, 0 is :meth:`stop`, and so
        is every command while the clock stands still. ``ValueError`` if a number is not finite."""
        if not (math.isfinite(linear) and math.isfinite(angular)):
            raise ValueError('command ({}, {}) is not finite'.format(linear, angular))
        with self._lock:
            if linear == angular == 0.0 or not self._clock.runs:
                self._stop()
            elif not self._closed:
                self._driving_since = self._driving_since or time.monotonic()
                publish_now(self._publisher, to_twist(linear, angular))

    def send(self, command):
        """Send the command of a core: a Twist2, or None to stop."""
        if command is None:
            self.stop()
        else:
            self.drive(command.linear, command.angular)

    def stop(self):
        """Send one zero if this node was driving, otherwise nothing. True if a zero was sent."""
        with self._lock:
            return self._stop()

    def _stop(self):
        was_driving = self._driving_since is not None
        if was_driving:
            self._driving_since = None
            publish_now(self._publisher, to_twist(0.0, 0.0))
        return was_driving

    def _close(self):
        with self._lock:
            self._closed = True
            before = messages_written(self._publisher)
            if self._stop():
                self._wait_until_written(before)

    def _wait_until_written(self, before):
        """Wait for the zero: rospy puts messages into a queue, which it drops at shutdown."""
        def is_written():
            now = messages_written(self._publisher)
            return all(now.get(link, count + 1) > count for link, count in before.items())
        wait_until(is_written, DELIVERY_TIME, LOOK_AGAIN)
        time.sleep(MARGIN)

    def _open(self):
        with self._lock:
            self._closed = rospy.is_shutdown()
