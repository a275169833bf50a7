"""Connects the MoveToGoalCore to ROS."""
import math
import sys
from collections import deque

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, Twist, Vector3
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool, ColorRGBA, String
from visualization_msgs.msg import Marker, MarkerArray

from tb3_labs.control.drive_law import DriveConfig, DriveLaw
from tb3_labs.control.motor_response import MotorResponse
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.gyro_check import GyroMonitor
from tb3_labs.nodes.move_to_goal.core import MoveToGoalCore
from tb3_labs.nodes.move_to_goal.ros_goals_and_resets import GoalServer, ResetServer
from tb3_labs.nodes.move_to_goal.status import MoveToGoalConfig
from tb3_labs.robot.turtlebot3 import Twist2
from tb3_labs.ros.clocks import ros_time, steady_time
from tb3_labs.ros.conversions import (
    frame_name, to_odometry_sample, to_pose_stamped, to_transform)
from tb3_labs.ros.core_runner import CoreRunner, publish_diagnostics, values_of
from tb3_labs.ros.live_settings import LiveSettings
from tb3_labs.ros.node import parent_roslaunch
from tb3_labs.ros.parameters import read_config, read_model
from tb3_labs.ros.rospy_internals import sender_of
from tb3_labs.ros.sensor_topics import subscribe_wheels, to_imu_sample
from tb3_labs.ros.topics import log_missing_topics, subscribe, subscribe_events

#: The path gets a new point after this distance [m], or after a turn by this angle [rad].
PATH_POINT_DISTANCE = 0.02
PATH_POINT_ANGLE = math.radians(10.0)
MAX_PATH_POINTS = 1000    # for a longer path, the oldest points are removed
TRANSFORM_PERIOD = 0.1    # time [s] between two equal transforms
PATH_PERIOD = 0.2         # [s]
MARKER_PERIOD = 1.0       # [s]

MARKER_ORANGE = ColorRGBA(r=1.0, g=0.55, b=0.0, a=1.0)
PALE_YELLOW = ColorRGBA(r=1.0, g=0.95, b=0.6, a=0.6)
WHITE = ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)


def pop_permission():
    """Remove `_has_control:=VALUE` from the arguments of this process. Returns the value, or False.
    init_node() would set a parameter from this argument, by which a later node would also drive."""
    typed_control = False
    values = {'true': True, 'false': False}
    for word in list(sys.argv):
        name, _, value = word.partition(':=')
        if name == '_has_control':
            sys.argv.remove(word)
            typed_control = values.get(value.lower(), value)    # read_config() refuses a text
    return typed_control


def _has_control_at_start(typed_control):
    """Returns False if roslaunch has restarted this node, else the value `typed_control`."""
    launch = parent_roslaunch()
    giver_parameter = rospy.get_name() + '_given_by'    # contains the roslaunch that gave control
    if launch and typed_control is True:
        if rospy.get_param(giver_parameter, 0) == launch:
            rospy.logwarn('This launch gave control before: False, then True, gives it again')
            return False
        rospy.set_param(giver_parameter, launch)
    return typed_control


