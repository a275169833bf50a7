#!/usr/bin/env python3
"""Publishes this computer's mouse, which drives the robot in the IMU lab.

Scrolling down activates the mouse. Scrolling up deactivates the mouse at once. While the mouse is
active, the node sends the mouse's position at a steady rate, so that the robot notices the end of
the node. While the mouse is not active, the node sends the position only if the mouse moves.

Publishes
    mouse_info   tb3_labs/MouseController: status, and the position on the screen, -1 to 1, x to
                 the right, y up, (0, 0) in the middle
"""
import tb3_labs.ros.early_signals    # noqa: F401 (first, so that Ctrl+C works in later imports)

import os
import threading
import time

import rospy
from std_msgs.msg import Bool

from tb3_labs.msg import MouseController
from tb3_labs.ros.node import begin_shutdown, guarded, run_node

SEND_PERIOD = 1.0 / 30.0    # [s], while the mouse is active


class MouseNode:
    """Publishes the computer's mouse as `mouse_info`."""

    def __init__(self):
        self._is_active = False
        self._send_now = threading.Event()
        self._lock = threading.Lock()    # guards _is_closed and the publisher
        self._is_closed = False
        # latched, so that a controller that starts later knows if the mouse is active
        self._publisher = rospy.Publisher('mouse_info', MouseController, queue_size=1,
                                          tcp_nodelay=True, latch=True)
        try:
            self._pointer = Pointer(self._on_scroll, self._on_move)
        except ValueError as error:    # this node ends without failure, and other nodes go on
            rospy.logwarn(str(error))
            begin_shutdown()
            return
        rospy.on_shutdown(self._close)
        rospy.loginfo('Scroll down to drive by the mouse, scroll up to stop')
        threading.Thread(target=guarded(self._publish_positions), name='mouse', daemon=True).start()

    def _on_scroll(self, steps):
        if steps < 0 and not self._is_active:
            self._is_active = True
            rospy.loginfo('Mouse activated: scroll up to stop')
        elif steps > 0 and self._is_active:
            self._is_active = False
            rospy.loginfo('Mouse deactivated')
        self._send_now.set()

    def _on_move(self):
        if not self._is_active:
            self._send_now.set()

    def _publish_positions(self):
        while not rospy.is_shutdown():
            try:
                position = self._pointer.position()
            except ValueError as error:
                begin_shutdown(str(error))
                return
            with self._lock:
                if not self._is_closed:
                    self._publish(self._is_active, *position)
            if not self._is_active:
                time.sleep(SEND_PERIOD)    # limits the rate of messages if the mouse moves fast
            longest_wait = SEND_PERIOD if self._is_active else None
            self._send_now.wait(longest_wait)
            self._send_now.clear()

    def _publish(self, is_active, x=0.0, y=0.0):
        message = MouseController(status=Bool(is_active), xPos=x, yPos=y)
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)

    def _close(self):
        """Publish an inactive mouse, so that the robot stops at once, not only after a timeout."""
        with self._lock:
            self._is_closed = True
            if self._is_active:
                self._publish(is_active=False)


class Pointer:
    """Reads the position, the movements and the wheel of the mouse on X11, with the package pynput.
    Raises ``ValueError`` if the mouse cannot be read, or if the display is lost."""

    def __init__(self, on_scroll, on_move):
        """A thread of pynput calls `on_move()` when the mouse moves, and `on_scroll(steps)` when
        the wheel turns. `steps` is positive for scrolling up."""
        if os.environ.get('WAYLAND_DISPLAY'):
            raise ValueError('the mouse cannot be read in a Wayland session: log in again with '
                             'an "Xorg" (X11) session')
        if not os.environ.get('DISPLAY'):
            raise ValueError('no display: the mouse can only be read on a computer with a screen '
                             '(DISPLAY is not set)')
        try:
            from pynput import mouse
            from Xlib import display
        except ImportError as error:    # pynput also raises ImportError if there is no display
            if (error.name or '').startswith('pynput'):
                raise ValueError('the mouse needs the Python package pynput: source '
                                 'scripts/setup.sh installs it') from None
            raise ValueError(f'cannot open the display {os.environ["DISPLAY"]}') from None
        self._mouse = mouse.Controller()
        self._root = display.Display().screen().root
        # the listener is a daemon thread, because on X11 its stop() and join() would hang
        self._listener = mouse.Listener(on_move=lambda x, y: on_move(),
                                        on_scroll=lambda x, y, dx, dy: on_scroll(dy))
        self._listener.start()
        self._listener.wait()

    def position(self):
        """Returns (x, y) on the screen, each from -1 to 1, x to the right, y up."""
        try:
            screen = self._root.get_geometry()
            pixel_x, pixel_y = self._mouse.position
            return screen_position(pixel_x, pixel_y, screen.width, screen.height)
        except Exception as error:    # the classes of some exceptions of Xlib are private
            raise ValueError(f'lost the display of the mouse ({error})') from None


def screen_position(pixel_x, pixel_y, width, height):
    """Returns (x, y) of a pixel, each from -1 to 1. Pixel (0, 0) is the top left corner."""
    x = 2.0 * pixel_x / max(width - 1, 1) - 1.0
    y = 1.0 - 2.0 * pixel_y / max(height - 1, 1)
    return max(-1.0, min(1.0, x)), max(-1.0, min(1.0, y))


if __name__ == '__main__':
    run_node('mouse', MouseNode, __doc__)
