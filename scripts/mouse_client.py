#!/usr/bin/env python3
"""The real mouse of this computer as a topic: the IMU lab's mouse controller.

Scrolling down activates the mouse, scrolling up deactivates it at once. While it is active, its
position is sent at a steady rate, so a robot notices when this node dies. Else it is sent when the
mouse moves.

Publishes
    mouse_info   tb3_labs/MouseController: status, and the position on the screen, -1 to 1, x to
                 the right, y up, (0, 0) in the middle
Parameters
    ~rate        messages a second while the mouse is active (30)
"""
import tb3_labs.ros.early_ctrl_c    # noqa: F401 (first: it is for the other imports)

import threading
import time
from dataclasses import dataclass

import rospy
from std_msgs.msg import Bool

from tb3_labs.config import Config, setting
from tb3_labs.msg import MouseController
from tb3_labs.ros.devices.pointer import Pointer
from tb3_labs.ros.node import end, guarded, run
from tb3_labs.ros.parameters import read_config


@dataclass(frozen=True)
class MouseConfig(Config):
    """The rate of the mouse's messages."""

    rate: float = setting(30.0, 'messages while the mouse is active', '1/s', 10.0, 200.0)


class Mouse:
    """Publishes the computer's mouse as `mouse_info`."""

    def __init__(self):
        self._period = 1.0 / read_config(MouseConfig).rate
        self._active = False
        self._stirred = threading.Event()
        self._lock = threading.Lock()    # guards what is published: nothing after the last message
        self._closed = False
        # latched: a controller that starts hears at once that the mouse is not active
        self._publisher = rospy.Publisher('mouse_info', MouseController, queue_size=1,
                                          tcp_nodelay=True, latch=True)
        try:
            self._pointer = Pointer(self._on_scroll, self._on_move)
        except ValueError as problem:    # the others of its launch go on without a mouse
            rospy.logwarn(str(problem))
            end()
            return
        rospy.on_shutdown(self._close)
        rospy.loginfo('Scroll down to drive by the mouse, scroll up to stop')
        threading.Thread(target=guarded(self._run), name='mouse', daemon=True).start()

    def _on_scroll(self, up):
        if self._active is up:
            self._active = not up
            rospy.loginfo('Mouse %s', 'deactivated' if up else 'activated: scroll up to stop')
        self._stirred.set()

    def _on_move(self):
        if not self._active:
            self._stirred.set()

    def _run(self):
        while not rospy.is_shutdown():
            try:
                position = self._pointer.position()
            except ValueError as problem:
                end(str(problem))
                return
            self._send(self._active, *position)
            if not self._active:
                time.sleep(self._period)    # bounds the rate of a mouse that moves fast
            self._stirred.wait(self._period if self._active else None)
            self._stirred.clear()

    def _send(self, active, x, y):
        with self._lock:
            if not self._closed:
                self._publish(active, x, y)

    def _publish(self, active, x, y):
        message = MouseController(status=Bool(active), xPos=x, yPos=y)
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)

    def _close(self):
        """Publish that the mouse is not active, so that the robot need not wait for a timeout."""
        with self._lock:
            self._closed = True
            if self._active:
                self._publish(False, 0.0, 0.0)


if __name__ == '__main__':
    run('mouse', Mouse)
