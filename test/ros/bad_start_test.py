"""Invalid parameters and missing files: one line names the valid values, and nothing moves."""
import os
import signal

from masters import cpu_time
from node_case import STARTING, NodeCase


class BadStartTest(NodeCase):

    def test_an_invalid_parameter_is_one_fatal_line_and_nothing_moves(self):
        """test/unit/test_config.py and test_parameters.py have each kind of invalid value."""
        cases = [('move2goal_tf.py', '_model:=[1]', '[1]', 'burger, waffle, waffle_pi'),
                 ('turtlebot_controller.py', '_max_ang_z:=9.0', 'max_ang_z', 'from 0.1 to 5'),
                 ('gamepad.py', 'dead_zone:=0.2', 'is not an argument', '_dead_zone:=VALUE'),
                 ('fake_turtlebot3.py', '_imu_rate:=0', 'imu_rate', 'from 1 to 1000')]
        self.observer.forget('cmd_vel')
        nodes = [self.start(executable, '__name:=bad%d' % number, parameter)
                 for number, (executable, parameter, _, _) in enumerate(cases)]
        for node, (_, parameter, problem, valid) in zip(nodes, cases):
            self.assertEqual(node.wait(STARTING), 1, parameter)
            line, = [line for line in node.lines if line.strip()]
            for words in 'FATAL', problem, valid:
                self.assertIn(words, line)
        self.assertEqual(self.observer.all('cmd_vel'), [])

    def test_a_node_without_a_robot_logs_the_missing_topics(self):
        both = '/nowhere/imu and /nowhere/odom'
        nodes = [(self.start(executable, '__ns:=nowhere'), topics) for executable, topics in (
            ('move2goal_tf.py', both), ('turtlebot_controller.py', '/nowhere/imu'))]
        for node, topics in nodes:
            node.wait_for('Waiting for {}: is the robot running?'.format(topics))
        for node, _ in nodes:    # a node by rospy alone takes longer to end than to start
            pid = node.pid
            started = cpu_time(pid)
            node.send(signal.SIGINT)
            os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
            self.assertLess(cpu_time(pid) - started, 0.3 * started)
            self.assertEqual(node.wait(), 0)

    def test_send_goal_without_its_node_is_one_line(self):
        tool = self.start('send_goal.py', '1', '1', '0', environment={'ROS_NAMESPACE': 'nowhere'})
        self.assertEqual(tool.wait(STARTING), 1)
        self.assertEqual(tool.lines, [
            'send_goal: /nowhere/move2goal does not answer: is move_to_goal running?'])

    def test_a_node_without_a_master_waits_for_one(self):
        node = self.start('move2goal_tf.py', '_goal_x:=1.0',
                          environment={'ROS_MASTER_URI': 'http://localhost:1'})
        node.wait_for('Waiting for a ROS master at http://localhost:1', STARTING)
        self.assertEqual(node.end(), 0)
        self.assertEqual(len(node.lines), 1, node.text)
