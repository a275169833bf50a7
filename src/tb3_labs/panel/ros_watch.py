"""Listens to one robot for pages: to nothing while nobody looks, no faster than a page draws."""
import threading

import rospy
from actionlib_msgs.msg import GoalID
from dynamic_reconfigure.msg import Config as Values
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import Imu, Joy
from std_msgs.msg import Bool, Float32, String
from tf2_msgs.msg import TFMessage

from tb3_labs.panel.picture import RobotView
from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.conversions import (
    frame, to_imu_sample, to_odometry_sample, to_pose2, transform_to_pose2)
from tb3_labs.ros.rospy_internals import connection_of, stop_hearing_oneself
from tb3_labs.ros.topics import subscribe, subscribe_events

#: The stream that moves the robot on the page is read once in this time [s]: local_pose, or odom if
#: no node publishes local_pose.
POSES = 0.045
#: All others are read once in this time [s]: each waking costs.
NUMBERS = 0.2
#: A local_pose that is older than this does not move the robot [s].
LOCAL_AGE = 0.5
#: For a robot in the list of all robots each is read once in this time [s].
LISTED = 0.5


def _data(message):
    return message.data


def _pose(message):
    return to_pose2(message.pose)


def _stamped_pose(message):
    """(Pose2, stamp [s])."""
    return to_pose2(message.pose), message.header.stamp.to_sec()


