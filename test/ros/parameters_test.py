#!/usr/bin/env python3
"""The ways to give a parameter: the package's file, your own, an argument, dynamic_reconfigure."""
import os
import signal
import sys
import tempfile

import rospkg
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from dynamic_reconfigure.client import Client
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

from tb3_labs.ros.testing.node_process import Program
from tb3_labs.ros.testing.observer import Observer

PACKAGE = rospkg.RosPack().get_path('tb3_labs')
sys.path.append(os.path.join(PACKAGE, 'test'))

import make_parameters  # noqa: E402
sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from node_case import STARTING, NodeCase    # noqa: E402 (a relay's folder)

DEFAULT_LINEAR = 0.26


def parameters_of(launch_file, *arguments):
    """{name: value} of the parameters that a launch file would set."""
    config = ROSLaunchConfig()
    XmlLoader().load(os.path.join(PACKAGE, 'launch', launch_file), config, argv=list(arguments),
                     verbose=False)
    return {name: param.value for name, param in config.params.items()}


def launch(namespace, *arguments):
    """move2goal.launch in a namespace of its own."""
    return Program(['roslaunch', '--disable-title', '--skip-log-check', 'tb3_labs',
                    'move2goal.launch'] + list(arguments), environment={'ROS_NAMESPACE': namespace})


class ParametersTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix='parameters_test_')
        cls.mine = os.path.join(cls.folder.name, 'my.yaml')
        with open(cls.mine, 'w') as file:
            file.write('max_linear: 0.2\nallow_reverse: true\nmodel: waffle\n')
        cls.faulty = os.path.join(cls.folder.name, 'faulty.yaml')
        with open(cls.faulty, 'w') as file:
            file.write('motor_lag: 0.1\n')
        cls.seen = Observer()
        cls.seen.watch('/diagnostics', DiagnosticArray, lambda message: message.status[0])
        cls.launches = [launch('plain'), launch('argument', 'max_linear:=0.1'),
                        launch('file', 'params:=' + cls.mine)]

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
            cls.folder.cleanup()

    def settings_of(self, namespace):
        """The settings of the node."""
        client = Client('/{}/move_to_goal'.format(namespace), timeout=20.0)
        self.addCleanup(client.close)
        return client.get_configuration(timeout=10.0)

    def test_an_argument(self):
        taken = self.settings_of('argument')
        self.assertEqual((taken['max_linear'], taken['allow_reverse']), (0.1, False))

    def test_a_file_of_ones_own_and_an_argument_that_wins_over_it(self):
        taken = self.settings_of('file')
        self.assertEqual((taken['max_linear'], taken['allow_reverse'], taken['law']),
                         (0.2, True, 'precise'))
        self.seen.wait_for('/diagnostics', lambda status: 'waffle' in status.hardware_id)
        both = parameters_of('move2goal.launch', 'params:=' + self.mine, 'max_linear:=0.1')
        self.assertEqual((both['/move_to_goal/max_linear'], both['/move_to_goal/allow_reverse']),
                         (0.1, True))

    def test_nothing_given_then_dynparam_while_it_runs(self):
        taken = self.settings_of('plain')
        self.assertEqual((taken['max_linear'], taken['allow_reverse'], taken['law']),
                         (DEFAULT_LINEAR, False, 'precise'))
        node = next(node for node in make_parameters.nodes() if node.name == 'move_to_goal')
        self.assertEqual(set(taken) - {'groups'},
                         {item.name for item, live in node.settings if live})
        done = self.start('dynparam.py', 'set', '/plain/move_to_goal', 'max_linear', '0.05')
        self.assertEqual(done.wait(STARTING), 0, done.text)
        self.assertEqual(done.text, 'max_linear is 0.05 now\n')
        self.assertEqual(self.settings_of('plain')['max_linear'], 0.05)
        # it lasts as long as the node: a node that starts again has the settings of its launch
        self.assertEqual(rospy.get_param('/plain/move_to_goal/max_linear'), DEFAULT_LINEAR)

    def test_dynparam_refuses_in_one_line(self):
        node = '/file/move_to_goal'
        cases = (('set {} max_linear 9'.format(node), 'max_linear = 9.0 is not valid: a number from'),
                 ('set {} max_linear fast'.format(node), "max_linear = 'fast' is not valid: a number from 0.02 to 1 m/s"),
                 ('set {} law Lab'.format(node), "law = 'Lab' is not valid: one of precise, lab"),
                 ('set {} max_liner 0.1'.format(node), 'near it: max_linear'),
                 ('set /file/move_to_gaol max_linear 0.1', 'near it: ' + node),
                 ('get {} lw'.format(node), 'near it: law'), ('sat', 'usage: dynparam list'))
        tools = [self.start('dynparam.py', *words.split()) for words, _ in cases]
        for tool, (words, line) in zip(tools, cases):
            self.assertEqual(tool.wait(STARTING), 1, words)
            self.assertEqual(len(tool.lines), 1, tool.text)
            self.assertIn(line, tool.text)

    def test_every_parameter_is_an_argument_of_its_launch_file(self):
        for node in make_parameters.nodes():
            given = {item.name: 'given {}'.format(number)
                     for number, (item, _) in enumerate(node.settings)}
            arguments = ['{}:={}'.format(node.argument(item), given[item.name])
                         for item, _ in node.settings]
            found = parameters_of(node.launch_file, *arguments + ['mouse:=true'] * (
                node.launch_file == 'turn.launch'))
            self.assertEqual(
                {name: found['/{}/{}'.format(node.name, name)] for name in given}, given)

    def test_files_that_include_others_pass_every_argument_on(self):
        demo = parameters_of('demo.launch', 'slip:=0.2', 'max_angular:=1.1')
        self.assertEqual((demo['/turtlebot3/slip'], demo['/move_to_goal/max_angular']), (0.2, 1.1))
        pad = parameters_of('gamepad.launch', 'pad:=xbox', 'max_angular:=1.1', 'dead_zone:=0.2',
                            'move_to_goal_params:=' + self.mine)
        self.assertEqual((pad['/gamepad/reset_button'], pad['/gamepad/dead_zone']), (3, 0.2))
        self.assertEqual((pad['/move_to_goal/max_angular'], pad['/move_to_goal/max_linear']),
                         (1.1, 0.2))
        lab = parameters_of('turn.launch', 'sim:=true', 'slip:=0.2', 'tolerance_deg:=1.5',
                            'turtlebot3_params:=' + self.faulty)
        self.assertEqual((lab['/turtlebot3/slip'], lab['/turtlebot3/motor_lag']), (0.2, 0.1))
        self.assertEqual(lab['/controller/tolerance_deg'], 1.5)
        lab = parameters_of('turn.launch', 'sim:=true', 'mystery:=7')
        self.assertEqual(lab['/turtlebot3/mystery'], 7)
        room = parameters_of('classroom.launch', 'robots:=13', 'mystery:=7')
        self.assertEqual((room['/turtlebots0/mystery'], room['/turtlebots1/mystery']), (7, 7))
        robot = parameters_of('robot.launch', 'robot:=localhost', 'lab:=turn', 'hdg_tol:=3')
        self.assertEqual(robot['/controller/hdg_tol'], 3)


if __name__ == '__main__':
    rospy.init_node('parameters_test')
    rostest.rosrun('tb3_labs', 'parameters', ParametersTest)
