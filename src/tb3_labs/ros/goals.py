"""Goals of move_to_goal, in any frame that tf knows, by the `move2goal` action and
`move_base_simple/goal`.
"""
import threading

import rospy
import tf2_ros
from actionlib import ActionServer
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseResult

from tb3_labs.ros.conversions import to_pose2, to_pose_stamped, transform_to_pose2
from tb3_labs.ros.node import guarded
from tb3_labs.ros.topics import only_news, subscribe, subscribe_news

#: Longest wait for a transform [s], so that a reset in a frame of tf is answered within a second.
TF_TIMEOUT = 0.5


class _Server(ActionServer):
    """An ActionServer that ignores a repeated latched goal, see :func:`topics.only_news`.

    Before the server's lock is held, each goal goes to `take(header, job)`; `job()` then gives the
    goal to actionlib. actionlib (1.14.0) offers neither of these: test/ros/stops.test shows both.
    """

    def __init__(self, take, on_goal, on_cancel):
        super().__init__('move2goal', MoveBaseAction, on_goal, on_cancel, auto_start=False)
        self._take = take
        self._hear = guarded(only_news('move2goal/goal', self._on_news))

    def internal_goal_callback(self, goal):
        """actionlib's own subscriber calls this."""
        self._hear(goal)

    def _on_news(self, goal):
        internal = super().internal_goal_callback
        self._take(goal.goal.target_pose.header, lambda: internal(goal))


class GoalInterfaces:
    """One goal at a time; a newer one, from either source, replaces the older.

    `set_goal(header, pose)` takes a goal and returns the object by which its end is reported here,
    or raises ``ValueError`` with the reason of a refusal. `cancel()` gives up the present goal.
    Both are called with this object's lock held, and must not wait, since a cancel needs that lock.
    Report only while you hold no lock of your own. `await_frame(header)` is called before
    `set_goal`, without the lock: PoseFrames.await_frame.

    A message on `move2goal/cancel` ends the goal with its id, or all goals up to its stamp, or any
    goal if it has neither. It also ends goals that actionlib does not know: a goal of the other
    source, and an ended goal that is driven to again after a reset.
    """

    def __init__(self, set_goal, cancel, await_frame):
        self._set_goal = set_goal
        self._cancel = cancel
        self._await_frame = await_frame
        self._cancels = 0             # number of messages so far that cancel all goals
        self._is_cancelled = False    # did one come while the newest goal waited for its frame?
        self._goal = None             # the present goal
        self._handle = None           # its action goal, if it came by the action and is not over
        self._id = GoalID(stamp=rospy.Time.now())    # id and time of the present goal
        self._server = _Server(self._take, guarded(self._on_action_goal), guarded(self._on_cancel))
        subscribe_news('move_base_simple/goal', PoseStamped, self._on_simple_goal, queue_size=1)
        # otherwise the server's status thread may still publish while the topics are closed
        rospy.on_shutdown(self._server.stop)
        self._server.start()
        self._survive_clock_jumps()
        # every cancel counts, also an old one
        subscribe('move2goal/cancel', GoalID, self._on_any_cancel, queue_size=None)

    def _survive_clock_jumps(self):
        """Replace actionlib's status timer (1.14.0), which dies with a traceback if the clock jumps
        back: test/ros/clock.test shows it."""
        server = self._server
        if server.status_timer is not None:
            server.status_timer.shutdown()
            server.status_timer = rospy.Timer(rospy.Duration(1.0 / server.status_frequency),
                                              server.publish_status_async, reset=True)

    def ended(self, goal, failure):
        """Report that `goal` was reached, or given up for the reason `failure`."""
        self._end(goal, 'set_aborted' if failure else 'set_succeeded', failure or 'Goal reached!')

    def feedback(self, fix, local_frame):
        """Send a localizer.Fix to the client of the present action goal, if there is one."""
        handle = self._handle
        if handle is not None:
            handle.publish_feedback(MoveBaseFeedback(base_position=to_pose_stamped(
                fix.local_T_base, local_frame, fix.stamp)))

    def _on_action_goal(self, handle):
        try:
            self._replace(handle.get_goal().target_pose, handle)
        except ValueError as problem:
            rospy.logwarn('Goal refused: %s', problem)
            handle.set_rejected(MoveBaseResult(), str(problem))

    def _on_simple_goal(self, message):
        try:
            self._take(message.header, lambda: self._replace(message, None))
        except ValueError as problem:
            rospy.logwarn('Goal refused: %s', problem)

    def _take(self, header, take):
        """Wait for the frame in `header` without the lock, then call `take()` with it held."""
        cancels = self._cancels
        waited = self._await_frame(header)
        with self._server.lock:
            self._is_cancelled = waited and self._cancels != cancels
            take()

    def _replace(self, stamped, handle):
        if self._is_cancelled:
            raise ValueError('it was cancelled while its frame was awaited')
        goal = self._set_goal(stamped.header, stamped.pose)
        self._end(self._goal, 'set_canceled', 'replaced by a newer goal')
        if handle is not None:
            handle.set_accepted('driving')
        self._goal, self._handle = goal, handle
        self._id = handle.get_goal_id() if handle is not None else GoalID(stamp=rospy.Time.now())

    def _on_cancel(self, handle):
        """actionlib calls this for a goal to be cancelled."""
        if handle == self._handle:
            self._cancel_all()

    def _on_any_cancel(self, which):
        """actionlib may not know the goal of this message on `move2goal/cancel`."""
        with self._server.lock:
            all_goals = not which.id and not which.stamp
            named = which.id and which.id == self._id.id
            until_then = which.stamp and self._id.stamp and self._id.stamp <= which.stamp
            self._cancels += all_goals
            if all_goals or named or until_then:
                self._cancel_all()

    def _cancel_all(self):
        self._cancel()
        self._end(self._goal, 'set_canceled', 'canceled')

    def _end(self, goal, how, text):
        with self._server.lock:
            if self._handle is not None and goal is self._goal:
                getattr(self._handle, how)(MoveBaseResult(), text)
                self._handle = None


