"""The simulated robot's node on simulated time: topics, frames, firmware, faults."""
import math
import unittest

import numpy as np
import rospy
import tf2_ros
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from tf2_msgs.msg import TFMessage

from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.conversions import to_pose2, to_twist

TOPICS = {'imu': Imu, 'odom': Odometry, 'joint_states': JointState, 'ground_truth': PoseStamped,
          '/tf': TFMessage}
#: This process subscribes to this topic with queue_size=1. rospy has one queue for a topic in a process.
NEWEST_ONLY = 'joint_states'
DEADLINE = 30.0  # of a wait, wall clock [s]
WHEEL_RADIUS = 0.033    # of a Burger [m]


def is_the_robots(message):
    """Is a message from the robot, and not a transform of robot_state_publisher?"""
    return not isinstance(message, TFMessage) or 'wheel' not in message.transforms[0].child_frame_id


class FakeRobotTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.received = {topic: [] for topic in TOPICS}
        for topic, kind in TOPICS.items():
            rospy.Subscriber(topic, kind, lambda message, seen=cls.received[topic]: is_the_robots(
                message) and seen.append(message), queue_size=1 if topic == NEWEST_ONLY else 1000)
        cls.commands = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        cls.live = Client('turtlebot3', timeout=DEADLINE)

    def setUp(self):
        self.wait('all topics', lambda: all(self.received.values()))
        self.wait('the robot listens', self.commands.get_num_connections)
        self.wait_for_rest()

    def wait(self, what, condition):
        self.assertTrue(wait_until(condition, DEADLINE, 0.005), 'waited in vain for: ' + what)

    def wait_for_rest(self):
        self.wait('rest', lambda: abs(self.last('odom').twist.twist.linear.x) < 1e-6
                  and abs(self.last('imu').angular_velocity.z) < 0.01)

    def move(self, command, speed):
        """Send one command. The robot is faster than `speed` [m/s] for a moment, and then at rest."""
        before = len(self.received['odom'])
        self.commands.publish(command)
        # the motion ends by itself after half a second, in which a busy machine may miss it
        self.wait('motion', lambda: any(message.twist.twist.linear.x > speed
                                        for message in self.received['odom'][before:]))
        self.wait_for_rest()

    def last(self, topic):
        return self.received[topic][-1]

    def stamps(self, topic):
        return [message.header.stamp.to_sec() for message in self.received[topic]]

    def test_frames_are_in_the_namespace_and_the_imu_is_nearly_level(self):
        self.assertEqual(self.last('imu').header.frame_id, 'robot3/imu_link')
        odom, transform = self.last('odom'), self.last('/tf').transforms[0]
        for message in odom, transform:
            self.assertEqual(message.header.frame_id, 'robot3/odom')
            self.assertEqual(message.child_frame_id, 'robot3/base_footprint')
        self.assertEqual(self.last('ground_truth').header.frame_id, 'world')
        self.assertEqual(self.last('joint_states').name, ['wheel_left_joint', 'wheel_right_joint'])
        imu = self.last('imu')
        self.assertAlmostEqual(imu.linear_acceleration.z, 9.81, delta=0.01)
        # the board is tilted by 0.7 and 0.4 degrees, so gravity has three parts
        for tilt in (2.0 * math.hypot(imu.orientation.x, imu.orientation.y),
                     math.hypot(imu.linear_acceleration.x, imu.linear_acceleration.y) / 9.81):
            self.assertAlmostEqual(tilt, math.radians(0.81), delta=1e-3)

    def test_the_wheels_in_rviz_turn_as_far_as_the_robot_drives(self):
        transforms = tf2_ros.Buffer()
        tf2_ros.TransformListener(transforms)

        def wheel(side):
            """The attitude of a wheel as a quaternion."""
            turned = transforms.lookup_transform('robot3/odom', 'robot3/wheel_{}_link'.format(side),
                                                 rospy.Time(0), rospy.Duration(60.0)).transform.rotation
            return np.array([turned.x, turned.y, turned.z, turned.w])

        start, before = self.truth(), {side: wheel(side) for side in ('left', 'right')}
        self.move(to_twist(0.1, 0.0), 0.09)
        angle = self.truth().distance_to(start) / WHEEL_RADIUS
        self.assertGreater(angle, 1.0)
        for side, old in before.items():
            self.wait('the {} wheel to turn by {:.2f} rad'.format(side, angle), lambda side=side, old=old: abs(
                2.0 * math.acos(min(1.0, abs(wheel(side) @ old))) - angle) < 0.01)

    def truth(self):
        return to_pose2(self.last('ground_truth').pose)

    def test_tf_is_the_odometry(self):
        def both():
            odom = self.last('odom')
            return odom, [t.transforms[0] for t in self.received['/tf']
                          if t.transforms[0].header.stamp == odom.header.stamp]
        self.wait('tf of the same stamp', lambda: both()[1])
        odom, transforms = both()
        self.assertEqual(transforms[0].transform.rotation, odom.pose.pose.orientation)
        self.assertEqual(transforms[0].transform.translation.x, odom.pose.pose.position.x)

    def test_wheels_are_those_of_the_odometry_however_late_it_is(self):
        self.live.update_configuration({'sensor_latency': 0.3})
        try:
            seen = len(self.received['joint_states'])
            start = self.stamps('odom')[-1]
            self.move(to_twist(0.1, 0.0), 0.09)
            speeds = {m.header.stamp: m.twist.twist.linear.x for m in list(self.received['odom'])}
            wheels = [m for m in self.received['joint_states'][seen:]
                      if m.header.stamp.to_sec() > start and m.header.stamp in speeds]
            for message in wheels:
                self.assertAlmostEqual(sum(message.velocity) / 2.0 * 0.033,
                                       speeds[message.header.stamp], delta=1e-9)
            self.assertGreater(max(m.velocity[0] for m in wheels), 0.09 / 0.033)
        finally:
            self.live.update_configuration({'sensor_latency': 0.0})

    def test_what_the_network_held_up_comes_in_one_write(self):
        """A subscriber with a queue of one gets the latest message, the other gets all, in order."""
        self.live.update_configuration({'network_cut': True})
        self.wait('a truth that goes on without odometry',
                  lambda: self.stamps('ground_truth')[-1] > self.stamps('odom')[-1] + 1.1)
        before = {topic: list(self.received[topic]) for topic in TOPICS}
        self.live.update_configuration({'imu_silent': True, 'odom_silent': True})
        self.live.update_configuration({'network_cut': False})    # only delayed messages arrive
        try:
            new = {topic: lambda topic=topic: self.received[topic][len(before[topic]):]
                   for topic in TOPICS}
            self.wait('all that was held up', lambda: new[NEWEST_ONLY]() and new['odom']() and (
                new['odom']()[-1].header.stamp == new[NEWEST_ONLY]()[-1].header.stamp))
            self.assertEqual(len(new[NEWEST_ONLY]()), 1)
            self.assertGreaterEqual(len(new['odom']()), 30)
            self.wait('tf', lambda: len(new['/tf']()) == len(new['odom']()))
            self.assertEqual([m.transforms[0].header.stamp for m in new['/tf']()],
                             [m.header.stamp for m in new['odom']()])
            self.wait('imu', lambda: new['imu']() and new['imu']()[-1].header.stamp.to_sec() >
                      new['odom']()[-1].header.stamp.to_sec() - 0.01)
            for topic, rate in (('odom', 30.0), ('imu', 200.0)):
                messages = before[topic][-1:] + new[topic]()
                for a, b in zip(messages, messages[1:]):
                    self.assertAlmostEqual((b.header.stamp - a.header.stamp).to_sec(), 1.0 / rate,
                                           delta=1e-6)
                    self.assertEqual(b.header.seq, a.header.seq + 1)
        finally:
            self.live.update_configuration({'imu_silent': False, 'odom_silent': False})
        self.wait('the next one', lambda: len(new[NEWEST_ONLY]()) > 1)
