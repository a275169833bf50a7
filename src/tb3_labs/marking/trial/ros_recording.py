"""Writes the bag of a trial, with the marker's actions and the node's reactions.

The bag contains these topics:

    imu, odom, ctrl_relinq, joy, mouse_info, /rosout
    cmd_vel         the node's commands, without the marker's own commands
    variables       the node's variables
    ground_truth    the robot's true pose, to which no node can subscribe
    trial           events, std_msgs/String in JSON: {"kind": ..., facts}; see from_bag.py
    printed         the output of the node, std_msgs/String

A message gets its time as soon as it arrives. A separate thread writes the bag.
"""
import json
import math
import os
import queue
import threading
from bisect import bisect_left
from collections import Counter
from io import BytesIO

import numpy as np
import rosbag
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu, Joy
from std_msgs.msg import Bool, Header, String

from tb3_labs.geometry.angles import unwrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.handout import CMD_VEL_TOPIC, CTRL_RELINQ_TOPIC, IMU_TOPIC, JOY_TOPIC, ODOM_TOPIC
from tb3_labs.marking.trial.observation import MAX_SENTENCE_LENGTH, NOT_FINITE
from tb3_labs.ros.clocks import ros_time, wait_until
from tb3_labs.ros.conversions import TRUTH_PIPE, to_pose_stamped
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import connection_of, record_connections

TRUTH = 'ground_truth'
EVENTS = 'trial'
PRINTED = 'printed'
VARIABLES = 'variables'
ROBOT_NODE = 'turtlebot3'
#: A bag contains at most this many messages of each kind.
MAX_COMMANDS = 40000
MAX_NOT_FINITE = 1000      # events on commands that are not finite numbers
MAX_LOG_LINES = 1000
MAX_EVENTS = 5000            # events of all kinds
MAX_LOG_LINE_LENGTH = 300    # Only so many characters of a line are recorded.
MAX_MESSAGE_BYTES = 10000    # a longer message is not recorded
MIN_TIME_STEP = 1e-6         # If two messages come at once, their times differ by this step [s].
#: A command that equals the previous command is recorded only if this time [s] has passed.
SAME_COMMAND_TIME = 0.04
FULL_BAG_BYTES = 3 * 10 ** 6
#: If the bag is full, only these topics are recorded.
JUDGED_TOPICS = {'/' + TRUTH, '/' + EVENTS, '/' + PRINTED, '/' + CMD_VEL_TOPIC}
CHUNK_BYTES = 2 ** 17           # rosbag compresses the messages in chunks of this size
#: A robot rests if it moved less than these limits in the last ROBOT_REST_TIME.
MAX_REST_DISTANCE = 0.002       # [m]
MAX_REST_ANGLE = 0.005          # [rad]
ROBOT_REST_TIME = 0.4           # [s]
MIN_REST_POSES = 5              # the number of true poses that must arrive in ROBOT_REST_TIME


class TrialBag:
    """A bag, and the thread that writes it."""

    def __init__(self, path):
        self._rosbag = rosbag.Bag(
            str(path), 'w', compression=rosbag.Compression.BZ2, chunk_threshold=CHUNK_BYTES)
        self._path = str(path)
        self._last_time = 0.0
        self._event_count = 0
        self.is_full = False
        self.is_closed = False
        self.problem = None     # the error that prevented further writing
        self._waiting = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._writer = threading.Thread(target=self._write, daemon=True)
        self._writer.start()

    def add(self, topic, message, time=None):
        """Record a message with a `time` [s], by default the current time. Returns this time.
        `message` is a ROS message, or the tuple (type, bytes, checksum, class)."""
        with self._lock:
            if time is None:
                time = max(ros_time(), self._last_time + MIN_TIME_STEP)
                self._last_time = time
            if self.problem is None:
                self._waiting.put(('/' + topic.lstrip('/'), message, time))
        return time

    def add_event(self, kind, time=None, **facts):
        """Record an event of the trial and return its time [s]. A text in `facts` is cut after
        MAX_SENTENCE_LENGTH characters."""
        self._event_count += 1
        if self._event_count > MAX_EVENTS:      # a node could cause endless events
            return ros_time()
        for name, fact in facts.items():
            if isinstance(fact, str):
                facts[name] = fact[:MAX_SENTENCE_LENGTH]
        return self.add(EVENTS, String(json.dumps(dict(facts, kind=kind))), time)

    def add_output(self, text):
        """Record a piece of the node's output and return its time [s]."""
        return self.add(PRINTED, String(text))

    @property
    def now(self):
        return ros_time()

    def close(self):
        """Write the waiting messages and close the bag. If this fails, `problem` is the error, and
        the bag is removed, because the student must not lose points for an incomplete bag."""
        self.is_closed = True
        self._waiting.put(None)
        self._writer.join()

    def _write(self):
        try:
            for topic, message, time in iter(self._waiting.get, None):
                if not self.is_full or topic in JUDGED_TOPICS:
                    self._rosbag.write(topic, message, rospy.Time.from_sec(time),
                                       raw=isinstance(message, tuple))
                    self.is_full = os.path.getsize(self._path) > FULL_BAG_BYTES
            self._rosbag.close()
        except OSError as error:      # for example a full disk
            self.problem = error
            os.remove(self._path)


