"""Everything `move_to_goal` decides, without ROS: where the robot is, may it drive, how.

Samples go in with the time of their arrival; :meth:`Navigator.command` says what to send. None
means: be silent (after one zero, if the robot was being driven). A robot moves only while this
node has control, both sensors are fresh, and there is a goal left to drive to.

Units: seconds on the receiver's clock (`now`), metres, radians; poses in the local frame.
"""
import math
from dataclasses import dataclass

from tb3_labs.angles import wrap
from tb3_labs.config import Config, setting
from tb3_labs.freshness import Freshness, complaints
from tb3_labs.goal import GoalMachine
from tb3_labs.localizer import Localizer
from tb3_labs.motion import clamp
from tb3_labs.se2 import Pose2

#: A goal farther away than this is a mistake, most likely in the unit [m].
MAX_GOAL_DISTANCE = 100.0
#: After a silence of the sensors up to this long the drive goes on by itself [s].
RESUME_TIME = 2.0


@dataclass(frozen=True)
class NavigatorConfig(Config):
    """What `move_to_goal` begins with."""

    goal_x: float = setting(-0.61, 'first goal, in the local frame', 'm',
                            -MAX_GOAL_DISTANCE, MAX_GOAL_DISTANCE)
    goal_y: float = setting(0.61, 'first goal, in the local frame', 'm',
                            -MAX_GOAL_DISTANCE, MAX_GOAL_DISTANCE)
    goal_yaw_deg: float = setting(0.0, 'heading at the first goal', 'deg', -360.0, 360.0)
    has_control: bool = setting(False, 'may drive from the start, without ctrl_relinq')

    @property
    def goal(self):
        """The first goal as a Pose2 in local."""
        return Pose2(self.goal_x, self.goal_y, wrap(math.radians(self.goal_yaw_deg)))


class Navigator:
    """Localizer, goal machine and permission of one robot."""

    def __init__(self, law, has_control=False):
        self.localizer = Localizer()
        self.machine = GoalMachine(law)
        self.has_control = has_control
        #: Why the robot stands although it has control and a goal; '' while it does not.
        self.hold_reason = ''
        self._period = law.period
        self._imu = Freshness('imu')
        self._odometry = Freshness('odom')
        self._last_step = None
        self._next_step = 0.0
        self._lost_at = None

    # -- what comes in

    def on_imu(self, sample, now):
        """Take an ImuSample in. Returns the resets that were carried out by it."""
        self._imu.heard(now)
        return self._restart_after(self.localizer.on_imu(sample, now))

    def on_odometry(self, sample, now):
        """Take an OdometrySample in. Returns the resets that were carried out by it."""
        self._odometry.heard(now)
        return self._restart_after(self.localizer.on_odometry(sample, now))

    def set_goal(self, goal):
        """A new goal (Pose2 in local), in place of any other; ``ValueError`` if it is too far."""
        if math.hypot(goal.x, goal.y) > MAX_GOAL_DISTANCE:
            raise ValueError('({}) is farther than {:.0f} m from the local origin; goals are in '
                             'metres'.format(goal, MAX_GOAL_DISTANCE))
        self.machine.set_goal(goal)
        self._pause()

    def set_control(self, has_control):
        """Permission to drive is given or taken. True if that changed anything."""
        changed = has_control != self.has_control
        self.has_control = has_control
        if changed and has_control and self.machine.active:
            # the robot may have been driven elsewhere meanwhile
            self.machine.restart()
            self._pause()
        return changed

    def sensor_complaint(self, now):
        """What is wrong with the sensors, in words; '' while both are fresh."""
        return complaints((self._imu, self._odometry), now)

    # -- what comes out

    def due(self, now):
        """Is it time for :meth:`command`? At the law's own rate, and whenever a sensor is lost."""
        return (now >= self._next_step or now < self._next_step - self._period
                or not (self._imu.is_fresh(now) and self._odometry.is_fresh(now)))

    def command(self, now):
        """The Twist2 to send now, or None: silence."""
        # at the law's rate on average, but neither catching up nor running ahead
        self._next_step = clamp(self._next_step + self._period,
                                now + 0.5 * self._period, now + self._period)
        if not (self.has_control and self.machine.active):
            self._pause()
            return None
        if not self._sensors_allow(now):
            return None
        motion = self.localizer.motion(now)
        if motion is None:
            return None
        dt = 0.0 if self._last_step is None else max(0.0, now - self._last_step)
        self._last_step = now
        return self.machine.step(motion, dt)

    def _sensors_allow(self, now):
        complaint = self.sensor_complaint(now)
        if complaint:
            self._last_step = None
            self.hold_reason = complaint
            if self._lost_at is None:
                self._lost_at = now
            return False
        if self._lost_at is not None:
            lost_for = now - self._lost_at
            self._lost_at, self.hold_reason = None, ''
            if 0.0 <= lost_for <= RESUME_TIME or not self.machine.begun:
                self.machine.restart()
            else:
                self.machine.give_up('sensors were silent for {:.1f} s'.format(lost_for))
        return self.machine.active

    def _pause(self):
        """The robot stands, or is in other hands: the next command starts afresh."""
        self._last_step = None
        self._lost_at = None
        self.hold_reason = ''

    def _restart_after(self, resets):
        if resets:
            self.machine.restart()
            self._pause()
        return resets
