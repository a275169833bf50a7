"""The three ways to say "the robot is here, now": two services and RViz's 2D Pose Estimate."""
import math
import time

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose_stamped
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

    def __init__(self, reset, to_local, local_frame):
        self._reset = reset
        self._to_local = to_local
        self._local_frame = local_frame
        rospy.Service('reset_pose', ResetPose, guarded(self._on_reset_pose))
        rospy.Service('set_pose', SetInitialPose, self._on_set_pose)
        subscribe_news('initialpose', PoseWithCovarianceStamped, self._on_initialpose, queue_size=1)

    def _on_reset_pose(self, request):
        response, deadline = ResetPoseResponse(), time.monotonic() + ANSWER_WITHIN
        try:
            if not Pose2(request.x, request.y, request.yaw_deg).is_finite():
                raise ValueError('x, y and yaw_deg must be finite numbers, not {}, {}, {}'.format(
                    request.x, request.y, request.yaw_deg))
            reset = self._reset(Pose2(request.x, request.y, wrap(math.radians(request.yaw_deg))),
                                deadline)
        except ValueError as problem:
            rospy.logwarn('Reset refused, the old frame stays: %s', problem)
            response.message = str(problem)
            return response
        response.success = True
        response.message = 'Local pose set to {}'.format(reset.after)
        if reset.before is not None:
            response.before = to_pose_stamped(reset.before, self._local_frame, reset.stamp)
        response.after = to_pose_stamped(reset.after, self._local_frame, reset.stamp)
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
