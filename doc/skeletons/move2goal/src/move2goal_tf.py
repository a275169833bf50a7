#!/usr/bin/env python3
"""Drives to a goal in a local frame that a service resets: the Transformation lab.

Each TODO says what belongs there. Write it, and delete the lines below it that say that the TODO is
open. The node starts with open TODOs, too, and names those that it meets.

Global is the frame of the odometry. The local frame begins where the robot stood at the reset.

Subscribes
    imu            sensor_msgs/Imu
    odom           nav_msgs/Odometry
    ctrl_relinq    std_msgs/Bool: True lets this node drive
Publishes
    cmd_vel        geometry_msgs/Twist
Services
    /set_pose      tb3_labs/SetInitialPose: resets the local frame
"""
import math

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from squaternion import Quaternion
from std_msgs.msg import Bool

from tb3_labs.srv import SetInitialPose, SetInitialPoseResponse


class MoveToGoal:
    def __init__(self):
        self.goal_x = -0.61
        self.goal_y = 0.61
        self.goal_yaw = 0.0
        self.local_x = 0.0
        self.local_y = 0.0
        self.local_yaw = 0.0
        self.initial_global_x = None
        self.initial_global_y = None
        self.initial_global_yaw = None
        self.state = 'ROTATE_TO_GOAL'
        self.has_control = False
        self.cmd_pub = rospy.Publisher('cmd_vel', Twist, queue_size=10)
        # TODO 1: offer the service /set_pose. Its type is SetInitialPose, and the method
        #     set_pose_callback answers each call.
        rospy.logwarn_once('TODO 1 is open: there is no service /set_pose')
        rospy.Subscriber('imu', Imu, self.imu_callback)
        rospy.Subscriber('odom', Odometry, self.odom_callback)
        rospy.Subscriber('ctrl_relinq', Bool, self.ctrl_relinq_callback)
        rospy.Timer(rospy.Duration(0.1), self.control_loop)

    def set_pose_callback(self, request):
        pose = request.pose.pose.pose
        q = pose.orientation
        self.local_x = pose.position.x
        self.local_y = pose.position.y
        self.local_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]
        self.initial_global_x = None
        self.initial_global_y = None
        self.initial_global_yaw = None
        self.state = 'ROTATE_TO_GOAL'
        rospy.loginfo('Local pose set to x=%.2f, y=%.2f, yaw=%.2f', self.local_x, self.local_y,
                      self.local_yaw)
        return SetInitialPoseResponse()

    def imu_callback(self, msg):
        q = msg.orientation
        global_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]
        if self.initial_global_yaw is None:
            self.initial_global_yaw = global_yaw
        # TODO 2: calculate local_yaw [rad]: the yaw as seen from the local frame. normalize_angle
        #     keeps an angle from -pi to pi.
        rospy.logwarn_once('TODO 2 is open: local_yaw stays 0')

    def odom_callback(self, msg):
        global_x = msg.pose.pose.position.x
        global_y = msg.pose.pose.position.y
        if self.initial_global_x is None:
            self.initial_global_x = global_x
            self.initial_global_y = global_y
        if self.initial_global_yaw is None:
            return
        # TODO 3: calculate the displacement since the reset, in global axes: dx and dy [m]. Replace
        #     each 0.
        dx = 0.0
        dy = 0.0
        rospy.logwarn_once('TODO 3 is open: the displacement stays 0')
        # TODO 4: rotate the displacement into the local frame: local_x and local_y [m]. The angle
        #     is initial_global_yaw. Is it the rotation matrix, or its inverse?
        rospy.logwarn_once('TODO 4 is open: local_x and local_y stay 0')

    def ctrl_relinq_callback(self, msg):
        if self.has_control and not msg.data:
            self.cmd_pub.publish(Twist())
        self.has_control = msg.data

    def control_loop(self, event):
        if not self.has_control or self.initial_global_x is None:
            return
        cmd = Twist()
        # TODO 5: calculate the way from the robot to the goal, in local coordinates: dx, dy and
        #     distance [m]. Replace each 0.
        dx = 0.0
        dy = 0.0
        distance = 0.0
        rospy.logwarn_once('TODO 5 is open: the way to the goal stays 0')
        # TODO 6: set cmd by the state, and go on to the next state when one is done. An error of an
        #     angle goes through normalize_angle. The lab sheet has all numbers.
        #     ROTATE_TO_GOAL     turn until the robot faces the goal
        #     MOVE_FORWARD       drive until the goal is near
        #     ROTATE_TO_FINAL    turn until the heading is goal_yaw; then log 'Goal reached!'
        #     GOAL_REACHED       publish nothing more
        rospy.logwarn_once('TODO 6 is open: the robot is not driven')
        self.cmd_pub.publish(cmd)

    def normalize_angle(self, angle):
        return math.atan2(math.sin(angle), math.cos(angle))


if __name__ == '__main__':
    rospy.init_node('move_to_goal')
    MoveToGoal()
    rospy.spin()
