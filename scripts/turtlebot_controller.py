#!/usr/bin/env python3
"""Turns the robot by keyboard with IMU feedback, beside the mouse: the IMU lab.

Keyboard: l (90 degrees left), r (90 right), b (180, about turn), a number of degrees (left
positive), q (quit); each with Enter.

Subscribes
    imu           sensor_msgs/Imu
    joint_states  sensor_msgs/JointState, if it is sent: the wheels show a wrong gyro
    turn          std_msgs/Float64 [deg], left positive: for scripts, in place of the keyboard
    mouse_info    tb3_labs/MouseController, from mouse_client.py
Publishes
    cmd_vel       geometry_msgs/Twist, only while turning or driven by the mouse; then one zero
    /diagnostics
Parameters
    ~max_ang_z, ~tolerance_deg, ...: see TurnConfig in tb3_labs.control.turning; they may change
    while it runs: dynparam set /controller max_ang_z 1.0
    ~model or TURTLEBOT3_MODEL in the environment: burger, waffle, waffle_pi
"""
import tb3_labs.ros.start    # noqa: F401 (first: Ctrl+C ends the imports below)

import contextlib
import signal
import sys
import threading
import time

import rospy
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64

from tb3_labs.control.motor_response import Response
from tb3_labs.control.turning import TurnConfig, degrees_of, make_turn
from tb3_labs.localization.contradiction import GyroWatch
from tb3_labs.msg import MouseController
from tb3_labs.nodes.controller_core import ControllerCore
from tb3_labs.ros.clocks import Complaints, steady_time, wait_until
from tb3_labs.ros.cmd_vel import CmdVel, Diagnostics, Watchdog, values_of
from tb3_labs.ros.conversions import to_mouse
from tb3_labs.ros.node import end, end_roslaunch, guarded, log_news, run
from tb3_labs.ros.parameters import LiveSettings, read_config, read_model
from tb3_labs.ros.rospy_internals import connection_of, sender_of
from tb3_labs.ros.sensor_topics import say_what_is_awaited, subscribe_wheels, to_imu_sample
from tb3_labs.ros.topics import sent_at, subscribe, subscribe_events
from tb3_labs.supervision.driver import Driver

#: A turn that is asked for before the robot is connected waits this long for the robot [s].
ROBOT_WAIT = 5.0


