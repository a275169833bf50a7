"""Sends the commands of a node to the robot, and one zero command at the end of a motion.

A node that stops the robot publishes exactly one zero command. Then the node is silent, so that
another node can drive. A node also stops the robot when the node ends, or if ROS time stands still.
"""
import math

import rospy
from geometry_msgs.msg import Twist, Vector3

from tb3_labs.ros.rospy_internals import is_wall_time, make_writes_immediate

#: A speed below this value [m/s or rad/s] is sent as 0. A motor does not turn at a lower speed,
#: and the firmware even reads 1e-40 as full speed.
MIN_SPEED = 1e-4


class CmdVel:
    """Publishes `cmd_vel` (geometry_msgs/Twist). Callers hold the lock of the CoreRunner."""

    def __init__(self):
        self._clock_runs = is_wall_time()
        self._is_driving = False
        self._is_closed = False
        self._publisher = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        make_writes_immediate(self._publisher)

    def send(self, command):
        """Send `command`, a Twist2. A zero command, or a clock that stands still, stops the robot.
        Raises ``ValueError`` if a speed is not finite."""
        linear, angular = command
        if not math.isfinite(linear + angular):
            raise ValueError(f'command ({linear}, {angular}) is not finite')
        linear = linear if abs(linear) >= MIN_SPEED else 0.0
        angular = angular if abs(angular) >= MIN_SPEED else 0.0
        if linear == angular == 0.0 or not self._clock_runs:
            self.stop()
        elif not self._is_closed:
            self._is_driving = True
            self._publish(linear, angular)

    def stop(self):
        """Send one zero command if this node was driving."""
        if self._is_driving:
            self._is_driving = False
            self._publish(0.0, 0.0)

    def close(self):
        """Stop the robot at the end of the node, and ignore all later commands."""
        self._is_closed = True
        self.stop()

    def set_clock_runs(self, clock_runs):
        """Store whether ROS time runs. When ROS time stops, stop the robot and return True."""
        has_stopped = self._clock_runs and not clock_runs
        self._clock_runs = clock_runs
        if has_stopped:
            self.stop()
        return has_stopped

    def _publish(self, linear, angular):
        self._publisher.publish(Twist(Vector3(x=linear), Vector3(z=angular)))
