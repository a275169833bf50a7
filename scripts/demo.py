#!/usr/bin/env python3
"""The demonstration of the Transformation lab, judged by the simulated robot's true pose.

This node gives control to move_to_goal, which drives to its goal. Then this node resets the local
frame to the robot's place, and the robot drives again. If every drive ends within tolerance, this
node makes a file, which tells demo.sh that all is well. demo.launch ends with this node.

Subscribes
    goal_state    std_msgs/String: the state of move_to_goal
    current_goal  geometry_msgs/PoseStamped: the goal of move_to_goal, in local
    local_pose    geometry_msgs/PoseStamped: the robot's pose by its sensors, in local
    ground_truth  geometry_msgs/PoseStamped: the true pose, in world
    has_control   std_msgs/Bool: may move_to_goal drive?
    ctrl_relinq   std_msgs/Bool: a later False of another node is a person's stop
Publishes
    ctrl_relinq   std_msgs/Bool: False, then True, until move_to_goal has control
Calls
    reset_pose    tb3_labs/ResetPose
Parameters: see DemoConfig.
"""
import tb3_labs.ros.early_signals    # noqa: F401 (first, so that Ctrl+C works in later imports)

import contextlib
import math
import os
import threading
from dataclasses import dataclass
from pathlib import Path

import rosgraph
import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool, String

from tb3_labs.config import Config, setting
from tb3_labs.control.goal_state import GoalState, is_over
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_pose2
from tb3_labs.ros.node import begin_shutdown, guarded, run_node
from tb3_labs.ros.parameters import read_config
from tb3_labs.ros.rospy_internals import connection_of
from tb3_labs.srv import ResetPose

MESSAGE_TIMEOUT = 120.0    # [s, wall clock]
RECORDER_TIMEOUT = 15.0    # [s, wall clock], because a recorder ends if the disk is full
GRANT_PERIOD = 1.0         # [s, wall clock]
SETTLING_TIME = 0.5        # [s] between the end of a drive and the reading of the true pose
MAX_ATTEMPTS = 10          # the node tries to begin a drive at most this often
#: A recording must contain these topics from its start on.
RECORDED_TOPICS = ('imu', 'odom', 'ground_truth', 'local_pose', 'goal_state', 'current_goal',
                   'ctrl_relinq', '/tf')
TABLE_ROW = '{:7} {:>17} {:>17} {:>16} {:>8}  {}'    # for a terminal of 80 columns
TABLE_HEADER = '        asked [m, m, deg] believed to be at     truly off by     time'
#: A drive is good if the true errors of place and heading are at most these values.
MAX_TRUE_ERROR = 0.01        # [m]
MAX_TRUE_ERROR_DEG = 0.5     # [deg]


@dataclass(frozen=True)
class DemoConfig(Config):
    drives: int = setting(2, 'number of drives, with a reset between them', low=1, high=100)
    stay: bool = setting(False, 'go on running, and print commands to try, instead of ending')
    record: bool = setting(False, 'begin when the node record, a recorder, listens')


@dataclass(frozen=True)
class DemoDrive:
    """The result of one drive. The poses are in the local frame."""

    last_state: str
    goal: Pose2
    measured_pose: Pose2     # of the resting robot, by move_to_goal
    true_pose: Pose2         # of the resting robot
    duration: float          # [s]

    @property
    def true_error(self):
        """Returns (distance [m], angle [deg]) from the true pose to the goal."""
        angle = abs(difference(self.true_pose.yaw, self.goal.yaw))
        return self.true_pose.distance_to(self.goal), math.degrees(angle)

    @property
    def is_good(self):
        """move_to_goal reached the goal, and the true errors are small."""
        distance, angle = self.true_error
        return (self.last_state == GoalState.GOAL_REACHED.name
                and distance <= MAX_TRUE_ERROR and angle <= MAX_TRUE_ERROR_DEG)

    def table_row(self, number):
        distance, angle = self.true_error
        true_error = f'{1000.0 * distance:.1f} mm {angle:.2f} deg'
        verdict = 'ok' if self.is_good else 'NOT GOOD: ' + self.last_state
        return TABLE_ROW.format(f'drive {number}', pose_text(self.goal),
                                pose_text(self.measured_pose), true_error,
                                f'{self.duration:.2f} s', verdict)


class ControlTaken(Exception):
    """A person or another node took control from the demonstration."""


