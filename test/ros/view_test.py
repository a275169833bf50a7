#!/usr/bin/env python3
"""The display of view.launch: RViz loads its file without an error, and the wheels turn as far as
the robot drives. RViz runs on screens of the test's own."""
import math
import re
import shutil
import unittest

import numpy as np
import roslib.packages
import rosgraph
import rospkg
import rospy
import tf2_ros
import yaml
from geometry_msgs.msg import PoseStamped, Twist
from rosgraph_msgs.msg import Log
from std_msgs.msg import Bool, String

from node_case import NodeCase, Program, run_as_node
from tb3_labs.ros.conversions import to_pose2, to_twist
from virtual_screen import VirtualScreen

WHEEL_RADIUS = 0.033    # of a Burger [m]


def is_installed(package, node=None):
    try:
        return bool(rospkg.RosPack().get_path(package) and (
            node is None or roslib.packages.find_node(package, node)))
    except rospkg.ResourceNotFound:
        return False


HAS_RVIZ = is_installed('rviz', 'rviz') and shutil.which('Xvfb')
with open(rospkg.RosPack().get_path('tb3_labs') + '/launch/params/local_frame.rviz') as file:
    MANAGER = yaml.safe_load(file)['Visualization Manager']
DRAWN = {display[key] for display in MANAGER['Displays'] for key in ('Topic', 'Marker Topic')
         if key in display}
SENT = {tool['Topic'] for tool in MANAGER['Tools'] if 'Topic' in tool}


class View:
    """view.launch, and with RViz its screen."""

    def __init__(self, namespace):
        self.namespace = namespace
        self.screen = VirtualScreen(1280, 800) if HAS_RVIZ else None
        self.start()

    def start(self):
        self.launch = Program([
            'roslaunch', 'tb3_labs', 'view.launch', 'rviz:=' + str(bool(HAS_RVIZ)).lower(),
            "prefix:='{}'".format(self.namespace.lstrip('/'))], environment={
            'DISPLAY': self.screen.display if HAS_RVIZ else '', 'LIBGL_ALWAYS_SOFTWARE': '1',
            'ROS_NAMESPACE': self.namespace})

    @property
    def crashed(self):
        return re.search(r'\[rviz-\d+\] process has died .* exit code -', self.launch.text)

    def end(self):
        self.launch.end()
        if self.screen:
            self.screen.close()


class ViewTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.watch_data(String, 'goal_state')
        cls.seen.watch('robot3/ground_truth', PoseStamped, lambda message: to_pose2(message.pose))
        cls.seen.watch('/rosout', Log)
        cls.control = rospy.Publisher('ctrl_relinq', Bool, queue_size=1)
        cls.wheels = rospy.Publisher('robot3/cmd_vel', Twist, queue_size=1)
        cls.tf = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.tf)
        cls.master = rosgraph.Master('/view_test')
        cls.views = []
        for namespace in ('/', '/robot3/') if HAS_RVIZ else ('/robot3/',):
            view = View(namespace)
            cls.addClassCleanup(view.end)
            cls.views.append(view)

    def nodes(self, role, topic):
        """Names of the nodes that publish (role 0) or subscribe to (role 1) `topic`."""
        return dict(self.master.getSystemState()[role]).get(topic, [])

    @unittest.skipUnless(HAS_RVIZ, 'RViz or Xvfb is not installed')
    def test_rviz_loads_its_file_without_a_complaint(self):
        self.assertLess({'odom', 'local_path', 'goal_marker', 'ground_truth'}, DRAWN)
        self.assertEqual(SENT, {'initialpose', 'move_base_simple/goal'})
        for view in self.views:
            for role, topics in ((1, DRAWN), (0, SENT)):
                for topic in topics:
                    topic = view.namespace + topic
                    self.wait_for_rviz(
                        view, lambda: view.namespace + 'rviz' in self.nodes(role, topic), topic)
        for role, topics in ((0, DRAWN), (1, SENT)):
            for topic in topics:    # an unknown topic would be drawn nowhere
                self.assertIn('/turtlebot3' if topic in ('odom', 'ground_truth')
                              else '/move_to_goal', self.nodes(role, '/' + topic))
        self.drive()
        for view in self.views:
            lines = [line for line in view.launch.lines if any(
                word in line for word in ('WARN', 'ERROR', 'FATAL', 'loadValue'))]
            self.assertEqual(lines, [])
        self.assertEqual([message for _, message in self.seen.all('/rosout')
                          if message.level >= Log.WARN], [])

    def wait_for_rviz(self, view, condition, what):
        """Start RViz again if it crashes: Debian 12's RViz sometimes crashes in its first picture
        if Mesa draws without a graphics card, also with files of others."""
        try:
            for _ in range(3):
                self.seen.wait_until(lambda: condition() or view.crashed, 30.0, what)
                if not view.crashed:
                    return
                view.launch.end()
                view.start()
            self.fail('RViz crashed three times')
        except RuntimeError as problem:
            self.fail('{}; RViz printed: {}'.format(problem, view.launch.text))

    def drive(self):
        """Drive to the goal, 0.08 m ahead."""
        self.control.publish(True)
        self.seen.wait_for('goal_state', lambda state: state == 'GOAL_REACHED')
        self.seen.wait_for_rest('ground_truth')

    def test_the_wheels_turn_as_far_as_the_robot_drives(self):
        start = self.seen.wait_for('robot3/ground_truth')
        before = [self.wheel(side) for side in ('left', 'right')]
        rate = rospy.Rate(20)
        while self.seen.latest('robot3/ground_truth').distance_to(start) < 0.08:
            self.wheels.publish(to_twist(0.1, 0.0))
            rate.sleep()
        self.wheels.publish(to_twist(0.0, 0.0))
        self.seen.wait_for_rest('robot3/ground_truth')
        angle = self.seen.latest('robot3/ground_truth').distance_to(start) / WHEEL_RADIUS
        for side, old in zip(('left', 'right'), before):
            self.seen.wait_until(
                lambda: abs(2.0 * math.acos(min(1.0, abs(self.wheel(side) @ old))) - angle) < 0.01,
                5.0, '{} wheel turned by {:.2f} rad'.format(side, angle))

    def wheel(self, side):
        """A wheel's attitude: a quaternion."""
        turned = self.tf.lookup_transform('robot3/odom', 'robot3/wheel_{}_link'.format(side),
                                          rospy.Time(0), rospy.Duration(60.0)).transform.rotation
        return np.array([turned.x, turned.y, turned.z, turned.w])


if __name__ == '__main__':
    run_as_node('view', ViewTest)
