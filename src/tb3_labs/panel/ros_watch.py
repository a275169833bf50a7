"""Listens to one robot for pages: only if a page looks, and no faster than a page draws."""
import threading
from functools import partial

import rospy
from actionlib_msgs.msg import GoalID
from dynamic_reconfigure.msg import Config as Values
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph.names import ns_join
from sensor_msgs.msg import Imu, Joy
from std_msgs.msg import Bool, Float32, String
from tf2_msgs.msg import TFMessage

from tb3_labs.panel.picture import RobotView
from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.conversions import (
    frame, to_imu_sample, to_odometry_sample, to_pose2, transform_to_pose2)
from tb3_labs.ros.rospy_internals import connection_of
from tb3_labs.ros.topics import subscribe, subscribe_events

#: The stream that moves the robot on the page is read once in this time [s]: local_pose, or odom if
#: no node publishes local_pose.
POSES = 0.045
#: All other streams are read once in this time [s]: each reading costs computing time.
NUMBERS = 0.2
#: A local_pose that is older than this does not move the robot [s].
LOCAL_AGE = 0.5
#: For a robot in the list of all robots, each stream is read once in this time [s].
LISTED = 0.5


def _data(message):
    return message.data


def _pose(message):
    return to_pose2(message.pose)


def _stamped_pose(message):
    """(Pose2, stamp [s])."""
    return to_pose2(message.pose), message.header.stamp.to_sec()


def _yaw(message):
    return to_imu_sample(message).yaw


def _tolerance(values):
    return next((value.value for value in values.doubles
                 if value.name == 'distance_tolerance'), None)


class Watch:
    """Writes the messages on the topics of one robot into a RobotView.

    `prefix` is the robot's namespace with a slash, or ''. `tell_holder(tell)` soon calls
    ``tell(holder, now)``; this reports the stops of other nodes. A `level` is NOTHING, SUMMARY (for
    the list of robots) or ALL.
    """

    NOTHING, SUMMARY, ALL = range(3)

    def __init__(self, prefix, tell_holder):
        self._prefix = prefix
        self._tell_holder = tell_holder
        self._lock = threading.Lock()    # guards the view
        self._view = RobotView()
        self._level = self.NOTHING
        #: Does it listen to the topics of `level` ALL by now?
        self.hears_all = False
        self._subscribers = {}
        self._odom, self._local = frame(prefix + 'odom'), frame(prefix + 'local')

    def read(self, question):
        """Returns ``question(view)``; any thread may call it."""
        with self._lock:
            return question(self._view)

    def look(self, level):
        """Listen to the topics of `level`, and to no others. This waits for the master."""
        self._level = level
        wanted = self._topics() if level else {}
        for topic in [topic for topic in self._subscribers if topic not in wanted]:
            self._subscribers.pop(topic).unregister()
        for topic, listen in wanted.items():
            if topic not in self._subscribers:
                self._subscribers[topic] = listen()
        self.hears_all = level == self.ALL

    def _topics(self):
        """{topic: function that subscribes to it}."""
        # every message counts
        news = {'goal_state': (String, self._hear('state'), _data),
                'has_control': (Bool, self._on_control, _data),
                'control_holder': (String, self._hear('holder'), _data),
                'current_goal': (PoseStamped, self._hear('goal'), _pose)}
        # the latest sample is read, then the stream is not read for a time [s]
        streams = {'odom': (Odometry, POSES, self._write(RobotView.hear_odometry),
                            to_odometry_sample),
                   'local_pose': (PoseStamped, POSES, self._write(_local), _stamped_pose),
                   'distance_error': (Float32, NUMBERS, self._hear('distance'), _data)}
        topics = {}
        if self._level == self.ALL:
            transforms = TFMessage, self._write(_transforms), self._read_transforms
            news.update({
                'move2goal/cancel': (GoalID, self._on_cancel, None),
                'move_to_goal/parameter_updates': (Values, self._hear('tolerance'), _tolerance),
                '/tf_static': transforms})
            streams.update({
                'ground_truth': (PoseStamped, NUMBERS, self._hear('truth'), _stamped_pose),
                'imu': (Imu, NUMBERS, self._hear('imu'), _yaw),
                'angle_error_deg': (Float32, NUMBERS, self._hear('angle'), _data),
                'cmd_vel': (Twist, NUMBERS, self._write(_command), None),
                'joy': (Joy, NUMBERS, self._on_joy, None),
                '/tf': (TFMessage, NUMBERS, *transforms[1:])})
            topics['ctrl_relinq'] = partial(
                subscribe_events, self._prefix + 'ctrl_relinq', Bool, self._on_grant, _data)
        for topic, how in news.items():
            topics[topic] = partial(subscribe, ns_join(self._prefix, topic), *how, queue_size=None)
        for topic, (kind, rest, *how) in streams.items():
            topics[topic] = partial(subscribe, ns_join(self._prefix, topic), kind, *how,
                                    idle_for=partial(self._idle_for, topic, rest))
        return topics

    def _idle_for(self, topic, rest, _now):
        """Returns for how long a stream is not read after a sample [s]."""
        if self._level == self.SUMMARY:
            return LISTED
        return NUMBERS if topic == 'odom' and self._has_local() else rest

    def _has_local(self):
        age = self.read(lambda view: view.age('local', steady_time()))
        return age is not None and age < LOCAL_AGE

    def _write(self, store):
        """Returns a callback that calls ``store(view, value, now)``."""
        def on_value(value):
            with self._lock:
                store(self._view, value, steady_time())
        return on_value

    def _hear(self, name):
        return self._write(lambda view, value, now: view.hear(name, value, now))

    def _read_transforms(self, message):
        """Returns [(kind, pose)] of the transforms for a picture; ValueError if one is invalid."""
        wanted = {(self._odom, self._local): 'frame', ('world', self._odom): 'origin'}
        found = [(wanted.get((stamped.header.frame_id.lstrip('/'),
                              stamped.child_frame_id.lstrip('/'))), stamped.transform)
                 for stamped in message.transforms]
        return [(kind, transform_to_pose2(transform)) for kind, transform in found if kind]

    # -- messages that also concern the holder, or this node

    def _on_control(self, granted):
        self._hear('has_control')(granted)
        self._tell_holder(lambda holder, now: holder.on_control(granted, now))

    def _on_grant(self, event):
        """Tell the holder if another node takes control: a False that is not an old message."""
        if not (event.value or event.is_old or event.sender == rospy.get_name()):
            self._tell_holder(lambda holder, now: holder.on_taken(now))

    def _on_cancel(self, _goal):
        self._tell_holder(lambda holder, now: holder.on_stop(now))

    def _on_joy(self, message):
        sender = connection_of(message)['callerid']
        if sender != rospy.get_name():
            self._hear('joy')(sender)


# -- functions that write a message into a view


def _local(view, stamped, now):
    view.hear_local(*stamped, now)


def _command(view, message, now):
    view.hear_command(connection_of(message)['callerid'], message.linear.x, message.angular.z, now)


def _transforms(view, poses, now):
    for kind, pose in poses:
        if kind == 'frame':
            view.hear_frame(pose, now)
        else:
            view.hear(kind, pose, now)
