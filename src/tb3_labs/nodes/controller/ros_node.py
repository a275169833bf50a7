"""Connects the ControllerCore to ROS and to the keyboard."""
import contextlib
import signal
import sys
import threading
import time

import rospy
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64

from tb3_labs.control.motor_response import MotorResponse
from tb3_labs.handout import CONTROLLER_GOODBYE
from tb3_labs.localization.gyro_check import GyroMonitor
from tb3_labs.msg import MouseController
from tb3_labs.nodes.controller.core import ControllerCore
from tb3_labs.nodes.controller.mouse import to_mouse
from tb3_labs.nodes.controller.turns import TurnConfig, make_turn_law, parse_turn
from tb3_labs.ros.clocks import ros_time, steady_time, wait_until
from tb3_labs.ros.core_runner import CoreRunner, publish_diagnostics, values_of
from tb3_labs.ros.live_settings import LiveSettings
from tb3_labs.ros.node import begin_shutdown, end_roslaunch, guarded
from tb3_labs.ros.parameters import read_config, read_model
from tb3_labs.ros.sensor_topics import subscribe_wheels, to_imu_sample
from tb3_labs.ros.topics import log_missing_topics, subscribe, subscribe_events
from tb3_labs.supervision.events import IncomingMessage
from tb3_labs.supervision.timeouts import ROBOT_WAIT_TIMEOUT


class ControllerNode:
    """Turns the robot on request of the keyboard or of a node. Drives the robot by a mouse."""

    def __init__(self):
        config = read_config(TurnConfig)
        self._model = read_model()
        self._response = MotorResponse()
        gyro = GyroMonitor(self._model, rospy.resolve_name('reset'))
        core = ControllerCore(self._make_law(config), gyro)
        self._robot_deadline = time.monotonic() + ROBOT_WAIT_TIMEOUT
        self._core = core
        self._runner = CoreRunner(self._tick)
        rospy.on_shutdown(lambda: rospy.loginfo(CONTROLLER_GOODBYE))
        self._wheels_are_published = subscribe_wheels(self._on_wheels)
        subscribe('imu', Imu, self._on_imu, to_imu_sample, idle_time=core.idle_time)
        subscribe_events('mouse_info', MouseController, self._on_mouse, to_mouse)
        subscribe_events('turn', Float64, self._on_turn)
        rospy.loginfo('Type l (left), r (right), b (about turn), a number of degrees, or q (quit), '
                      'and Enter')
        read_keyboard(self._on_line, self._on_keyboard_end)
        publish_diagnostics(self._model.name, lambda: self._runner.call_core(self._diagnose))
        log_missing_topics({'imu': core.imu})
        LiveSettings(config, self._use_config)
        self._runner.decide()

    def _make_law(self, config):
        return make_turn_law(config, self._model, self._response)

    def _use_config(self, config):
        self._runner.call_and_decide(self._core.set_law, self._make_law(config))

    def _tick(self):
        return self._core.tick(ros_time(), steady_time())

    def _on_wheels(self, sample):
        self._runner.call_core(self._core.on_wheels, sample)

    def _on_imu(self, sample):
        self._runner.call_and_decide(
            lambda: self._core.on_imu(sample, ros_time(), self._wheels_are_published()))

    def _on_mouse(self, mouse):
        self._runner.call_and_decide(self._core.on_mouse, mouse)

    def _on_turn(self, turn):
        self._runner.call_and_decide(lambda: self._core.on_turn(turn, ros_time()))

    def _on_line(self, line):
        if line.lower() == 'q':
            end_roslaunch()
            begin_shutdown()
            return
        try:
            degrees = parse_turn(line.lower())
        except ValueError as error:
            rospy.logwarn('%s', error)
            return
        wait_until(lambda: self._core.imu.is_fresh(ros_time()),
                   self._robot_deadline - time.monotonic())
        turn = IncomingMessage(degrees, steady_time())
        self._runner.call_and_decide(lambda: self._core.on_typed(turn, ros_time()))

    @staticmethod
    def _on_keyboard_end():
        rospy.loginfo('No keyboard (any more): turn by "rostopic pub -1 %s std_msgs/Float64 -- '
                      '90", or drive by the mouse', rospy.resolve_name('turn'))

    def _diagnose(self):
        core = self._core
        now = ros_time()
        values = {**values_of(core.imu, now), **values_of(core.mice.freshness, steady_time()),
                  'driver': core.driver.value,
                  'mouse': 'active' if core.mice.is_active else 'not active'}
        return core.problem_text(now), values


def read_keyboard(on_line, on_end):
    """Call `on_line(text)` for each line of the standard input, and `on_end()` at the end.

    The standard input may be a terminal, a pipe, or the terminal of roslaunch. If there is no
    standard input, or if the node is a background job, `on_end()` is called immediately.
    """
    handle_line, handle_end = guarded(on_line), guarded(on_end)

    def read_lines():
        if sys.stdin is not None:    # without a standard input, descriptor 0 may be another file
            with contextlib.suppress(OSError):
                # A thread that reads sys.stdin holds a lock, and Python waits for this lock when
                # the node ends. Reading descriptor 0 without a buffer needs no lock.
                for line in open(0, 'rb', buffering=0, closefd=False):
                    handle_line(line.decode(errors='replace').strip())
        handle_end()

    # Without this line, SIGTTIN would suspend a background job that reads from its terminal.
    signal.signal(signal.SIGTTIN, signal.SIG_IGN)
    threading.Thread(target=read_lines, name='keyboard', daemon=True).start()
