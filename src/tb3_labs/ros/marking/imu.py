"""How a node of the IMU exercise is tried out."""
import math

import rospy
from geometry_msgs.msg import Quaternion
from sensor_msgs.msg import Imu

from tb3_labs.marking.imu import AFTERWARDS, STANDS, headings
from tb3_labs.ros.conversions import to_quaternion

LISTENS = 'imu'
#: So many lines are read at each stand; the IMU sends 200 a second.
LINES = 3


def heading(stage):
    """The robot is turned on the spot and stands; then Ctrl+C."""
    if not stage.start():
        return
    offset = rospy.get_param('/turtlebot3/imu_offset_deg')
    for name, degrees in zip(STANDS, (50.0, 150.0, 220.0, 350.0)):
        stage.face(degrees - offset)
        with stage.stimulus(name, heading_deg=(stage.heading_deg + offset) % 360.0):
            characters = stage.node.printed[0]
            stage.wait_until(lambda: len(headings(stage.node.text_since(characters))) >= LINES
                             or not stage.alive, 1.5)
    stage.ctrl_c()


def odd_samples(stage):
    """An IMU of our own sends what a robot's seldom does."""
    probe = rospy.Publisher('probe/imu', Imu, queue_size=10)
    if not stage.start('imu:=probe/imu', listens='probe/imu'):
        return

    def send(orientation):
        for _ in range(60):
            probe.publish(Imu(orientation=orientation))
            stage.wait(0.01)
    with stage.stimulus('a hair below zero'):
        for yaw in (-1e-17, -1e-12, math.radians(-1e-8)):
            send(to_quaternion(yaw))
    with stage.stimulus('a quaternion of zeros'):
        send(Quaternion())
        stage.wait(0.3)
        send(to_quaternion(math.radians(AFTERWARDS)))
        stage.wait(0.3)
    stage.stop()


PARTS = {'heading': heading, 'odd samples': odd_samples}
