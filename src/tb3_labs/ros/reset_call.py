"""One call of the reset service, for a button or a page."""
import rospy

from tb3_labs.srv import ResetPose

#: Longest wait for the service [s].
WAIT = 1.0


def call_reset(x, y, yaw_deg, prefix=''):
    """Declare the robot to be at x, y [m], yaw [deg] in local; the answer in words.

    ``ValueError`` with the reason if that is refused, or no node offers the service. `prefix`: the
    robot's namespace with a slash; '' is this node's own.
    """
    service = rospy.resolve_name(prefix + 'reset_pose')
    try:
        rospy.wait_for_service(service, WAIT)
        response = rospy.ServiceProxy(service, ResetPose)(x, y, yaw_deg)
    except (rospy.ROSException, rospy.ServiceException) as problem:
        raise ValueError(str(problem)) from None
    if not response.success:
        raise ValueError(response.message)
    return response.message
