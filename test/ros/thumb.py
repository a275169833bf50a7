"""A pad for tests. It publishes `joy` as joy_node does with autorepeat_rate."""
import contextlib
import threading
import time
from collections import deque

import rospy
from sensor_msgs.msg import Joy

A, B, Y = 0, 1, 2
#: Time between two messages of a pad that repeats itself [s], and time for which a button is held.
PERIOD = 0.05
HELD = 0.06
#: A pad that is silent for 0.25 s is lost, and a node must stop. On a late machine the thumb itself may be silent. A
#: test is void if the thumb was silent for longer than this [s].
PUNCTUAL = 0.2


class Thumb:
    """A pad that repeats itself 20 times a second, with stamps."""

    def __init__(self, topic='joy'):
        self.closed = False
        self.hangs_since = None      # the stamp of all messages of a driver that hangs
        self._axes, self._buttons = [0.0] * 6, [0] * 8
        self._sent = deque(maxlen=20000)     # times [s, monotonic]
        self._publisher = rospy.Publisher(topic, Joy, queue_size=20, tcp_nodelay=True)
        threading.Thread(target=self._repeat, daemon=True).start()

    def _repeat(self):
        while not (self.closed or rospy.is_shutdown()):
            self._sent.append(time.monotonic())
            with contextlib.suppress(rospy.ROSException):    # the topic is closed
                self._send()
            rospy.rostime.wallsleep(PERIOD)
        self._publisher.unregister()

    def _send(self):
        message = Joy(axes=list(self._axes), buttons=list(self._buttons))
        message.header.stamp = self.hangs_since or rospy.Time.now()
        self._publisher.publish(message)

    def sticks(self, forward, left):
        """Push the sticks to these deflections, and hold them."""
        self._axes[1], self._axes[3] = forward, left
        self._send()

    def press(self, button):
        """Press a button, and let go. Returns the time of the press [s]."""
        pressed = rospy.get_time()
        for down in (1, 0):
            self._buttons[button] = down
            self._send()
            rospy.rostime.wallsleep(HELD)
        return pressed

    def longest_silence(self, since):
        """Returns the longest time between two messages after `since` [s, monotonic]."""
        sent = [at for at in list(self._sent) if at >= since]
        return max([then - now for now, then in zip(sent, sent[1:])], default=0.0)


class WithThumb:
    """Mixin of a case with a `thumb`. A test is void if the thumb was silent."""

    def excuse(self, begun):
        """The reason why a test that began at a time [s, monotonic] was void, or ''."""
        silence = self.thumb.longest_silence(begun)
        return 'the thumb was silent for {:.2f} s'.format(silence) if silence >= PUNCTUAL else ''
