#!/usr/bin/env python3
"""Invalid parameters and missing files: one line names the valid values, and nothing moves."""
import os
import sys

import rosgraph
import rospy
import rostest
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import RLException
from roslaunch.xmlloader import XmlLoader
from roslib.packages import find_resource as resource_file

from tb3_labs.ros.testing.node_process import Program
from tb3_labs.ros.testing.observer import Observer

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from node_case import STARTING, NodeCase    # noqa: E402 (a relay's folder is another one)


class BadStartTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        cls.seen = Observer()
        cls.seen.watch_robot()

    def test_a_bad_parameter_is_one_fatal_line_and_nothing_moves(self):
        """Each node, and each way in which it reads parameters; test/unit/test_config.py has every kind of
        value."""
        cases = [(node, '_' + parameter, words) for node, parameter, *words in (
            ('move2goal_tf.py', 'goal_x:=far', 'goal_x', 'a number from -100 to 100 m'),
            ('move2goal_tf.py', 'goal_yaw_deg:=.nan', 'goal_yaw_deg', 'a number'),
            ('move2goal_tf.py', 'model:=vacuum', 'vacuum', 'burger, waffle, waffle_pi'),
            ('turtlebot_controller.py', 'min_ang_z:=2.0', 'min_ang_z', 'up to max_ang_z'),
            ('gamepad.py', 'dead_zone:=-0.1', 'dead_zone', 'from 0 to 0.9'),
            ('fake_turtlebot3.py', 'imu_rate:=0', 'imu_rate', 'from 1 to 1000'),
            ('imu_sub.py', 'max_rate:=fast', 'max_rate', 'a number'))]
        self.seen.forget('cmd_vel')
        nodes = [self.start(executable, '__name:=bad%d' % number, parameter)
                 for number, (executable, parameter, _) in enumerate(cases)]
        for node, (_, parameter, words) in zip(nodes, cases):
            self.assertEqual(node.wait(STARTING), 1, parameter)
            lines = [line for line in node.lines if line.strip()]
            self.assertEqual(len(lines), 1, lines)
            for word in ['FATAL'] + words:
                self.assertIn(word, lines[0])
        self.assertEqual(self.seen.all('cmd_vel'), [])

    def test_a_node_without_a_robot_says_what_it_waits_for(self):
        both = '/nowhere/imu and /nowhere/odom'
        nodes = [(self.start(executable, '__ns:=nowhere'), topics) for executable, topics in (
            ('move2goal_tf.py', both), ('imu_sub.py', '/nowhere/imu'),
            ('turtlebot_controller.py', '/nowhere/imu'))]
        for node, topics in nodes:
            node.wait_for('Waiting for {}: is the robot running?'.format(topics))

    def test_a_nodes_help_needs_no_master(self):
        for name, words in ('imu_sub.py', 'Prints the robot'), ('panel.py', 'on a page in any browser'):
            tool = self.start(name, '--help', environment={'ROS_MASTER_URI': 'http://localhost:1'})
            self.assertEqual(tool.wait(STARTING), 0, name + tool.text)
            self.assertIn(words, tool.lines[0])

    def test_send_goal_refuses_with_one_line(self):
        cases = (
                (['1', '1', '900'], {}, 2, 'yaw_deg = 900.0 is not valid: a number from -360'),
                (['1', '1', '0'], {'ROS_NAMESPACE': 'nowhere'}, 1,
                 '/nowhere/move2goal does not answer: is move_to_goal running?'),
                (['1', '1', '0'], {'ROS_MASTER_URI': 'http://localhost:1'}, 1,
                 'no ROS master answers at http://localhost:1'),
                (['--help'], {}, 0, 'send_goal.py 1 1 90'))
        tools = [self.start('send_goal.py', *words, environment=environment)
                 for words, environment, _, _ in cases]
        for tool, (words, _, status, line) in zip(tools, cases):
            self.assertEqual(tool.wait(STARTING), status, words)
            self.assertIn(line, tool.text)
            if status:
                self.assertEqual(len(tool.lines), 1, tool.text)

    def launch(self, *arguments):
        program = Program(['roslaunch'] + list(arguments))
        self.addCleanup(program.kill)
        return program

    def test_a_file_that_is_missing_starts_nothing(self):
        launch = self.launch('tb3_labs', 'gamepad.launch', 'pad:=none')
        self.assertNotEqual(launch.wait(STARTING), 0)
        self.assertIn('pad:=none is not valid: one of f310_d', launch.text)
        self.assertNotIn('started with pid', launch.text)

    def test_a_second_launch_of_the_same_nodes_is_refused_and_the_first_runs_on(self):
        launch = self.launch('--no-summary', 'tb3_labs', 'fake_robot.launch')
        self.assertNotEqual(launch.wait(STARTING), 0)
        self.assertIn('running already at {}: /turtlebot3; end that launch first'.format(
            rosgraph.get_master_uri()), launch.text)
        self.assertNotIn('started with pid', launch.text)
        self.seen.forget('ground_truth')
        self.seen.wait_for('ground_truth')
        other = self.launch('--nodes', 'tb3_labs', 'fake_robot.launch')    # starts nothing
        self.assertEqual(other.wait(STARTING), 0)

    def test_a_class_of_no_robots_is_refused(self):
        why = 'robots must be a whole number, 1 or more'
        launch = self.launch('--nodes', 'tb3_labs', 'classroom.launch', 'robots:=0')
        path, = resource_file('tb3_labs', 'classroom.launch')
        for number in ('-1', '2.5', 'many'):    # as roslaunch does it, without a process for each
            with self.assertRaisesRegex(RLException, why):
                XmlLoader().load(path, ROSLaunchConfig(), argv=[path, 'robots:=' + number],
                                 verbose=False)
        self.assertNotEqual(launch.wait(STARTING), 0)
        self.assertIn(why, launch.text)

    def test_a_node_without_a_master_waits_for_one(self):
        node = self.start('move2goal_tf.py', '_goal_x:=1.0',
                          environment={'ROS_MASTER_URI': 'http://localhost:1'})
        node.wait_for('Waiting for a ROS master at http://localhost:1', STARTING)
        self.assertEqual(node.end(), 0)
        self.assertEqual(len(node.lines), 1, node.text)

    def test_a_misspelt_parameter_is_warned_of(self):
        node = self.start('move2goal_tf.py', '_gaol_x:=1.0')
        # it comes after goal_x in the list of the known parameters
        node.wait_for('goal_yaw_deg')
        line, = [line for line in node.lines if 'gaol_x' in line]
        self.assertIn('goal_x', line)
        self.assertEqual(node.end(), 0)


if __name__ == '__main__':
    rospy.init_node('bad_start_test')
    rostest.rosrun('tb3_labs', 'bad_start', BadStartTest)
