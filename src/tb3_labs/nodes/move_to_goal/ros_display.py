"""Publishes a drive: pose and path in local, the frame itself, the status, markers for RViz.

Making a message costs more time than a step of a control law. So a message without a subscriber is
not made, and displays are sent only as often as the eye needs.
"""
import math

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from std_msgs.msg import ColorRGBA, Float32, String
from visualization_msgs.msg import Marker, MarkerArray

from tb3_labs.control.goal_state import DRIVING, WAITING_FOR_CONTROL, is_stopped, to_go
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import frame, to_pose_stamped, to_transform

#: The path gets a new point after this distance [m].
PATH_STEP = 0.02
#: The path also gets a new point after this turn [rad].
PATH_TURN = math.radians(10.0)
#: If the path has more points than this, every second point is dropped.
PATH_POINTS = 1000
#: All messages but the pose are sent at most this often [1/s]; at once in a new frame.
DISPLAY_RATE = 10.0
#: The path is a long message: it is sent at most this often [1/s].
PATH_RATE = 5.0
#: Time between two lines of progress [s].
PROGRESS_PERIOD = 1.0
#: Time between two points of a plot [s].
PLOT_PERIOD = 0.1
#: Markers are sent again after this time [s].
REPEAT_PERIOD = 1.0

MARKER_ORANGE = ColorRGBA(r=1.0, g=0.55, b=0.0, a=1.0)
PALE_YELLOW = ColorRGBA(r=1.0, g=0.95, b=0.6, a=0.6)
WHITE = ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)


class LocalDisplay:
    """Publishes `local_pose`, `local_path` and the tf from the odometry's frame to local."""

    def __init__(self, local_frame, odom_frame):
        self.frame, self._odom = local_frame, odom_frame
        self._pose = rospy.Publisher('local_pose', PoseStamped, queue_size=1)
        self._path = rospy.Publisher('local_path', Path, queue_size=1, latch=True)
        self._tf = tf2_ros.TransformBroadcaster()
        self._shown = -math.inf, None           # the last stamp, and odom_T_local then
        self._points = []
        self._has_new_points = False            # since the path was sent
        self._path_sent = -math.inf

    def show(self, fix, odom_T_local):
        """Publish one localizer.Fix."""
        if self._pose.get_num_connections():
            self._pose.publish(to_pose_stamped(fix.local_T_base, self.frame, fix.stamp))
        shown_at, declared = self._shown
        if odom_T_local == declared and abs(fix.stamp - shown_at) < 1.0 / DISPLAY_RATE:
            return
        self._shown = fix.stamp, odom_T_local
        self._tf.sendTransform(to_transform(odom_T_local, self._odom, self.frame, fix.stamp))
        self._extend_path(fix)
        if self._has_new_points and abs(fix.stamp - self._path_sent) >= 1.0 / PATH_RATE:
            self._path_sent, self._has_new_points = fix.stamp, False
            self._path.publish(Path(header=self._points[-1][1].header,
                                    poses=[point for _, point in self._points]))

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
        self._points.append((fix.local_T_base,
                             to_pose_stamped(fix.local_T_base, self.frame, fix.stamp)))
        self._has_new_points = True
        if len(self._points) > PATH_POINTS:
            self._points = self._points[::2]


