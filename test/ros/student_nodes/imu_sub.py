#!/usr/bin/env python3
# What a student may hand in for the IMU exercise.
import rospy
from sensor_msgs.msg import Imu
from squaternion import Quaternion


class IMU:
    def __init__(self):
        self.ended = False
        rospy.Subscriber('imu', Imu, self.callback)
        rospy.on_shutdown(self.on_shutdown)

    def callback(self, imu):
        q = imu.orientation
        yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler(degrees=True)[2]
        if yaw < 0:
            yaw += 360
        if not self.ended:
            print('Current heading is %f degrees.' % yaw)

    def on_shutdown(self):
        self.ended = True
        print('Shutting down the IMU subscriber')


if __name__ == '__main__':
    rospy.init_node('imu_sub')
    IMU()
    rospy.spin()
