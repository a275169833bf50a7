#!/usr/bin/env python3
"""Drives by a gamepad, hands the robot over, and resets the local frame (the Transformation lab).

The code is a good student's solution.

The indices of axes and buttons are those of the course's pad. `rostopic echo /joy` shows the
indices of your pad.

Subscribes
    joy            sensor_msgs/Joy
Publishes
    cmd_vel        geometry_msgs/Twist
    ctrl_relinq    std_msgs/Bool: True hands the robot over, False takes it back
Calls
    set_pose       tb3_labs/SetInitialPose
"""
import math
import threading
from concurrent.futures import Future

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool

from tb3_labs.srv import SetInitialPose, SetInitialPoseRequest


class Gamepad:
    """Class that drives the TurtleBot3 by a gamepad, and resets its pose."""

    def __init__(self):
        self.has_control = True
        self.cmd_pub = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        self.ctrl_pub = rospy.Publisher('ctrl_relinq', Bool, queue_size=1)
        self.reset_pose_client = rospy.ServiceProxy('set_pose', SetInitialPose)
        rospy.Subscriber('joy', Joy, self.joy_callback)

    def joy_callback(self, msg):
        if msg.buttons[0]:
            self.has_control = False
            self.ctrl_pub.publish(True)
        elif msg.buttons[1]:
            self.has_control = True
            self.ctrl_pub.publish(False)
        if msg.buttons[2]:
            self.send_set_pose_request(0.0, 0.0, 0.0)
        if self.has_control:
            cmd = Twist()
            cmd.linear.x = 0.22 * msg.axes[1]
            cmd.angular.z = 2.84 * msg.axes[3]
            self.cmd_pub.publish(cmd)

    def send_set_pose_request(self, x, y, theta):
        try:
            self.reset_pose_client.wait_for_service(timeout=1.0)
        except rospy.ROSException:
            rospy.logwarn("Service 'reset_pose' not available.")
            return
        request = SetInitialPoseRequest()
        request.pose = PoseWithCovarianceStamped()
        request.pose.header.frame_id = 'map'
        request.pose.header.stamp = rospy.Time.now()
        request.pose.pose.pose.position.x = x
        request.pose.pose.pose.position.y = y
        request.pose.pose.pose.orientation.z = math.sin(theta / 2.0)
        request.pose.pose.pose.orientation.w = math.cos(theta / 2.0)
        request.pose.pose.covariance = [0.1] * 36
        future = self.call_async(request)
        future.add_done_callback(self.reset_pose_done_callback)

    def call_async(self, request):
        # rospy has no call_async(), so a thread calls the service, and a Future gets the answer
        future = Future()

        def call():
            try:
                future.set_result(self.reset_pose_client(request))
            except Exception as error:
                future.set_exception(error)
        threading.Thread(target=call, daemon=True).start()
        return future

    def reset_pose_done_callback(self, future):
        try:
            response = future.result()
            if response:
                rospy.loginfo('Pose reset successfully.')
            else:
                rospy.logerr('Pose reset failed.')
        except Exception as error:
            rospy.logerr(f'Service call failed: {error}')


if __name__ == '__main__':
    rospy.init_node('gamepad')
    Gamepad()
    rospy.spin()
