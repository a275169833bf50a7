#!/usr/bin/env python3
"""A class of robots on this computer: do all arrive, are the commands on time, what does it cost?

Starts classroom.py with a number of robots. Each is reset and sent to a goal of its own, twice:
first all at the same time, then one after the other, while the others drive. Each robot's true pose
is judged.

    reached         drives that ended at their goal
    off             true distance [mm] and angle [deg] from it, worst
    on time         share of a drive's commands, one for each of the firmware's periods of 33 ms,
                    that came at most 33 ms later than they were due; of each fourth robot, since
                    this process shares the machine with what it measures
    cores           CPU time of all its processes: robots, move_to_goal, gamepads
    memory          resident, of all [MB]

Usage: classroom.py [numbers of robots, default 1 4 12 24] [-r rate of the IMU, default 60]
"""
import argparse
import contextlib
import itertools
import math
import os
import random
import statistics
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import rospy
from geometry_msgs.msg import PoseStamped
from rospy.msg import AnyMsg
from std_msgs.msg import Bool, String

from tb3_labs.control.driving import PreciseLaw
from tb3_labs.control.goal import GoalState, is_over
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_pose2, to_pose_stamped
from tb3_labs.srv import ResetPose

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), '..', 'ros'))
from costs import benchmark, cpu_time, memory, on_time, parent    # noqa: E402

ROW = '{:>6} {:>9} {:>18} {:>9} {:>29} {:>9}'
#: A command that comes later than this after the one before is late [s].
ON_TIME = PreciseLaw.period + 0.033
PATIENCE = 240.0
#: Time between two looks at a robot [s], and robots for each one whose commands are timed: dozens
#: of them would cost this process as much as some robots.
LOOK, TIMED = 0.2, 4
#: A robot whose pose changes by less than this between two looks is at rest [m], [rad].
STILL = 1e-5
#: Kind of process: part of its command line.
KINDS = {'robots': 'fake_turtlebot3.py', 'move_to_goal': 'move2goal_tf.py',
         'gamepads': 'gamepad.py'}


class Pupil:
    """One robot of the class."""

    def __init__(self, number):
        self.name = '/robot%d' % number
        self._chance = random.Random(number)
        self._state = ''
        self.commands = []
        self._control = rospy.Publisher(self.name + '/ctrl_relinq', Bool, queue_size=1)
        self._goals = rospy.Publisher(self.name + '/move_base_simple/goal', PoseStamped,
                                      queue_size=1)
        self._subscribers = [rospy.Subscriber(self.name + '/goal_state', String, self._on_state)]
        if number % TIMED == 1:
            self._subscribers.append(rospy.Subscriber(
                self.name + '/cmd_vel', AnyMsg, self._on_command, queue_size=100, tcp_nodelay=True))

    def _on_state(self, message):
        self._state = message.data

    def _on_command(self, _message):
        self.commands.append(time.monotonic())

    def wait_until_ready(self):
        """Wait until the robot's node runs and hears this one."""
        rospy.wait_for_service(self.name + '/reset_pose', PATIENCE)
        wait(lambda: self._state and self._control.get_num_connections()
             and self._goals.get_num_connections())

    def drive(self):
        """(reached, distance [m], angle [deg] off) of one drive from a declared pose to a goal."""
        def pose(size):
            return Pose2(*(self._chance.uniform(-limit, limit) for limit in (size, size, math.pi)))
        declared, goal = pose(1.0), pose(1.0)
        before = self.at_rest()
        if not self._declare(declared):
            return False, math.nan, math.nan
        self._state = ''
        self._goals.publish(to_pose_stamped(goal, '', 0.0))
        self._control.publish(True)
        wait(lambda: is_over(self._state))
        reached = self._state == GoalState.GOAL_REACHED.name
        if not reached:
            print('{}: {}'.format(self.name, self._state))
        self._control.publish(False)
        place = declared @ before.inverse() @ self.at_rest()
        return reached, place.distance_to(goal), abs(math.degrees(
            difference(place.yaw, goal.yaw)))

    def _declare(self, pose):
        """Reset; once more where it is refused, as a person would. True if it was done."""
        reset = rospy.ServiceProxy(self.name + '/reset_pose', ResetPose)
        for _ in range(2):
            answer = reset(pose.x, pose.y, math.degrees(pose.yaw))
            if answer.success:
                return True
            print('{}: not reset: {}'.format(self.name, answer.message))
        return False

    def at_rest(self):
        """The robot's true pose, as soon as it does not move."""
        last = None
        while True:
            here = to_pose2(rospy.wait_for_message(
                self.name + '/ground_truth', PoseStamped, PATIENCE).pose)
            if last and last.distance_to(here) < STILL and (
                    abs(difference(last.yaw, here.yaw)) < STILL):
                return here
            last = here
            time.sleep(LOOK)

    def leave(self):
        """Disconnect from all its topics."""
        for subscriber in self._subscribers:
            subscriber.unregister()
        self._control.unregister()
        self._goals.unregister()


