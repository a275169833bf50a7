"""Calls the reset service for a button, without blocking, one call at a time."""
import threading

import rospy

from tb3_labs.ros.move_to_goal.reset_call import call_reset
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import is_ending


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
