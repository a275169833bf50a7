"""Listens to the robot's messages as an ordinary node, which is gone when the doctor ends."""
import os
import time
from operator import itemgetter

import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState

from tb3_labs.config import NOT_GIVEN
from tb3_labs.doctor.streams import HEARING_TIME
from tb3_labs.localization.contradiction import GyroWatch
from tb3_labs.localization.odometry_jumps import EncoderWatch
from tb3_labs.robot.turtlebot3 import model_called
from tb3_labs.ros.rospy_internals import connection_of
from tb3_labs.ros.sensor_topics import to_imu_sample, to_odometry_sample, to_wheel_sample

#: The topics of a robot that the doctor hears, with their messages.
TOPICS = {'imu': Imu, 'odom': Odometry, 'joint_states': JointState, 'cmd_vel': rospy.AnyMsg}


def listen(namespace, address):
    """Returns {name: [(time of arrival [s], sender, message)]} of a robot's topics, and the time of
    the end [s]. `address`: of this computer, on the way to the master; this node works also if the
    terminal's ROS_IP is wrong."""
    os.environ.pop('ROS_HOSTNAME', None)
    os.environ['ROS_IP'] = address
    heard = {name: [] for name in TOPICS}

    def hear(message, name):
        heard[name].append((time.time(), connection_of(message)['callerid'], message))

    try:
        rospy.init_node('doctor', anonymous=True, log_level=rospy.FATAL, disable_rosout=True,
                        disable_rostime=True, disable_signals=True)
        for name, kind in TOPICS.items():
            rospy.Subscriber(namespace + name, kind, hear, name)
        time.sleep(HEARING_TIME)
        return {name: list(messages) for name, messages in heard.items()}, time.time()
    finally:
        rospy.signal_shutdown('the doctor has heard enough')


def compared(heard, reset_topic):
    """Returns a GyroWatch and an EncoderWatch, and the samples of the IMU and of the wheels that they
    took in."""
    watch, encoders = GyroWatch(model_called(NOT_GIVEN, os.environ), reset_topic), EncoderWatch()
    imu, wheels = [], []

    def on_wheels(sample, at):
        watch.on_wheels(sample)
        encoders.on_wheels(sample)

    streams = [(at, read, message, take_in, samples) for topic, read, take_in, samples in (
        ('imu', to_imu_sample, watch.on_imu, imu), ('joint_states', to_wheel_sample, on_wheels, wheels),
        ('odom', to_odometry_sample, lambda sample, at: encoders.on_odometry(sample), []))
        for at, _, message in heard[topic]]
    for at, read, message, take_in, samples in sorted(streams, key=itemgetter(0)):
        try:
            samples.append(read(message))
        except ValueError:
            continue    # invalid, or of other joints
        take_in(samples[-1], at)
    return watch, encoders, imu, wheels
