"""The order in which nodes start decides nothing. A repeated permission gives no control. Two robots on
one master are independent."""
import contextlib
import itertools
import signal
import unittest

import rosgraph
import rospy
from geometry_msgs.msg import PoseStamped, Twist
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

from masters import free_port
from node_case import STARTING, ZERO, NodeProgram, TestProgram
from observer import Observer
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_pose2
from tb3_labs.ros.rospy_internals import subscribers_of
from tb3_labs.srv import ResetPose
from thumb import A, B, Thumb

#: {name of a node: its executable and arguments}
NODES = {'turtlebot3': ('fake_turtlebot3.py', '_imu_rate:=50'), 'move_to_goal': ('move2goal_tf.py', '_goal_x:=90'),
         'gamepad': ('gamepad.py',), 'panel': ('panel.py', '_port:={}'.format(free_port())),
         'controller': ('turtlebot_controller.py',)}
#: The outcome is judged this long after the last start [s]. A robot with control moves within 1 s.
SETTLED = 1.5
#: Longest wait for a robot with control to move [s].
MOVING = 15.0

_numbers = itertools.count(1)


class LabNodes(contextlib.ExitStack):
    """The nodes of a lab in a new namespace, and a person with a pad."""

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
        """End all nodes by Ctrl+C, so that they unregister: a master with many dead nodes is slow."""
        for node in self.nodes.values():
            node.send(signal.SIGINT)
        for node in self.nodes.values():
            with contextlib.suppress(RuntimeError):
                node.wait()
        return super().__exit__(*details)

    def start(self, name, *arguments):
        """Start a node of NODES. Returns its program."""
        self.nodes[name] = NodeProgram(*NODES[name], *arguments, '__ns:=' + self.name)
        self.callback(self.nodes[name].kill)
        return self.nodes[name]

    def start_all(self, *names, has_control):
        """Start the nodes at once, and wait until all are registered."""
        for name in names:
            given = ['_has_control:=true'] if has_control and name == 'move_to_goal' else []
            self.start(name, *given)
        if not wait_until(self._are_registered, STARTING):
            raise RuntimeError('not all nodes start')

    def _are_registered(self):
        topics = itertools.chain(*rosgraph.Master(rospy.get_name()).getSystemState()[:2])
        registered = set(itertools.chain(*(nodes for _, nodes in topics)))
        return {self.name + '/' + name for name in self.nodes} <= registered

    def drives(self):
        """Does move_to_goal have control, and the robot drive?"""
        return bool(self.observer.latest(self.control) and
                    self.observer.latest(self.commands) not in (None, ZERO))

    def outcome(self, expected):
        """Wait for the `expected` outcome, then for SETTLED, in which the outcome may change. Returns
        'drives', 'was stopped' or 'stands'."""
        wait_until(self.drives, MOVING if expected == 'drives' else SETTLED)
        rospy.rostime.wallsleep(SETTLED)
        has_moved = any(command != ZERO for _, command in self.observer.all(self.commands))
        return 'drives' if self.drives() else 'was stopped' if has_moved else 'stands'


