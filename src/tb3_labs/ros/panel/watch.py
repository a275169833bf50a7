"""Listens to one robot for a page: nothing while nobody looks, and no faster than a page draws."""
import rospy
from actionlib_msgs.msg import GoalID
from dynamic_reconfigure.msg import Config as Values
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import Imu, Joy
from std_msgs.msg import Bool, Float32, String
from tf2_msgs.msg import TFMessage

from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.conversions import (
    frame, to_imu_sample, to_odometry_sample, to_pose2, transform_to_pose2)
from tb3_labs.ros.rospy_internals import connection_of, stop_hearing_oneself
from tb3_labs.ros.topics import subscribe, subscribe_events

#: The stream that moves the robot on the page is read once in this time [s]: local_pose, or odom
#: where no node publishes the other.
POSES = 0.045
#: All others are read once in this time [s]. To wake up is what costs.
NUMBERS = 0.2
#: A local_pose that is older than this does not move the robot [s].
LOCAL_AGE = 0.5
#: For a robot in the list of all robots each is read once in this time [s].
LISTED = 0.5


class Watch:
    """Writes what the topics of one robot say into a panel.picture.RobotView.

    `prefix` is its namespace with a slash, or ''; `lock` guards the view. `tell_wheel(deed)` calls
    ``deed(wheel, now)`` for the stops of other nodes, soon. A `level` is NOTHING, SUMMARY (what the
    list of robots shows) or ALL.
    """

    NOTHING, SUMMARY, ALL = range(3)

    def __init__(self, prefix, view, lock, tell_wheel):
        self._prefix = prefix
        self._tell_wheel = tell_wheel
        self._view = view
        self._lock = lock
        self._level = self.NOTHING
        #: Does it listen to all of the robot by now?
        self.hears_all = False
        self._subscribers = {}
        self._odom, self._local = frame(prefix + 'odom'), frame(prefix + 'local')

    def look(self, level):
        """Listen to what `level` needs, and to nothing else. It waits for the master."""
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
            'goal_state': self._keep('goal_state', String, 'state', _data),
            'has_control': lambda: subscribe(self._prefix + 'has_control', Bool, self._on_control,
                                             _data, queue_size=None),
            'control_holder': self._keep('control_holder', String, 'holder', _data),
            'odom': self._stream('odom', Odometry, self._on_odometry, POSES, to_odometry_sample,
                                 moves_robot=True),
            'distance_error': self._stream('distance_error', Float32, self._hear('distance'),
                                           NUMBERS, _data)}
        if self._level == self.ALL:
            topics.update({
                'ctrl_relinq': lambda: subscribe_events(self._prefix + 'ctrl_relinq', Bool,
                                                        self._on_word, _data),
                'cancel': lambda: subscribe(self._prefix + 'move2goal/cancel', GoalID,
                                            self._on_cancel, queue_size=None),
                'local_pose': self._stream('local_pose', PoseStamped, self._on_local, POSES,
                                           _stamped_pose),
                'ground_truth': self._stream('ground_truth', PoseStamped, self._on_truth, NUMBERS,
                                             _stamped_pose),
                'imu': self._stream('imu', Imu, self._on_imu, NUMBERS, to_imu_sample),
                'angle_error_deg': self._stream('angle_error_deg', Float32, self._hear('angle'),
                                                NUMBERS, _data),
                'cmd_vel': self._stream('cmd_vel', Twist, self._on_command, NUMBERS),
                'joy': self._stream('joy', Joy, self._on_joy, NUMBERS),
                'current_goal': self._keep('current_goal', PoseStamped, 'goal', _pose),
                'local_path': self._path,
                'tolerance': self._tolerance,
                '/tf': self._stream('/tf', TFMessage, self._on_transforms, NUMBERS,
                                    self._read_transforms),
                '/tf_static': lambda: subscribe('/tf_static', TFMessage, self._on_transforms,
                                                self._read_transforms, queue_size=None)})
        return topics

    # -- ways to listen

    def _keep(self, topic, kind, name, read):
        """A topic with news only: every message counts."""
        return lambda: subscribe(self._prefix + topic, kind, self._hear(name), read,
                                 queue_size=None)

    def _stream(self, topic, kind, on_value, rest, read=None, moves_robot=False):
        """A stream of samples: the latest is read, then the stream is left alone for `rest` [s].
        `moves_robot`: only where local_pose does not."""
        def idle_for(_now):
            if self._level == self.SUMMARY:
                return LISTED
            return NUMBERS if moves_robot and self._has_local() else rest
        name = topic if topic.startswith('/') else self._prefix + topic
        return lambda: subscribe(name, kind, on_value, read, idle_for=idle_for)

    def _has_local(self):
        with self._lock:
            age = self._view.age('local', steady_time())
        return age is not None and age < LOCAL_AGE

    def _hear(self, name):
        def hear(value):
            with self._lock:
                self._view.hear(name, value, steady_time())
        return hear

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

    # -- what comes

    def _on_control(self, granted):
        self._hear('has_control')(granted)
        self._tell_wheel(lambda wheel, now: wheel.on_control(granted, now))

    def _on_word(self, word):
        """A False of another node; not one that was said before a page looked."""
        if not (word.value or word.is_old or word.sender == rospy.get_name()):
            self._tell_wheel(lambda wheel, now: wheel.on_taken(now))

    def _on_cancel(self, _goal):
        self._tell_wheel(lambda wheel, now: wheel.on_stop(now))

    def _on_odometry(self, sample):
        with self._lock:
            self._view.hear_odometry(sample.pose, steady_time())
            self._view.hear('motion', (sample.stamp, sample.linear, sample.angular), steady_time())

    def _on_truth(self, stamped):
        with self._lock:
            for kind, value in zip(('truth', 'truth_stamp'), stamped):
                self._view.hear(kind, value, steady_time())

    def _on_local(self, stamped):
        with self._lock:
            self._view.hear_local(stamped[0], steady_time(), stamped[1])

    def _on_imu(self, sample):
        with self._lock:
            self._view.hear('imu', None, steady_time())
            self._view.hear('heading', sample.yaw, steady_time())

    def _on_command(self, message):
        with self._lock:
            self._view.hear_command(connection_of(message)['callerid'], message.linear.x,
                                    message.angular.z, steady_time())

    def _on_joy(self, message):
        sender, subscriber = connection_of(message)['callerid'], self._subscribers.get('joy')
        if sender != rospy.get_name():
            self._hear('joy')(sender)
        elif subscriber is not None:
            stop_hearing_oneself(subscriber)

    def _read_transforms(self, message):
        """[(kind, pose)] of the transforms that a picture needs; ValueError for an invalid one."""
        wanted = {(self._odom, self._local): 'frame', ('world', self._odom): 'origin'}
        found = [(wanted.get((stamped.header.frame_id.lstrip('/'),
                              stamped.child_frame_id.lstrip('/'))), stamped.transform)
                 for stamped in message.transforms]
        return [(kind, transform_to_pose2(transform)) for kind, transform in found if kind]

    def _on_transforms(self, poses):
        with self._lock:
            for kind, pose in poses:
                if kind == 'frame':
                    self._view.hear_frame(pose, steady_time())
                else:
                    self._view.hear(kind, pose, steady_time())


def _data(message):
    return message.data


def _pose(message):
    return to_pose2(message.pose)


def _stamped_pose(message):
    """(Pose2, stamp [s])."""
    return to_pose2(message.pose), message.header.stamp.to_sec()
