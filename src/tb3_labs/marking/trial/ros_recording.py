"""Writes the bag of a trial. The marker's actions and the node's reactions have one clock.

Topics: imu, odom, cmd_vel (without the marker's own commands), ctrl_relinq, joy, mouse_info,
/rosout, variables (the node's own), ground_truth (the robot's true pose, to which no node can
subscribe), and

    trial     std_msgs/String, an event in JSON: {"kind": ..., facts}; from_bag.py has the kinds
    printed   std_msgs/String, the output of the node

A message gets its time as soon as it arrives. A separate thread writes the bag.
"""
import json
import math
import os
import queue
import threading
from bisect import bisect_left
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
from tb3_labs.handout import CMD_VEL, CTRL_RELINQ, IMU_TOPIC, JOY, ODOM_TOPIC
from tb3_labs.marking.trial.observation import LONGEST, NOT_FINITE
from tb3_labs.ros.clocks import ros_time, wait_until
from tb3_labs.ros.conversions import TRUTH_PIPE, to_pose_stamped
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import connection_of, note_connections

#: The topics of the robot's true pose, the events of the trial, the node's output, and the node's
#: variables.
TRUTH, EVENTS, PRINTED, VARIABLES = 'ground_truth', 'trial', 'printed', 'variables'
#: The name of the robot's node.
ROBOT_NODE = 'turtlebot3'
#: At most this many of each kind are recorded.
MOST_COMMANDS = 40000
MOST_MESSAGES = 100000      # messages of each other topic
MOST_NOT_FINITE = 1000      # commands that are not finite numbers
MOST_LINES = 1000           # lines of the log
MOST_EVENTS = 5000
LINE_LENGTH = 300           # characters of a line of the log
MOST_BYTES = 10000          # bytes of a message; a longer message is not recorded
#: A command that equals the last command is recorded only after this time [s].
SAME_COMMAND = 0.04
#: At most this many characters of the output are recorded in a second, a tenth of them if the bag
#: is full. The first characters are left out.
PRINTED_A_SECOND = 20000
#: A bag of this size is full [bytes].
FULL_SIZE = 3 * 10 ** 6
#: Only these topics are recorded in a full bag.
JUDGED_TOPICS = {'/' + TRUTH, '/' + EVENTS, '/' + PRINTED, '/' + CMD_VEL}
#: A recording that is cut off loses at most this part, before compression [bytes].
CHUNK_SIZE = 2 ** 17
#: A robot rests if it moves and turns less than this within REST_TIME.
REST_WAY = 0.002        # [m]
REST_TURN = 0.005       # [rad]
REST_TIME = 0.4         # [s]


class Recording:
    """A bag, and the thread that writes it."""

    def __init__(self, path):
        self._bag = rosbag.Bag(
            str(path), 'w', compression=rosbag.Compression.BZ2, chunk_threshold=CHUNK_SIZE)
        self._path, self.is_full, self.problem = str(path), False, None
        self._waiting, self._guard, self._last = queue.SimpleQueue(), threading.Lock(), 0.0
        self.is_closed, self._events = False, 0
        self._writer = threading.Thread(target=self._write, daemon=True)
        self._writer.start()

    def add(self, topic, message, at=None):
        """Record a message at the time `at` [s], by default now, and return this time. A serialized
        message is given as (type, bytes, checksum, class). Two default times are never equal."""
        with self._guard:
            if at is None:
                at = self._last = max(ros_time(), self._last + 1e-6)
            if self.problem is None:
                self._waiting.put(('/' + topic.lstrip('/'), message, at))
        return at

    def event(self, kind, at=None, **facts):
        """Record an event of the trial, and return the time of the event [s]. A text in `facts` is
        cut after LONGEST characters."""
        self._events += 1
        if self._events > MOST_EVENTS:      # a node may cause events for ever
            return ros_time()
        short = {name: fact[:LONGEST] if isinstance(fact, str) else fact
                 for name, fact in facts.items()}
        return self.add(EVENTS, String(json.dumps(dict(short, kind=kind))), at)

    def close(self):
        """Write the waiting messages, and close the bag. If the bag cannot be written, it is
        removed, and `problem` is the reason. Half a trial would cost the node points."""
        self.is_closed = True
        self._waiting.put(None)
        self._writer.join()

    def _write(self):
        try:
            for topic, message, at in iter(self._waiting.get, None):
                if not self.is_full or topic in JUDGED_TOPICS:
                    self._bag.write(topic, message, rospy.Time.from_sec(at),
                                    raw=isinstance(message, tuple))
                    self.is_full = os.path.getsize(self._path) > FULL_SIZE
            self._bag.close()
        except OSError as problem:      # for example a full disk
            self.problem = problem
            os.remove(self._path)