class ControllerNode:
    """Connects ROS, the keyboard and the ControllerCore."""

    def __init__(self):
        config = read_config(TurnConfig)
        self._model = read_model()
        self._response = Response()    # of this robot, learned while it moves
        self._core = ControllerCore(make_turn(config, self._model, self._response),
                                    GyroWatch(self._model, rospy.resolve_name('reset')))
        self._driver = Driver.NOBODY
        self._lock = threading.Lock()    # guards `_core` and `_driver`
        self._robot_wait = time.monotonic() + ROBOT_WAIT
        self._cmd_vel = CmdVel()
        self._complaints = Complaints()    # of turns that are refused
        rospy.on_shutdown(lambda: rospy.loginfo('Controller exiting. Halting robot.'))
        self._watchdog = Watchdog(self._tick)
        self._sends_wheels = subscribe_wheels(self._on_wheels)
        subscribe('imu', Imu, self._on_imu, to_imu_sample, self._core.imu,
                  idle_for=self._idle_for)
        # every message is read: scrolling up stops at once, even if later messages came with it
        subscribe('mouse_info', MouseController, self._on_mouse,
                  lambda message: (message, to_mouse(message)), self._core.mouse.source,
                  queue_size=None)
        subscribe_events('turn', Float64, self._on_turn)
        rospy.loginfo('Type l (left), r (right), b (about turn), a number of degrees, or q (quit), '
                      'and Enter')
        Keyboard(self._on_line, self._on_keyboard_end)
        Diagnostics(self._model.name, self._diagnose)
        say_what_is_awaited({'imu': lambda: self._core.imu.count})
        LiveSettings(config, self._on_settings)
        self._tick()

    def _on_imu(self, sample):
        with self._lock:
            self._core.on_imu(sample, rospy.get_time(), self._sends_wheels())
        self._tick()
        self._watchdog.feed()

    def _on_wheels(self, sample):
        with self._lock:
            self._core.on_wheels(sample)

    def _idle_for(self, now):
        with self._lock:
            return self._core.idle_for(now)

    def _on_mouse(self, heard):
        message, mouse = heard
        with self._lock:
            self._core.on_mouse(*mouse, steady_time(), sender_of(connection_of(message)),
                                sent_at(message))
        self._tick()
        self._watchdog.feed()

    def _on_turn(self, turn):
        self._turn(lambda now: self._core.on_turn(turn, now), self._complaints.warn)

    def _on_settings(self, config):
        law = make_turn(config, self._model, self._response)
        with self._lock:
            self._core.set_law(law)

    def _on_line(self, line):
        if line.lower() == 'q':
            end_roslaunch()
            end()
            return
        try:
            degrees = degrees_of(line.lower())
        except ValueError as problem:
            rospy.logwarn('%s', problem)
            return
        self._wait_for_robot()
        self._turn(lambda now: self._core.ask(degrees, now))

    def _wait_for_robot(self):
        wait_until(
            lambda: self._cmd_vel.is_heard and self._core.imu.is_fresh(rospy.get_time()),
            self._robot_wait - time.monotonic())

    @staticmethod
    def _on_keyboard_end():
        rospy.loginfo('No keyboard (any more): turn by "rostopic pub -1 %s std_msgs/Float64 -- '
                      '90", or drive by the mouse', rospy.resolve_name('turn'))

    def _turn(self, ask, complain=rospy.logwarn):
        with self._lock:
            self._core.update(steady_time())
            try:
                ask(rospy.get_time())
            except ValueError as problem:
                complain('%s', problem)
        self._tick()

    def _tick(self):
        """Send the command that is due; after a change of the driver, one zero comes first."""
        with self._lock:
            now = rospy.get_time()
            self._core.update(steady_time())
            due = self._core.due(now)
            command = self._core.command(now) if due else None
            if self._core.driver is not self._driver:
                self._driver = self._core.driver
                self._cmd_vel.stop()
            if due:
                self._cmd_vel.send(command)
            self._watchdog.keep(awake=self._core.watched)
            log_news(self._core.take_news())

    def _diagnose(self):
        with self._lock:
            problem = self._core.problem(rospy.get_time())
            return problem, dict(values_of(self._core.imu, rospy.get_time()),
                                 **values_of(self._core.mouse.source, steady_time()),
                                 driver=self._core.driver.value,
                                 mouse='active' if self._core.mouse.active else 'not active')


class Keyboard:
    """Calls `on_line(text)` for each line typed or piped in, and `on_end()` once after the last.

    It works in a terminal, in an xterm, under roslaunch (which gives its own terminal to its
    nodes), and from a pipe. Without input (no terminal, or a job in the background) `on_end()` is
    called at once.
    """

    def __init__(self, on_line, on_end):
        self._on_line = guarded(on_line)
        self._on_end = guarded(on_end)
        # This signal stops a job in the background that reads its terminal. If the signal is
        # ignored, the read fails instead.
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        threading.Thread(target=self._run, name='keyboard', daemon=True).start()

    def _run(self):
        if sys.stdin is not None:      # else descriptor 0 may belong to another file by now
            with contextlib.suppress(OSError):
                # Unbuffered: a thread that waits in Python's own buffer holds a lock that the
                # interpreter needs to end.
                for line in open(0, 'rb', buffering=0, closefd=False):
                    self._on_line(line.decode(errors='replace').strip())
        self._on_end()


if __name__ == '__main__':
    run('controller', ControllerNode)
