"""Tries a recorded run again: the present node gets the recorded sensors and inputs.

This is open loop: the recorded robot does not obey the node. The node runs on a separate ROS
master, with the recording's time, so that no command reaches a robot.

Units: seconds since the recording's start.
"""
import math
import os
import threading
import time
from functools import partial

import numpy as np
import rosbag
import rosgraph
import rospy
from geometry_msgs.msg import PoseStamped, Twist
from rosgraph_msgs.msg import Clock, Log
from rosmaster.master import Master

from tb3_labs.marking.observation import CMD_VEL, CTRL_RELINQ, IMU, JOY, MOUSE_INFO, ODOM
from tb3_labs.marking.ros_interface import ResetCaller
from tb3_labs.marking.ros_student_node import StudentNode
from tb3_labs.report.again import Again, control_moment
from tb3_labs.report.messages import LEVELS
from tb3_labs.report.run_data import Commands, LogLines, Poses
from tb3_labs.ros.conversions import to_pose2
from tb3_labs.ros.topics import subscribe

#: The topics that are played, without a namespace, since the node runs without one.
PLAYED = (IMU, ODOM, JOY, MOUSE_INFO, CTRL_RELINQ, 'turn')
#: Until the node is ready the clock stands at this time before the recording [s].
BEFORE = 0.1
#: The clock's steps are at most this long [s].
STEP = 0.01
#: A turn is typed this long before its first command [s].
REACTION = 0.05
#: The node may react to the last message for this time [s].
AFTER = 0.5
#: The sign of a turn -> the letter that a person types for it in the IMU lab.
LETTERS = {1.0: 'l', -1.0: 'r'}


class NotReplayed(Exception):
    """The run cannot be tried again; the text is the reason, and the remedy."""


class Replay:
    """A master with the recording's time, and a node that hears the recorded run."""

    def __init__(self, run, turned, package, executable, arguments=()):
        """`run`: the RunData; `turned`: the TurnReports of its turns, which were typed."""
        master = Master(0)
        master.start()
        os.environ.update(ROS_MASTER_URI=master.uri, ROS_HOSTNAME='localhost')
        for name in ('ROS_IP', 'ROS_NAMESPACE'):
            os.environ.pop(name, None)
        rosgraph.Master('/replay').setParam('/use_sim_time', True)
        rospy.init_node('replay', disable_signals=True)
        self._run, self._now = run, -BEFORE
        self._clock = rospy.Publisher('/clock', Clock, queue_size=1)
        self._publishers = {}
        self._lock = threading.Lock()
        self._commands, self._poses, self._lines = [], [], []
        subscribe(CMD_VEL, Twist, self._on_command, queue_size=None)
        subscribe('local_pose', PoseStamped, self._on_pose, queue_size=None)
        subscribe('/rosout', Log, self._on_log, queue_size=None)
        self._node = StudentNode(package, executable, IMU, lambda: self._now)
        self._arguments = arguments
        self._events = sorted(self._typed(turned) + self._resets() + self._messages(),
                              key=lambda event: event[0])

    def play(self, speed):
        """Play the run once. Returns the node's Again. ``NotReplayed`` if the node is not ready."""
        self._now = -BEFORE
        with self._lock:
            del self._commands[:], self._poses[:], self._lines[:]
        ticking = threading.Event()
        threading.Thread(target=self._tick, args=(ticking,), daemon=True).start()
        try:
            ready = self._node.start(*self._arguments) or self._node.start(
                *self._arguments, listens=ODOM)
        finally:
            ticking.set()
        if not ready:
            raise NotReplayed('the node does not listen to imu:\n{}'.format(
                self._node.runs[-1].printed.strip()))
        begun = time.monotonic()
        for at, act in self._events + [(self._run.duration + AFTER, lambda: None)]:
            self._advance(begun, at, speed)
            act()
        self._node.stop()
        return self._again()

    def _tick(self, over):
        """Repeat the time until `over`: a node that starts must hear a clock that stands still."""
        while not over.wait(0.05):
            self._say_time()

    def _advance(self, begun, until, speed):
        while self._now < until:
            self._now = min(until, self._now + STEP)
            time.sleep(max(0.0, begun + (self._now + BEFORE) / speed - time.monotonic()))
            self._say_time()

    def _say_time(self):
        self._clock.publish(Clock(rospy.Time.from_sec(self._run.start + self._now)))

    # -- what happens to the node

    def _typed(self, turned):
        return [(turn.begin - REACTION,
                 partial(self._node.type, LETTERS[math.copysign(1.0, turn.asked)]))
                for turn in turned]

    def _resets(self):
        resets = self._run.resets
        return [(float(at), partial(self._reset, resets.pose(k)))
                for k, at in enumerate(resets.time)]

    def _reset(self, pose):
        caller = ResetCaller(self._node.graph)
        if caller.found:
            threading.Thread(target=caller.call, args=(pose,), daemon=True).start()

    def _messages(self):
        prefix = self._run.topics['odometry'].rpartition('/')[0]
        topics = {'{}/{}'.format(prefix, name): name for name in PLAYED}
        topics.update((self._run.topics[part], name) for part, name in (
            ('imu', IMU), ('odometry', ODOM)))
        events = []
        with rosbag.Bag(self._run.name) as bag:
            for topic, (kind, data, checksum, *_), at in bag.read_messages(
                    list(topics), raw=True):
                publisher = self._publisher(topics[topic], kind, checksum)
                moment = at.to_sec() - self._run.start
                if topics[topic] == CTRL_RELINQ:
                    moment = control_moment(moment, data[0] > 0, self._run.commands)
                events.append((moment, partial(self._publish, *publisher, data)))
        return events

    def _publisher(self, name, kind, checksum):
        if name not in self._publishers:
            of_kind = type('Recorded', (rospy.AnyMsg,), {'_type': kind, '_md5sum': checksum})
            self._publishers[name] = rospy.Publisher(name, of_kind, queue_size=100), of_kind
        return self._publishers[name]

    @staticmethod
    def _publish(publisher, of_kind, data):
        message = of_kind()
        message._buff = data
        publisher.publish(message)

    # -- what the node does

    def _on_command(self, message):
        with self._lock:
            self._commands.append((self._now, message.linear.x, message.angular.z))

    def _on_pose(self, message):
        pose = to_pose2(message.pose)
        with self._lock:
            self._poses.append((self._now, pose.x, pose.y, pose.yaw))

    def _on_log(self, message):
        if message.name in self._node.graph.names:
            with self._lock:
                self._lines.append((self._now, LEVELS.get(message.level, ''), message.name,
                                    message.msg))

    def _again(self):
        def columns(rows, count):
            at, *others = np.array(rows, dtype=float).reshape(-1, count).T
            return (at, at, *others)
        with self._lock:
            at = np.array([line[0] for line in self._lines])
            words = np.array([line[1:] for line in self._lines], dtype=object).reshape(-1, 3).T
            return Again(Commands(*columns(self._commands, 3)), Poses(*columns(self._poses, 4)),
                         LogLines(at, at, *words), self._node.runs[-1].printed)
