"""Records the robot's true poses and the node's commands into an Observation.

Times are seconds since the recorder was made.
"""
import math
import threading

import rospy
from geometry_msgs.msg import PoseStamped, Twist

from tb3_labs.geometry.angles import continuous
from tb3_labs.marking.conduct import false_message
from tb3_labs.marking.ros_internals import sender_of
from tb3_labs.marking.topics import CMD_VEL, TRUTH
from tb3_labs.ros.conversions import to_pose2
from tb3_labs.ros.marking.waiting import wait_until
from tb3_labs.ros.topics import subscribe
from tb3_labs.ros.rospy_internals import connection_of

#: The embedded robot publishes its pose within this time [s].
START_TIME = 15.0
#: Of equal commands in a row, one is kept each so often [s].
SAME_COMMAND = 0.04
#: No more commands than this are kept of a node.
MOST_COMMANDS = 40000
#: A robot that moves less than this within REST_TIME rests [m], [rad], [s].
REST_WAY = 0.002
REST_TURN = 0.005
REST_TIME = 0.4
#: The latest poses, more than arrive in REST_TIME; fewer than FEWEST tell nothing.
LATEST, FEWEST = 200, 5


class Recorder:
    """Writes into an Observation from other threads; RuntimeError if the robot does not run."""

    def __init__(self, observation):
        self._observation = observation
        self._zero = rospy.get_time()
        self._lock = threading.Lock()
        #: The address of the robot: nobody else published its true pose when it began.
        self.robot = ''
        self._poses = self._commands = None
        self.watch_robot()
        self._commands = subscribe(CMD_VEL, Twist, self._on_command)
        if not wait_until(lambda: observation.truth, START_TIME):
            raise RuntimeError('the embedded robot does not run')

    def watch_robot(self):
        """Have each pose of the robot handed to :meth:`add_pose`."""
        self._poses = subscribe(TRUTH, PoseStamped, self._on_truth)

    def _on_truth(self, message):
        sender = sender_of(self._poses, message) if self._poses is not None else ''
        self.robot = self.robot or sender
        if sender != self.robot or not sender:
            self._observation.note(false_message(
                TRUTH, connection_of(message).get('callerid', ''), 'the robot') if sender else '')
            return
        self.add_pose(to_pose2(message.pose))

    def add_pose(self, pose):
        """Record a pose of the robot, a Pose2, as one of now."""
        truth = self._observation.truth
        with self._lock:
            yaw = continuous(pose.yaw, truth[-1][3]) if truth else pose.yaw
            truth.append([self.now, pose.x, pose.y, yaw])

    def is_judged(self, message):
        """Is this a command that is recorded? Those of the marker itself are not."""
        return sender_of(self._commands, message) != rospy.get_node_uri()

    def _on_command(self, message):
        entry = [self.now, message.linear.x, message.angular.z]
        if self._commands is None or not self.is_judged(message) or not (
                math.isfinite(entry[1]) and math.isfinite(entry[2])):
            return
        commands = self._observation.commands
        with self._lock:
            same = commands and commands[-1][1:] == entry[1:]
            if len(commands) < MOST_COMMANDS and not (
                    same and entry[0] - commands[-1][0] < SAME_COMMAND):
                commands.append(entry)

    @property
    def now(self):
        """Seconds since the recorder was made."""
        return rospy.get_time() - self._zero

    def hand_to(self, keep):
        """Call ``keep(observation)`` while nothing is written into it."""
        with self._lock:
            keep(self._observation)

    @property
    def pose(self):
        """The robot's true pose: (x [m], y [m], yaw [rad], continuous)."""
        with self._lock:
            return tuple(self._observation.truth[-1][1:])

    @property
    def heading_deg(self):
        """The robot's true heading [deg], continuous."""
        return math.degrees(self.pose[2])

    def commands_since(self, begin):
        """The node's commands since `begin`: [time, linear, angular]."""
        with self._lock:
            return [entry for entry in self._observation.commands if entry[0] >= begin]

    def moves(self, begin):
        """Has the node commanded a movement since `begin`?"""
        return any(linear or angular for _, linear, angular in self.commands_since(begin))

    def rests(self, without_command=0.0):
        """Has the robot rested for REST_TIME, and had no movement commanded for this time [s]?"""
        if without_command and self.moves(self.now - without_command):
            return False
        with self._lock:
            recent = [row for row in self._observation.truth[-LATEST:]
                      if row[0] >= self.now - REST_TIME]
        if len(recent) < FEWEST:
            return False
        ways = [math.hypot(row[1] - recent[0][1], row[2] - recent[0][2]) for row in recent]
        turns = [abs(row[3] - recent[0][3]) for row in recent]
        return max(ways) < REST_WAY and max(turns) < REST_TURN
