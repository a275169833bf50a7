"""How a node of the IMU exercise is tried out."""
import math

import rospy
from geometry_msgs.msg import Quaternion
from sensor_msgs.msg import Imu

from tb3_labs.marking.imu import (AFTERWARDS, HAIR_BELOW_ZERO, HEADING, HEADING_DEG, NEXT,
                                  ODD_SAMPLES, READING, STANDS, ZERO_QUATERNION, headings)
from tb3_labs.ros.conversions import to_quaternion
from tb3_labs.ros.marking.hand import Hand
from tb3_labs.ros.marking.waiting import wait, wait_until

#: This number of lines is read at each stand; the IMU sends 200 a second.
LINES = 3
#: The IMU of the hand, to which the node's is remapped.
PROBE = 'probe/imu'
#: How long each odd sample is repeated [s].
ODD = 0.6
#: Headings a hair below zero [rad].
HAIRS = (-1e-17, -1e-12, math.radians(-1e-8))


def heading(stage):
    """The robot is turned on the spot and stands; then Ctrl+C."""
    node = stage.node
    offset = rospy.get_param('/turtlebot3/imu_offset_deg')      # before a node may change it
    if not node.start():
        return
    for name, degrees in STANDS.items():
        stage.robot.face(degrees - offset)
        with stage.stimulus(name, {HEADING_DEG: (stage.recorder.heading_deg + offset) % 360.0}):
            characters, _ = node.printed
            wait_until(lambda: not node.alive
                       or len(headings(node.text_since(characters))) >= LINES, READING)
    stage.ctrl_c()


def odd_samples(stage):
    """An IMU in our hand sends samples that a robot's seldom sends."""
    if not stage.node.start('imu:=' + PROBE, listens=PROBE):
        return
    with Hand(PROBE, Imu) as hand:
        def send(orientation, seconds):
            hand.hold(Imu(orientation=orientation))
            wait(seconds)
        with stage.stimulus(HAIR_BELOW_ZERO):
            for yaw in HAIRS:
                send(to_quaternion(yaw), ODD)
        with stage.stimulus(ZERO_QUATERNION):
            send(Quaternion(), ODD)
            send(to_quaternion(math.radians(AFTERWARDS)), NEXT)
    stage.node.stop()


PARTS = {HEADING: heading, ODD_SAMPLES: odd_samples}
