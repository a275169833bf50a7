#!/usr/bin/env python3
# What a student may hand in for the gamepad of the Transformation lab.
import threading

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool

from tb3_labs.srv import SetInitialPose


class Gamepad:
    def __init__(self):
        self.control = True
        self.last_buttons = [0] * 3
        self.cmd = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        self.relinq = rospy.Publisher('ctrl_relinq', Bool, queue_size=1, latch=True)
        rospy.Subscriber('joy', Joy, self.on_joy)
        rospy.on_shutdown(self.on_shutdown)

    def on_joy(self, joy):
        a, b, y = [now and not last for now, last in zip(joy.buttons, self.last_buttons)]
        self.last_buttons = joy.buttons[:3]
        if a:
            self.control = False
            self.cmd.publish(Twist())
            self.relinq.publish(True)
        if b:
            self.control = True
            self.relinq.publish(False)
        if y:
            threading.Thread(target=self.reset, daemon=True).start()
        if self.control:
            twist = Twist()
            twist.linear.x = 0.22 * joy.axes[1]
            twist.angular.z = 2.84 * joy.axes[3]
            self.cmd.publish(twist)

    def reset(self):
        try:
            rospy.wait_for_service('/set_pose', 1.0)
            pose = PoseWithCovarianceStamped()
            pose.header.frame_id = 'map'
            pose.pose.pose.orientation.w = 1.0
            rospy.ServiceProxy('/set_pose', SetInitialPose)(pose)
            print('Pose reset successfully.')
        except (rospy.ROSException, rospy.ServiceException) as error:
            print('Pose reset failed: {}'.format(error))

    def on_shutdown(self):
        self.cmd.publish(Twist())


if __name__ == '__main__':
    rospy.init_node('gamepad')
    Gamepad()
    rospy.spin()
