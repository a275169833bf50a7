"""The ROS side of move_to_goal; scripts/move2goal_tf.py describes its interface."""
import threading

import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from tb3_labs.control.driving import PreciseLaw
from tb3_labs.control.goal_state import DriveConfig
from tb3_labs.control.motor_response import Response
from tb3_labs.localization.contradiction import GyroWatch
from tb3_labs.nodes.move_to_goal.core import MoveToGoalConfig, MoveToGoalCore
from tb3_labs.nodes.move_to_goal.ros_display import DriveStatusPublisher, LocalDisplay
from tb3_labs.nodes.move_to_goal.ros_goals import GoalInterfaces
from tb3_labs.nodes.move_to_goal.ros_resets import ControlTaker, Resets
from tb3_labs.ros.clocks import ros_time, steady_time
from tb3_labs.ros.conversions import frame, to_odometry_sample
from tb3_labs.ros.gate import (
    CmdVel, Diagnostics, Watchdog, hear_other_drivers, log_news, values_of)
from tb3_labs.ros.parameters import LiveSettings, read_config, read_model
from tb3_labs.ros.sensor_topics import say_what_is_awaited, subscribe_wheels, to_imu_sample
from tb3_labs.ros.topics import subscribe


class MoveToGoalNode:
    """Connects ROS and the MoveToGoalCore.

    The order of locks: first actionlib's lock, which GoalInterfaces holds while it calls this
    object, then `_changed`. So a thread that holds `_changed` does not call GoalInterfaces (checked
    by test_lock_order.py).
    """

    def __init__(self):
        start, drive = read_config(MoveToGoalConfig, DriveConfig)
        if rospy.has_param('~has_control'):    # a later start must not read it, and drive
            rospy.delete_param('~has_control')
        self._model = read_model()
        self._response = Response()    # of this robot, learned while it moves
        self._core = MoveToGoalCore(PreciseLaw(drive, self._model, self._response),
                                    start.has_control, self._response,
                                    GyroWatch(self._model, rospy.resolve_name('reset')))
        self._core.set_goal(start.goal)
        self._changed = threading.Condition()    # guards the core; see the order of locks above
        self._cmd_vel = CmdVel()
        self._display = LocalDisplay(frame('local'), frame('odom'))
        self._resets = Resets(self._core, self._changed, self._display.forget_path)
        self._status = DriveStatusPublisher(self._core, frame('local'))
        self._control = ControlTaker()
        self._watchdog = Watchdog(self._pass)
        self._goals = GoalInterfaces(self)
        self._resets.offer()
        hear_other_drivers(self._heard_command)
        LiveSettings(drive, self._on_settings)
        self._pass()
        self._control.hear(self._told_control)
        self._sends_wheels = subscribe_wheels(self._on_wheels)
        subscribe('imu', Imu, self._on_imu, to_imu_sample, self._core.imu,
                  idle_for=self._core.idle_for)
        # every message is read: any of them may have the displacement that the firmware reverses
        subscribe('odom', Odometry, self._on_odometry, to_odometry_sample,
                  self._core.odometry, queue_size=None)
        self._core.begin_control(steady_time())    # a slow start does not count as a sleep
        Diagnostics(self._model.name, self._diagnose)
        say_what_is_awaited({'imu': lambda: self._core.imu.count,
                             'odom': lambda: self._core.odometry.count})

    def _on_imu(self, sample):
        self._pass(lambda: self._core.on_imu(sample, ros_time(), self._sends_wheels()))
        self._watchdog.feed()

    def _on_odometry(self, sample):
        self._pass(lambda: self._core.on_odometry(sample, ros_time()), steps=False)

    def _on_wheels(self, sample):
        with self._changed:
            self._core.on_wheels(sample)

    def _heard_command(self, sender, twist):
        with self._changed:
            self._core.on_command(sender, twist.linear.x, twist.angular.z, ros_time())

    def _told_control(self, word):
        self._pass(lambda: self._core.told_control(word))

    def _pass(self, take_in=lambda: None, steps=True, shows=False):
        """Take something in and carry out what comes out, in one hold of the lock: commands and
        stops leave in the order in which they were decided. The client of a goal hears of it after
        that."""
        with self._changed:
            try:
                take_in()
            finally:    # also if a goal is refused
                now = ros_time()
                output = self._core.tick(now, steady_time(), steps)
                self._carry_out(output, now, shows)
        if output.end is not None:
            self._goals.ended(*output.end)
        if output.fix is not None:
            self._goals.feedback(output.fix, self._display.frame)

    def _carry_out(self, output, now, shows):
        """Carry out a DriveOutput of the core, but for its end; `shows`: publish a status, too."""
        if output.stops_first:
            self._cmd_vel.stop()
        if output.command is not None:
            self._cmd_vel.send(output.command)
        self._control.say(self._core.control_stands)
        self._watchdog.keep(awake=output.watched)
        self._resets.tell(output.resets)
        log_news(output.news)
        if output.acts or output.news or shows:
            self._status.update(now)
        if output.fix is not None:
            self._status.plot(output.fix)
            self._display.show(output.fix, self._core.odom_T_local)

    def hear_goal(self, request):
        """A GoalRequest has arrived; GoalInterfaces calls this, and the next two."""
        self._pass(lambda: self._core.hear_goal(request, steady_time()), steps=False)

    def on_goal(self, request):
        """Drive to the goal of `request`. Raises ``ValueError`` with the reason of a refusal."""
        self._pass(lambda: self._core.on_goal(request), steps=False, shows=True)

    def on_cancel(self, name, stamp):
        """Cancel goals. Returns True if this ends the drive."""
        with self._changed:
            is_meant = self._core.on_cancel(steady_time(), name, stamp)
            if is_meant:
                self._cmd_vel.stop()
                self._status.update(ros_time())
            return is_meant

    def _on_settings(self, drive):
        law = PreciseLaw(drive, self._model, self._response)
        with self._changed:
            self._core.set_law(law)

    def _diagnose(self):
        with self._changed:
            now = ros_time()
            problem, values = self._status.report(now)
            return problem, dict(
                values_of(self._core.imu, now), **values_of(self._core.odometry, now), **values)
