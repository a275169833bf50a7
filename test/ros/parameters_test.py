"""The ways to give a parameter to a node that runs: a file, set:=, dynparam; and its refusals."""
import os
import pathlib
import sys
import tempfile

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from dynamic_reconfigure.client import Client

from tb3_labs.control.goal_state import DriveConfig

from node_case import STARTING, NodeCase, TestProgram

NODE = '/mine/move_to_goal'
RUN = pathlib.Path(__file__).resolve().parents[2] / 'launch' / 'run.py'
DYNPARAM = [sys.executable, str(RUN), 'dynparam']


class ParametersTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix='parameters_test_')
        cls.addClassCleanup(folder.cleanup)
        mine = os.path.join(folder.name, 'my.yaml')
        with open(mine, 'w') as file:
            file.write('max_linear: 0.2\nallow_reverse: true\nmodel: waffle\n')
        super().setUpClass()
        cls.observer.watch('/diagnostics', DiagnosticArray, lambda message: message.status[0])
        cls.launch = TestProgram(['roslaunch', '--disable-title', '--skip-log-check', 'tb3_labs',
                                  'move2goal.launch', 'params:=' + mine, 'set:={max_angular: 1}'],
                                 environment={'ROS_NAMESPACE': 'mine'})
        cls.addClassCleanup(cls.launch.kill)
        cls.addClassCleanup(cls.launch.end, seconds=40.0)

    def settings(self):
        """The settings of the node, {name: value}, as ROS's own client reads them."""
        client = Client(NODE, timeout=20.0)
        self.addCleanup(client.close)
        return dict(client.get_configuration(timeout=10.0), groups=None)

    def test_1_a_file_of_ones_own_and_set_go_before_the_defaults(self):
        self.assertEqual(self.settings(), dict(vars(DriveConfig()), max_linear=0.2, groups=None,
                                               allow_reverse=True, max_angular=1.0))
        self.observer.wait_for('/diagnostics', lambda status: 'waffle' in status.hardware_id)

    def test_2_dynparam_while_it_runs(self):
        done = self.tool('set {} max_linear 0.05'.format(NODE))
        self.assertEqual(done.wait(STARTING), 0, done.text)
        self.assertEqual(done.text, 'max_linear is 0.05 now\n')
        self.assertEqual(self.settings()['max_linear'], 0.05)
        # it lasts as long as the node: a node that starts again has the settings of its launch
        self.assertEqual(rospy.get_param(NODE + '/max_linear'), 0.2)

    def test_3_dynparam_refuses_in_one_line(self):
        cases = (
            ('set {} max_linear 9'.format(NODE), 'max_linear = 9.0 is not valid: a number from'),
            ('set {} max_linear 1{}'.format(NODE, 400 * '0'), 'max_linear = inf is not valid: a number from'),
            ('set {} allow_reverse 1{}'.format(NODE, 400 * '0'), "0' is not valid"),
            ('set {} max_linear fast'.format(NODE), "'fast' is not valid: a number from 0.02 to 1"),
            ('set {} max_liner 0.1'.format(NODE), 'is max_linear meant?'),
            ('set /mine/move_to_gaol max_linear 0.1', 'is {} meant?'.format(NODE)),
            ('get {} max_liner'.format(NODE), 'is max_linear meant?'))
        tools = [self.tool(words) for words, _ in cases]
        for tool, (words, line) in zip(tools, cases):
            self.assertEqual(tool.wait(STARTING), 1, words)
            self.assertEqual(len(tool.lines), 1, tool.text)
            self.assertIn(line, tool.text)

    def tool(self, words):
        program = TestProgram(DYNPARAM + words.split())
        self.addCleanup(program.kill)
        return program
