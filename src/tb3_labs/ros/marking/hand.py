"""A hand on a mouse or a gamepad: a message that is repeated, as their drivers do."""
import threading

import rospy

from tb3_labs.ros.marking.waiting import wait, wait_until

#: How often the message is sent [s].
PERIOD = 0.05
#: A node that is ready connects within this time [s]. It may want to see a new pad at rest for a
#: moment before it obeys (this package's gamepad for 0.3 s): it has seen enough after SETTLED.
CONNECTING = 1.0
SETTLED = 0.45


class Hand:
    """Repeats the latest message on a topic, until it is closed.

    A ``with`` statement closes it at the end of the block.
    """

    def __init__(self, topic, kind):
        self._message = None
        self._closed = False
        self._publisher = rospy.Publisher(topic, kind, queue_size=1, tcp_nodelay=True)
        threading.Thread(target=self._repeat, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *problem):
        self.close()

    def hold(self, message):
        """Send this message from now on; None: nothing."""
        self._message = message
        self._send()

    def silence(self):
        """Send nothing, as after its plug was pulled."""
        self.hold(None)

    def wait_until_heard(self):
        """Wait until a node is connected and has heard the message that is held."""
        wait_until(self._publisher.get_num_connections, CONNECTING)
        wait(SETTLED)

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
            wait(PERIOD)
