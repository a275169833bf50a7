"""Receives goals and resets for move_to_goal. A reset declares the current pose of the robot.

Goals arrive by the action `move2goal`. As in move_base, a goal on the topic `move_base_simple/goal`
becomes a goal of this action. Resets arrive by the services `reset_pose` and `set_pose`, and by the
topic `initialpose`. In RViz, the tool 2D Pose Estimate publishes `initialpose`.
"""
import math

import rospy
from actionlib import ActionServer, ServerGoalHandle
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from move_base_msgs.msg import (
    MoveBaseAction, MoveBaseActionGoal, MoveBaseFeedback, MoveBaseGoal, MoveBaseResult)

from tb3_labs.handout import SET_POSE_SERVICE
from tb3_labs.localization.localizer import Reset
from tb3_labs.ros.clocks import ros_time, steady_time, wait_until
from tb3_labs.ros.conversions import frame_name, to_pose2, to_pose_stamped
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import sender_of
from tb3_labs.ros.topics import WarningThrottle, novelty_reader, sender_connection, subscribe
from tb3_labs.srv import (
    ResetPose, ResetPoseResponse, SetInitialPose, SetInitialPoseResponse)
from tb3_labs.supervision.events import Novelty
from tb3_labs.supervision.goal_requests import GoalOutcome, GoalRequest, RequestedPose, TypedPose

RESET_TIMEOUT = 0.85         # [s]
RESET_POLL_PERIOD = 0.005    # [s]
STATUS_PERIOD = 0.5          # time [s] between two messages of the action's status
#: In a goal or a reset, these names of frames mean ``local``. The handout's client sends `map`.
LOCAL_FRAMES = ('local', 'map', '')
ODOM_FRAME = 'odom'
#: {outcome of a goal: the method of actionlib that reports the outcome to the client}
END_METHODS = {GoalOutcome.REJECTED: ServerGoalHandle.set_rejected,
               GoalOutcome.REACHED: ServerGoalHandle.set_succeeded,
               GoalOutcome.GIVEN_UP: ServerGoalHandle.set_aborted,
               GoalOutcome.CANCELED: ServerGoalHandle.set_canceled}


class GoalServer(ActionServer):
    """Receives the goals of the action `move2goal` for a MoveToGoalCore.

    This class holds actionlib's lock while it hands a goal or a cancel to the core. So actionlib
    and the core receive goals and cancels in the same order.

    This class reads each message before actionlib (1.14.0) does, for two reasons. actionlib itself
    would accept a goal with a known GoalID again after 5 s, and a repeated latched goal even
    sooner. actionlib also ignores the cancel of a goal that has ended. But after a reset the robot
    may drive to this goal again, so the cancel must be obeyed. Test: test/ros/stops.test.
    """

    def __init__(self, runner, core):
        super().__init__('move2goal', MoveBaseAction, ServerGoalHandle.set_rejected,
                         auto_start=False)    # internal_goal_callback takes the goals
        self._runner, self._core = runner, core
        self._current_handle = None    # actionlib's handle of the current goal
        self._warnings = WarningThrottle()
        self._goal_callback = guarded(without_old('move2goal/goal', self._on_goal))

    def offer(self):
        """From now on receive goals."""
        subscribe('move_base_simple/goal', PoseStamped,
                  without_old('move_base_simple/goal', self._on_simple_goal))
        # without stop(), actionlib's status thread may publish while the topics are closed
        rospy.on_shutdown(self.stop)
        self.start()

    def send_answers(self, answers):
        """Send each GoalAnswer to its client. The caller does not hold the lock of the core."""
        for request, outcome, text in answers:
            if outcome is GoalOutcome.ACCEPTED:
                self._current_handle = request.client
                request.client.set_accepted(text)
                continue
            if outcome is GoalOutcome.REJECTED:
                self._warnings.warn('Goal refused: %s', text)
            else:
                self._current_handle = None
            END_METHODS[outcome](request.client, MoveBaseResult(), text)

    def send_feedback(self, stamped):
        """If there is a goal, send the robot's StampedPose to its client."""
        handle = self._current_handle
        if handle is not None and self.feedback_pub.get_num_connections():
            handle.publish_feedback(MoveBaseFeedback(base_position=to_pose_stamped(
                stamped.local_T_base, frame_name('local'), stamped.stamp)))

    def initialize(self):
        """Replace actionlib's status timer, because it would end if ROS time jumps back."""
        super().initialize()
        self.status_timer.shutdown()
        self.status_timer = rospy.Timer(rospy.Duration(STATUS_PERIOD), self.publish_status_async,
                                        reset=True)

    def internal_goal_callback(self, goal):
        """Receive a goal. actionlib's own subscriber calls this method."""
        self._goal_callback(goal)

    def internal_cancel_callback(self, goal_id):
        """Obey a cancel, even an old one. actionlib's own subscriber calls this method."""
        guarded(self._on_cancel)(goal_id)

    def _on_simple_goal(self, message):
        self._on_request(MoveBaseActionGoal(goal=MoveBaseGoal(message)), message)

    def _on_goal(self, message):
        self._on_request(message, message)

    def _on_request(self, action_goal, message):
        target = action_goal.goal.target_pose
        with self.lock:
            handle = self._new_handle(action_goal)
            # actionlib makes an id for a goal that has none
            goal_id = handle.get_goal_id() if handle else action_goal.goal_id
            request = GoalRequest(goal=None, sender=sender_of(message),
                                  name=goal_id.id, stamp=goal_id.stamp.to_nsec(), client=handle)
            try:
                request = request._replace(goal=to_requested_pose(target.header, target.pose))
            except ValueError as error:
                if handle:
                    self.send_answers([(request, GoalOutcome.REJECTED, str(error))])
                return
            method = self._core.on_goal if handle else self._core.register_goal
            self._runner.call_and_decide(lambda: method(request, steady_time()))

    def _new_handle(self, action_goal):
        """Give a goal to actionlib. Returns actionlib's handle for this goal. Returns None for a
        goal that actionlib knows already, or that was canceled before it arrived."""
        handles = []
        self.register_goal_callback(handles.append)
        super().internal_goal_callback(action_goal)
        return handles[0] if handles else None

    def _on_cancel(self, goal_id):
        stamp = goal_id.stamp.to_nsec()
        with self.lock:
            self._runner.call_and_decide(
                lambda: self._core.on_cancel(steady_time(), goal_id.id, stamp))
            super().internal_cancel_callback(goal_id)


