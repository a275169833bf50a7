"""How many messages come on a topic, also those that are overtaken by newer ones and never read."""
import io
import time

import rospy


class Traffic:
    """Counts by what rospy itself knows of a topic's connections: the bytes that were received.

    To be made after the node's own subscriber, which says how to connect.
    """

    def __init__(self, topic, kind):
        # shares the connections of the node's own subscriber
        self._subscriber = rospy.Subscriber(topic, kind, self._on_message)
        self._message = None
        self._counted = 0, time.monotonic()    # bytes, at

    def rate(self):
        """Messages a second since the last call."""
        if self._message is None:
            return 0.0
        (before, then), self._counted = self._counted, (self._bytes(), time.monotonic())
        received, at = self._counted
        return max(0, received - before) / self._size() / (at - then) if at > then else 0.0

    def _on_message(self, message):
        self._message = message

    def _bytes(self):
        _, connections = self._subscriber.impl.get_stats()
        return sum(received for _, received, *_ in connections)

    def _size(self):
        """Bytes of a message on the wire: its length first, which takes 4."""
        buffer = io.BytesIO()
        self._message.serialize(buffer)
        return 4 + len(buffer.getvalue())
