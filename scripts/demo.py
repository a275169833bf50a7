#!/usr/bin/env python3
"""The Transformation lab's demonstration, judged by the embedded robot's true pose.

Gives move_to_goal control, lets it drive to its goal, resets the local frame where the robot
stands, lets it drive again, and prints what was asked, what was reached, and how far that truly
was off. Exit status 0 only if both drives ended inside the tolerance.

Subscribes
    goal_state    std_msgs/String: what move_to_goal does
    current_goal  geometry_msgs/PoseStamped: where it drives to
    local_pose    geometry_msgs/PoseStamped: where it believes to be
    ground_truth  geometry_msgs/PoseStamped: where the robot is
Publishes
    ctrl_relinq   std_msgs/Bool: True for each drive
Calls
    reset_pose    tb3_labs/ResetPose
Parameters: see DemoConfig below; the limits are read from move_to_goal's own parameters.
    ~result       set at the end: a list with {'off_by': [m, deg], 'truly_off': [m, deg]} of each
                  drive, by local_pose and by ground_truth
"""
import math
import threading
import time
import xmlrpc.client
from dataclasses import dataclass

import rosgraph
import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool, String

from tb3_labs.config import Config, setting
from tb3_labs.control.driving import DriveConfig
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose2
from tb3_labs.ros.node import end, guarded, run
from tb3_labs.ros.parameters import read_config, read_model
from tb3_labs.ros.testing.observer import Observer
from tb3_labs.control.least_time import least_time
from tb3_labs.srv import ResetPose


@dataclass(frozen=True)
class DemoConfig(Config):
    """What counts as a good demonstration."""

    drives: int = setting(2, 'how many drives, with a reset between them', low=1, high=100)
    distance_tolerance: float = setting(0.01, 'true error at the goal', 'm', 0.0, 10.0)
    angle_tolerance_deg: float = setting(0.5, 'true error of the heading', 'deg', 0.0, 180.0)
    timeout: float = setting(120.0, 'longest drive', 's', 1.0, 3600.0)
    stay: bool = setting(False, 'say what to try next instead of ending')
    record: bool = setting(False, 'begin when the node record, a recorder, listens')
    status_file: str = setting('', 'file for the exit status, since roslaunch has none')


#: Longest wait for the robot and the nodes at the start [s];
START_TIMEOUT = 30.0
#: for the recorder, which may have ended: its disk was full [s].
RECORDER_TIMEOUT = 10.0
#: What a recording needs from its first moment on.
RECORDED = ('imu', 'odom', 'ground_truth', 'local_pose', 'goal_state', 'current_goal',
            'ctrl_relinq', '/tf')

ROW = '{:7} {:>17} {:>17} {:>16} {:>14}  {}'  # fits a terminal of 80 columns
HEADER = ROW.format('', 'asked [m, m, deg]', 'believed to be at', 'truly off by',
                    'time, at best', '').rstrip()

WHAT_NEXT = """
Everything is left running. In a second terminal, source scripts/setup.sh, then:
  rosservice call /reset_pose -- 0 0 0        here is the origin: drive again
  rosrun tb3_labs send_goal.py 1 1 90         another goal
  rostopic echo /local_pose/pose              where it believes to be
Ctrl+C here ends everything."""