class NodeOutput:
    """Records the output of one process of the node, at most PRINTED_A_SECOND."""

    def __init__(self, recording):
        self._recording, self._guard = recording, threading.Lock()
        self._text, self._left_out, self._lines, self._free_at = '', 0, 0, 0.0
        #: The end of the output since the last `flush`.
        self.last = ''

    def add(self, text):
        """Record a part of the output. If too little time has passed since the last part, it is
        recorded with the next part, or by `flush`."""
        with self._guard:
            self.last = (self.last + text)[-PRINTED_A_SECOND:]
            self._text += text
            excess = len(self._text) - self._most
            if excess > 0:
                self._left_out += excess
                self._lines += self._text.count('\n', 0, excess)
                self._text = self._text[excess:]
            if ros_time() >= self._free_at:
                self._hand_over()

    @property
    def _most(self):
        return PRINTED_A_SECOND // (10 if self._recording.is_full else 1)

    def flush(self):
        """Record the waiting output. An event follows, and its time must be later."""
        with self._guard:
            self._hand_over()
            self.last = ''

    def _hand_over(self):
        if self._text:
            if self._left_out:
                self._recording.event('unprinted', characters=self._left_out, lines=self._lines)
            at = self._recording.add(PRINTED, String(self._text))
            self._free_at = at + len(self._text) / self._most
            self._text, self._left_out, self._lines = '', 0, 0


