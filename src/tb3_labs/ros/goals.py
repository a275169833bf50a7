"""Goals of move_to_goal, in any frame that tf knows, by the `move2goal` action and
`move_base_simple/goal`.
"""
import queue
import threading

import rospy
import tf2_ros
from actionlib import ActionServer
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseResult

from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.conversions import to_pose2, to_pose_stamped, transform_to_pose2
from tb3_labs.ros.node import guarded
from tb3_labs.ros.topics import only_news, subscribe, subscribe_news
from tb3_labs.supervision.permission import Arrival, Arrivals

#: Longest wait for a transform [s], so that a reset in a frame of tf is answered within a second.
TF_TIMEOUT = 0.5


class _Server(ActionServer):
    """An ActionServer that ignores a repeated latched goal, see :func:`topics.only_news`.

    Before the server's lock is held, each goal goes to `take(header, goal_id, job)`; `job()` then
    gives the goal to actionlib. actionlib (1.14.0) offers neither of these: test/ros/stops.test
    shows both.
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
        self._take(goal.goal.target_pose.header, goal.goal_id, lambda: internal(goal))


class GoalInterfaces:
    """One goal at a time; a newer one, from either source, replaces the older.

    `set_goal(header, pose, arrived_at)` takes a goal, which arrived at that steady_time(), and
    returns the object by which its end is reported here, or raises ``ValueError`` with the reason
    of a refusal. `cancel()` gives up the present goal.
    Both are called with this object's lock held, and must not wait, since a cancel needs that lock.
    Report only while you hold no lock of your own. If `frames` (the PoseFrames) must wait for a
    goal's frame, the goal waits in a thread of its own, without the lock.

    A message on `move2goal/cancel` also ends goals that actionlib does not know: a goal of the
    other source, a goal that waits, and an ended goal that is driven to again after a reset.
    """

    def __init__(self, set_goal, cancel, frames):
        self._set_goal = set_goal
        self._cancel = cancel
        self._frames = frames
        self._arrivals = Arrivals(_arrival(GoalID()))
        self._coming = None           # the Arrival that is about to replace the present goal
        self._goal = None             # the present goal
        self._handle = None           # its action goal, if it came by the action and is not over
        self._awaited = queue.Queue()    # (header, Arrival, job) of goals that wait
        threading.Thread(target=guarded(self._await_frames), name='goals', daemon=True).start()
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
        self._replace(handle.get_goal().target_pose, handle)

    def _on_simple_goal(self, message):
        self._take(message.header, GoalID(), lambda: self._replace(message, None))

    def _take(self, header, goal_id, job):
        """Call `job()` with the lock held, now or after a wait for the frame in `header`."""
        goal = _arrival(goal_id)
        with self._server.lock:
            self._arrivals.add(goal)
            if self._frames.must_wait(header):
                self._awaited.put((header, goal, job))
            else:
                self._carry_out(goal, job)

    def _await_frames(self):
        while True:
            header, goal, job = self._awaited.get()
            if not goal.objection(steady_time()):
                self._frames.await_frame(header)
            with self._server.lock:
                self._carry_out(goal, job)

    def _carry_out(self, goal, job):
        self._coming = goal
        job()
        self._arrivals.drop(goal)

    def _replace(self, stamped, handle):
        coming = self._coming
        try:
            if coming.objection(steady_time()):
                raise ValueError(coming.objection(steady_time()))
            goal = self._set_goal(stamped.header, stamped.pose, coming.arrived_at)
        except ValueError as problem:
            rospy.logwarn('Goal refused: %s', problem)
            if handle is not None:
                handle.set_rejected(MoveBaseResult(), str(problem))
            return
        self._end(self._goal, 'set_canceled', 'replaced by a newer goal')
        if handle is not None:
            handle.set_accepted('driving')
            coming.name = handle.get_goal_id().id    # actionlib gives a goal an id if it has none
        self._goal, self._handle = goal, handle
        self._arrivals.accept(coming)

    def _on_cancel(self, handle):
        """actionlib calls this for a goal to be cancelled."""
        if handle == self._handle:
            self._cancel_all()

    def _on_any_cancel(self, which):
        """actionlib may not know the goal of this message on `move2goal/cancel`."""
        with self._server.lock:
            if self._arrivals.cancel(which.id, which.stamp.to_nsec()):
                self._cancel_all()

    def _cancel_all(self):
        self._cancel()
        self._end(self._goal, 'set_canceled', 'canceled')

    def _end(self, goal, how, text):
        with self._server.lock:
            if self._handle is not None and goal is self._goal:
                getattr(self._handle, how)(MoveBaseResult(), text)
                self._handle = None


def _arrival(goal_id):
    """The Arrival, now, of a goal with this GoalID."""
    return Arrival(steady_time(), goal_id.id, (goal_id.stamp or rospy.Time.now()).to_nsec())


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

    def must_wait(self, header):
        """Must the frame of `header` be awaited?"""
        frame = header.frame_id.lstrip('/')
        return not (self._is_local(frame) or self._is_odom(frame))

    def await_frame(self, header):
        """Wait until tf knows the frame of `header`, for at most TF_TIMEOUT; without a master for
        ever. Call it without a lock, before :meth:`to_local`."""
        if not self.must_wait(header):
            return
        with self._lock:
            if self._tf is None:
                buffer = tf2_ros.Buffer(debug=False)    # else it asks the master for a service
                self._listener = tf2_ros.TransformListener(buffer)
                self._tf = buffer
        self._tf.can_transform(self.odom, header.frame_id.lstrip('/'), rospy.Time(0),
                               rospy.Duration(TF_TIMEOUT))

    def to_local(self, header, pose, odom_T_local):
        """Returns the Pose2 in local of a geometry_msgs/Pose in the frame of `header`; an empty one
        means local. Raises ``ValueError`` with the reason of a refusal."""
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
