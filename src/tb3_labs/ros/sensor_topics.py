"""Converts messages of the IMU and of the wheels to samples.

A message is invalid, and raises ``ValueError``, if it has NaN, infinity, an invalid quaternion, or
a speed that the robot cannot have. A message of an IMU is also invalid if a covariance is -1, which
shows that the IMU does not measure the field.
"""
import rospy
from sensor_msgs.msg import JointState

from tb3_labs.geometry.angles import yaw_from_quaternion
from tb3_labs.robot.samples import (
    MAX_WHEEL_ANGLE, MAX_GYRO_RATE, MAX_STAMP, ImuSample, WheelSample, within_bound)
from tb3_labs.robot.turtlebot3 import WHEEL_JOINTS
from tb3_labs.ros.topics import publishers_of, subscribe

#: Time [s] between two readings of the wheels. A TurtleBot3 sends two messages in this time. The
#: period must be below timeouts.MAX_WHEEL_GAP, so that wheels and gyro can be compared.
WHEEL_PERIOD = 0.06


def to_imu_sample(message):
    """Returns the ImuSample of a sensor_msgs/Imu."""
    if message.orientation_covariance[0] == -1.0:
        raise ValueError('it has no orientation (orientation covariance -1)')
    if message.angular_velocity_covariance[0] == -1.0:
        raise ValueError('it has no gyro (gyro covariance -1)')
    yaw_rate = within_bound('rate of turn', message.angular_velocity.z, MAX_GYRO_RATE, 'rad/s')
    q = message.orientation
    yaw = yaw_from_quaternion(w=q.w, x=q.x, y=q.y, z=q.z)
    return ImuSample(_stamp(message), yaw, yaw_rate)


def to_wheel_sample(message):
    """Returns the WheelSample of a JointState. Raises ``ValueError`` if a wheel is missing."""
    angles = dict(zip(message.name, message.position))
    try:
        left, right = (within_bound(joint, angles[joint], MAX_WHEEL_ANGLE, 'rad')
                       for joint in WHEEL_JOINTS)
    except KeyError as missing:
        raise ValueError(f'no angle of {missing}') from None
    return WheelSample(_stamp(message), left, right)


def _stamp(message):
    return within_bound('stamp', message.header.stamp.to_sec(), MAX_STAMP, 's')


def subscribe_wheels(callback):
    """Call `callback` with the wheel samples on `joint_states`. Messages without wheels are
    ignored. Returns a function that is true if any node publishes the topic."""
    def on_message(message):
        try:
            sample = to_wheel_sample(message)
        except ValueError:
            return
        callback(sample)

    was_published = bool(publishers_of(rospy.resolve_name('joint_states')))
    subscriber = subscribe('joint_states', JointState, on_message,
                           idle_for=lambda now: WHEEL_PERIOD)
    return lambda: was_published or subscriber.get_num_connections() > 0