class StartOrderTest(unittest.TestCase):

    def lab(self):
        lab = LabNodes()
        self.addCleanup(lab.close)
        return lab

    def wait_for_publisher(self, topic):
        """Wait until a node is registered as a publisher of this topic."""
        self.assertTrue(wait_until(
            lambda: topic in dict(rospy.get_published_topics()), STARTING, 0.01), topic)

    def test_all_at_once(self):
        lab = self.lab()
        lab.start_all('controller', 'panel', 'gamepad', 'move_to_goal', 'turtlebot3', has_control=True)
        self.assertEqual(lab.outcome('drives'), 'drives')

    def test_a_pad_that_starts_late_stops_nothing_and_its_b_stops(self):
        """The pad's node is stopped while it registers, so that it connects late."""
        lab = self.lab()
        lab.start_all('turtlebot3', 'move_to_goal', has_control=True)
        pad = lab.start('gamepad')
        self.wait_for_publisher(lab.name + '/control_holder')
        pad.send(signal.SIGSTOP)
        self.assertEqual(lab.outcome('drives'), 'drives')
        pad.send(signal.SIGCONT)
        pad.wait_for('move_to_goal drives: press B to take the robot back')
        self.assertEqual(lab.outcome('drives'), 'drives')
        lab.thumb.press(B)
        lab.observer.wait_for(lab.control, lambda has_control: not has_control)
        self.assertEqual(lab.outcome('stands'), 'was stopped')
        pad.kill()       # A of the next pad is accepted at once
        lab.start('gamepad').wait_for('The gamepad drives')
        lab.thumb.press(A)
        lab.observer.wait_for(lab.control, lambda has_control: has_control)

    def test_a_repeated_true_drives_no_node_that_starts_later(self):
        lab = self.lab()
        topic = lab.name + '/ctrl_relinq'
        repeater = TestProgram(['rostopic', 'pub', '-r', '5', topic, 'std_msgs/Bool', 'true'])
        self.addCleanup(repeater.kill)
        self.wait_for_publisher(topic)
        lab.start_all('turtlebot3', 'move_to_goal', has_control=False)
        lab.nodes['move_to_goal'].wait_for('before this node could hear it')
        self.assertEqual(lab.outcome('stands'), 'stands')
        person = rospy.Publisher(topic, Bool, queue_size=5)
        self.assertTrue(wait_until(lambda: subscribers_of(person), STARTING))
        person.publish(True)
        self.assertEqual(lab.outcome('drives'), 'drives')
        lab.nodes['move_to_goal'].end(signal.SIGKILL)
        lab.observer.forget(lab.commands)
        lab.start('move_to_goal').wait_for('before this node could hear it')
        self.assertEqual(lab.outcome('stands'), 'stands')

    def test_two_robots_on_one_master_share_neither_a_reset_nor_a_drive_nor_a_frame(self):
        one, other = labs = self.lab(), self.lab()
        for lab in labs:
            lab.local = lab.name + '/local_pose'
            lab.observer.watch(lab.local, PoseStamped, lambda message: to_pose2(message.pose))
            lab.start_all('turtlebot3', 'gamepad', 'move_to_goal', has_control=False)
            lab.observer.wait_for(lab.local, seconds=STARTING)
        for topic in '/tf', '/tf_static':    # as a node that starts later reads them
            one.observer.watch(topic, TFMessage, lambda message: {
                (each.header.frame_id, each.child_frame_id) for each in message.transforms})
        reset = rospy.ServiceProxy(other.name + '/reset_pose', ResetPose)
        self.assertTrue(wait_until(lambda: reset(-1.0, 0.0, -2.0).success, STARTING))
        other.observer.wait_for(other.local, lambda pose: pose.distance_to(Pose2(-1.0)) < 0.01)
        for lab in labs:
            lab.nodes['gamepad'].wait_for('The gamepad drives')
            lab.thumb.press(B)    # the node ignores A of a pad that may be older than the node
        other.thumb.press(A)
        self.assertEqual(other.outcome('drives'), 'drives')
        other.observer.wait_for(other.local, lambda pose: pose.distance_to(Pose2(-1.0)) > 0.1)
        self.assertEqual(one.outcome('stands'), 'stands')
        self.assertLess(one.observer.latest(one.local).distance_to(Pose2()), 0.01)
        prefixes = [lab.name[1:] + '/' for lab in labs]
        for topic, frames in (
                ('/tf_static', {('world', prefix + 'odom') for prefix in prefixes}),
                ('/tf', {(prefix + 'odom', prefix + child) for prefix in prefixes
                         for child in ('local', 'base_footprint')})):
            self.assertEqual(set().union(*(pairs for _, pairs in one.observer.all(topic))), frames)
        one.thumb.press(A)
        self.assertEqual([lab.outcome('drives') for lab in labs], 2 * ['drives'])
