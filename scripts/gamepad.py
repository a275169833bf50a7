#!/usr/bin/env python3
"""Drives the robot by a gamepad, hands it over to move_to_goal, and resets its local frame.

Left stick up/down drives, right stick left/right turns; A lets move_to_goal drive, B takes the
robot back, Y declares the robot to be at (0, 0, 0) in local.

Subscribes
    joy             sensor_msgs/Joy, best with autorepeat (gamepad.launch)
Publishes
    cmd_vel         geometry_msgs/Twist, only while a stick is off its middle, one zero after it
    ctrl_relinq     std_msgs/Bool, latched: True = move_to_goal may drive; renewed while it may
    control_holder  std_msgs/String, latched: gamepad, move_to_goal or nobody
    /diagnostics
Calls
    reset_pose      tb3_labs/ResetPose
Parameters
    ~linear_axis, ~angular_axis, ~relinquish_button, ...: see PadConfig in tb3_labs.pad
    ~model or TURTLEBOT3_MODEL in the environment: burger, waffle, waffle_pi
"""
import threading

import rospy
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool, String

from tb3_labs.pad import PadConfig
from tb3_labs.pad_controller import PadController
from tb3_labs.permission import LAPSE
from tb3_labs.ros.cmd_vel import CmdVel
from tb3_labs.ros.diagnostics import Diagnostics, SourceReport
from tb3_labs.ros.news import log_news
from tb3_labs.ros.node import run, subscribe
from tb3_labs.ros.permissions import WILL_BE_RENEWED
from tb3_labs.ros.parameters import read_config, read_model
from tb3_labs.ros.reset_client import ResetClient
from tb3_labs.ros.rivals import Rivals
from tb3_labs.ros.traffic import Traffic
from tb3_labs.ros.watchdog import Watchdog

#: How often a permission is renewed [s].
RENEWAL = 0.2 * LAPSE


class Gamepad:
    """Glue between ROS and the core's PadController."""

    def __init__(self):
        model = read_model()
        self._pad = PadController(read_config(PadConfig), model)
        self._lock = threading.RLock()    # guards it, and what was published of it
        self._holder = None
        self._renewed_at = 0.0
        self._relinquished = rospy.Publisher('ctrl_relinq', Bool, queue_size=1, latch=True,
                                             headers=WILL_BE_RENEWED)
        self._holders = rospy.Publisher('control_holder', String, queue_size=1, latch=True)
        self._resets = ResetClient()
        self._cmd_vel = CmdVel()
        self._rivals = Rivals(self._cmd_vel)
        self._watchdog = Watchdog(self._tick)
        rospy.on_shutdown(self._close)
        self._tick()
        subscribe('joy', Joy, self._on_joy)
        self._sources = SourceReport((self._pad.joy, Traffic('joy', Joy)))
        Diagnostics(model.name, self._diagnose)

    def _on_joy(self, message):
        try:
            with self._lock:
                self._pad.on_joy(message.axes, message.buttons, rospy.get_time())
        except ValueError as problem:
            rospy.logwarn_throttle(1.0, 'bad message on joy dropped: {}'.format(problem))
            self._pad.joy.dropped += 1
            return
        self._tick()
        self._watchdog.feed()
        if self._pad.take_reset():
            self._resets.reset()

    def _tick(self):
        """Send the command that is due, and say who holds the robot: zero first, then the news."""
        with self._lock:
            now = rospy.get_time()
            if self._pad.due(now):
                self._cmd_vel.send(self._pad.command(now))
            self._say_who_holds(now)
            log_news(self._pad.take_news())
            self._watchdog.keep(awake=self._pad.watched)

    def _say_who_holds(self, now):
        if self._pad.holder is not self._holder:
            self._holder = self._pad.holder
            self._holders.publish(self._holder.value)
        elif not self._pad.relinquished or abs(now - self._renewed_at) < RENEWAL:
            return
        self._renewed_at = now
        self._relinquished.publish(self._pad.relinquished)

    def _diagnose(self):
        with self._lock:
            now = rospy.get_time()
            problem = self._rivals.complaint or ('' if self._pad.joy.count else 'no joy yet')
            return problem, dict(self._sources.values(now), holder=self._pad.holder.value)

    def _close(self):
        """An operator who leaves takes the robot along."""
        with self._lock:
            if self._pad.relinquished:
                self._relinquished.publish(False)


if __name__ == '__main__':
    run('gamepad', Gamepad)