class Watch:
    """Writes the messages on the topics of one robot into a RobotView.

    `prefix` is its namespace with a slash, or ''. `tell_holder(tell)` calls ``tell(holder, now)``
    for the stops of other nodes, soon. A `level` is NOTHING, SUMMARY (for the list of robots) or
    ALL.
    """

    NOTHING, SUMMARY, ALL = range(3)

    def __init__(self, prefix, tell_holder):
        self._prefix = prefix
        self._tell_holder = tell_holder
        self._lock = threading.Lock()    # guards the view
        self._view = RobotView()
        self._level = self.NOTHING
        #: Does it listen to all of the robot by now?
        self.hears_all = False
        self._subscribers = {}
        self._odom, self._local = frame(prefix + 'odom'), frame(prefix + 'local')

    def read(self, question):
        """``question(view)``, from any thread."""
        with self._lock:
            return question(self._view)

    def look(self, level):
        """Listen to the topics of `level`, and to no others. It waits for the master."""
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
        topics = {
            'goal_state': self._keep('goal_state', String, 'state'),
            'has_control': lambda: subscribe(self._prefix + 'has_control', Bool, self._on_control,
                                             _data, queue_size=None),
            'control_holder': self._keep('control_holder', String, 'holder'),
            'odom': self._stream('odom', Odometry, self._write(_odometry), POSES,
                                 to_odometry_sample, moves_robot=True),
            'distance_error': self._stream('distance_error', Float32, self._hear('distance'),
                                           NUMBERS, _data)}
        if self._level == self.ALL:
            topics.update({
                'ctrl_relinq': lambda: subscribe_events(self._prefix + 'ctrl_relinq', Bool,
                                                        self._on_grant, _data),
                'cancel': lambda: subscribe(self._prefix + 'move2goal/cancel', GoalID,
                                            self._on_cancel, queue_size=None),
                'local_pose': self._stream('local_pose', PoseStamped, self._write(_local), POSES,
                                           _stamped_pose),
                'ground_truth': self._stream('ground_truth', PoseStamped, self._write(_truth),
                                             NUMBERS, _stamped_pose),
                'imu': self._stream('imu', Imu, self._write(_imu), NUMBERS, to_imu_sample),
                'angle_error_deg': self._stream('angle_error_deg', Float32, self._hear('angle'),
                                                NUMBERS, _data),
                'cmd_vel': self._stream('cmd_vel', Twist, self._write(_command), NUMBERS),
                'joy': self._stream('joy', Joy, self._on_joy, NUMBERS),
                'current_goal': self._keep('current_goal', PoseStamped, 'goal', _pose),
                'local_path': self._path,
                'tolerance': self._tolerance,
                '/tf': self._stream('/tf', TFMessage, self._write(_transforms), NUMBERS,
                                    self._read_transforms),
                '/tf_static': lambda: subscribe(
                    '/tf_static', TFMessage, self._write(_transforms), self._read_transforms,
                    queue_size=None)})
        return topics

    # -- ways to listen

    def _keep(self, topic, kind, name, read=_data):
        """A topic with news only: every message counts."""
        return lambda: subscribe(self._prefix + topic, kind, self._hear(name), read,
                                 queue_size=None)

    def _stream(self, topic, kind, on_value, rest, read=None, moves_robot=False):
        """A stream of samples: the latest is read, then the stream is left alone for `rest` [s].
        `moves_robot`: only if local_pose does not."""
        def idle_for(_now):
            if self._level == self.SUMMARY:
                return LISTED
            return NUMBERS if moves_robot and self._has_local() else rest
        name = topic if topic.startswith('/') else self._prefix + topic
        return lambda: subscribe(name, kind, on_value, read, idle_for=idle_for)

    def _has_local(self):
        age = self.read(lambda view: view.age('local', steady_time()))
        return age is not None and age < LOCAL_AGE

    def _write(self, store):
        """The callback that calls ``store(view, value, now)``."""
        def on_value(value):
            with self._lock:
                store(self._view, value, steady_time())
        return on_value

    def _hear(self, name):
        return self._write(lambda view, value, now: view.hear(name, value, now))

    def _path(self):
        """The path so far, once: it grows to a thousand poses, five times a second."""
        def on_path(path):
            with self._lock:
                self._view.hear_path([(stamped.pose.position.x, stamped.pose.position.y)
                                      for stamped in path.poses])
            subscriber = self._subscribers.get('local_path')
            if subscriber is not None:    # else it is only being made: the next path ends it
                subscriber.unregister()
        return subscribe(self._prefix + 'local_path', Path, on_path)

    def _tolerance(self):
        def on_values(values):
            for value in values.doubles:
                if value.name == 'distance_tolerance':
                    self._hear('tolerance')(value.value)
        return subscribe(self._prefix + 'move_to_goal/parameter_updates', Values, on_values,
                         queue_size=None)

    def _read_transforms(self, message):
        """[(kind, pose)] of the transforms that a picture needs; ValueError for an invalid one."""
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
        """A False of another node; not one that was said before a page looked."""
        if not (event.value or event.is_old or event.sender == rospy.get_name()):
            self._tell_holder(lambda holder, now: holder.on_taken(now))

    def _on_cancel(self, _goal):
        self._tell_holder(lambda holder, now: holder.on_stop(now))

    def _on_joy(self, message):
        sender, subscriber = connection_of(message)['callerid'], self._subscribers.get('joy')
        if sender != rospy.get_name():
            self._hear('joy')(sender)
        elif subscriber is not None:
            stop_hearing_oneself(subscriber)


# -- messages as they are written into a view


def _odometry(view, sample, now):
    view.hear_odometry(sample.pose, now)
    view.hear('motion', (sample.stamp, sample.linear, sample.angular), now)


def _truth(view, stamped, now):
    for kind, value in zip(('truth', 'truth_stamp'), stamped):
        view.hear(kind, value, now)


def _local(view, stamped, now):
    view.hear_local(stamped[0], now, stamped[1])


def _imu(view, sample, now):
    view.hear('imu', None, now)
    view.hear('heading', sample.yaw, now)


def _command(view, message, now):
    view.hear_command(connection_of(message)['callerid'], message.linear.x, message.angular.z, now)


def _transforms(view, poses, now):
    for kind, pose in poses:
        if kind == 'frame':
            view.hear_frame(pose, now)
        else:
            view.hear(kind, pose, now)
