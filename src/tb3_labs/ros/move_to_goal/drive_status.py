"""The status of a drive: in the terminal, on `goal_state`, beside the robot in RViz; its errors.

The words of `goal_state` are those of :mod:`tb3_labs.control.goal_machine`.
"""
import math

import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Float32, String

from tb3_labs.control.goal import DRIVING, WAITING_FOR_CONTROL, is_stopped, to_go
from tb3_labs.ros.conversions import frame, to_pose_stamped
from tb3_labs.ros.move_to_goal.markers import GoalMarker

#: Time between two lines of progress [s].
PROGRESS_PERIOD = 1.0
#: Time between two points of a plot [s].
PLOT_PERIOD = 0.1


class DriveStatusPublisher:
    """Publishes the changes in the status of a MoveToGoalCore.

    Its methods are called with the core locked.
    """

    def __init__(self, core, local_frame):
        self._core = core
        self._frame = local_frame
        self._state = rospy.Publisher('goal_state', String, queue_size=10, latch=True)
        self._goal = rospy.Publisher('current_goal', PoseStamped, queue_size=1, latch=True)
        self._distance = rospy.Publisher('distance_error', Float32, queue_size=10)
        self._angle = rospy.Publisher('angle_error_deg', Float32, queue_size=10)
        self._marker = GoalMarker(local_frame, frame('base_footprint'))
        self._said = None         # the state that was published last
        self._begun = None        # the attempt that began last,
        self._begun_at = 0.0      # and the time of its begin
        self._progress_at = 0.0
        self._plotted_at = -math.inf

    def update(self, now):
        """Publish a new status at once, and progress once a second while the robot drives."""
        status = self._core.status(now)
        present = (status.attempt, status.goal, status.words)
        if not status.words:
            return
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
        """Publish the errors of a localizer.Fix on topics for rqt_plot, while they are heard."""
        if abs(fix.stamp - self._plotted_at) < PLOT_PERIOD or not (
                self._distance.get_num_connections() or self._angle.get_num_connections()):
            return
        self._plotted_at = fix.stamp
        distance, angle = self._core.errors(fix.local_T_base)
        self._distance.publish(distance)
        self._angle.publish(math.degrees(angle))

    def report(self, now):
        """(problem or '', {name: value}) for the diagnostics."""
        status, turned = self._core.status(now), self._core.imu_minus_odometry
        values = {'state': status.words or 'about to begin',
                  'control': 'granted' if status.has_control else 'not granted',
                  'goal': status.goal, 'last failure': status.last_failure or 'none'}
        if turned is not None:
            values['imu yaw - odom yaw [deg]'] = '{:.1f}'.format(math.degrees(turned))
        return status.failure or status.sensor_problem, values

    def _announce(self, status, now):
        """Log a new state."""
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
        """(distance [m], angle [deg], not negative) to the goal."""
        distance, angle = self._core.errors(self._core.pose(now))
        return distance, abs(math.degrees(angle))
