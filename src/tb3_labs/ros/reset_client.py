"""Calls the service that resets the pose of the node move_to_goal.

The node of this package (:mod:`tb3_labs.nodes.move_to_goal.ros_requests`) offers `reset_pose`,
whose response has the reason of a refusal. The handout's node offers only `set_pose`.
"""
import math

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped

from tb3_labs.handout import SET_POSE_SERVICE
from tb3_labs.srv import ResetPose, SetInitialPose


def call_reset(x, y, yaw_deg):
    """Declare that the robot is at `x` [m], `y` [m], `yaw_deg` in local. Returns the answer as
    text. Raises ``ValueError`` with the reason if the node refuses the reset."""
    try:
        response = rospy.ServiceProxy('reset_pose', ResetPose)(x, y, yaw_deg)
    except rospy.ServiceException:    # no node offers reset_pose, or the node was killed
        return _call_as_in_the_handout(x, y, yaw_deg)
    if not response.success:
        raise ValueError(response.message)
    return response.message


def _call_as_in_the_handout(x, y, yaw_deg):
    service = rospy.resolve_name(SET_POSE_SERVICE)
    half_yaw = math.radians(yaw_deg) / 2.0
    message = PoseWithCovarianceStamped()
    message.header.frame_id = 'map'
    message.header.stamp = rospy.Time.now()
    message.pose.covariance = 36 * [0.1]    # as in the handout
    pose = message.pose.pose
    pose.position.x, pose.position.y = x, y
    pose.orientation.z, pose.orientation.w = math.sin(half_yaw), math.cos(half_yaw)
    try:
        rospy.ServiceProxy(service, SetInitialPose)(message)
    except (rospy.ROSException, rospy.ServiceException) as problem:
        raise ValueError(str(problem)) from None
    return f'{service} was called with x={x:.3f}, y={y:.3f}, yaw={yaw_deg:.1f} deg'