def wait(condition):
    """Wait until it holds."""
    if not wait_until(condition, PATIENCE, LOOK):
        raise RuntimeError('timeout: not there within {:g} s'.format(PATIENCE))


def lesson(number, imu_rate):
    """A line of the table."""
    launch = subprocess.Popen(
        ['rosrun', 'tb3_labs', 'classroom.py', '%d' % number, '--imu-rate', '%g' % imu_rate],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    pupils = [Pupil(k) for k in range(1, number + 1)]
    try:
        for pupil in pupils:
            pupil.wait_until_ready()
        time.sleep(2.0)
        before, begun = costs(launch.pid), time.monotonic()
        results = drive_all(pupils)
        took = time.monotonic() - begun
        after = costs(launch.pid)
        return row(pupils, results, {kind: (after[kind][0] - before[kind][0]) / took
                                     for kind in after}, sum(used for _, used in after.values()))
    finally:
        for pupil in pupils:
            pupil.leave()
        launch.terminate()
        launch.wait()


def drive_all(pupils):
    """(reached, distance [m], angle [deg] off) of two drives of each."""
    def two_drives(pupil, late):
        first = pupil.drive()
        time.sleep(late)
        return first, pupil.drive()
    with ThreadPoolExecutor(len(pupils)) as pool:
        both = pool.map(two_drives, pupils, itertools.count(0.0, 0.2))
    return list(itertools.chain.from_iterable(both))


def row(pupils, results, cores, used):
    """The figures of a lesson as text; `cores` by kind, memory `used` in MB."""
    prompt = [is_prompt for pupil in pupils for is_prompt in on_time(pupil.commands, ON_TIME)]
    good = [result for result in results if result[0]] or [(False, math.nan, math.nan)]
    return ROW.format(
        len(pupils), '{}/{}'.format(sum(reached for reached, _, _ in results), 2 * len(pupils)),
        '{:.1f} mm {:.2f} deg'.format(1000.0 * max(off for _, off, _ in good),
                                      max(angle for _, _, angle in good)),
        '{:.1f} %'.format(100.0 * statistics.mean(prompt)),
        '{:.2f}: {:.2f} + {:.2f} + {:.2f}'.format(
            sum(cores.values()), *(cores[kind] for kind in KINDS)),
        '{:.0f} MB'.format(used))


def costs(launch):
    """{kind: (CPU time so far [s], resident memory [MB])} of a roslaunch's nodes."""
    found = {kind: [0.0, 0.0] for kind in KINDS}
    for pid in filter(str.isdigit, os.listdir('/proc')):
        with contextlib.suppress(OSError):     # it has ended
            if parent(pid) != launch:
                continue
            with open('/proc/%s/cmdline' % pid) as command:
                line = command.read()
            for kind, name in KINDS.items():
                if name in line:
                    found[kind][0] += cpu_time(int(pid))
                    found[kind][1] += memory(pid)
    return found


def main():
    """Measure and print."""
    parser = argparse.ArgumentParser(description='A class of robots on this computer.')
    parser.add_argument('robots', nargs='*', type=int, default=[1, 4, 12, 24])
    parser.add_argument('-r', '--imu-rate', type=float, default=60.0, help='of the robots [1/s]')
    given = parser.parse_args()
    with benchmark():
        print(ROW.format('robots', 'reached', 'off', 'on time', 'cores: robots, nodes, gamepads',
                         'memory'))
        for number in given.robots:
            print(lesson(number, given.imu_rate), flush=True)


if __name__ == '__main__':
    sys.exit(main())
