#!/usr/bin/env python3
"""Drives to a goal in a local frame that a service resets: the Transformation lab.

Each TODO describes code that you write in its place. Then delete the lines below the TODO that say
that the TODO is open. The node also starts with open TODOs, and names each one that it reaches.

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
    """Class that drives the TurtleBot3 to a goal in local coordinates."""

    def __init__(self):
        self.goal_x = -0.61
        self.goal_y = 0.61
        self.goal_yaw = 0.0     # radians
        # TODO 5: delete these lines, too, as soon as control_loop does not use them.
        self.x = 0.0
        self.y = 0.0
        self.yaw = 0.0
        self.local_x = 0.0
        self.local_y = 0.0
        self.local_yaw = 0.0
        self.initial_global_x = None
        self.initial_global_y = None
        self.initial_global_yaw = None    # measured by the IMU
        self.initial_odom_yaw = None      # measured by the odometry
        self.state = 'ROTATE_TO_GOAL'
        self.has_control = False
        self.cmd_pub = rospy.Publisher('cmd_vel', Twist, queue_size=10)
        # TODO 1: offer the service /set_pose, and keep it as self.reset_service. Its type is
        #     SetInitialPose, and the method set_pose_callback answers each call.
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
        rospy.loginfo(f'Local pose set to x={self.local_x}, y={self.local_y}, '
                      f'yaw={self.local_yaw}.')
        return SetInitialPoseResponse()

    def imu_callback(self, imu_msg):
        q = imu_msg.orientation
        global_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]
        # TODO 5: delete this line, too.
        self.yaw = global_yaw
        if self.initial_global_yaw is None:
            self.initial_global_yaw = global_yaw
            return    # skip the first iteration
        # TODO 2: calculate local_yaw [rad], which is the yaw in the local frame. normalize_angle
        #     keeps an angle from -pi to pi.
        rospy.logwarn_once('TODO 2 is open: local_yaw stays 0')

    def odom_callback(self, msg):
        q = msg.pose.pose.orientation
        global_x = msg.pose.pose.position.x
        global_y = msg.pose.pose.position.y
        # TODO 5: delete these two lines, too.
        self.x = global_x
        self.y = global_y
        if self.initial_global_x is None:
            self.initial_global_x = global_x
            self.initial_global_y = global_y
            self.initial_odom_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]
            return    # skip the first iteration
        # TODO 3: calculate the displacement since the reset, in global axes: dx and dy [m]. Replace
        #     each 0.
        dx = 0.0
        dy = 0.0
        rospy.logwarn_once('TODO 3 is open: the displacement stays 0')
        # TODO 4: rotate the displacement into the local frame. This gives local_x and local_y [m].
        #     The angle is initial_odom_yaw, since the odometry measured the displacement. Do you
        #     need the rotation matrix, or its inverse?
        rospy.logwarn_once('TODO 4 is open: local_x and local_y stay 0')

    def ctrl_relinq_callback(self, relinq_msg):
        if self.has_control and not relinq_msg.data:
            self.cmd_pub.publish(Twist())
        self.has_control = relinq_msg.data

    def control_loop(self, event):
        if not self.has_control or self.initial_global_x is None or self.state == 'GOAL_REACHED':
            return
        cmd = Twist()
        # TODO 5: the rest of this method is from Lab 6, and drives to the goal in global
        #     coordinates. Change four of its lines, so that it uses local coordinates.
        rospy.logwarn_once('TODO 5 is open: the goal is sought in global coordinates')
        dx = self.goal_x - self.x
        dy = self.goal_y - self.y
        distance = math.sqrt(dx ** 2 + dy ** 2)
        if self.state == 'ROTATE_TO_GOAL':
            yaw_error = self.normalize_angle(math.atan2(dy, dx) - self.yaw)
            if abs(yaw_error) > 0.05:
                cmd.angular.z = 0.3 * yaw_error
            else:
                self.state = 'MOVE_FORWARD'
        elif self.state == 'MOVE_FORWARD':
            if distance > 0.15:
                cmd.linear.x = 0.15
            else:
                self.state = 'ROTATE_TO_FINAL'
        elif self.state == 'ROTATE_TO_FINAL':
            yaw_error = self.normalize_angle(self.goal_yaw - self.yaw)
            if abs(yaw_error) > 0.05:
                cmd.angular.z = 0.5 * yaw_error
            else:
                self.state = 'GOAL_REACHED'
                rospy.loginfo('Goal reached!')
        self.cmd_pub.publish(cmd)

    def normalize_angle(self, angle):
        return math.atan2(math.sin(angle), math.cos(angle))


if __name__ == '__main__':
    rospy.init_node('move_to_goal')
    MoveToGoal()
    rospy.spin()
