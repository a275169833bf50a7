"""Converts messages to the types of the cores, and back. Also makes the names of frames. A message
with NaN, infinity or an invalid quaternion raises ``ValueError``.
"""
import math

import rospy
from geometry_msgs.msg import PoseStamped, Quaternion, TransformStamped, Twist

from tb3_labs.geometry.angles import quaternion_from_yaw, yaw_from_quaternion
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import (
    MAX_STAMP, MAX_ODOMETRY_SPEED, MAX_ODOMETRY_DISTANCE, MAX_ODOMETRY_TURN_RATE, OdometrySample,
    within_bound)

#: This environment variable has the path of the pipe for the true poses of the simulated robot. A
#: student's node could read a topic. Each line of the pipe has x [m], y [m], yaw [rad].
TRUTH_PIPE = 'TB3_LABS_TRUTH'


def frame(name):
    """Returns the name of a frame in this node's namespace, such as `robot3/odom`."""
    namespace = rospy.get_namespace().strip('/')
    return f'{namespace}/{name}' if namespace else name


def yaw_of(orientation):
    """Returns the heading [rad] of a geometry_msgs/Quaternion."""
    return yaw_from_quaternion(w=orientation.w, x=orientation.x, y=orientation.y, z=orientation.z)


def to_quaternion(yaw, *tilt):
    """Returns the geometry_msgs/Quaternion of a heading. `tilt` can be roll and pitch [rad]."""
    w, x, y, z = quaternion_from_yaw(yaw, *tilt)
    return Quaternion(x=x, y=y, z=z, w=w)


def to_pose2(pose):
    """Returns the planar part of a geometry_msgs/Pose."""
    return _finite(Pose2(pose.position.x, pose.position.y, yaw_of(pose.orientation)))


def transform_to_pose2(transform):
    """Returns the planar part of a geometry_msgs/Transform."""
    return _finite(Pose2(transform.translation.x, transform.translation.y,
                         yaw_of(transform.rotation)))


def to_odometry_sample(message):
    """Returns the OdometrySample of a nav_msgs/Odometry."""
    twist = message.twist.twist
    pose = to_pose2(message.pose.pose)
    within_bound('place', max(abs(pose.x), abs(pose.y)), MAX_ODOMETRY_DISTANCE, 'm')
    return OdometrySample(
        within_bound('stamp', message.header.stamp.to_sec(), MAX_STAMP, 's'), pose,
        within_bound('speed', twist.linear.x, MAX_ODOMETRY_SPEED, 'm/s'),
        within_bound('rate of turn', twist.angular.z, MAX_ODOMETRY_TURN_RATE, 'rad/s'))


def to_pose_stamped(pose, frame_id, stamp):
    """Returns the geometry_msgs/PoseStamped of a Pose2. `stamp` is in [s]."""
    message = PoseStamped()
    message.header.frame_id = frame_id
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.pose.position.x = pose.x
    message.pose.position.y = pose.y
    message.pose.orientation = to_quaternion(pose.yaw)
    return message


def to_transform(parent_T_child, parent, child, stamp):
    """Returns the geometry_msgs/TransformStamped of a Pose2. `stamp` is in [s]."""
    message = TransformStamped()
    message.header.frame_id = parent
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.child_frame_id = child
    message.transform.translation.x = parent_T_child.x
    message.transform.translation.y = parent_T_child.y
    message.transform.rotation = to_quaternion(parent_T_child.yaw)
    return message


def to_twist(linear, angular):
    """Returns the geometry_msgs/Twist of a forward speed [m/s] and a rate of turn [rad/s]."""
    message = Twist()
    message.linear.x = linear
    message.angular.z = angular
    return message


def _finite(pose):
    if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
        raise ValueError(f'a number is not finite: {pose}')
    return pose
