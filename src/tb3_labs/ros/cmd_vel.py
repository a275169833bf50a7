"""The commands of a node to the robot, and the zero at their end.

When a node stops the robot, it publishes exactly one zero and is then silent, so that another node
may drive. At its end, and while ROS time stands still, the node also stops the robot.
"""
import math

import rospy
from geometry_msgs.msg import Twist

from tb3_labs.ros.rospy_internals import is_wall_time, write_at_once

#: A smaller speed [m/s] or [rad/s] is sent as 0. Such a speed would not turn a motor, and the
#: firmware takes a speed such as 1e-40 for full speed.
MIN_SPEED = 1e-4


class CmdVel:
    """Publishes `cmd_vel` (geometry_msgs/Twist). Its caller holds the lock of the CoreRunner."""

    def __init__(self):
        self._clock_runs = is_wall_time()
        self._drives = False
        self._closed = False           # does the node end?
        self._message = Twist()        # reused, since publish() writes the message at once
        self._publisher = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        write_at_once(self._publisher)

    def send(self, command):
        """Send `command`, a Twist2. A zero command, and any command while the clock stands still,
        is a :meth:`stop`. ``ValueError`` if a speed is not finite."""
        linear, angular = command
        if not math.isfinite(linear + angular):
            raise ValueError(f'command ({linear}, {angular}) is not finite')
        linear = linear if abs(linear) >= MIN_SPEED else 0.0
        angular = angular if abs(angular) >= MIN_SPEED else 0.0
        if linear == angular == 0.0 or not self._clock_runs:
            self.stop()
        elif not self._closed:
            self._drives = True
            self._publish(linear, angular)

    def stop(self):
        """Send one zero if this node was driving, otherwise nothing."""
        if self._drives:
            self._drives = False
            self._publish(0.0, 0.0)

    def close(self):
        """Send the zero at the end of the node (Ctrl+C), and ignore all later commands."""
        self._closed = True
        self.stop()

    def set_clock_runs(self, runs):
        """Store whether ROS time runs. If it has just stopped, stop the robot, and return True."""
        has_stopped = self._clock_runs and not runs
        self._clock_runs = runs
        if has_stopped:
            self.stop()
        return has_stopped

    def _publish(self, linear, angular):
        self._message.linear.x, self._message.angular.z = linear, angular
        self._publisher.publish(self._message)
