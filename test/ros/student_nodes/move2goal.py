#!/usr/bin/env python3
# What a student may hand in for the Transformation lab: by the handout, somewhat faster.
import math

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from squaternion import Quaternion
from std_msgs.msg import Bool

from tb3_labs.srv import SetInitialPose, SetInitialPoseResponse

GOAL = (-0.61, 0.61)
DISTANCE_TOL = 0.15
ANGLE_TOL = 0.05


def wrap(angle):
    return math.atan2(math.sin(angle), math.cos(angle))


class MoveToGoal:
    def __init__(self):
        self.control = False
        self.odom = None
        self.origin = None
        self.state = 'ROTATE_TO_GOAL'
        self.pub = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        rospy.Service('set_pose', SetInitialPose, self.on_reset)
        rospy.Subscriber('ctrl_relinq', Bool, self.on_control)
        rospy.Subscriber('odom', Odometry, self.on_odom)
        rospy.on_shutdown(self.on_shutdown)

    def on_odom(self, odom):
        p, q = odom.pose.pose.position, odom.pose.pose.orientation
        self.odom = p.x, p.y, Quaternion(q.w, q.x, q.y, q.z).to_euler()[2]
        if self.origin is None:
            self.origin = self.odom

    def on_control(self, message):
        if self.control and not message.data:
            self.pub.publish(Twist())
        self.control = message.data

    def on_reset(self, request):
        self.origin = self.odom
        self.state = 'ROTATE_TO_GOAL'
        print('Local pose set to x=0.0, y=0.0, yaw=0.0')
        return SetInitialPoseResponse()

    def local_pose(self):
        dx, dy = self.odom[0] - self.origin[0], self.odom[1] - self.origin[1]
        c, s = math.cos(self.origin[2]), math.sin(self.origin[2])
        return c * dx + s * dy, -s * dx + c * dy, wrap(self.odom[2] - self.origin[2])

    def step(self):
        x, y, yaw = self.local_pose()
        dx, dy = GOAL[0] - x, GOAL[1] - y
        twist = Twist()
        if self.state == 'ROTATE_TO_GOAL':
            error = wrap(math.atan2(dy, dx) - yaw)
            twist.angular.z = self.rate(error)
            if abs(error) < ANGLE_TOL:
                self.state, twist = 'MOVE_FORWARD', Twist()
        elif self.state == 'MOVE_FORWARD':
            twist.linear.x = 0.22
            if math.hypot(dx, dy) < DISTANCE_TOL:
                self.state, twist = 'ROTATE_TO_FINAL', Twist()
        elif self.state == 'ROTATE_TO_FINAL':
            twist.angular.z = self.rate(-yaw)
            if abs(yaw) < ANGLE_TOL:
                self.state, twist = 'GOAL_REACHED', Twist()
                print('Goal reached!')
        else:
            return
        self.pub.publish(twist)

    def rate(self, error):
        return max(-2.0, min(2.0, 2.0 * error))

    def on_shutdown(self):
        self.pub.publish(Twist())

    def run(self):
        rate = rospy.Rate(10)
        while not rospy.is_shutdown():
            if self.control and self.odom is not None:
                self.step()
            rate.sleep()


if __name__ == '__main__':
    rospy.init_node('move_to_goal')
    try:
        MoveToGoal().run()
    except rospy.ROSInterruptException:
        pass
