"""A hand on a mouse or a gamepad: a message that is repeated, as their drivers do."""
import threading

import rospy

#: How often the message is sent [s].
PERIOD = 0.05


class Hand:
    """Repeats the newest message on a topic."""

    def __init__(self, topic, kind):
        self._message = None
        self._closed = False
        self._publisher = rospy.Publisher(topic, kind, queue_size=1, tcp_nodelay=True)
        threading.Thread(target=self._repeat, daemon=True).start()

    def hold(self, message):
        """Send this from now on; None: nothing."""
        self._message = message
        self._send()

    def close(self):
        """Send nothing ever again."""
        self._message, self._closed = None, True

    def _send(self):
        message = self._message
        if message is not None:
            self._publisher.publish(message)

    def _repeat(self):
        while not (self._closed or rospy.is_shutdown()):
            self._send()
            rospy.rostime.wallsleep(PERIOD)
