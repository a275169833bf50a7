#!/usr/bin/env python3
"""Prints the robot's heading (the IMU exercise).

The code is a good student's solution. The handout does not have the lines with `# added`.

Subscribes
    imu        sensor_msgs/Imu
Publishes
    heading    std_msgs/Float32 [deg], 0 to 360 counter-clockwise
"""
from importlib.util import find_spec    # added
import rospy
from sensor_msgs.msg import Imu
if not find_spec('squaternion'): exit('no package squaternion: source scripts/setup.sh')    # added
from squaternion import Quaternion
from std_msgs.msg import Float32    # added


class IMU:
    """Class to read orientation data from the TurtleBot3's IMU."""

    PERIOD = 0.1    # added: nobody can read 200 lines in a second

    def __init__(self):
        self.ctrl_c = False
        self.printed_at = 0.0    # added
        self.heading_pub = rospy.Publisher('heading', Float32, queue_size=1)    # added
        rospy.Subscriber('imu', Imu, self.callback_imu)
        rospy.on_shutdown(self.shutdownhook)

    def convert_yaw(self, yaw):
        return 360 + yaw if yaw < 0 else yaw

    def callback_imu(self, imu):
        if not self.ctrl_c:
            q = Quaternion(imu.orientation.w, imu.orientation.x, imu.orientation.y,
                           imu.orientation.z)
            e = q.to_euler(degrees=True)
            yaw = e[2]
            yaw = self.convert_yaw(yaw)
            yaw = 0.0 if yaw > 359.9999 else yaw    # added: "%f" would round up to 360
            self.heading_pub.publish(yaw)    # added
            if abs(rospy.get_time() - self.printed_at) < self.PERIOD:    # added
                return    # added
            self.printed_at = rospy.get_time()    # added
            print("Current heading is %f degrees." % yaw)

    def shutdownhook(self):
        print("Shutting down the IMU subscriber")
        self.ctrl_c = True


if __name__ == '__main__':
    rospy.init_node('imu_sub')
    IMU()
    rospy.spin()
