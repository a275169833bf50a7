#!/usr/bin/env python3
"""The ways to give a parameter to a node that runs: a file, set:=, dynparam; and its refusals."""
import os
import signal
import sys
import tempfile

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from dynamic_reconfigure.client import Client

from tb3_labs.control.goal import DriveConfig
from tb3_labs.ros.observer import Observer
from tb3_labs.ros.program import Program

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from node_case import STARTING, NodeCase    # noqa: E402

DEFAULT = DriveConfig()
DYNPARAM = [sys.executable, '-m', 'tb3_labs.ros.dynparam']


def launch(namespace, *arguments):
    """move2goal.launch in a namespace of its own."""
    return Program(['roslaunch', '--disable-title', '--skip-log-check', 'tb3_labs',
                    'move2goal.launch'] + list(arguments), environment={'ROS_NAMESPACE': namespace})


class ParametersTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix='parameters_test_')
        cls.addClassCleanup(folder.cleanup)
        mine = os.path.join(folder.name, 'my.yaml')
        with open(mine, 'w') as file:
            file.write('max_linear: 0.2\nallow_reverse: true\nmodel: waffle\n')
        cls.seen = Observer()
        cls.seen.watch('/diagnostics', DiagnosticArray, lambda message: message.status[0])
        cls.launches = [launch('plain'), launch('file', 'params:=' + mine, 'set:={max_angular: 1}')]

    @classmethod
    def tearDownClass(cls):
        for program in cls.launches:
            program.send(signal.SIGINT)
        try:
            for program in cls.launches:
                program.wait(40.0)
        finally:
            for program in cls.launches:
                program.kill()

    def settings_of(self, namespace):
        """The settings of the node, {name: value}."""
        client = Client('/{}/move_to_goal'.format(namespace), timeout=20.0)
        self.addCleanup(client.close)
        return client.get_configuration(timeout=10.0)

    def test_a_file_of_ones_own_and_set(self):
        taken = self.settings_of('file')
        self.assertEqual([taken[name] for name in (
            'max_linear', 'allow_reverse', 'max_angular', 'law')], [0.2, True, 1.0, 'precise'])
        self.seen.wait_for('/diagnostics', lambda status: 'waffle' in status.hardware_id)

    def test_nothing_given_then_dynparam_while_it_runs(self):
        taken = self.settings_of('plain')
        del taken['groups']
        self.assertEqual(taken, vars(DEFAULT))
        done = self.tool('set /plain/move_to_goal max_linear 0.05')
        self.assertEqual(done.wait(STARTING), 0, done.text)
        self.assertEqual(done.text, 'max_linear is 0.05 now\n')
        self.assertEqual(self.settings_of('plain')['max_linear'], 0.05)
        # it lasts as long as the node: a node that starts again has the settings of its launch
        self.assertEqual(rospy.get_param('/plain/move_to_goal/max_linear'), DEFAULT.max_linear)

    def test_dynparam_refuses_in_one_line(self):
        robot = self.start('fake_turtlebot3.py', '__ns:=/hidden', '_mystery:=7')
        robot.wait_for('one fault is hidden')
        node = '/file/move_to_goal'
        cases = (
            ('set {} max_linear 9'.format(node), 'max_linear = 9.0 is not valid: a number from'),
            ('set {} max_linear fast'.format(node), "'fast' is not valid: a number from 0.02 to 1"),
            ('set {} law Lab'.format(node), "law = 'Lab' is not valid: one of precise, lab"),
            ('set {} max_liner 0.1'.format(node), 'is max_linear meant?'),
            ('set /file/move_to_gaol max_linear 0.1', 'is {} meant?'.format(node)),
            ('get {} lw'.format(node), 'is law meant?'), ('sat', 'usage: dynparam list'),
            ('set /hidden/turtlebot3 slip 0', 'has no settings that can change while it runs'))
        tools = [self.tool(words) for words, _ in cases]
        for tool, (words, line) in zip(tools, cases):
            self.assertEqual(tool.wait(STARTING), 1, words)
            self.assertEqual(len(tool.lines), 1, tool.text)
            self.assertIn(line, tool.text)

    def tool(self, words):
        program = Program(DYNPARAM + words.split())
        self.addCleanup(program.kill)
        return program


if __name__ == '__main__':
    rospy.init_node('parameters_test')
    rostest.rosrun('tb3_labs', 'parameters', ParametersTest)