class MoveToGoalNode:
    """Drives to goals in a local frame. See scripts/move2goal_tf.py for the interface."""

    def __init__(self, typed_control):
        start_config, drive_config = read_config(
            MoveToGoalConfig, DriveConfig,
            typed_values={'has_control': _has_control_at_start(typed_control)})
        self._model = read_model()
        self._response = MotorResponse()
        gyro = GyroMonitor(self._model, rospy.resolve_name('reset'))
        core = MoveToGoalCore(
            self._make_law(drive_config), start_config.has_control, self._response, gyro)
        core.set_goal(start_config.goal)
        self._core = core
        self._display = Display()
        self._published_control = None
        self._control_publisher = rospy.Publisher('has_control', Bool, queue_size=20, latch=True)
        self._runner = CoreRunner(self._tick, self._publish_output, self._carry_out)
        self._goals = GoalServer(self._runner, core)
        self._goals.offer()
        ResetServer(self._runner, core)
        subscribe('cmd_vel', Twist, self._on_command)
        LiveSettings(drive_config, self._use_config)
        subscribe_events('ctrl_relinq', Bool, self._on_ctrl_relinq)
        self._wheels_are_published = subscribe_wheels(self._on_wheels)
        subscribe('imu', Imu, self._on_imu, to_imu_sample, idle_time=core.idle_time)
        # every message is read, since the firmware may reverse the displacement of one message
        subscribe('odom', Odometry, self._on_odometry, to_odometry_sample, queue_size=None)
        self._runner.decide()    # without this decision a slow start would look like a sleep
        publish_diagnostics(self._model.name, lambda: self._runner.call_core(self._diagnose))
        log_missing_topics({'imu': core.sensors.imu, 'odom': core.sensors.odometry})

    def _make_law(self, config):
        return DriveLaw(config, self._model, self._response)

    def _use_config(self, config):
        self._runner.call_and_decide(self._core.set_law, self._make_law(config))

    def _tick(self):
        return self._core.tick(ros_time(), steady_time())

    def _on_ctrl_relinq(self, event):
        self._runner.call_and_decide(self._core.on_ctrl_relinq, event)

    def _on_wheels(self, sample):
        self._runner.call_core(self._core.on_wheels, sample)

    def _on_command(self, message):
        sender = sender_of(message) or 'another program'
        if sender != rospy.get_name():    # the core knows its own commands
            command = Twist2(message.linear.x, message.angular.z)
            self._runner.call_core(lambda: self._core.on_command(command, ros_time(), sender))

    def _on_imu(self, sample):
        output = self._runner.call_and_decide(
            lambda: self._core.on_imu(sample, ros_time(), self._wheels_are_published()))
        if output.stamped_pose is not None:
            self._display.show_pose(output.stamped_pose, output.odom_T_local)
            self._goals.send_feedback(output.stamped_pose)

    def _on_odometry(self, sample):
        # the core decides at the next sample of the IMU, because that sample will be newer
        self._runner.call_core(lambda: self._core.on_odometry(sample, ros_time()))

    def _publish_output(self, output):
        if output.has_control is not self._published_control:
            self._published_control = output.has_control
            self._control_publisher.publish(output.has_control)

    def _carry_out(self, output):
        self._goals.send_answers(output.answers)
        if output.status is not None:
            self._display.show_status(output.status)

    def _diagnose(self):
        core = self._core
        now = ros_time()
        status = core.status(now)
        values = {**values_of(core.sensors.imu, now), **values_of(core.sensors.odometry, now),
                  'control': 'granted' if status.may_drive else 'not granted',
                  'goal': status.goal, 'state': status.text or 'about to begin'}
        return status.failure or status.sensor_problem, values


class LocalPath:
    """Publishes the path of the robot in the frame ``local``. A new frame starts a new path."""

    def __init__(self, frame_id):
        self._publisher = rospy.Publisher('local_path', Path, queue_size=1, latch=True)
        self._frame_id = frame_id
        self._frame_number = 0
        self._latest_pose = None
        self._points = deque(maxlen=MAX_PATH_POINTS)    # each point is a PoseStamped
        self._sent_at = -math.inf                       # stamp [s] of the latest published pose
        self._has_unsent_points = False

    def add_pose(self, stamped):
        """Add a localizer.StampedPose to the path. Publish the path at most once in PATH_PERIOD."""
        if stamped.frame_number != self._frame_number:
            self._frame_number = stamped.frame_number
            self._points.clear()
            self._sent_at = -math.inf
        here = stamped.local_T_base
        if not self._points or _needs_point(self._latest_pose, here):
            self._latest_pose = here
            self._points.append(to_pose_stamped(here, self._frame_id, stamped.stamp))
            self._has_unsent_points = True
        if self._has_unsent_points and abs(stamped.stamp - self._sent_at) >= PATH_PERIOD:
            self._sent_at = stamped.stamp
            self._has_unsent_points = False
            self._publisher.publish(Path(header=self._points[-1].header, poses=list(self._points)))


