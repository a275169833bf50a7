#!/usr/bin/env python3
"""Prints the robot's heading: the IMU exercise.

Each TODO describes code that you write in its place. Then delete the lines below the TODO that say
that the TODO is open. The node also starts with open TODOs, and names each one that it reaches.

Subscribes
    imu    sensor_msgs/Imu
"""
import rospy
# TODO 1: import the message of the topic imu. `rostopic type /imu` prints its package and its name.
#     The class of that name is in the module msg of that package.
rospy.logwarn_once('TODO 1 is open: the message of the topic imu is not imported')
from squaternion import Quaternion


class IMU:
    """Class to read orientation data from the TurtleBot3's IMU."""

    def __init__(self):
        self.ctrl_c = False
        # TODO 2: subscribe to the topic imu. Each message shall go to the method callback_imu.
        rospy.logwarn_once('TODO 2 is open: nothing listens to imu')
        rospy.on_shutdown(self.shutdownhook)

    def convert_yaw(self, yaw):
        return 360 + yaw if yaw < 0 else yaw

    def callback_imu(self, imu):
        if not self.ctrl_c:
            # TODO 3: make a Quaternion of the message's orientation. Its order is w, x, y, z.
            rospy.logwarn_once('TODO 3 is open: there is no quaternion')
            return
            # TODO 4: convert the quaternion to Euler angles, in degrees.
            rospy.logwarn_once('TODO 4 is open: there are no Euler angles')
            return
            # TODO 5: take yaw out of the Euler angles. They are roll, pitch, yaw.
            rospy.logwarn_once('TODO 5 is open: there is no yaw')
            return
            yaw = self.convert_yaw(yaw)
            print("Current heading is %f degrees." % yaw)

    def shutdownhook(self):
        print("Shutting down the IMU subscriber")
        self.ctrl_c = True


if __name__ == '__main__':
    rospy.init_node('imu_sub')
    IMU()
    rospy.spin()
