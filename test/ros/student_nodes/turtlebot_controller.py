#!/usr/bin/env python3
# What a student may hand in for the IMU lab: by the handout, and of this package only the message.
import threading

import rospy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Imu
from squaternion import Quaternion

from tb3_labs.msg import MouseController

K_HDG = 0.1
HDG_TOL = 10
MIN_ANG_Z = 0.5
MAX_ANG_Z = 1.5


class Controller:
    def __init__(self):
        self.yaw = None
        self.goal = None
        self.mouse = None
        self.mouse_was_active = False
        self.pub = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        rospy.Subscriber('imu', Imu, self.on_imu)
        rospy.Subscriber('mouse_info', MouseController, self.on_mouse)
        rospy.on_shutdown(self.on_shutdown)
        threading.Thread(target=self.keyboard, daemon=True).start()

    def on_imu(self, imu):
        q = imu.orientation
        self.yaw = Quaternion(q.w, q.x, q.y, q.z).to_euler(degrees=True)[2] % 360

    def on_mouse(self, mouse):
        self.mouse = mouse

    def keyboard(self):
        while not rospy.is_shutdown():
            self.handle(input('Turn left (l) or right (r)? '))

    def handle(self, text):
        if text == 'l':
            self.goal = (self.yaw + 90) % 360
        elif text == 'r':
            self.goal = (self.yaw - 90) % 360
        else:
            print('Not valid: {}. Type l or r.'.format(text))

    def control(self):
        if self.goal is not None:
            self.turn()
        elif self.mouse is not None and self.mouse.status.data:
            self.mouse_was_active = True
            self.pub.publish(self.mouse_twist())
        elif self.mouse_was_active:
            self.mouse_was_active = False
            self.pub.publish(Twist())

    def turn(self):
        error = self.goal - self.yaw
        if error > 180:
            error -= 360
        elif error < -180:
            error += 360
        twist = Twist()
        if abs(error) < HDG_TOL:
            self.goal = None
        else:
            size = min(max(abs(K_HDG * error), MIN_ANG_Z), MAX_ANG_Z)
            twist.angular.z = size if error > 0 else -size
        self.pub.publish(twist)

    def mouse_twist(self):
        twist = Twist()
        if abs(self.mouse.yPos) > 0.25:
            twist.linear.x = 0.5 * self.mouse.yPos
        if abs(self.mouse.xPos) > 0.25:
            twist.angular.z = -0.5 * self.mouse.xPos
        return twist

    def on_shutdown(self):
        print('Controller exiting. Halting robot.')
        self.pub.publish(Twist())

    def run(self):
        rate = rospy.Rate(20)
        while not rospy.is_shutdown():
            self.control()
            rate.sleep()


if __name__ == '__main__':
    rospy.init_node('controller')
    try:
        Controller().run()
    except rospy.ROSInterruptException:
        pass
