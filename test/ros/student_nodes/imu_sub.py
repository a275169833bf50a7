#!/usr/bin/env python3
"""The node of the IMU exercise: its skeleton in doc/skeletons, with the TODOs done."""
import rospy
from sensor_msgs.msg import Imu
from squaternion import Quaternion


class IMU:
    def __init__(self):
        self.ctrl_c = False
        rospy.Subscriber('imu', Imu, self.callback_imu)
        rospy.on_shutdown(self.shutdownhook)

    def convert_yaw(self, yaw):
        return 360 + yaw if yaw < 0 else yaw

    def callback_imu(self, imu):
        if not self.ctrl_c:
            q = Quaternion(imu.orientation.w, imu.orientation.x, imu.orientation.y,
                           imu.orientation.z)
            euler = q.to_euler(degrees=True)
            yaw = euler[2]
            yaw = self.convert_yaw(yaw)
            print("Current heading is %f degrees." % yaw)

    def shutdownhook(self):
        print("Shutting down the IMU subscriber")
        self.ctrl_c = True


if __name__ == '__main__':
    rospy.init_node('imu_sub')
    IMU()
    rospy.spin()
