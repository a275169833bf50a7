"""Measures the time of the zero, and the true place of the robot, after faults of real processes.

Prints a line with the measured times of each fault. The core's roll-outs (test/unit/test_stops.py)
cover every state of a drive, frozen sensors, stuck robots and the robot's own reset; test_encoders.py a battery that is
cut.
"""
import itertools
import math
import re

import rospy
from dynamic_reconfigure.client import Client
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool

from drive_case import DriveCase
from node_case import STARTING, ZERO, NodeProgram
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2

#: Time from the last valid sample to the zero [s]. Required is 0.3, which test_stops.py checks for
#: the core; here the time of the nodes is added.
SILENCE = 0.4
MOVER, TURNER = 'move2goal_tf.py', 'turtlebot_controller.py'
FAULTLESS = dict(imu_silent=False, odom_silent=False, gyro_bias_deg=0.0)


class FaultsTest(DriveCase):
    """Methods share the robot, and the nodes that an earlier method started."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.nodes = {}
        cls.observer.watch('imu', Imu)
        cls.observer.watch('odom', Odometry)
        cls.bad_imu = rospy.Publisher('imu', Imu, queue_size=1)
        cls.bad_odom = rospy.Publisher('odom', Odometry, queue_size=1)
        cls.observer.wait_for('ground_truth', seconds=STARTING)
        cls.robot = Client('turtlebot3', timeout=STARTING)

    @classmethod
    def tearDownClass(cls):
        for node in cls.nodes.values():
            node.kill()

    def setUp(self):
        self.set(**FAULTLESS)
        self.control.publish(False)
        self.rest()
        self.printed = {name: len(node.text) for name, node in self.nodes.items()}

    def set(self, **settings):
        self.robot.update_configuration(settings)

    def node(self, executable):
        """Returns the running node, or starts a new one."""
        if executable not in self.nodes or self.nodes[executable].status is not None:
            if executable == MOVER:
                self.wait_until_unheard({self.control: Bool(False)})
                self.observer.forget('goal_state')
            self.nodes[executable] = NodeProgram(executable, terminal=True)
            self.printed[executable] = 0
        return self.nodes[executable]

    def wait_for_line(self, executable, words):
        """Wait until a node has printed `words` in this test."""
        self.observer.wait_until(lambda: words in self.nodes[executable].text[
            self.printed[executable]:], what=words)

    def drive(self, goal=Pose2(2.0, 0.0, 0.0)):
        """Begin a drive straight ahead, and wait until it is fast. `begin` is its first true pose."""
        node = self.node(MOVER)
        self.wait_for_subscriber(self.control, self.goals)
        self.control.publish(False)
        self.begin = self.rest()
        self.declare()
        self.wait_for_state('waiting for control', seconds=STARTING)
        self.observer.forget('cmd_vel')
        self.go_to(goal)
        self.control.publish(True)
        self.wait_for_speed(0.2)
        self.observer.wait_for('ground_truth', lambda pose: pose.distance_to(self.begin) > 0.04)
        return node

    def turn(self):
        """Begin a turn, and wait until it is fast."""
        node, start = self.node(TURNER), self.rest()
        self.observer.forget('cmd_vel')
        node.type('b')      # a line that is typed waits for the robot
        self.observer.wait_for('cmd_vel', lambda command: command[1] > 1.4, STARTING)
        self.observer.wait_for('ground_truth', lambda pose: difference(pose.yaw, start.yaw) > 0.2)
        return node

    def place(self):
        """Returns the robot's true pose in the frame of move_to_goal."""
        return self.begin.inverse() @ self.observer.latest('ground_truth')

    def stop_since(self, last, within, what):
        """One zero comes within this time after `last`, and the robot rests."""
        zero = self.zero_since(last, within)
        start = self.place_at(last)
        way = start.distance_to(self.rest())
        print('%-44s zero %.2f s after the fault, %.0f mm driven' % (what, zero - last, 1000 * way))
        commands = [command for _, command in self.observer.all('cmd_vel')]
        self.assertNotIn((ZERO, ZERO), list(zip(commands, commands[1:])))
        self.assertEqual(commands[-1], ZERO)

    def place_at(self, time):
        return min(self.observer.all('ground_truth'), key=lambda entry: abs(entry[0] - time))[1]

    def silence_of(self, *topics):
        """Wait until no message comes. Returns the earliest of the topics' last arrivals."""
        self.observer.wait_until(lambda: all(
            rospy.get_time() - self.observer.all(topic)[-1][0] > 0.1 for topic in topics), 5.0)
        return min(self.observer.all(topic)[-1][0] for topic in topics)

    def test_silent_sensors_in_a_drive(self):
        self.drive()
        for lost in (('imu',), ('odom',), ('imu', 'odom')):
            self.set(**{name + '_silent': True for name in lost})
            last = self.silence_of(*lost)
            self.stop_since(last, SILENCE, ' and '.join(lost) + ' silent in a drive')
            # of two that fall silent, one may be noticed first
            self.observer.wait_for('goal_state', lambda state: state.startswith('stopped') and all(
                'no ' + name in state for name in lost))
            self.assertFalse(self.reset(0.0, 0.0, 0.0).success)
            self.set(**{name + '_silent': False for name in lost})
            self.wait_for_speed(0.2, 5.0)     # the drive goes on by itself
        self.set(imu_silent=True)
        self.wait_for_state('stopped')
        self.wait_for_state('gave up: no imu for 2.')      # the silence is too long for the drive to go on
        self.control.publish(False)
        self.observer.forget('cmd_vel')
        self.control.publish(True)        # a robot that comes later does not move, either
        self.wait_for_line(MOVER, 'Control from {} is gone: no imu'.format(rospy.get_name()))
        self.set(imu_silent=False)
        self.let_pass(1.0)
        self.assertEqual(self.observer.all('cmd_vel'), [])

    def test_the_gyro_lies(self):
        for executable, begin in ((MOVER, self.drive), (TURNER, self.turn)):
            begin()
            self.set(gyro_bias_deg=40.0)
            self.stop_since(rospy.get_time(), SILENCE, 'a gyro that lies in a ' + begin.__name__)
            self.wait_for_line(executable, 'the gyro contradicts the wheels')
            self.set(gyro_bias_deg=0.0)
            self.let_pass(1.2)      # they must agree for 1 s

    def test_messages_that_cannot_be_true(self):
        node, bad = self.drive(Pose2(0.4)), []
        for w, x in ((math.nan, 0.0), (math.inf, 0.0), (0.0, 0.0), (3.0, 0.0), (1.0, math.nan),
                     (1.0, 1.7e308), (1.0, 1e200), (1.0, -3e4)):
            imu, odom = Imu(), Odometry()
            imu.orientation.w = odom.pose.pose.orientation.w = w
            imu.angular_velocity.z = odom.pose.pose.position.x = x
            bad.append((imu, odom))

        def flood_until(topic, value, seconds):
            give_up = rospy.get_time() + seconds
            for imu, odom in itertools.cycle(bad):
                self.bad_imu.publish(imu)
                self.bad_odom.publish(odom)
                if self.observer.latest(topic) == value:
                    return
                self.assertLess(rospy.get_time(), give_up, value)
                rospy.rostime.wallsleep(0.005)

        # among valid messages the invalid ones have no effect
        flood_until('goal_state', 'GOAL_REACHED', 20.0)
        self.rest()
        self.assertLess(self.place().distance_to(Pose2(0.4)), 0.01)
        for topic in ('imu', 'odom'):
            self.assertIn('invalid message on {} dropped'.format(topic), node.text)
        # without valid messages the sensor is silent
        self.go_to(Pose2(3.0))
        self.wait_for_speed(0.2)
        self.set(imu_silent=True)
        good = [at for at, imu in self.observer.all('imu') if abs(imu.orientation.w) <= 1.0][-1]
        flood_until('cmd_vel', ZERO, 3.0)
        self.zero_since(good, SILENCE)

    def test_a_node_that_raises(self):
        for executable, where, *arguments in (
                (MOVER, 'tb3_labs.nodes.move_to_goal.core:MoveToGoalCore.on_odometry',
                 '_has_control:=true', '_goal_x:=3.0'),
                (TURNER, 'tb3_labs.nodes.controller.core:ControllerCore._next_command')):
            if executable in self.nodes:
                self.nodes[executable].end()
            self.rest()
            self.observer.forget('cmd_vel')
            node = self.start('broken_node.py', executable, where, *arguments, terminal=True)
            if executable == TURNER:
                node.type('b')
            node.wait_for('FATAL', STARTING)
            fatal, = [line for line in node.lines if 'FATAL' in line]
            self.assertIn('RuntimeError: broken on purpose', fatal)
            self.assertEqual(node.wait(), 1)
            failed = float(re.search(r'\[(\d+\.\d+)\]', fatal).group(1))
            self.stop_since(failed, 0.2, 'exception in ' + where.split(':')[1])
            self.assertNotIn('Traceback', node.text)
        self.forget_parameters('move_to_goal')
