"""Calls the reset service for a button, without blocking, one call after the other."""
import threading

import rospy

from tb3_labs.ros.move_to_goal.reset_call import call_reset
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import is_ending


class ResetClient:
    """Declares the robot to be at (0, 0, 0) in local, by `reset_pose`."""

    def __init__(self):
        self._asked = threading.Semaphore(0)
        threading.Thread(target=guarded(self._run), name='reset', daemon=True).start()

    def reset(self):
        """Ask for a call; one that is asked for during a call follows it."""
        self._asked.release()

    def _run(self):
        while self._asked.acquire():
            while self._asked.acquire(blocking=False):
                pass    # several presses meanwhile are one reset
            self._call()

    @staticmethod
    def _call():
        try:
            call_reset(0.0, 0.0, 0.0)
            rospy.loginfo('Pose reset successfully.')
        except ValueError as problem:
            if not is_ending():
                rospy.logwarn('Pose not reset: %s', problem)
