"""Subscribes to the robot's topics. Skips messages of fast topics to save computing time."""
import threading
from operator import attrgetter

import rospy
from actionlib_msgs.msg import GoalID
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, Joy
from std_msgs.msg import Bool, String
from tf2_msgs.msg import TFMessage

from tb3_labs.panel.robot_view import RobotView
from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.conversions import frame_name, to_odometry_sample, to_pose2, transform_to_pose2
from tb3_labs.ros.rospy_internals import sender_of
from tb3_labs.ros.sensor_topics import to_imu_sample
from tb3_labs.ros.topics import subscribe, subscribe_events

#: The panel reads one message of `odom` in this time [s], and then moves the drawn robot.
ODOMETRY_PERIOD = 0.045
#: The panel reads one message of each other fast topic in this time [s].
FAST_TOPIC_PERIOD = 0.2
_data_of = attrgetter('data')


def _pose_of(message):
    return to_pose2(message.pose)


def _truth_of(message):
    return to_pose2(message.pose), message.header.stamp.to_sec()


class RobotSubscriptions:
    """Writes the messages on the robot's topics into a RobotView. Calls `on_stop()` when another
    node stops the robot."""

    def __init__(self, on_stop):
        self._on_stop = on_stop
        self._lock = threading.Lock()    # guards the view
        self._view = RobotView()
        self._odom = frame_name('odom')
        self._local = frame_name('local')

        def subscribe_all(topic, *arguments):    # every message
            subscribe(topic, *arguments, queue_size=None)

        def subscribe_some(topic, *arguments, period=FAST_TOPIC_PERIOD):    # one in `period`
            return subscribe(topic, *arguments, idle_time=lambda now: period)

        subscribe_events('ctrl_relinq', Bool, self._on_permission)
        subscribe_all('goal_state', String, self._store_as('state'), _data_of)
        subscribe_all('has_control', Bool, self._on_control, _data_of)
        subscribe_all('control_holder', String, self._store_as('holder'), _data_of)
        subscribe_all('current_goal', PoseStamped, self._store_as('goal'), _pose_of)
        subscribe_all('move2goal/cancel', GoalID, lambda goal: on_stop())
        subscribe_some('odom', Odometry, self._callback(RobotView.on_odometry),
                       to_odometry_sample, period=ODOMETRY_PERIOD)
        subscribe_some('local_pose', PoseStamped, self._store_as('local'), _pose_of)
        subscribe_some('ground_truth', PoseStamped, self._store_as('truth'), _truth_of)
        subscribe_some('imu', Imu, self._store_as('imu'), lambda imu: to_imu_sample(imu).yaw)
        subscribe_some('cmd_vel', Twist, self._callback(_store_command))
        subscribe_some('variables', DiagnosticArray, self._callback(_store_variables))
        store_transforms = self._callback(_store_transforms)
        subscribe_all('/tf_static', TFMessage, store_transforms, self._read_transforms)
        subscribe_some('/tf', TFMessage, store_transforms, self._read_transforms)
        # this subscriber only counts the publishers of `joy`
        self._joy = subscribe_some('joy', Joy, lambda joy: None)

    def use_view(self, function):
        """Returns ``function(view)``, which may change the view. Any thread may call use_view."""
        with self._lock:
            return function(self._view)

    def latest(self, entry):
        return self.use_view(lambda view: view.latest(entry))

    @property
    def has_another_pad(self):
        """Another node publishes `joy`."""
        return self._joy.get_num_connections() > 1    # this node's own publisher is also connected

    def _callback(self, store):
        """Returns a callback that calls `store(view, value, now)` with the value of a message."""
        def callback(value):
            self.use_view(lambda view: store(view, value, steady_time()))
        return callback

    def _store_as(self, entry):
        """Returns a callback that stores the value of a message as `entry` of the view."""
        return self._callback(lambda view, value, now: view.on_message(entry, value, now))

    def _read_transforms(self, message):
        """Returns [(entry, pose)] of the transforms that a picture needs. Raises ``ValueError`` if
        a needed transform is invalid."""
        entries = {(self._odom, self._local): 'frame', ('world', self._odom): 'origin'}
        poses = []
        for stamped in message.transforms:
            frames = (stamped.header.frame_id.lstrip('/'), stamped.child_frame_id.lstrip('/'))
            if frames in entries:
                poses.append((entries[frames], transform_to_pose2(stamped.transform)))
        return poses

    def _on_permission(self, event):
        if not event.content and event.sender != rospy.get_name():
            self._on_stop()

    def _on_control(self, granted):
        had_control = self.latest('has_control')
        self._store_as('has_control')(granted)
        if had_control and not granted:
            self._on_stop()


def _store_command(view, message, now):
    view.on_command(sender_of(message), message.linear.x, message.angular.z, now)


def _store_variables(view, message, now):
    for status in message.status:
        variables = ((variable.key, variable.value) for variable in status.values)
        view.on_variables(status.name, variables, now)


def _store_transforms(view, poses, now):
    for entry, pose in poses:
        view.on_message(entry, pose, now)
