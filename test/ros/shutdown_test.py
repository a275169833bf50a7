#!/usr/bin/env python3
"""Ctrl+C, SIGTERM, an exception and bad parameters: what the robot gets, and the exit status."""
import signal
import subprocess
import time
import unittest

import rospy
import rostest
from geometry_msgs.msg import Twist

from tb3_labs.ros.observer import Observer


class ShutdownTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.seen = Observer()
        cls.seen.watch('cmd_vel', Twist, lambda message: (message.linear.x, message.angular.z))

    def start(self, *parameters):
        node = subprocess.Popen(['rosrun', 'tb3_labs', 'move2goal_tf.py'] + list(parameters),
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                start_new_session=True)
        self.addCleanup(lambda: node.poll() is None and node.kill())
        return node

    def test_a_signal_in_mid_turn_delivers_one_zero(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            self.seen.forget('cmd_vel')
            node = self.start('_has_control:=true')
            self.seen.wait_for('cmd_vel', lambda command: command[1] > 1.0)
            sent = rospy.get_time()
            node.send_signal(number)
            self.seen.wait_for('cmd_vel', lambda command: command == (0.0, 0.0), 2.0)
            arrived, _ = self.seen.all('cmd_vel')[-1]
            self.assertLess(arrived - sent, 0.2)
            self.assertIsNotNone(node.wait(10.0))
            zeros = [command for _, command in self.seen.all('cmd_vel', sent)
                     if command == (0.0, 0.0)]
            self.assertEqual(zeros, [(0.0, 0.0)])
            self.assertEqual(self.seen.latest('cmd_vel'), (0.0, 0.0))
            self.assertNotIn('Traceback', node.stdout.read())

    def test_a_bad_parameter_is_one_fatal_line_and_nothing_moves(self):
        cases = [('_goal_x:=far', 'goal_x', 'a number from -100 to 100 m'),
                 ('_goal_yaw_deg:=.nan', 'goal_yaw_deg', 'a number'),
                 ('_distance_tolerance:=-1', 'distance_tolerance', 'from 0.002 to 1 m'),
                 ('_has_control:=maybe', 'has_control', 'true or false'),
                 ('_law:=fast', 'law', 'precise, lab'),
                 ('_model:=vacuum', 'vacuum', 'burger, waffle, waffle_pi')]
        self.seen.forget('cmd_vel')
        nodes = [self.start('_has_control:=true', '__name:=bad{}'.format(number), parameter)
                 for number, (parameter, _, _) in enumerate(cases)]
        for node, (parameter, name, valid) in zip(nodes, cases):
            self.assertEqual(node.wait(20.0), 1, parameter)
            lines = [line for line in node.stdout.read().splitlines() if line.strip()]
            self.assertEqual(len(lines), 1, lines)
            for word in ('FATAL', name, valid):
                self.assertIn(word, lines[0])
        self.assertEqual(self.seen.all('cmd_vel'), [])

    def test_a_misspelt_parameter_is_warned_of(self):
        node = self.start('_gaol_x:=1.0')
        deadline = time.monotonic() + 10.0
        line = ''
        while 'gaol_x' not in line and time.monotonic() < deadline:
            line = node.stdout.readline()
        self.assertIn('goal_x', line)
        node.send_signal(signal.SIGINT)
        self.assertEqual(node.wait(10.0), 0)


if __name__ == '__main__':
    rospy.init_node('shutdown_test')
    rostest.rosrun('tb3_labs', 'shutdown', ShutdownTest)