class Recorder:
    """Records the topics of the robot and of the node. All times are ROS times [s]. The constructor
    raises ``RuntimeError`` if the robot does not run."""

    def __init__(self, bag):
        self.bag = bag
        self._lock = threading.Lock()
        self._truth = []            # [time, x, y, yaw]; the yaw is continuous over whole turns
        self._commands = []         # [time, linear, angular]
        self._counts = Counter()    # {kind of message: the number of messages so far}
        threading.Thread(
            target=self._read_truth, args=(os.environ[TRUTH_PIPE],), daemon=True).start()
        record_connections()
        rospy.Subscriber(CMD_VEL_TOPIC, Twist, guarded(self._on_command), tcp_nodelay=True)
        # rospy does not unpack an AnyMsg, which saves time. All subscribers of a topic in a process
        # must use the same class, and ros_gamepad.py needs Bool for CTRL_RELINQ_TOPIC.
        for topic, message_class, subscribed_class in (
                (IMU_TOPIC, Imu, rospy.AnyMsg), (ODOM_TOPIC, Odometry, rospy.AnyMsg),
                (VARIABLES, DiagnosticArray, rospy.AnyMsg), (JOY_TOPIC, Joy, rospy.AnyMsg),
                (CTRL_RELINQ_TOPIC, Bool, Bool)):
            rospy.Subscriber(topic, subscribed_class, self._on_message,
                             callback_args=(topic, message_class), tcp_nodelay=True)
        rospy.Subscriber('/rosout', Log, guarded(self._on_log))
        if not wait_until(lambda: self._truth, 60.0):     # a busy computer starts the robot slowly
            raise RuntimeError('the simulated robot does not run')

    def _read_truth(self, path):
        os.mkfifo(path, 0o600)
        with open(path, 'rb') as pipe:
            os.remove(path)     # now only the robot can write into the pipe
            for line in pipe:
                time = ros_time()
                x, y, yaw = map(float, line.split())
                with self._lock:
                    if self._truth:
                        *_, last_yaw = self._truth[-1]
                        yaw = unwrap(yaw, last_yaw)
                    self._truth.append([time, x, y, yaw])
                self.bag.add(TRUTH, to_pose_stamped(Pose2(x, y, yaw), 'world', time), time)
        self.bag.add_event('finding', text='The robot was ended while the node ran.')

    def _count(self, kind):
        """Count a message and return the number of messages of this kind so far."""
        self._counts[kind] += 1
        return self._counts[kind]

    def _on_command(self, message):
        time = ros_time()
        if connection_of(message)['process'] == rospy.get_node_uri():
            return      # the marker itself sent this command
        linear, angular = message.linear.x, message.angular.z
        if not (math.isfinite(linear) and math.isfinite(angular)):
            if self._count(NOT_FINITE) <= MAX_NOT_FINITE:
                self.bag.add_event('odd', text=f'{linear:g} m/s and {angular:g} rad/s')
            return
        with self._lock:
            if self._commands:
                last_time, *last_speeds = self._commands[-1]
                is_repeated = last_speeds == [linear, angular]
                if is_repeated and time - last_time < SAME_COMMAND_TIME:
                    return
            if self._count('commands') > MAX_COMMANDS:
                return
            self._commands.append([time, linear, angular])
        self.bag.add(CMD_VEL_TOPIC, message, time)

    def _on_message(self, message, topic_and_class):
        time = ros_time()
        topic, message_class = topic_and_class
        checksum = message_class._md5sum
        buffer = BytesIO()
        message.serialize(buffer)
        data = buffer.getvalue()
        if connection_of(message)['md5sum'] == checksum and len(data) <= MAX_MESSAGE_BYTES:
            self.bag.add(topic, (message_class._type, data, checksum, message_class), time)

    def _on_log(self, line):
        if line.name in (rospy.get_name(), '/' + ROBOT_NODE):
            return
        if self._count('log lines') <= MAX_LOG_LINES:
            self.bag.add('/rosout', Log(
                header=Header(stamp=line.header.stamp), level=line.level,
                name=line.name[:MAX_LOG_LINE_LENGTH], msg=line.msg[:MAX_LOG_LINE_LENGTH]),
                ros_time())

    def finish(self):
        """Record the numbers of the commands that were not recorded."""
        for kind, max_count in (('commands', MAX_COMMANDS), (NOT_FINITE, MAX_NOT_FINITE)):
            if self._counts[kind] > max_count:
                self.bag.add_event('left out', what=f'{kind} after the first {max_count}',
                                   number=self._counts[kind] - max_count)

    @property
    def pose(self):
        """The robot's true pose, a Pose2. The yaw is continuous over whole turns."""
        with self._lock:
            _, x, y, yaw = self._truth[-1]
        return Pose2(x, y, yaw)

    @property
    def heading_deg(self):
        """The robot's true heading [deg], continuous over whole turns."""
        return math.degrees(self.pose.yaw)

    def commands_since(self, begin):
        """Returns the node's commands since `begin` [s], each [time, linear, angular]."""
        with self._lock:
            return _rows_since(begin, self._commands)

    def node_moved_since(self, begin):
        """Returns True if the node has commanded a movement since `begin` [s]."""
        return any(linear or angular for _, linear, angular in self.commands_since(begin))

    def is_at_rest(self, idle_time=0.0):
        """Returns True if the robot has rested for ROBOT_REST_TIME, and the node has commanded no
        movement for `idle_time` [s]."""
        if idle_time and self.node_moved_since(ros_time() - idle_time):
            return False
        with self._lock:
            recent_poses = _rows_since(ros_time() - ROBOT_REST_TIME, self._truth)
        if len(recent_poses) < MIN_REST_POSES:    # the robot has just started
            return False
        _, dx, dy, turn = np.subtract(recent_poses, recent_poses[0]).T
        distance, angle = np.hypot(dx, dy).max(), np.abs(turn).max()
        return bool(distance < MAX_REST_DISTANCE and angle < MAX_REST_ANGLE)


def _rows_since(begin, rows):
    """Returns the rows, each a list [time, ...], whose time is `begin` [s] or later."""
    return rows[bisect_left(rows, [begin]):]
