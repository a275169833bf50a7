"""Publishes a drive: pose and path in the local frame, the frame itself, the line to the goal.

A message costs more than the step of a law. So nothing is made that nobody hears, and what is only
looked at comes at the pace of the eye.
"""
import math

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path

from tb3_labs.geometry.angles import difference
from tb3_labs.ros.conversions import to_pose_stamped, to_transform
from tb3_labs.ros.move_to_goal.markers import WayMarker

#: The path gets a new point after this distance [m] or turn [rad];
PATH_STEP = 0.02
PATH_TURN = math.radians(10.0)
#: beyond this many points every other one is dropped.
PATH_POINTS = 1000
#: All but the pose is sent at most this often [1/s], unless the frame is declared anew: then at
#: once.
DISPLAY_RATE = 10.0
#: The path, which is long, is sent at most this often [1/s].
PATH_RATE = 5.0


class LocalDisplay:
    """Publishes `local_pose`, `local_path` and the tf from the odometry's frame to local."""

    def __init__(self, local_frame):
        self._frame = local_frame
        self._pose = rospy.Publisher('local_pose', PoseStamped, queue_size=1)
        self._path = rospy.Publisher('local_path', Path, queue_size=1, latch=True)
        self._tf = tf2_ros.TransformBroadcaster()
        self._shown = -math.inf, None           # the last stamp, and odom_T_local then
        self._way = WayMarker(local_frame)
        self._points = []
        self._path_sent = -math.inf

    def show(self, fix, odom_T_local, odom_frame, goal_of_drive):
        """Publish one localizer.Fix. `goal_of_drive()` is the goal, a Pose2 in local; None where
        there is no drive."""
        if self._pose.get_num_connections():
            self._pose.publish(to_pose_stamped(fix.local_T_base, self._frame, fix.stamp))
        shown_at, declared = self._shown
        if odom_T_local == declared and abs(fix.stamp - shown_at) < 1.0 / DISPLAY_RATE:
            return
        self._shown = fix.stamp, odom_T_local
        self._tf.sendTransform(to_transform(odom_T_local, odom_frame, self._frame, fix.stamp))
        self._way.show(fix.local_T_base, goal_of_drive)
        self._extend_path(fix)

    def forget_path(self):
        """Clear the path: the local frame was declared anew, and the path was in the old one."""
        self._points = []
        self._path_sent = -math.inf

    def _extend_path(self, fix):
        if self._points:
            last, _ = self._points[-1]
            if last.distance_to(fix.local_T_base) < PATH_STEP and (
                    abs(difference(fix.local_T_base.yaw, last.yaw)) < PATH_TURN):
                return
        message = to_pose_stamped(fix.local_T_base, self._frame, fix.stamp)
        self._points.append((fix.local_T_base, message))
        if len(self._points) > PATH_POINTS:
            self._points = self._points[::2]
        if abs(fix.stamp - self._path_sent) >= 1.0 / PATH_RATE:
            self._path_sent = fix.stamp
            self._path.publish(Path(header=message.header,
                                    poses=[point for _, point in self._points]))