class DriveStatusPublisher:
    """Publishes the changes in the status of a MoveToGoalCore; the caller holds the core's lock."""

    def __init__(self, core, local_frame):
        self._core = core
        self._frame = local_frame
        self._state = rospy.Publisher('goal_state', String, queue_size=10, latch=True)
        self._goal = rospy.Publisher('current_goal', PoseStamped, queue_size=1, latch=True)
        self._distance = rospy.Publisher('distance_error', Float32, queue_size=10)
        self._angle = rospy.Publisher('angle_error_deg', Float32, queue_size=10)
        self._marker = GoalMarker(local_frame, frame('base_footprint'))
        self._said = None         # the state that was published last
        self._begun = None        # the attempt that began last
        self._begun_at = 0.0      # the time at which it began
        self._progress_at = 0.0
        self._plotted_at = -math.inf

    def update(self, now):
        """Publish a new status at once, and progress once a second while the robot drives."""
        status = self._core.status(now)
        if not status.words:
            return
        present = (status.attempt, status.goal, status.words)
        if present != self._said:
            if status.begun and (self._said is None or status.attempt != self._begun):
                self._begun, self._begun_at = status.attempt, now
            self._said = present
            self._announce(status, now)
            self._state.publish(status.words)
            self._goal.publish(to_pose_stamped(status.goal, self._frame, now))
            self._marker.show(status.goal, status.tolerance, status.words)
            self._progress_at = now
        elif status.words in DRIVING and abs(now - self._progress_at) >= PROGRESS_PERIOD:
            self._progress_at = now
            rospy.loginfo('%s: %s', status.words, to_go(*self._left(now)))

    def plot(self, fix):
        """Publish the errors of a localizer.Fix for rqt_plot, if their topics are heard."""
        self._marker.repeat(fix.stamp)
        if abs(fix.stamp - self._plotted_at) < PLOT_PERIOD or not (
                self._distance.get_num_connections() or self._angle.get_num_connections()):
            return
        self._plotted_at = fix.stamp
        distance, angle = self._core.errors(fix.local_T_base)
        self._distance.publish(distance)
        self._angle.publish(math.degrees(angle))

    def report(self, now):
        """Returns the answer for Diagnostics."""
        status, turned = self._core.status(now), self._core.imu_minus_odometry
        values = {'state': status.words or 'about to begin',
                  'control': 'granted' if status.has_control else 'not granted',
                  'goal': status.goal, 'last failure': status.last_failure or 'none'}
        if turned is not None:
            values['imu yaw - odom yaw [deg]'] = '{:.1f}'.format(math.degrees(turned))
        return status.failure or status.sensor_problem, values

    def _announce(self, status, now):
        if status.failure:
            rospy.logwarn('Goal (%s) given up: %s', status.goal, status.failure)
        elif not status.active:
            distance, angle = self._left(now)
            rospy.loginfo('Goal reached! %.3f m and %.1f deg off, after %.1f s', distance, angle,
                          now - self._begun_at)
        elif status.words in DRIVING:
            if self._begun_at == now:
                rospy.loginfo('Goal (%s): %s', status.goal, to_go(*self._left(now)))
            rospy.loginfo('%s', status.words)
        elif is_stopped(status.words):
            rospy.logwarn('%s', status.words.capitalize())
        else:
            hint = ' (True on ctrl_relinq)' if status.words == WAITING_FOR_CONTROL else ''
            rospy.loginfo('Goal (%s): %s%s', status.goal, status.words, hint)

    def _left(self, now):
        """Returns the distance [m] and the angle [deg, not negative] to the goal."""
        distance, angle = self._core.errors(self._core.pose(now))
        return distance, abs(math.degrees(angle))


class GoalMarker:
    """Publishes `goal_marker`."""

    def __init__(self, frame, robot_frame):
        self._frame = frame
        self._robot = robot_frame
        self._publisher = rospy.Publisher('goal_marker', MarkerArray, queue_size=1, latch=True)
        self._shown = MarkerArray()
        self._repeated_at = -math.inf

    def show(self, goal, tolerance, words):
        """Draw the Pose2 `goal` with its tolerance [m], and a line of text above the robot."""
        arrow = _marker('goal', 0, self._frame, goal, Marker.ARROW, MARKER_ORANGE,
                        (0.20, 0.03, 0.03))
        disc = _marker('goal', 1, self._frame, goal, Marker.CYLINDER, PALE_YELLOW,
                       (2.0 * tolerance, 2.0 * tolerance, 0.005))
        text = _marker('words', 2, self._robot, Pose2(), Marker.TEXT_VIEW_FACING, WHITE,
                       (0.0, 0.0, 0.1))
        disc.pose.position.z, text.pose.position.z = 0.02, 0.3
        text.text = words + 4 * '\n'    # empty lines lift the centred text off the robot
        self._shown = MarkerArray(markers=[arrow, disc, text])
        self._publisher.publish(self._shown)

    def repeat(self, stamp):
        """Draw again every REPEAT_PERIOD, since RViz drops markers whose frame it does not know."""
        if abs(stamp - self._repeated_at) >= REPEAT_PERIOD:
            self._repeated_at = stamp
            self._publisher.publish(self._shown)


def _marker(namespace, number, frame, pose, kind, color, scale):
    marker = Marker(type=kind, action=Marker.ADD, ns=namespace, id=number, color=color,
                    frame_locked=True)
    stamped = to_pose_stamped(pose, frame, 0.0)
    marker.header, marker.pose = stamped.header, stamped.pose
    marker.scale.x, marker.scale.y, marker.scale.z = scale
    return marker
