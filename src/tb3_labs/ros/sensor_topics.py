"""The robot's sensors: their messages as samples, and reminders of sensors that are not heard.

An invalid message (NaN, infinity, an invalid quaternion) raises ``ValueError``.
"""
import rospy
from sensor_msgs.msg import JointState

from tb3_labs.robot.samples import ImuSample, OdometrySample, WheelSample
from tb3_labs.robot.turtlebot3 import WHEEL_JOINTS
from tb3_labs.ros.clocks import remind
from tb3_labs.ros.conversions import finite, to_pose2, yaw_of
from tb3_labs.ros.topics import publishers_of, subscribe


def to_imu_sample(message):
    """The ImuSample of a sensor_msgs/Imu."""
    return finite(ImuSample(message.header.stamp.to_sec(), yaw_of(message.orientation),
                            message.angular_velocity.z), message.angular_velocity.z)


def to_odometry_sample(message):
    """The OdometrySample of a nav_msgs/Odometry."""
    twist = message.twist.twist
    return finite(OdometrySample(message.header.stamp.to_sec(), to_pose2(message.pose.pose),
                                 twist.linear.x, twist.angular.z),
                  twist.linear.x, twist.angular.z)


def to_wheel_sample(message):
    """The WheelSample of a TurtleBot3's sensor_msgs/JointState; ``ValueError`` without wheels."""
    angles = dict(zip(message.name, message.position))
    try:
        left, right = (angles[joint] for joint in WHEEL_JOINTS)
    except KeyError as missing:
        raise ValueError('no angle of {}'.format(missing)) from None
    return finite(WheelSample(message.header.stamp.to_sec(), left, right), left, right)


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
