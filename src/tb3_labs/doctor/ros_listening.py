"""Listens to the robot as a node and yields the findings on drivers, sensors, clock and motion."""
import os
import time
from collections import Counter
from contextlib import suppress
from typing import Any, NamedTuple

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState

from tb3_labs.doctor.master_and_nodes import SENSORS
from tb3_labs.doctor.motion import judge_motion
from tb3_labs.doctor.streams import (
    LISTENING_TIME, drift_of, judge_clock, judge_drift, judge_drivers, judge_gyro, judge_stream)
from tb3_labs.localization.gyro_check import GyroMonitor
from tb3_labs.localization.sample_timing import SampleTiming
from tb3_labs.robot.samples import ImuSample, WheelSample
from tb3_labs.robot.turtlebot3 import Twist2, model_of_environment
from tb3_labs.ros.conversions import to_odometry_sample
from tb3_labs.ros.rospy_internals import sender_of
from tb3_labs.ros.sensor_topics import to_imu_sample, to_wheel_sample

#: {topic to which the doctor listens: type of the messages}
MESSAGE_TYPES = {'imu': Imu, 'odom': Odometry, 'joint_states': JointState, 'cmd_vel': Twist}
#: {topic: function that converts a message to a sample or a command}
SAMPLE_READERS = dict(imu=to_imu_sample, odom=to_odometry_sample, joint_states=to_wheel_sample,
                      cmd_vel=lambda message: Twist2(message.linear.x, message.angular.z))


class ReceivedMessage(NamedTuple):
    topic: str
    arrived_at: float    # [s]
    sender: str
    message: Any


def examine_messages(graph, address, is_wall_time):
    """Yields the findings on the messages of the robot in a RobotGraph. `is_wall_time` is True if
    the stamps come from a real clock. For `address` see :func:`listen`."""
    received, listening_end = listen(graph.namespace, address)
    yield judge_drivers(Counter(
        message.sender for message in received if message.topic == 'cmd_vel'))
    for name in SENSORS:
        arrivals = [message.arrived_at for message in received if message.topic == name]
        publishers = graph.sensor_publishers[name]
        publisher = publishers[0] if publishers else ''
        yield judge_stream(graph.namespace + name, arrivals, listening_end, publisher)
    delays = [arrived_at - message.header.stamp.to_sec()
              for topic, arrived_at, _, message in received
              if topic in SENSORS and message.header.stamp]
    if delays and is_wall_time:
        yield judge_clock(min(delays))

    samples = read_samples(received)
    motion = judge_motion(samples)
    if motion:    # gyro and wheels are not compared, because one of them may be frozen
        yield motion
        return
    gyro = gyro_monitor_of(samples, graph.namespace + 'reset')
    problem, _, remedy = gyro.problem_text().partition(': ')
    yield judge_gyro(problem, remedy, is_compared=gyro.has_compared)
    if problem or not gyro.has_compared:
        return
    yaws = [(sample.stamp, sample.yaw) for _, sample in samples if isinstance(sample, ImuSample)]
    wheel_angles = [(sample.left, sample.right) for _, sample in samples
                    if isinstance(sample, WheelSample)]
    drift = drift_of(yaws, wheel_angles)
    if drift is not None:
        yield judge_drift(drift, graph.namespace)


def listen(namespace, address):
    """Returns all ReceivedMessages of a robot's topics, and the time [s] at which listening ended.
    ROS_IP may be wrong. So the doctor advertises `address`, its own address on the way to the
    master."""
    os.environ.pop('ROS_HOSTNAME', None)
    os.environ['ROS_IP'] = address
    received = []

    def on_message(message, name):
        received.append(ReceivedMessage(name, time.time(), sender_of(message), message))

    try:
        rospy.init_node('doctor', anonymous=True, log_level=rospy.FATAL, disable_rosout=True,
                        disable_rostime=True, disable_signals=True)
        for name, message_type in MESSAGE_TYPES.items():
            rospy.Subscriber(namespace + name, message_type, on_message, name)
        time.sleep(LISTENING_TIME)
        return list(received), time.time()
    finally:
        rospy.signal_shutdown('the doctor has heard enough')


def read_samples(received):
    """Returns [(time of arrival [s], sample or command)] of the valid messages."""
    samples = []
    for topic, arrived_at, _, message in received:
        with suppress(ValueError):    # an arm also publishes joint_states, but without wheels
            samples.append((arrived_at, SAMPLE_READERS[topic](message)))
    return samples


def gyro_monitor_of(samples, reset_topic):
    """Returns a GyroMonitor that has received the samples of :func:`read_samples`."""
    monitor = GyroMonitor(model_of_environment(os.environ), reset_topic)
    timing = SampleTiming()
    for arrived_at, sample in samples:
        if isinstance(sample, ImuSample):
            monitor.on_imu(timing.on_imu(sample, arrived_at))
        elif isinstance(sample, WheelSample):
            monitor.on_wheels(sample)
    return monitor
