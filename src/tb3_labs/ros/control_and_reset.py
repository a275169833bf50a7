"""The requests that move_to_goal takes: control, and resets ("the robot is here, now").

Control comes by `ctrl_relinq`. Resets come in three ways: the services `reset_pose` and `set_pose`,
and `initialpose`, RViz's 2D Pose Estimate. The other side is :mod:`tb3_labs.ros.operator`.
"""
import math
import time

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_msgs.msg import Bool

from tb3_labs.geometry.se2 import TypedPose
from tb3_labs.ros.node import guarded
from tb3_labs.ros.topics import subscribe_events, subscribe_news
from tb3_labs.srv import (
    ResetPose, ResetPoseResponse, SetInitialPose, SetInitialPoseResponse)

#: Longest time of a reset [s], so that every reset is answered within a second.
ANSWER_WITHIN = 0.85


class ControlTaker:
    """move_to_goal's side of `ctrl_relinq`: hears all senders, and says whether it has control."""

    def __init__(self):
        self._has_control = None
        self._publisher = rospy.Publisher('has_control', Bool, queue_size=20, latch=True)

    def hear(self, told):
        """Call `told(granted, **details)` for each message; see permission.Permission.told."""
        def hear(event):
            told(event.value.data, sender=event.sender, renews=event.renews,
                 is_doubtful=event.is_doubtful, is_old=event.is_old)

        subscribe_events('ctrl_relinq', Bool, hear)

    def say(self, has_control):
        """Publish whether move_to_goal has control, if that has changed."""
        if has_control != self._has_control:
            self._has_control = has_control
            self._publisher.publish(has_control)


class Resets:
    """Offers `reset_pose`, `set_pose` and `initialpose`, and carries them out by a MoveToGoalCore.

    A reset waits in the core for samples of the moment at which it was asked for.
    """

    def __init__(self, core, changed, frames, forget_path):
        """`changed`: the Condition that guards `core`. ``forget_path()`` is called with each new
        frame."""
        self._core = core
        self._changed = changed
        self._frames = frames
        self._forget_path = forget_path
        self._awaited = []    # resets that are not carried out yet; guarded by `changed`

    def offer(self):
        """Take resets from now on."""
        rospy.Service('reset_pose', ResetPose, guarded(self._on_reset_pose))
        rospy.Service('set_pose', SetInitialPose, self._on_set_pose)
        subscribe_news('initialpose', PoseWithCovarianceStamped, self._on_initialpose, queue_size=1)

    def look(self):
        """Log the resets that the latest sample has carried out, and wake their callers; `changed`
        is held."""
        done = [reset for reset in self._awaited if reset.done]
        for reset in done:
            self._awaited.remove(reset)
            self._forget_path()
            rospy.loginfo('%s', self._told(reset))
        if self._awaited or done:
            self._changed.notify_all()

    def _reset(self, declared, deadline):
        """Reset to the Pose2 `declared` in local. Returns (localizer.Reset, answer in words);
        ``ValueError`` if it is refused, or not carried out before `deadline` [time.monotonic()]."""
        with self._changed:
            reset = self._core.reset(declared, rospy.get_time())
            self._awaited.append(reset)
            self._changed.wait_for(lambda: reset.done or reset.problem,
                                   max(0.0, deadline - time.monotonic()))
            if not reset.done:
                self._awaited.remove(reset)
                self._core.give_up_reset(reset)
                raise ValueError(reset.problem or 'no sample of imu and odom at that instant')
            return reset, self._told(reset)

    def _told(self, reset):
        hint = '' if self._core.status(rospy.get_time()).active else '; no goal: send one'
        return 'Local pose set to {}{}'.format(reset.declared, hint)

    def _on_reset_pose(self, request):
        response, deadline = ResetPoseResponse(), time.monotonic() + ANSWER_WITHIN
        try:
            reset, response.message = self._reset(
                TypedPose(request.x, request.y, request.yaw_deg).pose, deadline)
        except ValueError as problem:
            rospy.logwarn('Reset refused, the old frame stays: %s', problem)
            response.message = str(problem)
            return response
        response.success = True
        if reset.before is not None:
            response.before = _in_degrees(reset.before)
        response.after = _in_degrees(reset.declared)
        response.stamp = reset.stamp
        return response

    def _on_set_pose(self, request):
        problem = self._on_initialpose(request.pose)
        if problem:
            raise rospy.ServiceException(str(problem))
        return SetInitialPoseResponse()

    def _on_initialpose(self, stamped):
        """Reset to a stamped pose. The frame `map` means local here, since the handout's client
        sends it so. Returns the reason of a refusal, or None."""
        header, deadline = stamped.header, time.monotonic() + ANSWER_WITHIN
        if header.frame_id.lstrip('/') == 'map':
            header.frame_id = ''
        self._frames.await_frame(header)
        with self._changed:
            odom_T_local = self._core.odom_T_local
        try:
            self._reset(self._frames.to_local(header, stamped.pose.pose, odom_T_local), deadline)
        except ValueError as problem:
            rospy.logwarn('Reset refused, the old frame stays: %s', problem)
            return problem
        return None


def _in_degrees(pose):
    """Returns [x [m], y [m], yaw [deg]], rounded for people to read."""
    return [round(value, 6) for value in (pose.x, pose.y, math.degrees(pose.yaw))]
