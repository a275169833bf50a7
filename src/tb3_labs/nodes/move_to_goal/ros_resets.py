"""The requests that move_to_goal takes: control, and resets ("the robot is here, now").

Control comes by `ctrl_relinq`. Resets come in three ways: the services `reset_pose` and `set_pose`,
and `initialpose`, RViz's 2D Pose Estimate. The other side is :mod:`tb3_labs.ros.reset_call`.
"""
import math

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_msgs.msg import Bool

from tb3_labs.geometry.se2 import AskedPose, TypedPose
from tb3_labs.ros.clocks import Complaints
from tb3_labs.ros.conversions import to_asked_pose
from tb3_labs.ros.node import guarded
from tb3_labs.ros.topics import subscribe_events, subscribe_news
from tb3_labs.srv import (
    ResetPose, ResetPoseResponse, SetInitialPose, SetInitialPoseResponse)

#: Longest time of a reset [s], so that every reset is answered within a second.
ANSWER_WITHIN = 0.85
REFUSED = 'Reset refused, the old frame stays: %s'


class ControlTaker:
    """move_to_goal's side of `ctrl_relinq`: hears all senders, and says whether it has control."""

    def __init__(self):
        self._has_control = None
        self._publisher = rospy.Publisher('has_control', Bool, queue_size=20, latch=True)

    @staticmethod
    def hear(told):
        """Call ``told(event)`` with the Event of each message; see permission.Permission.told."""
        subscribe_events('ctrl_relinq', Bool, told)

    def say(self, has_control):
        """Publish whether move_to_goal has control, if that has changed."""
        if has_control != self._has_control:
            self._has_control = has_control
            self._publisher.publish(has_control)


class Resets:
    """Offers `reset_pose`, `set_pose` and `initialpose`, which a MoveToGoalCore carries out.

    A reset waits in the core for samples of the moment at which it was asked for.
    """

    def __init__(self, core, changed, forget_path):
        """`changed`: the Condition that guards `core`. ``forget_path()`` is called with each new
        frame."""
        self._core = core
        self._changed = changed
        self._forget_path = forget_path
        self._complaints = Complaints()

    def offer(self):
        """Take resets from now on."""
        rospy.Service('reset_pose', ResetPose, guarded(self._on_reset_pose))
        rospy.Service('set_pose', SetInitialPose, guarded(self._on_set_pose))
        subscribe_news('initialpose', PoseWithCovarianceStamped, self._on_initialpose, queue_size=1)

    def tell(self, over):
        """Log the resets that are over, and wake their callers; `changed` is held."""
        for reset in over:
            if reset.done:
                self._forget_path()
                rospy.loginfo('%s', self._told(reset))
        if over:
            self._changed.notify_all()

    def _reset(self, asked):
        """Reset to an AskedPose. Returns the localizer.Reset and an answer in words; ``ValueError``
        if it is refused, or not carried out within ANSWER_WITHIN."""
        with self._changed:
            reset = self._core.reset(asked, rospy.get_time())
            if not self._changed.wait_for(lambda: reset.is_over, ANSWER_WITHIN):
                reset.give_up()
            if reset.problem:
                raise ValueError(reset.problem)
            return reset, self._told(reset)

    def _told(self, reset):
        hint = '' if self._core.status(rospy.get_time()).active else '; no goal: send one'
        return 'Local pose set to {}{}'.format(reset.declared, hint)

    def _on_reset_pose(self, request):
        response = ResetPoseResponse()
        try:
            reset, response.message = self._reset(AskedPose(
                TypedPose(request.x, request.y, request.yaw_deg).pose))
        except ValueError as problem:
            response.message = str(problem)
            self._complaints.warn(REFUSED, problem)
            return response
        response.success = True
        if reset.before is not None:
            response.before = _in_degrees(reset.before)
        response.after = _in_degrees(reset.declared)
        response.stamp = reset.stamp
        return response

    def _on_set_pose(self, request):
        try:
            self._reset_to(request.pose)
        except ValueError as problem:
            self._complaints.warn(REFUSED, problem)
            raise rospy.ServiceException(str(problem)) from None
        return SetInitialPoseResponse()

    def _on_initialpose(self, stamped):
        try:
            self._reset_to(stamped)
        except ValueError as problem:
            self._complaints.warn(REFUSED, problem)

    def _reset_to(self, stamped):
        self._reset(to_asked_pose(stamped.header, stamped.pose.pose))


def _in_degrees(pose):
    """Returns [x [m], y [m], yaw [deg]], rounded for people to read."""
    return [round(value, 6) for value in (pose.x, pose.y, math.degrees(pose.yaw))]
