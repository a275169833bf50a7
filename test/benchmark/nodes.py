"""The cost of each node, beside bare rospy nodes on the same topics in the same run.

    node            its name
    CPU             share of one core [%]: at rest, and while it drives
    times bare      the same, in bare nodes: subscribers of the node's topics; beside gamepad, nodes
                    that publish one Twist for each Joy
    memory          resident [MB], and above the bare one's

CPU and times are medians of five measurements.

Usage: nodes.py [seconds of all five measurements, default 20]
"""
import contextlib
import os
import statistics
import sys
import threading
import time

import rospy
from geometry_msgs.msg import PoseStamped, Twist
from sensor_msgs.msg import Imu, Joy
from std_msgs.msg import Bool, Float64

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose_stamped

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), '..', 'ros'))
from costs import benchmark, memory, shares, start, wait_for_node

#: A node of rospy alone; its arguments: topic, package and type of each topic. It answers each Joy.
BARE = '''
import importlib, sys, rospy
from geometry_msgs.msg import Twist
rospy.init_node(sys.argv[1])
commands = rospy.Publisher('~cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
def hear(message):
    if 'joy' in sys.argv:
        commands.publish(Twist())
for topic, package, kind in zip(*[iter(sys.argv[2:])] * 3):
    rospy.Subscriber(topic, getattr(importlib.import_module(package + '.msg'), kind), hear,
                     queue_size=1, buff_size=65536, tcp_nodelay=True)
rospy.spin()
'''
IMU, ODOM, JOY = ('imu', 'sensor_msgs', 'Imu'), ('odom', 'nav_msgs', 'Odometry'), (
    'joy', 'sensor_msgs', 'Joy')
#: Node: (its file, topics of the bare subscriber beside it).
NODES = {'imu_sub': ('imu_sub.py', IMU), 'controller': ('turtlebot_controller.py', IMU),
         'move_to_goal': ('move2goal_tf.py', IMU + ODOM), 'gamepad': ('gamepad.py', JOY)}
#: Number of bare nodes beside each node: the cost of a single one varies by a third, with the load
#: of its core.
BARES = 3
REPEATS = 5
ROW = '{:13} {:>11} {:>10} {:>11} {:>10} {:>11}'


class NodeBench:
    """The robot, a pad, and one node after the other beside bare ones."""

    def __init__(self, seconds, stack):
        self.seconds, self._stack = seconds, stack
        rospy.Subscriber('imu', Imu, lambda _: None, queue_size=1, tcp_nodelay=True)
        self.goals = rospy.Publisher('move_base_simple/goal', PoseStamped, queue_size=1)
        self.control = rospy.Publisher('ctrl_relinq', Bool, queue_size=5)
        self.turns = rospy.Publisher('turn', Float64, queue_size=1)
        self.joy = rospy.Publisher('joy', Joy, queue_size=1)
        self.stick = 0.0
        threading.Thread(target=self._hold_pad, daemon=True).start()
        self.robot = self.node('turtlebot3', 'fake_turtlebot3.py')

    def node(self, name, executable, wait_for='imu'):
        """Process id of one of the package's nodes."""
        start(self._stack, ['rosrun', 'tb3_labs', executable, '__name:=' + name])
        return wait_for_node(name, wait_for)

    def bare(self, name, topics):
        """Process id of a bare node; this process is its robot."""
        self._stack.callback(rospy.Subscriber(
            name + '/cmd_vel', Twist, lambda _: None, tcp_nodelay=True).unregister)
        start(self._stack, [sys.executable, '-c', BARE, name] + list(topics))
        return wait_for_node(name, topics[0])

    def row(self, name):
        """One line of the table: a node beside its bare ones."""
        executable, topics = NODES[name]
        outer, self._stack = self._stack, contextlib.ExitStack()
        try:
            bare = [self.bare('{}_{}'.format(name, number), topics) for number in range(BARES)]
            pid = self.node(name, executable, topics[0])
            time.sleep(2.0)
            cells = self.shares(pid, bare)
            if name == 'imu_sub':
                cells += ['', '']
            else:
                self.drive(name)
                time.sleep(1.0)
                cells += self.shares(pid, bare)
            used, more = memory(pid), memory(pid) - memory(bare[0])
        finally:
            self.stick = 0.0
            self._stack.close()
            self._stack = outer
        return ROW.format(name, *cells, '{:.0f} MB ({:+.0f})'.format(used, more))

    def shares(self, pid, bare):
        """[CPU of a node, times the CPU of the bare nodes beside it], as text."""
        measured = [shares(self.seconds / REPEATS, pid, *bare) for _ in range(REPEATS)]
        times = [share / max(statistics.mean(least), 0.01) for share, *least in measured]
        return ['{:.1f} %'.format(statistics.median(share for share, *_ in measured)),
                '{:.2f}'.format(statistics.median(times))]

    def drive(self, name):
        """Let a node drive during the next measurement."""
        if name == 'controller':
            self.turns.publish(180.0 * self.seconds)
        elif name == 'move_to_goal':
            self.goals.publish(to_pose_stamped(Pose2(50.0, 0.0, 0.0), 'local', 0.0))
            self.control.publish(True)
        elif name == 'gamepad':
            self.stick = 0.5

    def _hold_pad(self):
        while not rospy.is_shutdown():
            self.joy.publish(Joy(axes=[0.0, self.stick] + 6 * [0.0], buttons=11 * [0]))
            time.sleep(0.05)


def main(seconds):
    """Measure and print."""
    with benchmark() as stack:
        print(ROW.format('node', 'CPU at rest', 'times bare', 'CPU driving', 'times bare', 'memory'))
        bench = NodeBench(seconds, stack)
        for name in NODES:
            print(bench.row(name), flush=True)
        print('simulated robot, with all its topics heard: {:.1f} %, {:.0f} MB'.format(
            *shares(seconds, bench.robot), memory(bench.robot)))


if __name__ == '__main__':
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
