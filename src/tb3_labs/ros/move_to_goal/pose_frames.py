"""Converts poses of users, in any frame, into the local frame."""
import threading

import rospy
import tf2_ros

from tb3_labs.ros.conversions import to_pose2, transform_to_pose2

#: Longest wait for a transform [s], so that a reset in a frame of tf is answered within a second.
TF_TIMEOUT = 0.5


class PoseFrames:
    """Turns a stamped pose into a Pose2 in ``local``.

    Nearly all poses come in `local` or `odom`. Others need tf, to which the node subscribes with
    the first of them. So :meth:`await_frame` waits for tf, and for the master; :meth:`to_local`
    never waits, and may be called with locks held.
    """

    def __init__(self, local, odom):
        self.local = local
        self.odom = odom
        self._tf = None
        self._lock = threading.Lock()

    def await_frame(self, header, also_local=()):
        """Wait until tf knows the frame of `header`, for at most TF_TIMEOUT; without a master for
        ever. To be called without a lock, before :meth:`to_local`. False if no wait was needed."""
        frame = header.frame_id.lstrip('/')
        if self._is_local(frame, also_local) or self._is_odom(frame):
            return False
        with self._lock:
            if self._tf is None:
                buffer = tf2_ros.Buffer(debug=False)    # else it asks the master for a service
                self._listener = tf2_ros.TransformListener(buffer)
                self._tf = buffer
        self._tf.can_transform(self.odom, frame, rospy.Time(0), rospy.Duration(TF_TIMEOUT))
        return True

    def to_local(self, header, pose, odom_T_local, also_local=()):
        """The Pose2 in local of a geometry_msgs/Pose with `header`.

        An empty frame, `local`, and the frames `also_local` mean the local frame itself.
        ``ValueError`` with the reason if a pose is refused.
        """
        frame = header.frame_id.lstrip('/')
        pose2 = to_pose2(pose)
        if self._is_local(frame, also_local):
            return pose2
        if odom_T_local is None:
            raise ValueError('no local frame now: nothing was heard from imu and odom, or the '
                             'pose is lost; give the pose in {}'.format(self.local))
        if self._is_odom(frame):
            return odom_T_local.inverse() @ pose2
        return odom_T_local.inverse() @ self._odom_T(frame) @ pose2

    def _is_local(self, frame, also_local):
        return frame in ('', self.local, 'local') or frame in also_local

    def _is_odom(self, frame):
        return frame in (self.odom, 'odom')

    def _odom_T(self, frame):
        try:
            transform = self._tf.lookup_transform(self.odom, frame, rospy.Time(0))
        except tf2_ros.TransformException as problem:
            raise ValueError('frame {!r} is unknown; known here: {}, {} and what tf knows '
                             '({})'.format(frame, self.local, self.odom, problem)) from None
        return transform_to_pose2(transform.transform)
