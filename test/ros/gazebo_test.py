#!/usr/bin/env python3
"""gazebo.launch with a stand-in for Gazebo's TurtleBot3."""
import os
import pathlib
import tempfile

import rospy
from rosgraph_msgs.msg import Clock

from node_case import STARTING, NodeCase, Program, run_as_node

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


class GazeboTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.seen.watch('/clock', Clock)
        cls.addClassCleanup(rospy.set_param, '/use_sim_time', False)

    def launch(self, *arguments, environment=None):
        program = Program(['roslaunch', '--disable-title', '--skip-log-check', 'tb3_labs']
                          + list(arguments), environment=environment)
        self.addCleanup(program.kill)
        return program

    def test_a_lab_beside_it(self):
        with tempfile.TemporaryDirectory(prefix='gazebo_test_') as folder:
            package = pathlib.Path(folder) / 'turtlebot3_gazebo'
            (package / 'launch').mkdir(parents=True)
            (package / 'package.xml').write_text(MANIFEST)
            (package / 'launch' / 'turtlebot3_empty_world.launch').write_text(WORLD)
            path = {'ROS_PACKAGE_PATH': folder + ':' + os.environ['ROS_PACKAGE_PATH']}
            gazebo = self.launch('gazebo.launch', 'model:=waffle', environment=path)
            self.seen.wait_for('/clock', seconds=STARTING)
            self.assertEqual(rospy.get_param('/stand_in/model'), 'waffle')
            lab = self.launch('imu_sub.launch')
            lab.wait_for('Current heading is 123.0', STARTING)
            for program in (lab, gazebo):
                program.end(seconds=STARTING)


if __name__ == '__main__':
    run_as_node('gazebo', GazeboTest)
