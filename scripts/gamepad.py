#!/usr/bin/env python3
"""Drives the robot by a gamepad, hands it over to move_to_goal, and resets its local frame.

Left stick up/down drives, right stick left/right turns; A lets move_to_goal drive, B takes the
robot back, Y declares the robot to be at (0, 0, 0) in local.

Subscribes
    joy             sensor_msgs/Joy, best with autorepeat (gamepad.launch)
    ctrl_relinq     std_msgs/Bool: False of other nodes, which takes control from move_to_goal
    has_control     std_msgs/Bool: does move_to_goal have control, given by any node?
Publishes
    cmd_vel         geometry_msgs/Twist, only while a stick is off its middle; then one zero
    ctrl_relinq     std_msgs/Bool, latched: True = move_to_goal may drive, renewed while this pad
                    gives control; False at each press of B
    control_holder  std_msgs/String, latched: gamepad, move_to_goal or nobody
    /diagnostics
Calls
    reset_pose      tb3_labs/ResetPose, or, if no node offers that:
    set_pose        tb3_labs/SetInitialPose
Parameters
    ~linear_axis, ~angular_axis, ~relinquish_button, ...: see PadConfig in tb3_labs.nodes.pad
    ~model or TURTLEBOT3_MODEL in the environment: burger, waffle, waffle_pi
"""
import tb3_labs.ros.start    # noqa: F401 (first: Ctrl+C ends the imports below)

import threading

import rospy
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool, String

from tb3_labs.nodes.gamepad_core import GamepadCore
from tb3_labs.nodes.pad import PAD_TIMEOUT, PadConfig, read_pad
from tb3_labs.ros.clocks import remind, steady_time
from tb3_labs.ros.cmd_vel import CmdVel, Diagnostics, Watchdog, values_of
from tb3_labs.ros.node import guarded, log_news, run, when_stopped
from tb3_labs.ros.operator import ControlSender, call_reset, hear_takers
from tb3_labs.ros.parameters import read_config, read_model
from tb3_labs.ros.topics import sent_at, subscribe

#: If no node publishes joy within this time, a warning is logged [s].
PAD_WAIT = 3.0


class GamepadNode:
    """Connects ROS and the GamepadCore."""

    def __init__(self):
        model = read_model()
        self._config = read_config(PadConfig)
        self._core = GamepadCore(self._config, model)
        self._lock = threading.RLock()    # guards the core, and the order of publications
        self._holder = None
        self._control = ControlSender()
        self._holders = rospy.Publisher('control_holder', String, queue_size=20, latch=True)
        self._resets = ResetClient()
        self._cmd_vel = CmdVel()
        self._watchdog = Watchdog(self._tick, quiet_time=0.8 * PAD_TIMEOUT)
        rospy.on_shutdown(self._leave)
        when_stopped(self._leave, lambda: None)
        self._tick()
        # every message is read: a press counts even if many messages arrive at once
        pads = subscribe('joy', Joy, self._on_joy, self._to_pad, self._core.joy, queue_size=None)
        remind(lambda: _say_if_nobody_sends(pads), PAD_WAIT)
        hear_takers(self._on_taken)
        subscribe('has_control', Bool, self._on_control, queue_size=None)
        Diagnostics(model.name, self._diagnose)

    def _to_pad(self, message):
        return read_pad(message.axes, message.buttons, self._config), sent_at(message)

    def _on_joy(self, heard):
        with self._lock:
            self._core.on_joy(heard[0], steady_time(), heard[1])
            self._tick()
        self._watchdog.feed()
        if self._core.take_reset():
            self._resets.reset()

    def _on_taken(self):
        with self._lock:
            self._core.on_taken(steady_time())
        self._tick()

    def _on_control(self, message):
        with self._lock:
            self._core.on_control(message.data, steady_time())
        self._tick()

    def _tick(self):
        """Send the command that is due, then publish the holder of the robot."""
        with self._lock:
            now = steady_time()
            self._core.update(now)
            if self._core.due(now):
                self._cmd_vel.send(self._core.command(now))
            self._say_who_holds(now)
            log_news(self._core.take_news())
            self._watchdog.keep(awake=self._core.watched)

    def _say_who_holds(self, now):
        if self._core.holder is not self._holder:
            self._holder = self._core.holder
            self._holders.publish(self._holder.value)
        for word in self._core.messages.take():
            self._control.say(word, now)
        if self._core.messages.grants:
            self._control.renew(now)

    def _diagnose(self):
        with self._lock:
            problem = '' if self._core.joy.count else 'no joy yet'
            return problem, dict(values_of(self._core.joy, steady_time()),
                                 holder=self._core.holder.value)

    def _leave(self):
        """Stop the robot and take control back: the operator leaves."""
        with self._lock:
            if self._core.messages.grants:
                self._core.on_taken(steady_time())
                self._tick()


class ResetClient:
    """Declares the robot to be at (0, 0, 0) in local, without blocking the caller."""

    def __init__(self):
        self._asked = threading.Event()
        threading.Thread(target=guarded(self._run), name='reset', daemon=True).start()

    def reset(self):
        """Ask for a reset. All requests during a call become one more call after it."""
        self._asked.set()

    def _run(self):
        while self._asked.wait():
            self._asked.clear()
            try:
                call_reset(0.0, 0.0, 0.0)
                rospy.loginfo('Pose reset successfully.')
            except ValueError as problem:
                rospy.logwarn('Pose not reset: %s', problem)


def _say_if_nobody_sends(pads):
    if not pads.get_num_connections():
        rospy.logwarn('nobody publishes %s: sudo apt install ros-noetic-joy (Debian has none), or '
                      'web:=true, whose page is a pad', pads.resolved_name)


if __name__ == '__main__':
    run('gamepad', GamepadNode)
