#!/usr/bin/env python3
"""Prints the robot's heading: the IMU exercise.

Subscribes
    imu        sensor_msgs/Imu
Publishes
    heading    std_msgs/Float32 [deg], 0 to 360 counter-clockwise, with each message
Parameters
    ~max_rate  most lines a second; 0: a line for each message, as in the handout (10)
"""
import tb3_labs.ros.early_ctrl_c    # noqa: F401 (first: Ctrl+C ends the imports below)

import math
import threading
from dataclasses import dataclass

import rospy
from sensor_msgs.msg import Imu
from std_msgs.msg import Float32

from tb3_labs.config import Config, setting
from tb3_labs.localization.heading import compass_degrees
from tb3_labs.ros.conversions import to_imu_sample
from tb3_labs.ros.node import read_config, run
from tb3_labs.ros.topics import say_what_is_awaited, subscribe


@dataclass(frozen=True)
class ImuSubConfig(Config):
    """The rate of the printed lines."""

    max_rate: float = setting(10.0, 'most lines; 0: one for every message', '1/s', 0.0, 1000.0)


class IMU:
    """Prints and publishes the heading of each quaternion."""

    def __init__(self):
        max_rate = read_config(ImuSubConfig).max_rate
        self._period = 1.0 / max_rate if max_rate else 0.0
        self._printed_at = -math.inf
        self._lock = threading.Lock()
        self._closed = False
        self._heading = rospy.Publisher('heading', Float32, queue_size=10)
        rospy.on_shutdown(self._close)
        subscribe('imu', Imu, self._on_imu, to_imu_sample)
        say_what_is_awaited({'imu': lambda: math.isfinite(self._printed_at)})

    def _on_imu(self, sample):
        heading = compass_degrees(sample.yaw)
        self._heading.publish(heading)
        now = rospy.get_time()
        with self._lock:
            if not self._closed and abs(now - self._printed_at) >= self._period:
                self._printed_at = now
                rospy.loginfo('Current heading is %f degrees.', heading)

    def _close(self):
        with self._lock:
            self._closed = True
            rospy.loginfo('Shutting down the IMU subscriber')


if __name__ == '__main__':
    run('imu_sub', IMU)