class Recorder:
    """Records the topics of the robot and of the node. The attributes show what both did last.

    Times are in seconds of ROS. RuntimeError if the robot does not run.
    """

    def __init__(self, recording):
        self.recording, self._lock = recording, threading.Lock()
        #: The robot's true poses: [time, x, y, yaw], the yaw continuous over whole turns.
        self._truth = []
        #: The node's commands: [time, linear, angular].
        self._commands = []
        #: kind of message -> the number of messages so far
        self._number = {}
        threading.Thread(
            target=self._read_truth, args=(os.environ[TRUTH_PIPE],), daemon=True).start()
        note_connections()
        rospy.Subscriber(CMD_VEL, Twist, guarded(self._on_command), tcp_nodelay=True)
        # rospy does not unpack an AnyMsg. In a process all subscribers of a topic have one class,
        # and ros_gamepad.py reads Bool
        for topic, kind, received in (
                (IMU_TOPIC, Imu, rospy.AnyMsg), (ODOM_TOPIC, Odometry, rospy.AnyMsg),
                (VARIABLES, DiagnosticArray, rospy.AnyMsg), (JOY, Joy, rospy.AnyMsg),
                (CTRL_RELINQ, Bool, Bool)):
            rospy.Subscriber(topic, received, self._on_message, (topic, kind), tcp_nodelay=True)
        rospy.Subscriber('/rosout', Log, guarded(self._on_log))
        if not wait_until(lambda: self._truth, 60.0):     # also on a busy computer
            raise RuntimeError('the simulated robot does not run')

    def _read_truth(self, path):
        os.mkfifo(path, 0o600)
        with open(path, 'rb') as pipe:
            os.remove(path)     # the robot has opened the pipe, and nobody else may open it
            for line in pipe:
                at, (x, y, yaw) = self.now, map(float, line.split())
                with self._lock:
                    yaw = unwrap(yaw, self._truth[-1][3]) if self._truth else yaw
                    self._truth.append([at, x, y, yaw])
                self.recording.add(TRUTH, to_pose_stamped(Pose2(x, y, yaw), 'world', at), at)
        self.recording.event('finding', text='The robot was ended while the node ran.')

    def _is_within(self, what, most):
        """Count a message of the kind `what`. Returns True while the number is at most `most`."""
        self._number[what] = self._number.get(what, 0) + 1
        return self._number[what] <= most

    def _on_command(self, message):
        at = self.now
        entry = [at, message.linear.x, message.angular.z]
        if connection_of(message)['process'] == rospy.get_node_uri():
            return      # a command of the marker
        if not (math.isfinite(entry[1]) and math.isfinite(entry[2])):
            if self._is_within(NOT_FINITE, MOST_NOT_FINITE):
                self.recording.event('odd', text='{:g} m/s and {:g} rad/s'.format(*entry[1:]))
            return
        with self._lock:
            last = self._commands[-1:]
            if last and last[0][1:] == entry[1:] and at - last[0][0] < SAME_COMMAND or (
                    not self._is_within('commands', MOST_COMMANDS)):
                return
            self._commands.append(entry)
        self.recording.add(CMD_VEL, message, at)

    def _on_message(self, message, about):
        (topic, kind), at, data = about, self.now, BytesIO()
        message.serialize(data)
        data = data.getvalue()
        if connection_of(message)['md5sum'] == kind._md5sum and len(data) <= MOST_BYTES and (
                self._is_within(topic, MOST_MESSAGES)):
            self.recording.add(topic, (kind._type, data, kind._md5sum, kind), at)

    def _on_log(self, line):
        if line.name not in (rospy.get_name(), '/' + ROBOT_NODE) and self._is_within(
                'log lines', MOST_LINES):
            self.recording.add('/rosout', Log(
                header=Header(stamp=line.header.stamp), level=line.level,
                name=line.name[:LINE_LENGTH], msg=line.msg[:LINE_LENGTH]), self.now)

    def finish(self):
        """Record the number of the messages that were not recorded."""
        for what, most in (('commands', MOST_COMMANDS), (NOT_FINITE, MOST_NOT_FINITE)):
            if self._number.get(what, 0) > most:
                self.recording.event('left out', what=f'{what} after the first {most}',
                                     number=self._number[what] - most)

    @property
    def now(self):
        """The time of ROS [s]."""
        return ros_time()

    @property
    def pose(self):
        """The robot's true pose, a Pose2. The yaw is continuous over whole turns."""
        with self._lock:
            return Pose2(*self._truth[-1][1:])

    @property
    def heading_deg(self):
        """The robot's true heading, continuous over whole turns [deg]."""
        return math.degrees(self.pose.yaw)

    def commands_since(self, begin):
        """Returns the node's commands since `begin` [s], each [time, linear, angular]."""
        with self._lock:
            return self._commands[bisect_left(self._commands, [begin]):]

    def moves(self, begin):
        """Has the node commanded a movement since `begin` [s]?"""
        return any(linear or angular for _, linear, angular in self.commands_since(begin))

    def rests(self, without_command=0.0):
        """Has the robot rested for REST_TIME, and has the node sent no command to move for
        `without_command` [s]?"""
        if without_command and self.moves(self.now - without_command):
            return False
        with self._lock:
            recent = np.array(self._truth[bisect_left(self._truth, [self.now - REST_TIME]):])
        if len(recent) < 5:     # the robot has just started
            return False
        _, x, y, yaw = (recent - recent[0]).T
        return bool(np.hypot(x, y).max() < REST_WAY and np.abs(yaw).max() < REST_TURN)
