"""A /clock that is missing, stands still or jumps back: the robot stays safe, a line reports it."""
import math
import threading
import time

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu

from tb3_labs.ros.conversions import to_quaternion

from node_case import STARTING, NodeCase

STEP = 0.01
#: Sensors that are silent for longer than 2 s make a node wait for a pose. A clock that stands does not:
#: the simulated robot stands, too [s].
PAUSED = 2.6


class ObedientRobot:
    """A robot that obeys at once, and publishes /clock, at the pace of the wall clock."""

    def __init__(self):
        self.clock = rospy.Publisher('/clock', Clock, queue_size=10)
        self.imu = rospy.Publisher('imu', Imu, queue_size=10)
        self.odom = rospy.Publisher('odom', Odometry, queue_size=10)
        self.now, self.runs, self.speed = 1000.0, True, (0.0, 0.0)
        self.yaw = self.x = self.y = 0.0
        rospy.Subscriber('cmd_vel', Twist, self._obey)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _obey(self, message):
        self.speed = message.linear.x, message.angular.z

    def end(self):
        self._over.set()
        self._thread.join()

    def _run(self):
        while not self._over.wait(STEP):
            linear, angular = self.speed
            if self.runs:
                self.now += STEP
                self.yaw += angular * STEP
                self.x += linear * math.cos(self.yaw) * STEP
                self.y += linear * math.sin(self.yaw) * STEP
                self.clock.publish(rospy.Time.from_sec(self.now))
            imu, odom = Imu(), Odometry()
            imu.header.stamp = odom.header.stamp = rospy.Time.from_sec(self.now)
            imu.angular_velocity.z = angular + 1e-5 * math.sin(1e3 * time.monotonic())
            pose = odom.pose.pose
            imu.orientation = pose.orientation = to_quaternion(self.yaw)
            pose.position.x, pose.position.y = self.x, self.y
            odom.twist.twist.linear.x = linear
            self.imu.publish(imu)
            self.odom.publish(odom)


class ClockTest(NodeCase):

    @classmethod
    def watch(cls):
        cls.observer.watch('cmd_vel', Twist, lambda message: (time.monotonic(), message.linear.x,
                                                              message.angular.z))

    def commands(self, since):
        return [value for _, value in self.observer.all('cmd_vel') if value[0] >= since]

    def test_1_a_missing_clock_is_reported(self):
        nodes = [self.start(executable) for executable in (
            'move2goal_tf.py', 'turtlebot_controller.py', 'gamepad.py')]
        for node in nodes:
            node.wait_for('ERROR', STARTING)
            line, = [line for line in node.lines if 'ERROR' in line]
            self.assertIn('nobody publishes /clock', line)
        for node in nodes:
            self.assertEqual(node.end(), 0)

    def test_2_a_clock_that_stands_still_or_jumps_back(self):
        robot = ObedientRobot()
        self.addCleanup(robot.end)
        node = self.start('move2goal_tf.py', '_has_control:=true', '_goal_x:=1.0', '_goal_y:=0.25')
        self.observer.wait_for('cmd_vel', lambda command: command[1] > 0.2, STARTING)
        # the clock stands still, though the sensors go on
        robot.runs = False
        stood = time.monotonic()
        self.observer.wait_for('cmd_vel', lambda command: command[1:] == (0.0, 0.0))
        zero, late = self.observer.latest('cmd_vel')[0], time.time() - time.monotonic()
        self.assertLess(zero - stood, 0.5 + self.hiccups.since(stood + late, zero + late))
        node.wait_for('/clock stands still')
        self.assert_no_commands(PAUSED)
        robot.runs = True
        self.observer.wait_for('cmd_vel', lambda command: command[1] > 0.2)
        # a bag that is played again
        jumped = time.monotonic()
        robot.now -= 500.0
        self.observer.wait_until(lambda: time.monotonic() > jumped + 2.0)
        self.assertTrue(all(abs(linear) <= 0.2108 and abs(angular) <= 1.5 for _, linear, angular
                            in self.commands(jumped)))
        self.observer.wait_for('cmd_vel', lambda command: command[1] > 0.2)
        node.wait_for('Goal reached!', STARTING)
        self.assertLess(math.hypot(robot.x - 1.0, robot.y - 0.25), 0.02)
        self.assertNotIn('Traceback', node.text)
        self.assertEqual(node.end(), 0)

    def assert_no_commands(self, seconds):
        """No command is sent for this time of the wall clock, since ROS time may stand still."""
        since = time.monotonic() + 0.1
        self.observer.wait_until(lambda: time.monotonic() > since + seconds)
        self.assertEqual(self.commands(since), [])
