"""dynamic_reconfigure of both driving nodes, by ROS's own client: effective at once; plots."""
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from dynamic_reconfigure import DynamicReconfigureCallbackException
from dynamic_reconfigure.client import Client
from std_msgs.msg import Bool, Float32, Float64

from node_case import NodeCase

BURGER_LINEAR, BURGER_ANGULAR = 0.2108, 2.635


class LiveTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.watch_data(Float32, 'distance_error', 'angle_error_deg')
        cls.observer.watch('/diagnostics', DiagnosticArray, lambda message: message.status[0])
        cls.control = rospy.Publisher('ctrl_relinq', Bool, queue_size=5)    # each word counts
        cls.turn = rospy.Publisher('turn', Float64, queue_size=1)
        cls.wait_for_subscriber(cls.control, cls.turn)

    def diagnosis(self, node, is_right):
        """{name: value} of a node's diagnosis without a problem, as soon as `is_right`: its first
        second may be incomplete (before it, the Updater says that the node starts up, without a
        value), and a late machine counts a message in the next one."""
        def values(status):
            return {item.key: item.value for item in status.values}
        return values(self.observer.wait_for('/diagnostics', lambda status: (
            status.name == node + ': state' and status.level == DiagnosticStatus.OK
            and status.values and is_right(values(status)))))

    def test_every_driving_node_tells_how_it_is(self):
        mover = self.diagnosis('move_to_goal', lambda values: (
            float(values['imu age [s]']) < 0.1 and float(values['odom age [s]']) < 0.1
            and (values['imu dropped'], values['odom dropped']) == ('0', '0')))
        self.assertTrue(mover['state'] and mover['control'] and mover['goal'])
        controller = self.diagnosis('controller', lambda values: (
            float(values['imu age [s]']) < 0.1))
        self.assertEqual((controller['driver'], controller['mouse']), ('nobody', 'not active'))

    def test_move_to_goal_in_the_middle_of_a_drive(self):
        client = Client('move_to_goal', timeout=10.0)
        for word in (False, True):    # a True alone may be older than the node
            self.control.publish(word)
        self.observer.wait_for('cmd_vel', lambda command: command[0] > 0.2)
        client.update_configuration({'max_linear': 0.1})
        self.observer.wait_for('cmd_vel', lambda command: 0.0 < command[0] <= 0.1)
        changed = rospy.get_time()
        self.let_pass(0.5)
        self.assertTrue(all(linear <= 0.1 for _, (linear, _) in self.observer.all('cmd_vel', changed)))
        # a limit beyond the robot's own has no effect
        client.update_configuration({'max_linear': 1.0})
        self.observer.wait_for('cmd_vel', lambda command: command[0] > 0.2)
        self.control.publish(False)
        self.observer.wait_for('cmd_vel', lambda command: command == (0.0, 0.0))
        self.assertTrue(all(linear <= BURGER_LINEAR for _, (linear, _) in self.observer.all('cmd_vel')))
        # the remaining way from here to (-3, 3), for plots
        self.rest()
        here = self.observer.latest('ground_truth')
        left = ((here.x + 3.0) ** 2 + (here.y - 3.0) ** 2) ** 0.5
        self.observer.wait_for('distance_error', lambda error: abs(error - left) < 0.01, 5.0)
        self.assertIsNotNone(self.observer.latest('angle_error_deg'))

    def test_the_controller_in_the_middle_of_a_turn(self):
        client = Client('controller', timeout=10.0)
        self.rest()
        self.turn.publish(720.0)
        self.observer.wait_for('cmd_vel', lambda command: command[1] == 1.5)
        client.update_configuration({'max_ang_z': 0.6})
        self.observer.wait_for('cmd_vel', lambda command: command[1] == 0.6)
        client.update_configuration({'max_ang_z': 5.0})
        self.observer.wait_for('cmd_vel', lambda command: command[1] == BURGER_ANGULAR)
        with self.assertRaises((DynamicReconfigureCallbackException, rospy.ServiceException)):
            client.update_configuration({'max_ang_z': 0.05})    # its bound is 0.1
        self.observer.wait_for('cmd_vel', lambda command: command == (0.0, 0.0), 20.0)
