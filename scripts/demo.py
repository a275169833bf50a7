#!/usr/bin/env python3
"""The Transformation lab's demonstration, judged by the simulated robot's true pose.

The node gives control to move_to_goal, which drives to its goal. Then it declares the local frame
again at the robot's place, and the robot drives again. demo.launch starts it, and ends with it. Its
exit status shows demo.sh whether every drive ended within tolerance.

Subscribes
    goal_state    std_msgs/String: the state of move_to_goal
    current_goal  geometry_msgs/PoseStamped: its goal, in local
    local_pose    geometry_msgs/PoseStamped: the pose by its sensors, in local
    ground_truth  geometry_msgs/PoseStamped: the true pose, in world
    has_control   std_msgs/Bool: may move_to_goal drive?
    ctrl_relinq   std_msgs/Bool: another node's False, after control was given, is a person's stop
Publishes
    ctrl_relinq   std_msgs/Bool: False, then True, until move_to_goal has control
Calls
    reset_pose    tb3_labs/ResetPose
Parameters: see DemoConfig in tb3_labs.nodes.demonstration.
"""
import tb3_labs.ros.start    # noqa: F401 (first: Ctrl+C ends the imports below)

import contextlib
import os
import threading
from pathlib import Path

import rosgraph
import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool, String

from tb3_labs.control.goal_state import is_over
from tb3_labs.nodes.demonstration import BEGUN, STILL_TIME, DemoConfig, DemoDrive, rests, table
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_pose2
from tb3_labs.ros.node import end, guarded, run
from tb3_labs.ros.parameters import read_config
from tb3_labs.ros.rospy_internals import connection_of
from tb3_labs.srv import ResetPose

#: Longest wait for a node that starts, and for the end of a drive; for the recorder, which may have
#: ended because its disk was full; for move_to_goal, before control is given again [s, wall clock].
LONGEST_WAIT, RECORDER_TIMEOUT, GRANT_PERIOD = 120.0, 15.0, 1.0
#: A drive may begin so many times, if it is given up before the robot moves.
TRIES = 10
#: Topics that a recording needs from its first moment on.
RECORDED = ('imu', 'odom', 'ground_truth', 'local_pose', 'goal_state', 'current_goal',
            'ctrl_relinq', '/tf')

WHAT_NEXT = """
Everything is left running. Drive it on the page of the panel, or in a second terminal, after
source scripts/setup.sh:
  rosservice call /reset_pose -- 0 0 0        here is the origin: drive again
  rosrun tb3_labs send_goal.py 1 1 90         another goal
  rostopic echo /local_pose/pose              where it believes to be
Ctrl+C here ends everything."""


class Taken(Exception):
    """A person, or another node, took control: the drive is ignored."""


