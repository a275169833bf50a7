"""Parameters of running nodes: by a file, by set:=, by dynparam and by ROS's own client. A change has
an effect at once."""
import pathlib
import sys

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from dynamic_reconfigure import DynamicReconfigureCallbackException
from dynamic_reconfigure.client import Client
from std_msgs.msg import Bool, Float64

from node_case import STARTING, ZERO, NodeCase, TestProgram
from tb3_labs.control.drive_law import DriveConfig
from tb3_labs.robot.turtlebot3 import MODELS
from tb3_labs.ros import dynparam

MOVER = '/move_to_goal'
WAFFLE = MODELS['waffle']
RUN = pathlib.Path(__file__).resolve().parents[2] / 'launch' / 'run.py'


def values_of(status):
    """Returns the values of a DiagnosticStatus, {name: value}."""
    return {item.key: item.value for item in status.values}


class LiveTest(NodeCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.observer.watch('/diagnostics', DiagnosticArray, lambda message: message.status[0])
        cls.control = rospy.Publisher('ctrl_relinq', Bool, queue_size=5)    # each word counts
        cls.turn = rospy.Publisher('turn', Float64, queue_size=1)
        cls.wait_for_subscriber(cls.control, cls.turn)

    def settings(self):
        """Reads the settings of move_to_goal, {name: value}, by ROS's own client."""
        client = Client(MOVER, timeout=20.0)
        self.addCleanup(client.close)
        return dict(client.get_configuration(timeout=10.0), groups=None)

    def diagnosis(self, node, is_right):
        """The first status of `node` without a problem whose values are right. The first second of a node may be
        incomplete, and a late machine counts a message in the next second."""
        return self.observer.wait_for('/diagnostics', lambda status: (
            status.name == node + ': state' and status.level == DiagnosticStatus.OK
            and status.values and is_right(values_of(status))))

    def test_a_file_of_ones_own_and_set_go_before_the_defaults(self):
        self.assertEqual(self.settings(), dict(vars(DriveConfig()), max_linear=0.2, distance_tolerance=0.02,
                                               max_angular=1.0, groups=None))

    def test_every_driving_node_publishes_its_state(self):
        status = self.diagnosis('move_to_goal', lambda values: (
            float(values['imu age [s]']) < 0.1 and float(values['odom age [s]']) < 0.1
            and (values['imu dropped'], values['odom dropped']) == ('0', '0')))
        self.assertIn('waffle', status.hardware_id)
        self.assertTrue(all(values_of(status)[name] for name in ('state', 'control', 'goal')))
        controller = values_of(self.diagnosis('controller', lambda values: float(values['imu age [s]']) < 0.1))
        self.assertEqual((controller['driver'], controller['mouse']), ('nobody', 'not active'))

    def test_dynparam_refuses_with_a_reason(self):
        for (name, value), reason in (
                (('max_linear', '9'), 'max_linear = 9.0 is not valid: a number from'),
                (('max_linear', '1' + 400 * '0'), 'max_linear = inf is not valid: a number from'),
                (('allow_reverse', 'maybe'), "allow_reverse = 'maybe' is not valid: true or false"),
                (('max_linear', 'fast'), "'fast' is not valid: a number from 0.02 to 1"),
                (('max_liner', '0.1'), 'is max_linear meant?')):
            with self.assertRaises(ValueError) as refused:
                dynparam.change(MOVER, name, value)
            self.assertIn(reason, str(refused.exception))
        done = self.dynparam('set', '/move_to_gaol', 'max_linear', '0.1')
        self.assertEqual((done.wait(STARTING), len(done.lines)), (1, 1), done.text)
        self.assertIn('service /move_to_gaol/set_parameters', done.text)

    def dynparam(self, *words):
        program = TestProgram([sys.executable, str(RUN), 'dynparam', *words])
        self.addCleanup(program.kill)
        return program

    def test_move_to_goal_in_the_middle_of_a_drive(self):
        client = Client('move_to_goal', timeout=10.0)
        for word in (False, True):    # a True alone may be older than the node
            self.control.publish(word)
        self.observer.wait_for('cmd_vel', lambda command: 0.15 < command[0] <= 0.2)
        done = self.dynparam('set', MOVER, 'max_linear', '0.1')
        self.assertEqual((done.wait(STARTING), done.text), (0, 'max_linear is 0.1 now\n'))
        self.observer.wait_for('cmd_vel', lambda command: 0.0 < command[0] <= 0.1)
        changed = rospy.get_time()
        self.let_pass(0.5)
        self.assertTrue(all(linear <= 0.1 for _, (linear, _) in self.observer.all('cmd_vel', changed)))
        # a node that starts again has the settings of its launch
        self.assertEqual((self.settings()['max_linear'], rospy.get_param(MOVER + '/max_linear')), (0.1, 0.2))
        # a limit beyond the robot's own has no effect
        client.update_configuration({'max_linear': 1.0})
        self.observer.wait_for('cmd_vel', lambda command: command[0] == WAFFLE.max_linear)
        self.control.publish(False)
        self.observer.wait_for('cmd_vel', lambda command: command == ZERO)
        self.assertEqual(max(linear for _, (linear, _) in self.observer.all('cmd_vel')), WAFFLE.max_linear)

    def test_the_controller_in_the_middle_of_a_turn(self):
        client = Client('controller', timeout=10.0)
        self.rest()
        self.turn.publish(720.0)
        for most, rate in ((None, 1.5), (0.6, 0.6), (5.0, WAFFLE.max_angular)):
            if most is not None:
                client.update_configuration({'max_ang_z': most})
            self.observer.wait_for('cmd_vel', lambda command, rate=rate: command[1] == rate)
        with self.assertRaises((DynamicReconfigureCallbackException, rospy.ServiceException)):
            client.update_configuration({'max_ang_z': 0.05})    # its bound is 0.1
        self.observer.wait_for('cmd_vel', lambda command: command == ZERO, 20.0)
