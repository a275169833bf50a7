"""Goals of move_to_goal: the `move2goal` action. A goal on `move_base_simple/goal` becomes a goal
of this action, as in move_base.
"""
import rospy
from actionlib import ActionServer
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import (
    MoveBaseAction, MoveBaseActionGoal, MoveBaseFeedback, MoveBaseGoal, MoveBaseResult)

from tb3_labs.nodes.move_to_goal.core import GoalStaysEnded
from tb3_labs.ros.clocks import Complaints
from tb3_labs.ros.conversions import to_asked_pose, to_pose_stamped
from tb3_labs.ros.node import guarded
from tb3_labs.ros.rospy_internals import connection_of, sender_of
from tb3_labs.ros.topics import only_news, subscribe_news
from tb3_labs.supervision.goal_requests import GoalRequest


class GoalInterfaces(ActionServer):
    """An ActionServer of one goal at a time; a newer one replaces the older.

    `node` hears of each goal by ``hear_goal(request)``, and takes it by ``on_goal(request)``, which
    raises ``ValueError`` with the reason of a refusal. ``on_cancel(name, stamp)`` returns True if
    it ends the present goal. All are called with this object's lock held. So a thread that holds a
    lock of the node calls nothing of this object.

    actionlib (1.14.0) takes a goal whose GoalID it knows for the same goal for 5 s, then for a new
    one. It takes a repeated latched goal for a new one, and does not cancel an ended goal that is
    driven to again after a reset. So each message comes here first (test/ros/stops.test).
    """

    def __init__(self, node):
        super().__init__('move2goal', MoveBaseAction, self._on_goal, auto_start=False)
        self._node = node
        self._request = None          # the GoalRequest that is about to replace the present one
        self._objection = ''          # the reason why it cannot be one
        self._present = None, None    # the present goal's GoalRequest and its handle, until its end
        self._complaints = Complaints()
        self._hear_goal = guarded(only_news('move2goal/goal', self._on_action_goal))
        subscribe_news('move_base_simple/goal', PoseStamped, self._on_simple_goal, queue_size=1)
        # otherwise the server's status thread may still publish while the topics are closed
        rospy.on_shutdown(self.stop)
        self.start()
        self._survive_clock_jumps()

    def _survive_clock_jumps(self):
        """Replace actionlib's status timer (1.14.0), which dies with a traceback if the clock jumps
        back: test/ros/clock.test shows it."""
        if self.status_timer is not None:
            self.status_timer.shutdown()
            self.status_timer = rospy.Timer(rospy.Duration(1.0 / self.status_frequency),
                                            self.publish_status_async, reset=True)

    def ended(self, request, failure):
        """Report that the goal of `request` was reached, or given up for the reason `failure`."""
        with self.lock:
            if request is self._present[0]:
                self._end('set_aborted' if failure else 'set_succeeded',
                          failure or 'Goal reached!')

    def feedback(self, fix, local_frame):
        """Send a localizer.Fix to the client of the present goal, if there is one."""
        _, handle = self._present
        if handle is not None and self.feedback_pub.get_num_connections():
            handle.publish_feedback(MoveBaseFeedback(base_position=to_pose_stamped(
                fix.local_T_base, local_frame, fix.stamp)))

    def internal_goal_callback(self, goal):
        """actionlib's own subscriber calls this."""
        self._hear_goal(goal)

    def internal_cancel_callback(self, goal_id):
        """actionlib's own subscriber calls this. Every cancel counts, also an old one."""
        guarded(self._on_cancel)(goal_id)

    def _on_simple_goal(self, message):
        self._hear(
            MoveBaseActionGoal(goal=MoveBaseGoal(message)), sender_of(connection_of(message)))

    def _on_action_goal(self, goal):
        self._hear(goal, sender_of(connection_of(goal)))

    def _hear(self, goal, sender):
        target = goal.goal.target_pose
        with self.lock:
            self._request, self._objection = None, ''
            try:
                self._request = GoalRequest(to_asked_pose(target.header, target.pose), sender,
                                            goal.goal_id.id, goal.goal_id.stamp.to_nsec())
                self._node.hear_goal(self._request)
            except ValueError as problem:
                self._objection = str(problem)
            super().internal_goal_callback(goal)

    def _on_goal(self, handle):
        """actionlib calls this for a goal that it does not know."""
        try:
            if self._objection:
                raise ValueError(self._objection)
            goal_id = handle.get_goal_id()    # actionlib gives a goal an id if it has none
            request = GoalRequest(self._request.goal, self._request.sender, goal_id.id,
                                  goal_id.stamp.to_nsec())
            self._node.on_goal(request)
        except ValueError as problem:
            if not isinstance(problem, GoalStaysEnded):
                self._complaints.warn('Goal refused: %s', problem)
            handle.set_rejected(MoveBaseResult(), str(problem))
            return
        self._end('set_canceled', 'replaced by a newer goal')
        handle.set_accepted('driving')
        self._present = request, handle

    def _on_cancel(self, goal_id):
        with self.lock:
            if self._node.on_cancel(goal_id.id, goal_id.stamp.to_nsec()):
                self._end('set_canceled', 'canceled')
            super().internal_cancel_callback(goal_id)

    def _end(self, how, text):
        """End the present goal. The caller holds the lock."""
        _, handle = self._present
        self._present = None, None
        if handle is not None:
            getattr(handle, how)(MoveBaseResult(), text)
