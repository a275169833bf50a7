"""The robot's sensors: their messages as samples, and reminders of sensors that are not heard.

An invalid message raises ``ValueError``: NaN, infinity, an invalid quaternion, a place or a speed
that no such robot can have, an IMU that says that it has no orientation.
"""
import rospy
from sensor_msgs.msg import JointState

from tb3_labs.robot.samples import (
    FARTHEST_PLACE, FARTHEST_WHEEL, FASTEST_DRIVE, FASTEST_GYRO, FASTEST_SPIKE, LAST_STAMP,
    ImuSample, OdometrySample, WheelSample, bounded)
from tb3_labs.robot.turtlebot3 import WHEEL_JOINTS
from tb3_labs.ros.clocks import remind
from tb3_labs.ros.conversions import to_pose2, yaw_of
from tb3_labs.ros.topics import publishers_of, subscribe


def to_imu_sample(message):
    """The ImuSample of a sensor_msgs/Imu."""
    for covariance, what in ((message.orientation_covariance, 'orientation'),
                             (message.angular_velocity_covariance, 'gyro')):
        if covariance[0] == -1.0:
            raise ValueError('it has no {0} ({0} covariance -1)'.format(what))
    return ImuSample(_stamp(message), yaw_of(message.orientation), bounded(
        'rate of turn', message.angular_velocity.z, FASTEST_GYRO, 'rad/s'))


def to_odometry_sample(message):
    """The OdometrySample of a nav_msgs/Odometry."""
    twist, pose = message.twist.twist, to_pose2(message.pose.pose)
    bounded('place', max(abs(pose.x), abs(pose.y)), FARTHEST_PLACE, 'm')
    return OdometrySample(
        _stamp(message), pose, bounded('speed', twist.linear.x, FASTEST_DRIVE, 'm/s'),
        bounded('rate of turn', twist.angular.z, FASTEST_SPIKE, 'rad/s'))


def to_wheel_sample(message):
    """The WheelSample of a TurtleBot3's sensor_msgs/JointState; ``ValueError`` without wheels."""
    angles = dict(zip(message.name, message.position))
    try:
        left, right = (bounded(joint, angles[joint], FARTHEST_WHEEL, 'rad')
                       for joint in WHEEL_JOINTS)
    except KeyError as missing:
        raise ValueError('no angle of {}'.format(missing)) from None
    return WheelSample(_stamp(message), left, right)


def _stamp(message):
    return bounded('stamp', message.header.stamp.to_sec(), LAST_STAMP, 's')


def subscribe_wheels(callback):
    """Hear every sample of the wheels on `joint_states`, but no message of other joints, such as an
    arm's. Returns a function that answers whether anybody publishes there."""
    def hear(message):
        try:
            sample = to_wheel_sample(message)
        except ValueError:
            return
        callback(sample)

    were_sent = bool(publishers_of(rospy.resolve_name('joint_states')))
    subscriber = subscribe('joint_states', JointState, hear, queue_size=None)
    return lambda: were_sent or subscriber.get_num_connections() > 0


def say_what_is_awaited(heard):
    """Remind of the topics without a message so far. `heard`: {topic: function that answers whether
    a message was heard}."""
    def tell():
        missing = [rospy.resolve_name(topic) for topic, was_heard in heard.items()
                   if not was_heard()]
        if missing:
            rospy.loginfo('Waiting for %s: is the robot running?', ' and '.join(missing))
        return missing

    remind(tell)
