#!/usr/bin/env python3
"""The gamepad of the Transformation lab: its skeleton in doc/skeletons, with the TODOs done."""
import math
import threading

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool

from tb3_labs.srv import SetInitialPose


class Gamepad:
    def __init__(self):
        self.has_control = True
        self.cmd_pub = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        self.ctrl_pub = rospy.Publisher('ctrl_relinq', Bool, queue_size=1)
        self.set_pose_client = rospy.ServiceProxy('/set_pose', SetInitialPose)
        rospy.Subscriber('joy', Joy, self.callback_joy)

    def callback_joy(self, joy):
        if joy.buttons[0]:
            self.has_control = False
            self.ctrl_pub.publish(True)
        elif joy.buttons[1]:
            self.has_control = True
            self.ctrl_pub.publish(False)
        if joy.buttons[2]:
            self.reset_pose(0.0, 0.0, 0.0)
        if self.has_control:
            cmd = Twist()
            cmd.linear.x = 0.22 * joy.axes[1]
            cmd.angular.z = 2.84 * joy.axes[3]
            self.cmd_pub.publish(cmd)

    def reset_pose(self, x, y, yaw):
        try:
            self.set_pose_client.wait_for_service(timeout=1.0)
        except rospy.ROSException:
            rospy.logwarn('Service reset_pose is not available.')
            return
        pose = PoseWithCovarianceStamped()
        pose.header.frame_id = 'map'
        pose.header.stamp = rospy.Time.now()
        pose.pose.pose.position.x = x
        pose.pose.pose.position.y = y
        pose.pose.pose.orientation.z = math.sin(yaw / 2.0)
        pose.pose.pose.orientation.w = math.cos(yaw / 2.0)
        pose.pose.covariance = [0.1] * 36
        threading.Thread(target=self.call_async, args=(pose,), daemon=True).start()

    def call_async(self, pose):
        try:
            self.set_pose_client(pose)
            self.reset_pose_callback(None)
        except rospy.ServiceException as error:
            self.reset_pose_callback(error)

    def reset_pose_callback(self, error):
        if error is None:
            rospy.loginfo('Pose reset successfully.')
        else:
            rospy.logerr('Pose reset failed: %s', error)


if __name__ == '__main__':
    rospy.init_node('gamepad')
    Gamepad()
    rospy.spin()