class Demo:
    """Lets move_to_goal drive and judges the drives."""

    def __init__(self):
        self._config = read_config(DemoConfig)
        self._received = {}          # {topic: [(time of arrival [s], value)]}
        self._has_granted = False    # True after this node gave move_to_goal control
        self._is_control_taken = False
        # this publisher does not latch, because a latched permission may be old
        self._permission = rospy.Publisher('ctrl_relinq', Bool, queue_size=10)
        self._subscribe('goal_state', String, lambda message: message.data)
        self._subscribe('has_control', Bool, lambda message: message.data)
        for topic in ('current_goal', 'local_pose', 'ground_truth'):
            self._subscribe(topic, PoseStamped, lambda message: to_pose2(message.pose))
        rospy.Subscriber('ctrl_relinq', Bool, guarded(self._on_control), tcp_nodelay=True)
        threading.Thread(target=guarded(self._judge_drives), daemon=True).start()

    def _subscribe(self, topic, message_type, read):
        """Subscribe to `topic`, and store the latest value that `read(message)` returns. The values
        of goal_state are all stored."""
        received = self._received.setdefault(topic, [])

        def store(message):
            received.append((rospy.get_time(), read(message)))
            if topic != 'goal_state':
                del received[:-1]
        rospy.Subscriber(topic, message_type, guarded(store), tcp_nodelay=True)

    def _on_control(self, message):
        is_own = connection_of(message)['callerid'] == rospy.get_name()
        if not message.data and not is_own:
            self._is_control_taken = self._has_granted

    def _judge_drives(self):
        self._wait_for_arrival('local_pose')
        self._wait_for_arrival('current_goal')
        if self._config.record and not wait_until(is_recorder_listening, RECORDER_TIMEOUT):
            rospy.logwarn('The recorder does not listen: the recording will be incomplete')
        problem = self._demonstrate()
        if self._config.stay:
            print(f'\n{problem}\nAll nodes still run. Drive the robot on its page, or by the '
                  'commands of README.md in a second terminal. Ctrl+C here ends all nodes.')
        else:
            begin_shutdown(problem)

    def _demonstrate(self):
        """Let the robot drive, and print the table. Returns the problem, or '' if all is well."""
        drives = []
        try:
            for number in range(1, self._config.drives + 1):
                rospy.loginfo('--- Drive %d of %d ---', number, self._config.drives)
                drives.append(self._drive(needs_reset=number > 1))
        except ControlTaken:
            return 'Control was taken from the demonstration: it drives no more'
        print(drives_table(drives))
        if not all(drive.is_good for drive in drives):
            return 'a drive ended outside the tolerance'
        if 'TB3_LABS_DEMO' in os.environ:
            Path(os.environ['TB3_LABS_DEMO'], 'good').touch()
        return ''

    def _drive(self, needs_reset):
        """Let the robot drive once. Returns the DemoDrive. If late sensors end a drive before the
        robot moves, a reset is made, and the drive begins again."""
        if self._wait_for_value('has_control'):
            needs_reset = True
        world_T_local = self._wait_for_value('ground_truth', rospy.get_time())
        for attempt in range(MAX_ATTEMPTS):
            self._received['goal_state'].clear()
            if needs_reset or attempt > 0:
                self._wait_for('a reset', try_reset)
            self._give_control()
            begin, state = self._wait_for_arrival('goal_state', matches=has_begun_or_ended)
            if not is_over(state):
                break
        end, state = self._wait_for_arrival('goal_state', matches=is_over)
        world_T_robot = self._wait_for_value('ground_truth', end + SETTLING_TIME)
        return DemoDrive(
            state, goal=self._wait_for_value('current_goal'),
            measured_pose=self._wait_for_value('local_pose', end),
            true_pose=world_T_local.inverse() @ world_T_robot, duration=end - begin)

    def _give_control(self):
        """Publish permissions until move_to_goal has control, or a person stops the robot. One is
        not enough for a node that has just started, which ignores permissions that may be old."""
        def try_to_give():
            if self._is_control_taken or self._wait_for_value('has_control'):
                return True
            self._permission.publish(False)
            self._permission.publish(True)
            return wait_until(lambda: self._wait_for_value('has_control'), GRANT_PERIOD)
        self._wait_for('move_to_goal to take control', try_to_give)
        self._has_granted = True

    def _wait_for_value(self, topic, since=0.0):
        """Returns a value of `topic` that arrived at `since` [s] or later."""
        _, value = self._wait_for_arrival(topic, since)
        return value

    def _wait_for_arrival(self, topic, since=0.0, matches=lambda value: True):
        """Wait for a value of `topic` that arrived at `since` [s] or later, and for which
        `matches(value)` is true. Returns (time of arrival [s], value)."""
        def matching_values():
            if self._is_control_taken:
                raise ControlTaken
            return [(arrival, value) for arrival, value in list(self._received[topic])
                    if arrival >= since and matches(value)]
        self._wait_for(topic, matching_values)
        return matching_values()[0]

    def _wait_for(self, what, condition):
        if not wait_until(condition, MESSAGE_TIMEOUT):
            states = [state for _, state in self._received['goal_state']]
            raise RuntimeError(
                f'waited {MESSAGE_TIMEOUT:.0f} s in vain for {what}; states: {states}')


def has_begun_or_ended(state):
    """Returns True if the robot turns to the goal, or if the drive is over."""
    return state == GoalState.ROTATE_TO_GOAL.name or is_over(state)


def try_reset():
    """Reset the local frame to the robot's place. Returns True if move_to_goal accepts the reset.
    move_to_goal refuses a reset while sensors are late."""
    with contextlib.suppress(rospy.ServiceException):
        return rospy.ServiceProxy('reset_pose', ResetPose)(0.0, 0.0, 0.0).success


def is_recorder_listening():
    """Returns True if the node `record` subscribes to all RECORDED_TOPICS."""
    _, subscribers, _ = rosgraph.Master(rospy.get_name()).getSystemState()
    recorder = rospy.resolve_name('record')
    recorded_topics = {topic for topic, nodes in subscribers if recorder in nodes}
    return recorded_topics.issuperset(map(rospy.resolve_name, RECORDED_TOPICS))


def drives_table(drives):
    rows = [drive.table_row(number) for number, drive in enumerate(drives, 1)]
    return '\n'.join(['', TABLE_HEADER, *rows])


def pose_text(pose):
    return f'{pose.x:.3f} {pose.y:.3f} {math.degrees(pose.yaw):.1f}'


if __name__ == '__main__':
    run_node('demo', Demo, __doc__)