class Demo:
    """Watches move_to_goal drive; runs in a thread of its own, since it waits."""

    def __init__(self):
        self._config = read_config(DemoConfig)
        self._heard = {}        # {topic: (arrival [s], latest value)}
        self._states = []       # (arrival [s], state) of the goal_state of this drive
        self._granted = False   # does move_to_goal have control from this node?
        self._taken = False
        # not latched: a latched message could come from an earlier node
        self._control = rospy.Publisher('ctrl_relinq', Bool, queue_size=10)
        hear('ctrl_relinq', Bool, self._on_control)
        hear('goal_state', String, lambda message: self._states.append(
            (rospy.get_time(), message.data)))
        self._keep('has_control', Bool, lambda message: message.data)
        for topic in ('current_goal', 'local_pose', 'ground_truth'):
            self._keep(topic, PoseStamped, lambda message: to_pose2(message.pose))
        threading.Thread(target=guarded(self._run), daemon=True).start()

    def _keep(self, topic, kind, read):
        def keep(message):
            self._heard[topic] = rospy.get_time(), read(message)
        hear(topic, kind, keep)

    def _on_control(self, message):
        if not message.data and connection_of(message)['callerid'] != rospy.get_name():
            self._taken = self._granted

    def _run(self):
        for topic in ('local_pose', 'ground_truth', 'current_goal', 'has_control'):
            self._latest(topic)
        if self._config.record and not wait_until(recorder_hears, RECORDER_TIMEOUT):
            rospy.logwarn('The recorder does not listen: the recording will be incomplete')
        drives = []
        try:
            for number in range(1, self._config.drives + 1):
                rospy.loginfo('--- Drive %d of %d ---', number, self._config.drives)
                drives.append(self._drive(number))
            print(table(drives))
            self._end(all(drive.is_good for drive in drives), 'a drive ended outside the tolerance')
        except Taken:
            self._end(False, 'Control was taken from the demonstration: it drives no more')

    def _end(self, good, problem):
        if good and 'TB3_LABS_DEMO' in os.environ:
            Path(os.environ['TB3_LABS_DEMO'], 'good').touch()
        if not self._config.stay:
            end('' if good else problem)
            return
        if not good:
            rospy.logwarn(problem)
        print(WHAT_NEXT)

    def _drive(self, number):
        """Let the robot drive once from a new origin. Returns the DemoDrive."""
        world_T_local = self._rest()
        begun = self._begin(number > 1 or self._latest('has_control'))
        ended, state = self._first(is_over)
        reached = self._rest()
        return DemoDrive(state, self._latest('current_goal'), self._latest('local_pose', ended),
                         world_T_local.inverse() @ reached, ended - begun)

    def _begin(self, anew):
        """Let a drive begin; `anew`: after a reset. Returns the time [s]. If a drive is given up
        before the robot moved (a busy computer's sensors are late), it begins again."""
        for attempt in range(TRIES):
            self._states.clear()
            if anew or attempt:
                self._wait(is_reset, 'a reset')
            self._give_control()
            begun, state = self._first(lambda state: state == BEGUN or is_over(state))
            if state == BEGUN:
                break
        return begun

    def _give_control(self):
        """Give control until move_to_goal says that it has control. A node that was slow to start
        does not take the first permission, which may be old. A person's stop is not undone."""
        def is_given():
            if self._taken or self._latest('has_control'):
                return True
            self._control.publish(False)
            self._control.publish(True)
            return wait_until(lambda: self._latest('has_control'), GRANT_PERIOD)
        self._wait(is_given, 'move_to_goal to take control')
        self._granted = True

    def _first(self, condition):
        """Wait for the first state that fulfils `condition`. Returns (arrival [s], state). Raises
        Taken if control is taken before."""
        def found():
            if self._taken:
                raise Taken
            return [entry for entry in list(self._states) if condition(entry[1])]
        self._wait(found, 'the end of a drive')
        return found()[0]

    def _latest(self, topic, since=0.0):
        """Returns the latest value of `topic`; waits for one that arrives at `since` [s] or later.
        """
        self._wait(lambda: topic in self._heard and self._heard[topic][0] >= since, topic)
        return self._heard[topic][1]

    def _rest(self):
        """Wait until the robot rests. Returns its true pose."""
        before, pose = None, self._latest('ground_truth', rospy.get_time())
        while before is None or not rests(before, pose):
            before, pose = pose, self._latest('ground_truth', rospy.get_time() + STILL_TIME)
        return pose

    def _wait(self, condition, what):
        if not wait_until(condition, LONGEST_WAIT):
            raise RuntimeError('waited {:.0f} s in vain for {}; states: {}'.format(
                LONGEST_WAIT, what, [state for _, state in self._states]))


def hear(topic, kind, callback):
    """Call `callback` for each message, in their order."""
    rospy.Subscriber(topic, kind, guarded(callback), queue_size=None, tcp_nodelay=True)


def is_reset():
    """Declare the local frame again. False if it was refused, as while a busy computer's sensors
    are late."""
    with contextlib.suppress(rospy.ServiceException):
        return rospy.ServiceProxy('reset_pose', ResetPose)(0.0, 0.0, 0.0).success


def recorder_hears():
    """Does the node record subscribe to all topics RECORDED?"""
    subscribed = dict(rosgraph.Master(rospy.get_name()).getSystemState()[1])
    return all(rospy.resolve_name('record') in subscribed.get(rospy.resolve_name(topic), [])
               for topic in RECORDED)


if __name__ == '__main__':
    run('demo', Demo)
