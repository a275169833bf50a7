"""The hand on the embedded robot: turns it, and changes its settings."""
import math
import time

import rospy
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import Twist

from tb3_labs.geometry.angles import clamp, difference
from tb3_labs.marking.topics import CMD_VEL
from tb3_labs.ros.conversions import to_twist
from tb3_labs.ros.marking.waiting import wait, wait_until

#: The robot's name, by which its settings are found.
ROBOT = 'turtlebot3'
#: A turn of the hand: rate for each rad of error [1/s], least and greatest rate [rad/s], the
#: greatest error at its end [rad], the time between two commands [s].
GAIN, SLOWEST, FASTEST, NEAR, PERIOD = 3.0, 0.1, 1.5, 0.01, 0.03
#: The robot rests within this time after its last command [s].
RESTS = 2.0


class RobotHand:
    """Moves the robot by commands of its own, which are not the node's."""

    def __init__(self, recorder):
        self._recorder = recorder
        self._wheels = rospy.Publisher(CMD_VEL, Twist, queue_size=1)

    def face(self, heading_deg, seconds=8.0):
        """Turn the robot to a heading [deg], the short way, in at most this time [s]; at rest
        afterwards."""
        def error():
            return difference(math.radians(heading_deg), self._recorder.pose[2])
        deadline = time.monotonic() + seconds
        while abs(error()) > NEAR and time.monotonic() < deadline:
            rate = clamp(GAIN * error(), -FASTEST, FASTEST)
            self._wheels.publish(to_twist(0.0, math.copysign(max(abs(rate), SLOWEST), rate)))
            wait(PERIOD)
        self._wheels.publish(to_twist(0.0, 0.0))
        wait_until(self._recorder.rests, RESTS)

    @staticmethod
    def settings():
        """A client of the robot's settings, which takes a moment to connect."""
        return Client(ROBOT, timeout=10.0)
