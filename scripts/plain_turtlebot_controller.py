#!/usr/bin/env python3
"""Turns the robot by 90 degrees after a typed letter, and drives it by a mouse (the IMU lab).

The code is a good student's solution.

Subscribes
    imu           sensor_msgs/Imu
    mouse_info    MouseController of this package
Publishes
    cmd_vel       geometry_msgs/Twist
"""
from importlib.util import find_spec    # added
import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Imu
if not find_spec('squaternion'): exit('no package squaternion: source scripts/setup.sh')    # added
from squaternion import Quaternion

from tb3_labs.msg import MouseController


class Controller:
    """Class that controls the TurtleBot3 by the mouse and the IMU."""

    K_HDG = 0.1    # rotation controller constant [rad/s for each degree]
    HDG_TOL = 10    # heading tolerance +/- [deg]
    MIN_ANG_Z = 0.5    # limits of the commanded rate of turn [rad/s]
    MAX_ANG_Z = 1.5    # [rad/s]

    def __init__(self):
        self.ctrl_c = False
        self.curr_yaw = 0
        self.goal_yaw = 0
        self.turning = False
        self.cmd = Twist()
        self.cmd_pub = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        rospy.Subscriber('imu', Imu, self.callback_imu)
        rospy.Subscriber('mouse_info', MouseController, self.callback_mouse)
        rospy.Timer(rospy.Duration(.1), self.callback_controller)
        rospy.on_shutdown(self.shutdownhook)

    def convert_yaw(self, yaw):
        return 360 + yaw if yaw < 0 else yaw

    def callback_imu(self, imu):
        if not self.ctrl_c:
            q = Quaternion(imu.orientation.w, imu.orientation.x, imu.orientation.y,
                           imu.orientation.z)
            yaw = q.to_euler(degrees=True)[2]
            self.curr_yaw = self.convert_yaw(yaw)

    def callback_mouse(self, mouse_info):
        if self.ctrl_c or self.turning:
            return
        cmd = Twist()
        if mouse_info.status.data:
            if abs(mouse_info.yPos) > .25:
                cmd.linear.x = .5 * mouse_info.yPos
            if abs(mouse_info.xPos) > .25:
                cmd.angular.z = -.5 * mouse_info.xPos
        self.cmd_pub.publish(cmd)

    def callback_controller(self, event):
        yaw_err = 0
        ang_z = 0
        if not self.turning:
            direction = input("Input l or r to turn 90 deg")
            if direction == "l":
                self.goal_yaw = self.curr_yaw + 90
                self.turning = True
            elif direction == "r":
                self.goal_yaw = self.curr_yaw - 90
                self.turning = True
            else:
                print("Error: valid inputs are l and r")
            if self.goal_yaw < 0:
                self.goal_yaw = self.goal_yaw + 360
            elif self.goal_yaw > 360:
                self.goal_yaw = self.goal_yaw - 360
        elif self.turning:
            yaw_err = self.goal_yaw - self.curr_yaw
            if yaw_err > 180:
                yaw_err = yaw_err - 360
            elif yaw_err < -180:
                yaw_err = yaw_err + 360
            ang_z = self.K_HDG * yaw_err
            if 0 < ang_z < self.MIN_ANG_Z:
                ang_z = self.MIN_ANG_Z
            elif ang_z > self.MAX_ANG_Z:
                ang_z = self.MAX_ANG_Z
            elif -self.MIN_ANG_Z < ang_z < 0:
                ang_z = -self.MIN_ANG_Z
            elif ang_z < -self.MAX_ANG_Z:
                ang_z = -self.MAX_ANG_Z
            if abs(yaw_err) < self.HDG_TOL:
                self.turning = False
                ang_z = 0
        self.cmd.linear.x = 0
        self.cmd.angular.z = ang_z
        self.cmd_pub.publish(self.cmd)

    def shutdownhook(self):
        print("Controller exiting. Halting robot.")
        self.ctrl_c = True
        self.cmd.linear.x = 0
        self.cmd.angular.z = 0
        self.cmd_pub.publish(self.cmd)


if __name__ == '__main__':
    rospy.init_node('controller')
    Controller()
    rospy.spin()
