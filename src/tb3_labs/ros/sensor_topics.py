"""Converts messages of the IMU and of the wheels to samples.

A conversion raises ``ValueError`` for NaN, infinity, an invalid quaternion, or a speed that the
robot cannot have. The covariance -1 is also refused, because the IMU does not measure this field.
"""
import rospy
from sensor_msgs.msg import JointState

from tb3_labs.geometry.angles import yaw_from_quaternion
from tb3_labs.robot.samples import (
    MAX_GYRO_RATE, MAX_STAMP, MAX_WHEEL_ANGLE, ImuSample, WheelSample, checked_number)
from tb3_labs.robot.turtlebot3 import WHEEL_JOINTS
from tb3_labs.ros.topics import publishers_of, subscribe

#: After each message of the wheels, the topic is not read for this time [s], in which a TurtleBot3
#: sends two messages. Wheels and gyro can be compared if this time is below timeouts.MAX_WHEEL_GAP.
WHEEL_PERIOD = 0.06


def to_imu_sample(message):
    """Returns the ImuSample of a sensor_msgs/Imu."""
    if message.orientation_covariance[0] == -1.0:
        raise ValueError('it has no orientation (orientation covariance -1)')
    if message.angular_velocity_covariance[0] == -1.0:
        raise ValueError('it has no gyro (gyro covariance -1)')
    yaw_rate = checked_number('rate of turn', message.angular_velocity.z, MAX_GYRO_RATE, 'rad/s')
    q = message.orientation
    yaw = yaw_from_quaternion(w=q.w, x=q.x, y=q.y, z=q.z)
    return ImuSample(_stamp(message), yaw, yaw_rate)


def to_wheel_sample(message):
    """Returns the WheelSample of a JointState. Raises ``ValueError`` if a wheel is missing."""
    angles = dict(zip(message.name, message.position))
    for joint in WHEEL_JOINTS:
        if joint not in angles:
            raise ValueError(f'no angle of {joint!r}')
        checked_number(joint, angles[joint], MAX_WHEEL_ANGLE, 'rad')
    left_joint, right_joint = WHEEL_JOINTS
    return WheelSample(_stamp(message), angles[left_joint], angles[right_joint])


def _stamp(message):
    return checked_number('stamp', message.header.stamp.to_sec(), MAX_STAMP, 's')


def subscribe_wheels(callback):
    """Call `callback` with the WheelSamples on `joint_states`. Messages without wheels are ignored.
    Returns a function ``is_published()``, which returns True if any node publishes the topic."""
    def on_message(message):
        try:
            sample = to_wheel_sample(message)
        except ValueError:
            return
        callback(sample)

    was_published = bool(publishers_of(rospy.resolve_name('joint_states')))
    subscriber = subscribe('joint_states', JointState, on_message,
                           idle_time=lambda now: WHEEL_PERIOD)
    return lambda: was_published or subscriber.get_num_connections() > 0
