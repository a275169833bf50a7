"""view.launch on a robot in a namespace: its wheels turn as far as it drives. test_launch.py reads RViz's file."""
import math

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, Twist

from node_case import NodeCase
from tb3_labs.ros.conversions import to_pose2, to_twist

WHEEL_RADIUS = 0.033    # of a Burger [m]


class ViewTest(NodeCase):

    @classmethod
    def watch(cls):
        cls.observer.watch('robot3/ground_truth', PoseStamped, lambda message: to_pose2(message.pose))

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.wheels = rospy.Publisher('robot3/cmd_vel', Twist, queue_size=1)
        cls.tf = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.tf)

    def test_the_wheels_turn_as_far_as_the_robot_drives(self):
        start = self.observer.wait_for('robot3/ground_truth')
        before = [self.wheel(side) for side in ('left', 'right')]
        rate = rospy.Rate(20)
        while self.observer.latest('robot3/ground_truth').distance_to(start) < 0.08:
            self.wheels.publish(to_twist(0.1, 0.0))
            rate.sleep()
        self.wheels.publish(to_twist(0.0, 0.0))
        angle = self.rest('robot3/ground_truth').distance_to(start) / WHEEL_RADIUS
        for side, old in zip(('left', 'right'), before):
            self.observer.wait_until(
                lambda: abs(2.0 * math.acos(min(1.0, abs(self.wheel(side) @ old))) - angle) < 0.01,
                5.0, '{} wheel turned by {:.2f} rad'.format(side, angle))

    def wheel(self, side):
        """A wheel's attitude: a quaternion."""
        turned = self.tf.lookup_transform('robot3/odom', 'robot3/wheel_{}_link'.format(side),
                                          rospy.Time(0), rospy.Duration(60.0)).transform.rotation
        return np.array([turned.x, turned.y, turned.z, turned.w])
