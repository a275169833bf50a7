#!/usr/bin/env python3
"""The Transformation lab's demonstration, judged by the simulated robot's true pose.

The node gives control to move_to_goal, which drives to its goal. Then it declares the local frame
anew at the robot's place, and the robot drives again. The exit status is 0 only if every drive
ended within tolerance. demo.sh starts it beside demo.launch.

Subscribes
    goal_state    std_msgs/String: the state of move_to_goal
    current_goal  geometry_msgs/PoseStamped: its goal, in local
    local_pose    geometry_msgs/PoseStamped: the pose by its sensors, in local
    ground_truth  geometry_msgs/PoseStamped: the true pose, in world
    has_control   std_msgs/Bool: may move_to_goal drive?
    ctrl_relinq   std_msgs/Bool: another node's False is a person's stop
Publishes
    ctrl_relinq   std_msgs/Bool: False, then True, until move_to_goal has control
Calls
    reset_pose    tb3_labs/ResetPose
Parameters: see DemoConfig in tb3_labs.nodes.demonstration, set by demo.launch; limits are those of
move_to_goal.
"""
import tb3_labs.ros.start    # noqa: F401 (first: Ctrl+C ends the imports below)

import math
import threading
import time
import xmlrpc.client

import rosgraph
import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool, String

from tb3_labs.control.goal_state import DriveConfig, is_over
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.nodes.demonstration import BEGUN, LONGEST_DRIVE, DemoConfig, DemoDrive, table
from tb3_labs.report.drives import least_time
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_pose2
from tb3_labs.ros.node import end, guarded, run
from tb3_labs.ros.observer import Observer
from tb3_labs.ros.operator import call_reset, hear_takers
from tb3_labs.ros.parameters import read_config, read_model
from tb3_labs.ros.rospy_internals import heard_by

#: Longest wait for the robot and the nodes at the start [s].
START_TIMEOUT = 30.0
#: Longest wait for the recorder, which may have ended because its disk was full [s].
RECORDER_TIMEOUT = 10.0
#: If move_to_goal does not take control in this time, control is given again [s, wall clock].
GRANT_PERIOD = 1.0
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
TAKEN_LINE = 'Control was taken from the demonstration: it drives no more'


class Taken(Exception):
    """A person, or another node, took control: the drive does not count."""


