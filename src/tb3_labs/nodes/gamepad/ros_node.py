"""Connects the GamepadCore to ROS."""
import threading

import rospy
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool, String

from tb3_labs.handout import PRINTED_RESET
from tb3_labs.nodes.gamepad.core import GamepadCore
from tb3_labs.nodes.gamepad.pad import PadConfig, read_pad
from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.core_runner import CoreRunner, publish_diagnostics, values_of
from tb3_labs.ros.node import guarded
from tb3_labs.ros.parameters import read_config, read_model
from tb3_labs.ros.reset_client import call_reset
from tb3_labs.ros.topics import RENEWAL_HEADER, log_missing_topics, subscribe_events


class GamepadNode:
    """Drives a robot by a pad. Gives control to move_to_goal and takes it back."""

    def __init__(self):
        model = read_model()
        config = read_config(PadConfig)
        self._core = GamepadCore(config, model)
        self._control_publisher = rospy.Publisher(
            'ctrl_relinq', Bool, queue_size=20, latch=True, headers=RENEWAL_HEADER)
        self._published_holder = None
        self._holder_publisher = rospy.Publisher(
            'control_holder', String, queue_size=20, latch=True)
        self._runner = CoreRunner(lambda: self._core.tick(steady_time()), self._publish_output)
        rospy.on_shutdown(self._on_leave)
        self._runner.decide_now()
        subscribe_events('joy', Joy, lambda joy: self._runner.decide_after(self._core.on_joy, joy),
                         lambda joy: read_pad(joy.axes, joy.buttons, config))
        subscribe_events('ctrl_relinq', Bool, self._on_ctrl_relinq)
        subscribe_events('has_control', Bool,
                         lambda event: self._runner.decide_after(self._core.on_has_control, event))
        publish_diagnostics(model.name, lambda: self._runner.call_core(self._diagnose))
        log_missing_topics({'joy': self._core.pad.freshness}, 'is joy_node running (Debian has '
                           'none)? The page of web:=true is a pad, too')

    def _on_leave(self):
        self._runner.decide_after(lambda: self._core.on_leave(steady_time()))

    def _on_ctrl_relinq(self, event):
        if event.sender != rospy.get_name():    # this node also receives its own messages
            self._runner.decide_after(self._core.on_ctrl_relinq, event)

    def _publish_output(self, output):
        for granted in output.control_messages:
            self._control_publisher.publish(granted)
            if not granted:    # a node may treat the first message of a connection as old
                self._control_publisher.publish(granted)
        if output.renewal_is_due:
            self._control_publisher.publish(True)
        if output.is_reset_requested:    # in a thread, since move_to_goal may answer late
            threading.Thread(target=guarded(_reset), daemon=True).start()
        if output.holder is not self._published_holder:
            self._published_holder = output.holder
            self._holder_publisher.publish(output.holder.value)

    def _diagnose(self):
        joy = self._core.pad.freshness
        problem = '' if joy.count else joy.silence_text()
        return problem, dict(values_of(joy, steady_time()), holder=self._core.holder.value)


def _reset():
    try:
        call_reset(0.0, 0.0, 0.0)
        rospy.loginfo(PRINTED_RESET + '.')
    except ValueError as error:
        rospy.logwarn('Pose not reset: %s', error)
