#!/usr/bin/env python3
"""Drives to a goal in a local frame (a student's solution). The handout has no lines with
`# added`. The handout's node fails in practice, because it rotates positions by the IMU's yaw."""
from importlib.util import find_spec    # added
import math
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
if not find_spec('squaternion'): exit('no package squaternion: source scripts/setup.sh')    # added
from squaternion import Quaternion
from std_msgs.msg import Bool
from tb3_labs.srv import SetInitialPose, SetInitialPoseResponse


class MoveToGoal:
    """Class that drives the TurtleBot3 to a goal in local coordinates."""

    def __init__(self):
        self.goal_x = -0.61
        self.goal_y = 0.61
        self.goal_yaw = 0.0     # radians
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
        self.reset_service = rospy.Service('set_pose', SetInitialPose, self.set_pose_callback)
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
        if self.initial_global_yaw is None:
            self.initial_global_yaw = global_yaw
            self.initial_global_yaw -= self.local_yaw    # added
            return    # skip the first iteration
        self.local_yaw = self.normalize_angle(global_yaw - self.initial_global_yaw)

    def odom_callback(self, msg):
        q = msg.pose.pose.orientation
        global_x = msg.pose.pose.position.x
        global_y = msg.pose.pose.position.y
        if self.initial_global_x is None:
            self.initial_global_x = global_x
            self.initial_global_y = global_y
            self.initial_odom_yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]
            self.initial_odom_yaw -= self.local_yaw    # added
            cos, sin = math.cos(self.initial_odom_yaw), math.sin(self.initial_odom_yaw)    # added
            self.initial_global_x -= cos * self.local_x - sin * self.local_y    # added
            self.initial_global_y -= sin * self.local_x + cos * self.local_y    # added
            return    # skip the first iteration
        dx = global_x - self.initial_global_x
        dy = global_y - self.initial_global_y
        cos, sin = math.cos(self.initial_odom_yaw), math.sin(self.initial_odom_yaw)
        self.local_x = cos * dx + sin * dy
        self.local_y = -sin * dx + cos * dy

    def ctrl_relinq_callback(self, relinq_msg):
        if self.has_control and not relinq_msg.data:
            self.cmd_pub.publish(Twist())
        self.has_control = relinq_msg.data

    def control_loop(self, event):
        if not self.has_control or self.initial_global_x is None or self.state == 'GOAL_REACHED':
            return
        cmd = Twist()
        dx = self.goal_x - self.local_x
        dy = self.goal_y - self.local_y
        distance = math.sqrt(dx ** 2 + dy ** 2)
        if self.state == 'ROTATE_TO_GOAL':
            yaw_error = self.normalize_angle(math.atan2(dy, dx) - self.local_yaw)
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
            yaw_error = self.normalize_angle(self.goal_yaw - self.local_yaw)
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