class Demo:
    """Watches move_to_goal drive; runs in a thread of its own, since it waits."""

    def __init__(self):
        self._config = read_config(DemoConfig)
        self._law = read_config(DriveConfig, of='move_to_goal')
        self._model = read_model()
        self._observer = Observer()
        # not latched: move_to_goal would take a latched message for one of an earlier node
        self._control = rospy.Publisher('ctrl_relinq', Bool, queue_size=10)
        self._taken = threading.Event()    # by a person
        hear_takers(self._taken.set)
        self._observer.watch('goal_state', String, lambda message: message.data)
        self._observer.watch('has_control', Bool, lambda message: message.data)
        for topic in ('current_goal', 'local_pose', 'ground_truth'):
            self._observer.watch(topic, PoseStamped, lambda message: to_pose2(message.pose))
        threading.Thread(target=guarded(self._run), daemon=True).start()

    def _run(self):
        self._wait_for_everybody()
        drives = []
        try:
            for number in range(1, self._config.drives + 1):
                rospy.loginfo('--- Drive %d of %d ---', number, self._config.drives)
                drives.append(self._drive(number))
            self._tell(drives)
        except Taken:
            if self._config.stay:
                rospy.logwarn(TAKEN_LINE)
                print(WHAT_NEXT)
            else:
                end(TAKEN_LINE)

    def _wait_for_everybody(self):
        for topic in ('local_pose', 'ground_truth'):
            self._observer.wait_for(topic, seconds=START_TIMEOUT)
        if self._config.pad:
            self._observer.watch('control_holder', String)
            self._observer.wait_for('control_holder', seconds=START_TIMEOUT)
        mover = rospy.resolve_name('move_to_goal')
        if not wait_until(lambda: mover in heard_by(self._control), START_TIMEOUT):
            raise RuntimeError('move_to_goal does not listen on ctrl_relinq')
        self._observer.wait_for('has_control', seconds=START_TIMEOUT)
        self._taken.clear()    # the first message of the node gamepad takes control
        if self._config.record and not wait_until(recorder_hears, RECORDER_TIMEOUT):
            rospy.logwarn('The recorder does not listen: the recording will be incomplete')

    def _drive(self, number):
        """Let the robot drive once from a new origin. Returns the DemoDrive."""
        observer = self._observer
        observer.wait_for_rest('ground_truth')
        world_T_local = observer.latest('ground_truth')
        observer.forget('goal_state')
        if number > 1 or observer.latest('has_control'):
            call_reset(0.0, 0.0, 0.0)
        self._give_control()
        begun, _ = self._first(lambda state: state == BEGUN, START_TIMEOUT)
        ended, state = self._first(is_over, LONGEST_DRIVE)
        observer.wait_for_rest('ground_truth')
        goal = observer.latest('current_goal')
        bound = least_time(Pose2(), goal, self._model, self._law.max_linear,
                           self._law.max_angular, reverse=self._law.allow_reverse)
        return DemoDrive(state, goal, observer.latest('local_pose'),
                         world_T_local.inverse() @ observer.latest('ground_truth'), ended - begun,
                         bound)

    def _give_control(self):
        """Give control until move_to_goal says that it has control. A node that was slow to start
        does not take the first permission, which may be old. A person's stop is not undone."""
        deadline = time.monotonic() + START_TIMEOUT
        while not self._observer.latest('has_control') and not self._taken.is_set():
            if time.monotonic() > deadline:
                raise RuntimeError('move_to_goal does not take control')
            self._control.publish(False)
            self._control.publish(True)
            wait_until(lambda: self._observer.latest('has_control'), GRANT_PERIOD)

    def _first(self, condition, seconds):
        """Wait for the first goal_state that fulfils `condition`. Returns (its time [s], words).
        Raises RuntimeError after `seconds` of wall time, Taken if control was taken."""
        def found():
            if self._taken.is_set():
                raise Taken
            return [entry for entry in self._observer.all('goal_state') if condition(entry[1])]
        self._observer.wait_until(found, seconds, 'goal_state')
        return found()[0]

    def _tell(self, drives):
        """Print the table, and end or stay."""
        print(table(drives))
        if self._config.stay:
            print(WHAT_NEXT)
        else:
            good = all(drive.is_good for drive in drives)
            end('' if good else 'a drive ended outside the tolerance')


def recorder_hears():
    """Is the node record connected to all that publish the topics RECORDED?"""
    return all(_is_recorded(topic) for topic in RECORDED)


def _is_recorded(topic):
    link = [rospy.resolve_name('record'), 'o', 'TCPROS', rospy.resolve_name(topic)]
    master = rosgraph.Master(rospy.get_name())
    publishers = dict(master.getSystemState()[0]).get(link[-1], [])
    try:
        slaves = [xmlrpc.client.ServerProxy(master.lookupNode(each)) for each in publishers]
        infos = [slave.getBusInfo(rospy.get_name()) for slave in slaves]
    except (OSError, rosgraph.MasterException):    # one of them has just ended
        return False
    return bool(infos) and all(link in [each[1:5] for each in links] for _, _, links in infos)


def parameters_are_set():
    """Has roslaunch set the parameters of demo.launch, and /use_sim_time?"""
    try:
        return rosgraph.Master('/demo').hasParam('/demo/drives')
    except (OSError, rosgraph.MasterException):    # no master answers yet
        return False


if __name__ == '__main__':
    wait_until(parameters_are_set, math.inf)
    run('demo', Demo)