class ResetServer:
    """Receives resets by `reset_pose`, `set_pose` and `initialpose`. The core carries out a reset
    when both IMU and odometry have sent a sample after the request."""

    def __init__(self, runner, core):
        self._runner, self._core = runner, core
        self._warnings = WarningThrottle()
        rospy.Service('reset_pose', ResetPose, guarded(self._on_reset_pose))
        rospy.Service(SET_POSE_SERVICE, SetInitialPose, guarded(self._on_set_pose))
        subscribe('initialpose', PoseWithCovarianceStamped,
                  without_old('initialpose', self._on_initialpose))

    def _on_reset_pose(self, request):
        try:
            typed_pose = TypedPose(request.x, request.y, request.yaw_deg)
            reset = self._reset(RequestedPose(typed_pose.pose))
        except ValueError as error:
            return ResetPoseResponse(message=self._log_refusal(error))
        response = ResetPoseResponse(success=True, message=reset.answer, stamp=reset.stamp,
                                     after=_in_degrees(reset.declared_pose))
        if reset.pose_before is not None:
            response.before = _in_degrees(reset.pose_before)
        return response

    def _on_set_pose(self, request):
        reason = self._on_initialpose(request.pose)
        if reason:
            raise rospy.ServiceException(reason)
        return SetInitialPoseResponse()

    def _on_initialpose(self, stamped):
        """Carry out a reset. Returns None, or the reason if the reset is refused."""
        try:
            self._reset(to_requested_pose(stamped.header, stamped.pose.pose))
        except ValueError as error:
            return self._log_refusal(error)
        return None

    def _log_refusal(self, reason):
        self._warnings.warn('Reset refused, the old frame stays: %s', reason)
        return str(reason)

    def _reset(self, requested):
        """Reset to a RequestedPose. Returns the localizer.Reset. Raises ``ValueError`` if the reset
        is refused, or not carried out within RESET_TIMEOUT."""
        reset = Reset(requested)
        self._runner.call_and_decide(lambda: self._core.on_reset(reset, ros_time(), steady_time()))
        is_over = wait_until(lambda: self._runner.call_core(lambda: reset.is_over),
                             RESET_TIMEOUT, RESET_POLL_PERIOD)
        if not is_over:
            self._runner.call_core(reset.give_up)
        if reset.reason:
            raise ValueError(reset.reason)
        return reset


def _in_degrees(pose):
    """Returns the list of x [m], y [m] and yaw [deg], rounded for people to read."""
    return [round(value, 6) for value in (pose.x, pose.y, math.degrees(pose.yaw))]


def without_old(topic, callback):
    """Returns a function that gives each message to `callback`, but no old latched message."""
    novelty_of = novelty_reader(topic)

    def on_message(message):
        if novelty_of(message) in (Novelty.LATCHED, Novelty.OLD):
            rospy.logwarn('%s: a message of %s from before this node could hear it does not count; '
                          'say it again', rospy.resolve_name(topic),
                          sender_connection(message).sender)
        else:
            callback(message)

    return on_message


def to_requested_pose(header, pose):
    """Returns the RequestedPose of a geometry_msgs/Pose in the frame of `header`. The name of the
    frame may begin with this node's namespace. Raises ``ValueError`` for an unknown frame."""
    name = header.frame_id.lstrip('/')
    is_odom = name in (ODOM_FRAME, frame_name(ODOM_FRAME))
    is_local = name in LOCAL_FRAMES or name == frame_name('local')
    if not is_odom and not is_local:
        raise ValueError(f'frame {name[:40]!r} is not valid: local, odom, or map (or none), which '
                         'means local')
    return RequestedPose(to_pose2(pose), is_odom)
