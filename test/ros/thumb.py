#!/usr/bin/env python3
"""A pad in a hand, for tests: publishes `joy` as joy_node does with autorepeat_rate."""
import threading

import rospy
from sensor_msgs.msg import Joy

A, B, Y = 0, 1, 2
#: Between two messages of a pad that repeats itself [s], and for how long a button is held.
PERIOD = 0.05
HELD = 0.06


class Thumb:
    """A pad that repeats itself 20 times a second, with stamps."""

    def __init__(self, topic='joy'):
        self.plugged = True
        self._axes, self._buttons = [0.0] * 6, [0] * 8
        self._publisher = rospy.Publisher(topic, Joy, queue_size=20, tcp_nodelay=True)
        threading.Thread(target=self._repeat, daemon=True).start()

    def _repeat(self):
        while not rospy.is_shutdown():
            if self.plugged:
                self._send()
            rospy.rostime.wallsleep(PERIOD)

    def _send(self):
        message = Joy(axes=list(self._axes), buttons=list(self._buttons))
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)

    def sticks(self, forward, left):
        """Push the sticks there, and hold them."""
        self._axes[1], self._axes[3] = forward, left
        self._send()

    def press(self, button):
        """Press and let go; returns when it was pressed [s]."""
        pressed = rospy.get_time()
        for down in (1, 0):
            self._buttons[button] = down
            self._send()
            rospy.rostime.wallsleep(HELD)
        return pressed