def _needs_point(latest, here):
    turn = abs(difference(here.yaw, latest.yaw))
    return latest.distance_to(here) >= PATH_POINT_DISTANCE or turn >= PATH_POINT_ANGLE


class Display:
    """Publishes each StampedPose and each new DriveStatus for people to see.

    The thread of the IMU calls `show_pose`, and the thread of the CoreRunner calls `show_status`. A
    message costs more computing time than a step of a control law. So poses and transforms are made
    only for subscribers. Transforms, path and markers are sent less often than poses.
    """

    def __init__(self):
        self._local_frame = frame_name('local')
        self._odom_frame = frame_name('odom')
        self._pose_publisher = rospy.Publisher('local_pose', PoseStamped, queue_size=1)
        self._tf = tf2_ros.TransformBroadcaster()
        self._state_publisher = rospy.Publisher('goal_state', String, queue_size=10, latch=True)
        self._goal_publisher = rospy.Publisher(
            'current_goal', PoseStamped, queue_size=1, latch=True)
        self._marker_publisher = rospy.Publisher(
            'goal_marker', MarkerArray, queue_size=1, latch=True)
        self._markers = MarkerArray()
        self._transform_sent_at = -math.inf      # stamp [s] of the pose
        self._markers_sent_at = -math.inf        # stamp [s] of the pose
        self._sent_odom_T_local = None
        self._local_path = LocalPath(self._local_frame)

    def show_pose(self, stamped, odom_T_local):
        """Publish a localizer.StampedPose. Publish transform, path and markers if they are due."""
        if self._pose_publisher.get_num_connections():
            self._pose_publisher.publish(
                to_pose_stamped(stamped.local_T_base, self._local_frame, stamped.stamp))
        is_early = abs(stamped.stamp - self._transform_sent_at) < TRANSFORM_PERIOD
        if is_early and odom_T_local == self._sent_odom_T_local:
            return
        self._transform_sent_at = stamped.stamp
        self._sent_odom_T_local = odom_T_local
        if self._tf.pub_tf.get_num_connections():
            self._tf.sendTransform(
                to_transform(odom_T_local, self._odom_frame, self._local_frame, stamped.stamp))
        if abs(stamped.stamp - self._markers_sent_at) >= MARKER_PERIOD:
            # the markers are repeated, since RViz drops a marker while its frame is unknown
            self._markers_sent_at = stamped.stamp
            self._marker_publisher.publish(self._markers)
        self._local_path.add_pose(stamped)

    def show_status(self, status):
        """Publish the text and the goal of a DriveStatus, and markers for RViz."""
        goal = status.goal
        self._state_publisher.publish(status.text)
        self._goal_publisher.publish(to_pose_stamped(goal, self._local_frame, ros_time()))
        arrow = _marker(goal, self._local_frame, ns='goal', id=0, type=Marker.ARROW,
                        color=MARKER_ORANGE, scale=Vector3(0.20, 0.03, 0.03))
        diameter = 2.0 * status.distance_tolerance
        disc = _marker(goal, self._local_frame, ns='goal', id=1, type=Marker.CYLINDER,
                       color=PALE_YELLOW, scale=Vector3(diameter, diameter, 0.005))
        disc.pose.position.z = 0.02
        text = _marker(Pose2(), frame_name('base_footprint'), ns='words', id=2, color=WHITE,
                       type=Marker.TEXT_VIEW_FACING, scale=Vector3(0.0, 0.0, 0.1))
        text.pose.position.z = 0.3
        text.text = status.text + '\n\n\n\n'    # empty lines lift the text above the robot
        self._markers = MarkerArray(markers=[arrow, disc, text])
        self._marker_publisher.publish(self._markers)


def _marker(pose, frame_id, **fields):
    stamped = to_pose_stamped(pose, frame_id, 0.0)
    return Marker(header=stamped.header, pose=stamped.pose, action=Marker.ADD, frame_locked=True,
                  **fields)
