"""The three ways to say "the robot is here, now": two services and RViz's 2D Pose Estimate."""
import math
import time

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped

from tb3_labs.geometry.se2 import TypedPose
from tb3_labs.ros.node import guarded
from tb3_labs.ros.topics import subscribe_news
from tb3_labs.srv import (
    ResetPose, ResetPoseResponse, SetInitialPose, SetInitialPoseResponse)


#: A reset is answered within a second in all cases [s].
ANSWER_WITHIN = 0.85


class ResetInterfaces:
    """Offers `reset_pose`, `set_pose` and `initialpose`.

    `reset(pose, deadline)` carries out a reset to a Pose2 in local before `deadline` [s,
    time.monotonic()], and returns the localizer.Reset. `to_local(header, pose)` reads a stamped
    pose. Both raise ``ValueError`` with the reason of a refusal.
    """

    def __init__(self, reset, to_local):
        self._reset = reset
        self._to_local = to_local
        rospy.Service('reset_pose', ResetPose, guarded(self._on_reset_pose))
        rospy.Service('set_pose', SetInitialPose, self._on_set_pose)
        subscribe_news('initialpose', PoseWithCovarianceStamped, self._on_initialpose, queue_size=1)

    def _on_reset_pose(self, request):
        response, deadline = ResetPoseResponse(), time.monotonic() + ANSWER_WITHIN
        try:
            reset = self._reset(TypedPose(request.x, request.y, request.yaw_deg).pose, deadline)
        except ValueError as problem:
            rospy.logwarn('Reset refused, the old frame stays: %s', problem)
            response.message = str(problem)
            return response
        response.success = True
        response.message = 'Local pose set to {}'.format(reset.after)
        if reset.before is not None:
            response.before = _in_degrees(reset.before)
        response.after = _in_degrees(reset.after)
        response.stamp = reset.stamp
        return response

    def _on_set_pose(self, request):
        try:
            self._declare(request.pose)
        except ValueError as problem:
            rospy.logwarn('Reset refused, the old frame stays: %s', problem)
            raise rospy.ServiceException(str(problem)) from None
        return SetInitialPoseResponse()

    def _on_initialpose(self, message):
        try:
            self._declare(message)
        except ValueError as problem:
            rospy.logwarn('Reset refused, the old frame stays: %s', problem)

    def _declare(self, stamped):
        deadline = time.monotonic() + ANSWER_WITHIN
        self._reset(self._to_local(stamped.header, stamped.pose.pose), deadline)


def _in_degrees(pose):
    """x, y [m], yaw [deg], without the digits that nobody measures: people read them."""
    return [round(value, 6) for value in (pose.x, pose.y, math.degrees(pose.yaw))]
