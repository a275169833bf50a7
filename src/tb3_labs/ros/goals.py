"""Where goals come from: the `move2goal` action and `move_base_simple/goal`."""
import rospy
from actionlib import ActionServer
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseResult

from tb3_labs.ros.node import guarded, subscribe


class GoalInterfaces:
    """One goal at a time; a newer one, from either side, replaces the older.

    `set_goal(header, pose)` takes a goal and returns it as the object by which its end is reported
    here, or raises ``ValueError`` with the reason of a refusal; `cancel()` gives the present goal
    up. Both are called with this object's lock held, so report only without locks of your own.
    """

    def __init__(self, set_goal, cancel):
        self._set_goal = set_goal
        self._cancel = cancel
        self._goal = None         # what is being driven to,
        self._handle = None       # and its action goal, where it came by the action
        self._server = ActionServer('move2goal', MoveBaseAction, guarded(self._on_action_goal),
                                    guarded(self._on_cancel), auto_start=False)
        subscribe('move_base_simple/goal', PoseStamped, self._on_simple_goal)
        # else its status thread may still publish while the topics are closed
        rospy.on_shutdown(self._server.stop)
        self._server.start()
        self._survive_clock_jumps()

    def _survive_clock_jumps(self):
        """actionlib's status timer dies, with a traceback, of a clock that jumps back."""
        server = self._server
        if server.status_timer is not None:
            server.status_timer.shutdown()
            server.status_timer = rospy.Timer(rospy.Duration(1.0 / server.status_frequency),
                                              server.publish_status_async, reset=True)

    def reached(self, goal):
        """`goal` was reached."""
        self._end(goal, 'set_succeeded', 'Goal reached!')

    def failed(self, goal, reason):
        """`goal` was given up."""
        self._end(goal, 'set_aborted', reason)

    def feedback(self, local_pose):
        """Tell action clients where the robot is (PoseStamped)."""
        handle = self._handle
        if handle is not None:
            handle.publish_feedback(MoveBaseFeedback(base_position=local_pose))

    def _on_action_goal(self, handle):
        try:
            self._replace(handle.get_goal().target_pose, handle)
        except ValueError as problem:
            rospy.logwarn('Goal refused: %s', problem)
            handle.set_rejected(MoveBaseResult(), str(problem))

    def _on_simple_goal(self, message):
        try:
            with self._server.lock:
                self._replace(message, None)
        except ValueError as problem:
            rospy.logwarn('Goal refused: %s', problem)

    def _replace(self, stamped, handle):
        goal = self._set_goal(stamped.header, stamped.pose)
        self._end(self._goal, 'set_canceled', 'replaced by a newer goal')
        if handle is not None:
            handle.set_accepted('driving')
        self._goal, self._handle = goal, handle

    def _on_cancel(self, handle):
        if handle == self._handle:
            self._cancel()
            self._end(self._goal, 'set_canceled', 'canceled')

    def _end(self, goal, how, text):
        with self._server.lock:
            if self._handle is not None and goal is self._goal:
                getattr(self._handle, how)(MoveBaseResult(), text)
                self._handle = None