class Demo:
    """Watches move_to_goal drive; runs in a thread of its own, since it waits."""

    def __init__(self):
        self._config = read_config(DemoConfig)
        drive = read_config(DriveConfig, of='move_to_goal')
        self._reverse = drive.allow_reverse
        self._model = read_model()
        self._limits = drive.max_linear, drive.max_angular
        self._observer = Observer()
        # not latched: move_to_goal takes what it hears at its start for another node's
        self._control = rospy.Publisher('ctrl_relinq', Bool, queue_size=1)
        self._observer.watch('goal_state', String, lambda message: message.data)
        for topic in ('current_goal', 'local_pose', 'ground_truth'):
            self._observer.watch(topic, PoseStamped, lambda message: to_pose2(message.pose))
        threading.Thread(target=guarded(self._run), daemon=True).start()

    def _run(self):
        for topic in ('local_pose', 'ground_truth'):
            self._observer.wait_for(topic, seconds=START_TIMEOUT)
        if not comes_to_hear('move_to_goal', ['ctrl_relinq'], START_TIMEOUT):
            raise RuntimeError('move_to_goal does not listen on ctrl_relinq')
        if self._config.record and not comes_to_hear('record', RECORDED, RECORDER_TIMEOUT):
            rospy.logwarn('The recorder does not listen: the recording will not be whole')
        drives = []
        for number in range(1, self._config.drives + 1):
            rospy.loginfo('--- Drive %d of %d ---', number, self._config.drives)
            drives.append(self._drive(number))
        good = all(drive.is_good(self._config) for drive in drives)
        print('\n'.join(['', HEADER] + [
            drive.row(number, self._config) for number, drive in enumerate(drives, 1)]), flush=True)
        rospy.set_param('~result', [
            {'off_by': list(drive.off_by), 'truly_off': list(drive.truly_off)} for drive in drives])
        if self._config.status_file:
            with open(self._config.status_file, 'w') as status:
                status.write('{}\n'.format(0 if good else 1))
        if self._config.stay:
            print(WHAT_NEXT, flush=True)
        else:
            end('' if good else 'a drive ended outside the tolerance')

    def _drive(self, number):
        """One Drive from a fresh origin."""
        observer = self._observer
        observer.wait_for_rest('ground_truth')
        world_T_local = observer.latest('ground_truth')
        observer.forget('goal_state')
        if number > 1:
            answer = rospy.ServiceProxy('reset_pose', ResetPose)(0.0, 0.0, 0.0)
            if not answer.success:
                raise RuntimeError('reset_pose: ' + answer.message)
        self._control.publish(True)
        observer.wait_for('goal_state', lambda state: state == 'ROTATE_TO_GOAL', START_TIMEOUT)
        begun = rospy.get_time()
        state = observer.wait_for('goal_state', is_over, self._config.timeout)
        seconds = rospy.get_time() - begun
        observer.wait_for_rest('ground_truth')
        goal = observer.latest('current_goal')
        bound = least_time(Pose2(), goal, self._model, *self._limits, reverse=self._reverse)
        return Drive(state, goal, observer.latest('local_pose'),
                     world_T_local.inverse() @ observer.latest('ground_truth'), seconds, bound)


@dataclass(frozen=True)
class Drive:
    """How one drive went; poses in local."""

    state: str               # in which it ended
    goal: Pose2
    believed: Pose2          # where move_to_goal had the robot at rest,
    reached: Pose2           # and where it truly was
    time: float              # [s]
    bound: float             # least possible time [s]

    @property
    def off_by(self):
        """(distance [m], angle [deg]) of the goal from where the robot is believed to be."""
        return miss(self.believed, self.goal)

    @property
    def truly_off(self):
        """(distance [m], angle [deg]) of the goal from where the robot is."""
        return miss(self.reached, self.goal)

    def is_good(self, config):
        """Did it end as it should?"""
        distance, angle = self.truly_off
        return (self.state == 'GOAL_REACHED' and distance <= config.distance_tolerance
                and angle <= config.angle_tolerance_deg)

    def row(self, number, config):
        """Its row of the table."""
        distance, angle = self.truly_off
        return ROW.format('drive {}'.format(number), in_short(self.goal), in_short(self.believed),
                          '{:.1f} mm {:.2f} deg'.format(1000.0 * distance, angle),
                          '{:.2f}, {:.2f} s'.format(self.time, self.bound),
                          'ok' if self.is_good(config) else 'NOT GOOD: ' + self.state)


def miss(pose, goal):
    """(distance [m], angle [deg]) from a pose to the goal."""
    return pose.distance_to(goal), abs(math.degrees(difference(pose.yaw, goal.yaw)))


def is_over(state):
    """Is this `goal_state` the end of a drive?"""
    return state == 'GOAL_REACHED' or state.startswith('gave up')


def in_short(pose):
    """A pose as a cell of the table."""
    return '{:.3f} {:.3f} {:.1f}'.format(
        pose.x, pose.y, round(math.degrees(pose.yaw), 1) + 0.0)  # not -0.0


def comes_to_hear(node, topics, seconds):
    """Wait until `node` hears all publishers of each of `topics`; False if it does not in time."""
    deadline = time.monotonic() + seconds
    while not all(hears(node, topic) for topic in topics):
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


def hears(node, topic):
    """Is `node` connected to all publishers of `topic`, and is there one? By their own account."""
    node, topic = rospy.resolve_name(node), rospy.resolve_name(topic)
    master = rosgraph.Master(rospy.get_name())
    publishers = dict(master.getSystemState()[0]).get(topic, [])
    try:
        return bool(publishers) and all(
            (topic, node) in listeners(master.lookupNode(publisher)) for publisher in publishers)
    except (OSError, rosgraph.MasterException):    # one of them has just ended
        return False


def listeners(uri):
    """{(topic, node that is connected to it)} of the node at `uri`, by ROS's slave API."""
    _, _, links = xmlrpc.client.ServerProxy(uri).getBusInfo(rospy.get_name())
    return {(topic, node) for _, node, direction, _, topic, *_ in links if direction == 'o'}


if __name__ == '__main__':
    run('demo', Demo)
