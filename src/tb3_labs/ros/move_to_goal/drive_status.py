"""A drive in words: in the terminal, as `goal_state`, and beside the robot in RViz; its errors.

`goal_state` is one of the four states, or begins with 'waiting', 'stopped' or 'gave up'.
"""
import math

import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Float32, String

from tb3_labs.control.goal_machine import DRIVING
from tb3_labs.ros.conversions import to_pose_stamped
from tb3_labs.ros.frames import frame
from tb3_labs.ros.move_to_goal.markers import GoalMarker

#: Between two lines of progress [s].
PROGRESS_PERIOD = 1.0


class DriveStatusPublisher:
    """Says what changed since it was last asked; call :meth:`update` with the navigator locked."""

    def __init__(self, navigator, local_frame):
        self._navigator = navigator
        self._frame = local_frame
        self._state = rospy.Publisher('goal_state', String, queue_size=10, latch=True)
        self._goal = rospy.Publisher('current_goal', PoseStamped, queue_size=1, latch=True)
        self._distance = rospy.Publisher('distance_error', Float32, queue_size=10)
        self._angle = rospy.Publisher('angle_error_deg', Float32, queue_size=10)
        self._marker = GoalMarker(local_frame, frame('base_footprint'))
        self._said = None
        self._begun = None        # the attempt that began last,
        self._begun_at = 0.0      # and when
        self._progress_at = 0.0

    def update(self, now):
        """Report a new state at once, and progress once a second while the robot drives."""
        machine = self._navigator.machine
        state = self._state_in_words(now)
        present = (machine.attempt, machine.goal, state)
        if state is None:
            return
        if present != self._said:
            if machine.begun and (self._said is None or machine.attempt != self._begun):
                self._begun, self._begun_at = machine.attempt, now
            self._said = present
            self._announce(state, now)
            self._state.publish(state)
            self._goal.publish(to_pose_stamped(machine.goal, self._frame, now))
            self._marker.show(machine.goal, machine.law.distance_tolerance, state)
            self._progress_at = now
        elif state in DRIVING and abs(now - self._progress_at) >= PROGRESS_PERIOD:
            self._progress_at = now
            rospy.loginfo('%s: %s to go', state, self._to_go(now))

    def plot(self, pose):
        """The errors of a Pose2 in local, on topics made for rqt_plot."""
        distance, angle = self._navigator.machine.errors(pose)
        self._distance.publish(distance)
        self._angle.publish(math.degrees(angle))

    def report(self, now):
        """(problem or '', {what: value}) for the diagnostics."""
        machine, frame = self._navigator.machine, self._navigator.localizer.frame
        values = {'state': self._state_in_words(now) or 'about to begin',
                  'control': 'granted' if self._navigator.has_control else 'not granted',
                  'goal': machine.goal, 'last failure': machine.failure or 'none'}
        if frame is not None:
            values['imu yaw - odom yaw [deg]'] = '{:.1f}'.format(
                math.degrees(frame.imu_minus_odometry))
        return machine.failure or self._navigator.sensor_complaint(now), values

    def _state_in_words(self, now):
        """What `goal_state` says; None in the moment before the first command."""
        machine = self._navigator.machine
        if machine.failure:
            return 'gave up: ' + machine.failure
        if not machine.active:
            return machine.state.name
        if not self._navigator.has_control:
            return 'waiting for control'
        if not machine.begun:
            complaint = self._navigator.sensor_complaint(now)
            return 'waiting: ' + complaint if complaint else None
        if self._navigator.hold_reason:
            return 'stopped: ' + self._navigator.hold_reason
        return machine.state.name

    def _announce(self, state, now):
        """Say a new state in the terminal."""
        machine = self._navigator.machine
        if machine.failure:
            rospy.logwarn('Goal (%s) given up: %s', machine.goal, machine.failure)
        elif not machine.active:
            rospy.loginfo('Goal reached! %s off, after %.1f s', self._to_go(now),
                          now - self._begun_at)
        elif state in DRIVING:
            if self._begun_at == now:
                rospy.loginfo('Goal (%s): %s to go', machine.goal, self._to_go(now))
            rospy.loginfo('%s', state)
        elif state.startswith('stopped'):
            rospy.logwarn('%s', state.capitalize())
        else:
            hint = ' (True on ctrl_relinq)' if state == 'waiting for control' else ''
            rospy.loginfo('Goal (%s): %s%s', machine.goal, state, hint)

    def _to_go(self, now):
        distance, angle = self._navigator.machine.errors(self._navigator.localizer.motion(now).pose)
        return '{:.3f} m and {:.1f} deg'.format(distance, abs(math.degrees(angle)))
