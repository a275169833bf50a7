"""How many messages arrive on a topic, also those that are never read because newer ones came."""
import io
import time

import rospy

from tb3_labs.ros.rospy_internals import bytes_received


class Traffic:
    """Counts by what rospy itself knows of a topic's connections: the bytes that were received.

    To be made after the node's own subscriber: the two share its connections, and the first one
    says how to connect.
    """

    def __init__(self, topic, kind):
        self._subscriber = rospy.Subscriber(topic, kind, self._on_message)
        self._message = None
        self._counted = 0, time.monotonic()    # bytes, at

    def rate(self):
        """Messages a second [1/s] since the last call; 0 before the first message."""
        if self._message is None:
            return 0.0
        before, then = self._counted
        received, at = self._counted = bytes_received(self._subscriber), time.monotonic()
        return max(0, received - before) / self._size() / (at - then) if at > then else 0.0

    def _on_message(self, message):
        self._message = message

    def _size(self):
        """Bytes of a message on the wire: its length first, which takes 4."""
        buffer = io.BytesIO()
        self._message.serialize(buffer)
        return 4 + len(buffer.getvalue())
