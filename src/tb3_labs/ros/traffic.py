"""The rate of messages on a topic, including those that are dropped unread."""
import contextlib
import io
import time

import rospy

from tb3_labs.ros.rospy_internals import bytes_received


class Traffic:
    """Counts by the bytes that rospy received on a topic's connections, and the size of the first
    message.

    To be made after the node's own subscriber: both share its connections, and the first one
    decides how to connect.
    """

    def __init__(self, topic, kind):
        self._subscriber = rospy.Subscriber(topic, kind)    # no callback: it costs nothing
        self._size = None                                   # of a message [bytes]
        self._counted = 0, time.monotonic()                 # bytes, at
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
        with contextlib.suppress(KeyError):                 # two senders' first messages
            self._first.unregister()
