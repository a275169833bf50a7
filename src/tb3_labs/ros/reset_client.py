"""Resets the pose of move_to_goal by the service `reset_pose`. If no node offers this service, the
reset uses `set_pose`, since the handout's node offers only `set_pose`."""
import math

import rospy
from geometry_msgs.msg import Point, PoseWithCovarianceStamped, Quaternion

from tb3_labs.handout import SET_POSE_SERVICE
from tb3_labs.srv import ResetPose, SetInitialPose


def call_reset(x, y, yaw_deg):
    """Declare that the robot is at `x` [m], `y` [m], `yaw_deg` in the frame local. Returns the
    node's answer. Raises ``ValueError`` with the reason if the node refuses the reset."""
    try:
        response = rospy.ServiceProxy('reset_pose', ResetPose)(x, y, yaw_deg)
    except rospy.ServiceException:    # no node offers reset_pose, or the node was killed
        return _call_set_pose(x, y, yaw_deg)
    if not response.success:
        raise ValueError(response.message)
    return response.message


def _call_set_pose(x, y, yaw_deg):
    half_yaw = math.radians(yaw_deg) / 2.0
    message = PoseWithCovarianceStamped()
    message.header.frame_id = 'map'
    message.header.stamp = rospy.Time.now()
    message.pose.covariance = 36 * [0.1]    # as in the handout
    message.pose.pose.position = Point(x=x, y=y)
    message.pose.pose.orientation = Quaternion(z=math.sin(half_yaw), w=math.cos(half_yaw))
    try:
        rospy.ServiceProxy(SET_POSE_SERVICE, SetInitialPose)(message)
    except (rospy.ROSException, rospy.ServiceException) as error:
        raise ValueError(str(error)) from None
    return (f'{rospy.resolve_name(SET_POSE_SERVICE)} was called with x={x:.3f}, y={y:.3f}, '
            f'yaw={yaw_deg:.1f} deg')
