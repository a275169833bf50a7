#!/usr/bin/env python3
"""The cost of the panel, while a robot drives from goal to goal: without it, with it but without a
page, with one page at 20 pictures a second, and with RViz in its place.

    CPU             share of one core [%]: of the panel (or RViz), of move_to_goal, of the robot
    pictures        that the page gets [1/s]
    first picture   from the connection of the page until its first picture [s]
    on time         share of a drive's commands that come at most 33 ms later than they were due

Usage: panel.py [seconds of each measurement, default 20]
"""
import pathlib
import shutil
import statistics
import sys
import time

import rospy
from geometry_msgs.msg import PoseStamped, Twist
from std_msgs.msg import Bool, String

from tb3_labs.control.driving import PreciseLaw
from tb3_labs.control.goal import is_over
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_pose_stamped

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / 'ros'))
from costs import benchmark, on_time, process_of, shares, start, wait_for_node    # noqa: E402
from panel_page import Page    # noqa: E402
from virtual_screen import VirtualScreen    # noqa: E402

PORT = 8130
GOALS = Pose2(0.6, 0.0, 1.5), Pose2(0.0, 0.4, -1.5)
#: A command that comes later than this after the one before is late [s].
ON_TIME = PreciseLaw.period + 0.033
#: Before a measurement a node runs for this long [s].
SETTLE = 4.0
ROW = '{:24} {:>14} {:>13} {:>7} {:>9} {:>14} {:>8}'


class Drives:
    """A robot that drives from goal to goal, and the times of its commands."""

    def __init__(self, stack):
        self._stack = stack
        self._goals = rospy.Publisher('move_base_simple/goal', PoseStamped, queue_size=1)
        self._control = rospy.Publisher('ctrl_relinq', Bool, queue_size=1)
        self._number = 0
        self._commands = []
        self.start(['rosrun', 'tb3_labs', 'fake_turtlebot3.py'], 'turtlebot3', 'imu')
        self.start(['rosrun', 'tb3_labs', 'move2goal_tf.py'], 'move_to_goal', 'odom')
        rospy.Subscriber('goal_state', String, self._on_state)
        rospy.Subscriber('cmd_vel', Twist, lambda _: self._commands.append(time.monotonic()),
                         queue_size=100, tcp_nodelay=True)
        wait_until(lambda: self._goals.get_num_connections()
                   and self._control.get_num_connections(), 30.0)
        self._control.publish(True)
        self._on_state(String('GOAL_REACHED'))

    def start(self, command, name, topic, environment=None):
        """Start a node; (its process id, the process) once it is connected to a topic."""
        process = start(self._stack, command, environment=environment)
        return wait_for_node(name, topic), process

    def measure(self, seconds, watched=None, page=None):
        """A line of figures: CPU of the process `watched`, of move_to_goal and of the robot."""
        pids = [watched] * (watched is not None) + [
            process_of('/move_to_goal'), process_of('/turtlebot3')]
        pictures = page.pictures if page else 0
        self._commands.clear()
        used = ['{:.1f} %'.format(share) for share in shares(seconds, *pids)]
        return used[:-2] or [''], used[-2:], (
            '{:.1f}'.format((page.pictures - pictures) / seconds) if page else ''), (
            '{:.1f} %'.format(100.0 * statistics.mean(on_time(self._commands, ON_TIME))))

    def _on_state(self, message):
        if is_over(message.data):
            self._number += 1
            self._goals.publish(to_pose_stamped(GOALS[self._number % len(GOALS)], '', 0.0))


def line(name, figures, first=''):
    """A row of the table."""
    watched, others, pictures, on_time = figures
    print(ROW.format(name, *watched, *others, pictures, first, on_time), flush=True)


def with_page(drives, seconds):
    """The two rows of the panel."""
    pid, process = drives.start(['rosrun', 'tb3_labs', 'panel.py', '_port:=%d' % PORT], 'panel',
                                'ctrl_relinq')
    time.sleep(SETTLE)
    line('panel, nobody looks', drives.measure(seconds, pid))
    begun = time.monotonic()
    page = Page('http://localhost:%d/' % PORT)
    page.wait_until(lambda: 'picture' in page.latest)
    first = '{:.2f} s'.format(time.monotonic() - begun)
    time.sleep(SETTLE)
    line('panel, one page', drives.measure(seconds, pid, page), first)
    page.close()
    process.kill()


def with_rviz(drives, seconds):
    """The row of RViz, whose pictures a computer without a graphics card draws by itself."""
    screen = VirtualScreen(1280, 800)
    try:
        pid, process = drives.start(
            ['roslaunch', 'tb3_labs', 'view.launch'], 'rviz', 'tf',
            {'DISPLAY': screen.display, 'LIBGL_ALWAYS_SOFTWARE': '1'})
        time.sleep(2 * SETTLE)
        line('RViz', drives.measure(seconds, pid))
        process.kill()
    finally:
        screen.close()


def main(seconds=20.0):
    """Measure and print."""
    with benchmark() as stack:
        print(ROW.format('', 'CPU: panel', 'move_to_goal', 'robot', 'pictures', 'first picture',
                         'on time'))
        drives = Drives(stack)
        time.sleep(SETTLE)
        line('neither', drives.measure(seconds))
        with_page(drives, seconds)
        if shutil.which('rviz') and shutil.which('Xvfb'):
            with_rviz(drives, seconds)


if __name__ == '__main__':
    main(*(float(text) for text in sys.argv[1:2]))
