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
            rospy.wait_for_service('reset_pose', WAIT)
            response = rospy.ServiceProxy('reset_pose', ResetPose)(0.0, 0.0, 0.0)
            if response.success:
                rospy.loginfo('Pose reset successfully.')
            else:
                rospy.logwarn('Pose not reset: %s', response.message)
        except (rospy.ROSException, rospy.ServiceException) as problem:
            if not is_ending():
                rospy.logwarn('Pose not reset: %s', problem)
        finally:
            self._busy.release()
