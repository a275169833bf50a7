"""Records the robot and the commands of one node, also without a true pose of the robot."""
import math

import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from tb3_labs.geometry.angles import continuous
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.topics import IMU, ODOM
from tb3_labs.ros.conversions import to_imu_sample, to_odometry_sample
from tb3_labs.ros.marking.recorder import Recorder
from tb3_labs.ros.rospy_internals import connection_of
from tb3_labs.ros.topics import subscribe


class BenchRecorder(Recorder):
    """As Recorder. Without a true pose the place is that of the odometry, and the heading that of
    the IMU, both as they were at first."""

    def __init__(self, observation, is_judged, has_truth):
        """``is_judged(sender)``: are this node's commands recorded?"""
        self._is_judged, self._has_truth = is_judged, has_truth
        self._yaw, self._offset = None, None
        super().__init__(observation)

    def watch_robot(self):
        if self._has_truth:
            super().watch_robot()
            return
        subscribe(IMU, Imu, self._on_imu, to_imu_sample)
        subscribe(ODOM, Odometry, self._on_odometry, to_odometry_sample)

    def is_judged(self, message):
        return self._is_judged(connection_of(message)['callerid'])

    def _on_imu(self, sample):
        self._yaw = sample.yaw if self._yaw is None else continuous(sample.yaw, self._yaw)

    def _on_odometry(self, sample):
        if self._yaw is None:
            return
        if self._offset is None:
            self._offset = sample.pose.yaw - self._yaw
        self.add_pose(Pose2(sample.pose.x, sample.pose.y, self._yaw + self._offset))


def imu_heading_deg():
    """The heading that the IMU says now, 0 to 360 [deg]. ``rospy.ROSException`` if it is silent."""
    sample = to_imu_sample(rospy.wait_for_message(IMU, Imu, timeout=5.0))
    return math.degrees(sample.yaw) % 360.0
