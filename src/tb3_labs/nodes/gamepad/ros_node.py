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
        self._runner = CoreRunner(self._tick, self._publish_output)
        rospy.on_shutdown(self._on_leave)
        self._runner.decide()
        subscribe_events('joy', Joy, self._on_joy,
                         lambda joy: read_pad(joy.axes, joy.buttons, config))
        subscribe_events('ctrl_relinq', Bool, self._on_ctrl_relinq)
        subscribe_events('has_control', Bool, self._on_has_control)
        publish_diagnostics(model.name, lambda: self._runner.call_core(self._diagnose))
        log_missing_topics({'joy': self._core.pad.freshness}, 'is joy_node running (Debian has '
                           'none)? The page of web:=true is a pad, too')

    def _tick(self):
        return self._core.tick(steady_time())

    def _on_leave(self):
        self._runner.call_and_decide(lambda: self._core.on_leave(steady_time()))

    def _on_joy(self, joy):
        self._runner.call_and_decide(self._core.on_joy, joy)

    def _on_ctrl_relinq(self, event):
        if event.sender != rospy.get_name():    # this node also receives its own messages
            self._runner.call_and_decide(self._core.on_ctrl_relinq, event)

    def _on_has_control(self, event):
        self._runner.call_and_decide(self._core.on_has_control, event)

    def _publish_output(self, output):
        for granted in output.control_messages:
            self._control_publisher.publish(granted)
            if not granted:    # again, since a node may treat the first message as an old one
                self._control_publisher.publish(granted)
        if output.renewal_is_due:
            self._control_publisher.publish(True)
        if output.is_reset_requested:    # a thread calls move_to_goal, whose answer may be late
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
