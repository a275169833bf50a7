#!/usr/bin/env python3
"""sim:=gazebo with a stand-in for Gazebo's TurtleBot3, and where that is not installed."""
import os
import pathlib
import sys
import tempfile
import unittest

import rosgraph
import rospkg
import rospy
from rosgraph_msgs.msg import Clock

from tb3_labs.ros.testing.node_process import Program
from tb3_labs.ros.testing.observer import Observer
from tb3_labs.ros.testing.rosunit_internals import rosrun

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from node_case import STARTING    # noqa: E402 (a relay's folder is another one)

#: The package, the file and the argument are turtlebot3_simulations'; the embedded robot stands in.
MANIFEST = ('<package format="2"><name>turtlebot3_gazebo</name><version>0.0.0</version>'
            '<description>a stand-in</description><license>BSD</license>'
            '<maintainer email="nobody@localhost">nobody</maintainer></package>\n')
WORLD = '''<launch>
  <arg name="model"/>
  <param name="use_sim_time" value="true"/>
  <node pkg="tb3_labs" type="fake_turtlebot3.py" name="stand_in">
    <param name="model" value="$(arg model)"/>
    <param name="start_yaw_deg" value="123"/>
    <param name="imu_noise_deg" value="0"/>
  </node>
</launch>
'''


class GazeboTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.seen = Observer()
        cls.seen.watch_robot()
        cls.seen.watch('/clock', Clock)

    def launch(self, *arguments, environment=None):
        program = Program(['roslaunch', '--disable-title', '--skip-log-check', 'tb3_labs']
                          + list(arguments), environment=environment)
        self.addCleanup(self.end, program)
        return program

    @staticmethod
    def end(program):
        """Ctrl+C, so that no node is left behind."""
        if program.status is None:
            program.end(seconds=STARTING)
        program.kill()
        rospy.set_param('/use_sim_time', False)    # no node runs on that time any more

    def test_a_lab_on_it(self):
        with tempfile.TemporaryDirectory(prefix='gazebo_test_') as folder:
            package = pathlib.Path(folder) / 'turtlebot3_gazebo'
            (package / 'launch').mkdir(parents=True)
            (package / 'package.xml').write_text(MANIFEST)
            (package / 'launch' / 'turtlebot3_empty_world.launch').write_text(WORLD)
            program = self.launch(
                'imu_sub.launch', 'sim:=gazebo', 'model:=waffle', environment={
                    'ROS_PACKAGE_PATH': folder + ':' + os.environ['ROS_PACKAGE_PATH']})
            program.wait_for('Current heading is 123.0', STARTING)
            self.assertEqual(rospy.get_param('/stand_in/model'), 'waffle')
            self.seen.wait_for('/clock', seconds=STARTING)
            self.end(program)
            nodes = [node for topic, nodes in rosgraph.Master(rospy.get_name()).getSystemState()[0]
                     if topic == '/imu' for node in nodes]
            self.assertEqual(nodes, [])

    def test_without_it_one_line_says_so_and_everything_ends(self):
        try:
            rospkg.RosPack().get_path('turtlebot3_gazebo')
            self.skipTest('turtlebot3_gazebo is installed')
        except rospkg.ResourceNotFound:
            pass
        program = self.launch('move2goal.launch', 'sim:=gazebo', 'has_control:=true')
        self.seen.forget('cmd_vel')
        self.assertIsNotNone(program.wait(STARTING))
        line, = [line for line in program.lines if 'turtlebot3_gazebo is not installed' in line]
        self.assertIn('sudo apt install ros-noetic-turtlebot3-gazebo', line)
        self.assertIn('sim:=true', line)
        self.assertEqual(self.seen.all('cmd_vel'), [])


if __name__ == '__main__':
    rospy.init_node('gazebo_test')
    rosrun('gazebo', GazeboTest)
