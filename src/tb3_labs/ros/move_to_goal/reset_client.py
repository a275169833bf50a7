"""Calls the reset service for a button, without blocking, one call at a time."""
import threading

import rospy

from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import is_ending
from tb3_labs.srv import ResetPose

#: Longest wait for the service [s].
WAIT = 1.0


class ResetClient:
    """Declares the robot to be at (0, 0, 0) in local, by `reset_pose`."""

    def __init__(self):
        self._busy = threading.Lock()

    def reset(self):
        """Start a call, unless one is under way."""
        if self._busy.acquire(blocking=False):
            threading.Thread(target=guarded(self._call), name='reset', daemon=True).start()

    def _call(self):
        try:
            call_reset(0.0, 0.0, 0.0)
            rospy.loginfo('Pose reset successfully.')
        except ValueError as problem:
            if not is_ending():
                rospy.logwarn('Pose not reset: %s', problem)
        finally:
            self._busy.release()


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
