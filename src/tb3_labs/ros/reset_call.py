"""An operator's reset of move_to_goal, a call of a service.

A node of this package (:mod:`tb3_labs.nodes.move_to_goal.ros_requests`) offers `reset_pose`, which
says why a reset is refused. A node as in the handout offers only `set_pose`.
"""
import math

import rosgraph
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped

from tb3_labs.geometry.angles import quaternion_from_yaw
from tb3_labs.ros.clocks import wait_until
from tb3_labs.srv import ResetPose, SetInitialPose

#: Longest wait until a service is offered (WAIT), and for the connection to it (CONTACT) [s].
WAIT, CONTACT = 1.0, 0.5
#: The covariance in the handout. The service was AMCL's at first, and AMCL requires a covariance.
COVARIANCE = 36 * [0.1]


def call_reset(x, y, yaw_deg):
    """Declare the robot to be at x, y [m], yaw [deg] in local. Returns the answer in words;
    ``ValueError`` with the reason of a refusal."""
    own, handout = (rospy.resolve_name(name) for name in ('reset_pose', 'set_pose'))
    try:
        if _first_offered(own, handout) == handout:
            rospy.ServiceProxy(handout, SetInitialPose)(_stamped(x, y, math.radians(yaw_deg)))
            return '{} was called with x={:.3f}, y={:.3f}, yaw={:.1f} deg'.format(
                handout, x, y, yaw_deg)
        response = rospy.ServiceProxy(own, ResetPose)(x, y, yaw_deg)
    except (rospy.ROSException, rospy.ServiceException) as problem:
        raise ValueError(str(problem)) from None
    if not response.success:
        raise ValueError(response.message)
    return response.message


def _first_offered(*services):
    """Returns the first service that answers; ``ValueError`` if none answers within WAIT."""
    found = ''

    def look():
        nonlocal found
        found = next(filter(_answers, services), '')
        return found
    if not wait_until(look, WAIT):
        raise ValueError('no node offers ' + ' or '.join(services))
    return found


def _answers(service):
    try:
        # wait_for_service() alone would sleep for 0.3 s if the master does not know the service
        rosgraph.Master(rospy.get_name()).lookupService(service)
        rospy.wait_for_service(service, CONTACT)
    except (OSError, rosgraph.MasterException, rospy.ROSException):
        return False
    return True


def _stamped(x, y, yaw):
    """The geometry_msgs/PoseWithCovarianceStamped that the handout's gamepad sends."""
    message = PoseWithCovarianceStamped()
    message.header.frame_id, message.header.stamp = 'map', rospy.Time.now()
    message.pose.covariance, pose = COVARIANCE, message.pose.pose
    pose.position.x, pose.position.y, turn = x, y, pose.orientation
    turn.w, turn.x, turn.y, turn.z = quaternion_from_yaw(yaw)
    return message
