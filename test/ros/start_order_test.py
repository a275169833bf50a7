"""The order in which nodes start decides nothing, and what merely repeats gives nothing; two robots
on one master are apart."""
import signal
import unittest

import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

from node_case import STARTING, TestProgram
from starts import StartOrder
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_pose2
from tb3_labs.ros.rospy_internals import subscribers_of
from tb3_labs.srv import ResetPose
from thumb import A, B


class StartsTest(unittest.TestCase):

    def stage(self):
        stage = StartOrder()
        self.addCleanup(stage.close)
        return stage

    def wait_for_topic(self, name):
        """Wait until a node is registered as this topic's publisher."""
        self.assertTrue(wait_until(
            lambda: name in dict(rospy.get_published_topics()), STARTING, 0.01), name)

    def test_all_at_once(self):
        stage = self.stage()
        stage.start_all(('controller', 'panel', 'gamepad', 'move_to_goal', 'turtlebot3'), True)
        self.assertEqual(stage.outcome('drives'), 'drives')

    def test_a_pad_that_starts_late_says_nothing_and_its_b_takes(self):
        """Its node is stopped while it registers, so that it connects late."""
        stage = self.stage()
        stage.start_all(('turtlebot3', 'move_to_goal'), True)
        pad = stage.start('gamepad')
        self.wait_for_topic(stage.name + '/control_holder')
        pad.send(signal.SIGSTOP)
        self.assertEqual(stage.outcome('drives'), 'drives')
        pad.send(signal.SIGCONT)
        pad.wait_for('move_to_goal drives: press B to take the robot back')
        self.assertEqual(stage.outcome('drives'), 'drives')
        stage.thumb.press(B)
        stage.observer.wait_for(stage.control, lambda has_control: not has_control)
        self.assertEqual(stage.outcome('stands'), 'was stopped')
        pad.kill()       # A of the next one is accepted at once
        again = stage.start('gamepad')
        again.wait_for('The gamepad drives')
        stage.thumb.press(A)
        stage.observer.wait_for(stage.control, lambda has_control: has_control)

    def test_a_true_that_is_only_repeated_drives_no_node_that_starts_anew(self):
        stage = self.stage()
        words = stage.name + '/ctrl_relinq'
        repeater = TestProgram(['rostopic', 'pub', '-r', '5', words, 'std_msgs/Bool', 'true'])
        self.addCleanup(repeater.kill)
        self.wait_for_topic(words)
        stage.start_all(('turtlebot3', 'move_to_goal'), False)
        stage.nodes['move_to_goal'].wait_for('before this node could hear it')
        self.assertEqual(stage.outcome('stands'), 'stands')
        person = rospy.Publisher(words, Bool, queue_size=5)
        self.assertTrue(wait_until(lambda: subscribers_of(person), STARTING))
        person.publish(True)
        self.assertEqual(stage.outcome('drives'), 'drives')
        stage.nodes['move_to_goal'].end(signal.SIGKILL)
        stage.observer.forget(stage.commands)
        stage.start('move_to_goal').wait_for('before this node could hear it')
        self.assertEqual(stage.outcome('stands'), 'stands')

    def test_two_robots_on_one_master_share_neither_a_reset_nor_a_drive_nor_a_frame(self):
        one, other = stages = self.stage(), self.stage()
        for stage in stages:
            stage.local = stage.name + '/local_pose'
            stage.observer.watch(stage.local, PoseStamped, lambda message: to_pose2(message.pose))
            stage.start_all(('turtlebot3', 'gamepad', 'move_to_goal'), False)
            stage.observer.wait_for(stage.local, seconds=STARTING)
        for topic in '/tf', '/tf_static':    # heard by a node that comes later
            one.observer.watch(topic, TFMessage, lambda message: {
                (each.header.frame_id, each.child_frame_id) for each in message.transforms})
        reset = rospy.ServiceProxy(other.name + '/reset_pose', ResetPose)
        self.assertTrue(wait_until(lambda: reset(-1.0, 0.0, -2.0).success, STARTING))
        other.observer.wait_for(other.local, lambda pose: pose.distance_to(Pose2(-1.0)) < 0.01)
        for stage in stages:
            stage.nodes['gamepad'].wait_for('The gamepad drives')
            stage.thumb.press(B)    # the pad may have been there before its node
        other.thumb.press(A)
        self.assertEqual(other.outcome('drives'), 'drives')
        other.observer.wait_for(other.local, lambda pose: pose.distance_to(Pose2(-1.0)) > 0.1)
        self.assertEqual(one.outcome('stands'), 'stands')
        self.assertLess(one.observer.latest(one.local).distance_to(Pose2()), 0.01)
        names = [stage.name[1:] + '/' for stage in stages]
        for topic, frames in (
                ('/tf_static', {('world', name + 'odom') for name in names}),
                ('/tf', {(name + 'odom', name + child) for name in names
                         for child in ('local', 'base_footprint')})):
            self.assertEqual(set().union(*(pairs for _, pairs in one.observer.all(topic))), frames)
        one.thumb.press(A)
        self.assertEqual([stage.outcome('drives') for stage in stages], 2 * ['drives'])
