"""The ROS side of move_to_goal; scripts/move2goal_tf.py describes its interface."""
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool

from tb3_labs.control.driving import PreciseLaw
from tb3_labs.control.goal_state import DriveConfig
from tb3_labs.control.motor_response import Response
from tb3_labs.localization.contradiction import GyroWatch
from tb3_labs.nodes.move_to_goal.core import MoveToGoalConfig, MoveToGoalCore
from tb3_labs.nodes.move_to_goal.ros_display import Display
from tb3_labs.nodes.move_to_goal.ros_requests import GoalServer, Resets
from tb3_labs.ros.clocks import ros_time, steady_time
from tb3_labs.ros.conversions import to_odometry_sample
from tb3_labs.ros.gate import Diagnostics, Gate, hear_other_drivers, values_of
from tb3_labs.ros.parameters import LiveSettings, read_config, read_model
from tb3_labs.ros.sensor_topics import say_what_is_awaited, subscribe_wheels, to_imu_sample
from tb3_labs.ros.topics import subscribe, subscribe_events


class MoveToGoalNode:
    """Hears the robot, its goals and resets, and who gives control; drives the robot."""

    def __init__(self):
        start, drive = read_config(MoveToGoalConfig, DriveConfig)
        if rospy.has_param('~has_control'):    # a later start must not read it, and drive
            rospy.delete_param('~has_control')
        self._model = read_model()
        self._response = Response()    # of this robot, learned while it moves
        self._core = core = MoveToGoalCore(self._law(drive), start.has_control, self._response,
                                           GyroWatch(self._model, rospy.resolve_name('reset')))
        core.set_goal(start.goal)
        self._display = Display()
        self._has_control = None
        self._control = rospy.Publisher('has_control', Bool, queue_size=20, latch=True)
        self._gate = gate = Gate(lambda: core.tick(ros_time(), steady_time()), self._say,
                                 self._carry_out)
        self._goals = GoalServer(gate, core)
        self._goals.offer()
        Resets(gate, core).offer()
        hear_other_drivers(lambda sender, twist: gate.ask(
            core.on_command, sender, twist.linear.x, twist.angular.z, ros_time()))
        LiveSettings(drive, lambda new: gate.take_in(core.set_law, self._law(new)))
        gate.look()
        subscribe_events('ctrl_relinq', Bool, lambda word: gate.take_in(core.on_word, word))
        self._sends_wheels = subscribe_wheels(lambda sample: gate.ask(core.on_wheels, sample))
        subscribe('imu', Imu, self._on_imu, to_imu_sample, core.imu, idle_for=core.idle_for)
        # every message is read: any of them may have the displacement that the firmware reverses;
        # what it shows is decided with the next sample of the IMU, which is fresher
        subscribe('odom', Odometry,
                  lambda sample: gate.ask(core.on_odometry, sample, ros_time()),
                  to_odometry_sample, core.odometry, queue_size=None)
        core.begin_control(steady_time())    # a slow start does not count as a sleep
        Diagnostics(self._model.name, lambda: gate.ask(self._diagnose))
        say_what_is_awaited({'imu': lambda: core.imu.count, 'odom': lambda: core.odometry.count})

    def _law(self, drive):
        return PreciseLaw(drive, self._model, self._response)

    def _on_imu(self, sample):
        output = self._gate.take_in(self._core.on_imu, sample, ros_time(), self._sends_wheels())
        if output.fix is not None:
            self._display.show(output.fix, output.odom_T_local)
            self._goals.feedback(output.fix)

    def _say(self, output):
        if output.control_stands is not self._has_control:
            self._has_control = output.control_stands
            self._control.publish(output.control_stands)

    def _carry_out(self, output):
        self._goals.answer(output.answers)
        if output.status is not None:
            self._display.show_status(output.status)

    def _diagnose(self):
        core, now = self._core, ros_time()
        status = core.status(now)
        return status.failure or status.sensor_problem, dict(
            values_of(core.imu, now), **values_of(core.odometry, now),
            state=status.words or 'about to begin',
            control='granted' if status.has_control else 'not granted', goal=status.goal)
