"""The nodes of a lab, started in any order; each time in a namespace of their own."""
import contextlib
import itertools
import signal

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool

from costs import free_port
from node_case import STARTING, ZERO, NodeProgram
from observer import Observer
from tb3_labs.ros.clocks import wait_until
from thumb import Thumb

#: Name of each node, and its executable and arguments.
NODES = {'turtlebot3': ('fake_turtlebot3.py', '_imu_rate:=50'), 'move_to_goal': ('move2goal_tf.py', '_goal_x:=90'),
         'gamepad': ('gamepad.py',), 'panel': ('panel.py',),
         'controller': ('turtlebot_controller.py',)}
#: From the last start to the moment at which the outcome is judged [s]; a robot that has control
#: begins to move within the second.
SETTLED, MOVING = 1.5, 15.0

_numbers = itertools.count(1)


class StartOrder(contextlib.ExitStack):
    """A namespace, with a pad in a person's hands. Its nodes end with it, and unregister: a master
    that knows hundreds of dead nodes answers late."""

    def __init__(self):
        super().__init__()
        self.name = '/stage{}'.format(next(_numbers))
        self.observer = Observer()
        self.commands, self.control = self.name + '/cmd_vel', self.name + '/has_control'
        self.observer.watch(self.commands, Twist, lambda twist: (twist.linear.x, twist.angular.z))
        self.observer.watch(self.control, Bool, lambda message: message.data)
        self.thumb = Thumb(self.name + '/joy')
        self.callback(setattr, self.thumb, 'closed', True)
        self.nodes = {}

    def __exit__(self, *details):
        for node in self.nodes.values():
            node.send(signal.SIGINT)
        for node in self.nodes.values():
            with contextlib.suppress(RuntimeError):
                node.wait()
        return super().__exit__(*details)

    def start(self, name, *arguments):
        """Start one of NODES; returns it."""
        if name == 'panel':
            arguments += '_port:={}'.format(free_port()),
        self.nodes[name] = NodeProgram(*NODES[name], *arguments, '__ns:=' + self.name)
        self.callback(self.nodes[name].kill)
        return self.nodes[name]

    def start_all(self, names, has_control):
        """Start the nodes at once; returns when all are connected."""
        for name in names:
            self.start(name, *['_has_control:=true'] * (has_control and name == 'move_to_goal'))
        if not wait_until(self._all_are_there, STARTING):
            raise RuntimeError('not all nodes start')

    def _all_are_there(self):
        topics = itertools.chain(*rosgraph.Master(rospy.get_name()).getSystemState()[:2])
        there = set(itertools.chain(*(nodes for _, nodes in topics)))
        return {self.name + '/' + name for name in self.nodes} <= there

    def drives(self):
        """Does the robot drive by now, and with control?"""
        return bool(self.observer.latest(self.control) and
                    self.observer.latest(self.commands) not in (None, ZERO))

    def outcome(self, expected):
        """'drives' or 'stands', judged as soon as it is `expected` and could have changed."""
        wait_until(self.drives, MOVING if expected == 'drives' else SETTLED)
        rospy.rostime.wallsleep(SETTLED)
        has_moved = any(command != ZERO for _, command in self.observer.all(self.commands))
        return 'drives' if self.drives() else 'was stopped' if has_moved else 'stands'