class PoseFrames:
    """Turns a stamped pose into a Pose2 in ``local``.

    Nearly all poses come in `local` or `odom`. The node subscribes to tf when the first pose in
    another frame comes: :meth:`await_frame` waits for tf, and for the master. :meth:`to_local`
    never waits, and may be called with locks held.
    """

    def __init__(self, local, odom):
        self.local = local
        self.odom = odom
        self._tf = None
        self._lock = threading.Lock()

    def await_frame(self, header):
        """Wait until tf knows the frame of `header`, for at most TF_TIMEOUT; without a master for
        ever. Call it without a lock, before :meth:`to_local`. Returns False if it need not wait."""
        frame = header.frame_id.lstrip('/')
        if self._is_local(frame) or self._is_odom(frame):
            return False
        with self._lock:
            if self._tf is None:
                buffer = tf2_ros.Buffer(debug=False)    # else it asks the master for a service
                self._listener = tf2_ros.TransformListener(buffer)
                self._tf = buffer
        self._tf.can_transform(self.odom, frame, rospy.Time(0), rospy.Duration(TF_TIMEOUT))
        return True

    def to_local(self, header, pose, odom_T_local):
        """Returns the Pose2 in local of a geometry_msgs/Pose in the frame of `header`; an empty one
        means local. ``ValueError`` with the reason of a refusal."""
        frame = header.frame_id.lstrip('/')
        pose2 = to_pose2(pose)
        if self._is_local(frame):
            return pose2
        if odom_T_local is None:
            raise ValueError('no local frame now: nothing was heard from imu and odom, or the '
                             'pose is lost; give the pose in {}'.format(self.local))
        if self._is_odom(frame):
            return odom_T_local.inverse() @ pose2
        return odom_T_local.inverse() @ self._odom_T(frame) @ pose2

    def _is_local(self, frame):
        return frame in ('', self.local, 'local')

    def _is_odom(self, frame):
        return frame in (self.odom, 'odom')

    def _odom_T(self, frame):
        try:
            transform = self._tf.lookup_transform(self.odom, frame, rospy.Time(0))
        except tf2_ros.TransformException as problem:
            raise ValueError('frame {!r} is unknown; known here: {}, {} and what tf knows '
                             '({})'.format(frame, self.local, self.odom, problem)) from None
        return transform_to_pose2(transform.transform)
