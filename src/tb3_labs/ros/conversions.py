"""Converts messages to the types of the cores, and back. Invalid messages raise ``ValueError``."""
import math

import rospy
from geometry_msgs.msg import (
    Point, Pose, PoseStamped, Quaternion, Transform, TransformStamped, Twist, Vector3)
from std_msgs.msg import Header

from tb3_labs.geometry.angles import quaternion_from_yaw, yaw_from_quaternion
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import (
    MAX_ODOMETRY_DISTANCE, MAX_ODOMETRY_SPEED, MAX_ODOMETRY_TURN_RATE, MAX_STAMP, OdometrySample,
    checked_number)

#: This environment variable is the path of a pipe. A simulated robot writes its true poses there,
#: because a student's node could read a topic. Each line is x [m], y [m], yaw [rad].
TRUTH_PIPE = 'TB3_LABS_TRUTH'


def frame_name(name):
    """Returns the name of a frame in this node's namespace, such as `robot3/odom`."""
    namespace = rospy.get_namespace().strip('/')
    return f'{namespace}/{name}' if namespace else name


def yaw_of(orientation):
    """Returns the heading [rad] of a geometry_msgs/Quaternion."""
    return yaw_from_quaternion(w=orientation.w, x=orientation.x, y=orientation.y, z=orientation.z)


def to_quaternion(yaw, *tilt):
    """Returns the geometry_msgs/Quaternion of a heading [rad]. `tilt` can be roll and pitch."""
    w, x, y, z = quaternion_from_yaw(yaw, *tilt)
    return Quaternion(x=x, y=y, z=z, w=w)


def to_pose2(pose):
    """Returns the planar part of a geometry_msgs/Pose."""
    return _to_finite_pose2(pose.position, pose.orientation)


def transform_to_pose2(transform):
    """Returns the planar part of a geometry_msgs/Transform."""
    return _to_finite_pose2(transform.translation, transform.rotation)


def _to_finite_pose2(place, orientation):
    pose = Pose2(place.x, place.y, yaw_of(orientation))
    if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
        raise ValueError(f'a number is not finite: {pose}')
    return pose


def to_odometry_sample(message):
    """Returns the OdometrySample of a nav_msgs/Odometry."""
    twist = message.twist.twist
    pose = to_pose2(message.pose.pose)
    checked_number('place', max(abs(pose.x), abs(pose.y)), MAX_ODOMETRY_DISTANCE, 'm')
    stamp = checked_number('stamp', message.header.stamp.to_sec(), MAX_STAMP, 's')
    linear = checked_number('speed', twist.linear.x, MAX_ODOMETRY_SPEED, 'm/s')
    angular = checked_number('rate of turn', twist.angular.z, MAX_ODOMETRY_TURN_RATE, 'rad/s')
    return OdometrySample(stamp, pose, linear, angular)


def to_pose_stamped(pose, frame_id, stamp):
    """Returns the geometry_msgs/PoseStamped of a Pose2. `stamp` is in [s]."""
    header = Header(frame_id=frame_id, stamp=rospy.Time.from_sec(stamp))
    return PoseStamped(header, Pose(Point(x=pose.x, y=pose.y), to_quaternion(pose.yaw)))


def to_transform(parent_T_child, parent, child, stamp):
    """Returns the geometry_msgs/TransformStamped of a Pose2. `stamp` is in [s]."""
    header = Header(frame_id=parent, stamp=rospy.Time.from_sec(stamp))
    translation = Vector3(x=parent_T_child.x, y=parent_T_child.y)
    return TransformStamped(
        header, child, Transform(translation, to_quaternion(parent_T_child.yaw)))


def to_twist(linear, angular):
    """Returns the geometry_msgs/Twist of a forward speed [m/s] and a rate of turn [rad/s]."""
    return Twist(Vector3(x=linear), Vector3(z=angular))
