"""Everything `move_to_goal` decides, without ROS: where the robot is, may it drive, how.

Samples go in with the time of their arrival; :meth:`MoveToGoalCore.command` says what to send. None
means: be silent (after one zero, if the robot was being driven). A robot moves only while this
node has control, both sensors are fresh, and there is a goal left to drive to.

Units: seconds on the receiver's clock (`now`), metres, radians; poses in the local frame.
"""
import math
from dataclasses import dataclass

from tb3_labs.config import Config, setting
from tb3_labs.control.goal_machine import GoalMachine
from tb3_labs.control.pace import LONGEST_IDLE, Pace
from tb3_labs.control.speed_laws import Twist2
from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.localizer import Localizer
from tb3_labs.news import NewsDesk
from tb3_labs.supervision.freshness import Freshness, FrozenWatch, SensorWatch, Sight
from tb3_labs.supervision.permission import Permission

#: A place farther than this from the local origin is a mistake, most likely in the unit [m].
MAX_DISTANCE = 100.0
#: A robot that is told to be faster than this must be seen to drive, or to turn [m/s], [rad/s].
SURELY_DRIVES = 0.02
SURELY_TURNS = 0.1


@dataclass(frozen=True)
class MoveToGoalConfig(Config):
    """What `move_to_goal` begins with."""

    goal_x: float = setting(-0.61, 'first goal, in the local frame', 'm',
                            -MAX_DISTANCE, MAX_DISTANCE)
    goal_y: float = setting(0.61, 'first goal, in the local frame', 'm',
                            -MAX_DISTANCE, MAX_DISTANCE)
    goal_yaw_deg: float = setting(0.0, 'heading at the first goal', 'deg', -360.0, 360.0)
    has_control: bool = setting(False, 'may drive from the start, without ctrl_relinq')

    @property
    def goal(self):
        """The first goal as a Pose2 in local."""
        return Pose2(self.goal_x, self.goal_y, wrap(math.radians(self.goal_yaw_deg)))


class MoveToGoalCore:
    """Localizer, goal machine and permission of one robot."""

    def __init__(self, law, has_control=False):
        self.localizer = Localizer()
        self.machine = GoalMachine(law)
        #: May it drive? A permission.Permission.
        self.permission = Permission(has_control)
        self._may_drive = has_control      # as of the last look at it,
        self._givings = 0                  # and its count of givings then
        self._pace = Pace(law.period)
        self.imu = Freshness('imu')
        self.odometry = Freshness('odom')
        self._sensors = SensorWatch(self.imu, self.odometry)
        self._frozen = FrozenWatch()
        self._sent = Twist2()
        self._odometry_yaw = None
        self._odometry_turned = False
        desk = NewsDesk()
        #: Takes the News since the last call.
        self.take_news = desk.take
        self._tell = desk.tell

    # -- what comes in

    def on_imu(self, sample, now):
        """Take an ImuSample in. Returns the resets that were carried out by it."""
        self.imu.heard(now, sample[1:])
        self.localizer.on_imu(sample, now)
        return self._after(self.localizer.take_resets())

    def on_odometry(self, sample, now):
        """Take an OdometrySample in. Returns the resets that were carried out by it."""
        self.odometry.heard(now, (sample.pose, sample.linear, sample.angular))
        self._odometry_turned = sample.pose.yaw != self._odometry_yaw
        self._odometry_yaw = sample.pose.yaw
        self.localizer.on_odometry(sample, now)
        return self._after(self.localizer.take_resets())

    def set_law(self, law):
        """Drive by another law from now on; a drive that is under way begins anew."""
        self.machine.law = law
        self._pace = Pace(law.period)
        if self.machine.active:
            self.machine.restart()

    def set_goal(self, goal):
        """A new goal (Pose2 in local), in place of any other; ``ValueError`` if it is too far."""
        _check_distance(goal)
        self.machine.set_goal(goal)
        self._pause()

    def reset(self, declared, now):
        """The robot is at `declared` (Pose2 in local) now: the localizer.Reset to watch.

        ``ValueError`` where it cannot be carried out: too far, or no fresh sensors.
        """
        _check_distance(declared)
        complaint = self._sensors.complaint(now, with_age=True)
        if complaint:
            raise ValueError('{}: is the robot running?'.format(complaint))
        return self.localizer.reset(declared, now)

    def cancel(self):
        """The goal is over, by somebody's wish."""
        self.machine.cancel()
        self._pause()

    @property
    def has_control(self):
        """May this node drive?"""
        return self.permission.granted

    def told_control(self, granted, now, sender='', renews=False):
        """`sender` gives control, or takes it; `now` as in permission.Permission."""
        self.permission.told(granted, now, sender, renews)
        self.look_at_control(now)

    def look_at_control(self, now):
        """What the permission has come to; to be called again and again."""
        self.permission.update(now)
        for news in self.permission.take_news():
            self._tell(*news)
        before, self._may_drive = self._may_drive, self.permission.granted
        given, self._givings = self.permission.count > self._givings, self.permission.count
        if given and (self.machine.failure or not before):
            # the robot may have been driven elsewhere meanwhile
            self._begin_anew()
        elif self._may_drive and not before:
            self.machine.interrupt()
        elif before and not self._may_drive:
            self._pause()

    def sensor_complaint(self, now):
        """What is wrong with the sensors, in words; '' while both are fresh."""
        return self._sensors.complaint(now)

    @property
    def hold_reason(self):
        """Why the robot stands although it has control and a goal; '' while it does not."""
        return self._sensors.hold_reason

    # -- what comes out

    @property
    def watched(self):
        """Must somebody look at the clock, even if no message arrives?"""
        return self.permission.stands and self.machine.active

    def due(self, now):
        """Is it time for :meth:`command`? At the law's own rate, and whenever a sensor is lost."""
        return self._pace.due(now) or not self._sensors.are_fresh(now)

    def idle_for(self, now):
        """For so long no sample of the IMU needs to be looked at [s]."""
        if self.localizer.has_resets:
            return 0.0
        driving = self.has_control and self.machine.active
        return self._pace.idle_for(now) if driving else LONGEST_IDLE

    def command(self, now):
        """The Twist2 to send now, or None: silence."""
        if not (self.has_control and self.machine.active):
            self._pause()
        elif self._sensors_allow(now):
            motion = self.localizer.motion(now)
            if motion is not None:
                dt = self._pace.step(now)
                self._look_for_frozen(dt)
                command = self.machine.step(motion, dt)
                self._sent = command or Twist2()
                return command
        self._pace.skip(now)
        return None

    def _look_for_frozen(self, dt):
        drives = abs(self._sent.linear) > SURELY_DRIVES
        turns = abs(self._sent.angular) > SURELY_TURNS
        # An odometry that turns knows it from the same IMU.
        complaints = [
            self._frozen.complaint(self.odometry, drives or turns, dt),
            self._frozen.complaint(self.imu, turns or (drives and self._odometry_turned), dt)]
        if any(complaints):
            self.machine.give_up(' and '.join(filter(None, complaints)))

    def _sensors_allow(self, now):
        sight = self._sensors.look(now)
        if sight is Sight.SILENT:
            self._pace.pause()
            self._frozen.start()
            return False
        if sight is Sight.BACK_SOON:
            self._pace.pause()
            self._frozen.start()
            self.machine.interrupt()
        elif sight is Sight.BACK_LATE and self.machine.begun:
            self.machine.give_up('sensors were silent for {:.1f} s'.format(
                self._sensors.silent_for))
        return self.machine.active

    def _begin_anew(self):
        """The drive begins once more, unless its goal was reached or cancelled."""
        if self.machine.failure or self.machine.active:
            self.machine.restart()
        self._pause()

    def _pause(self):
        """The robot stands, or is in other hands: the next command starts afresh."""
        self._pace.pause()
        self._sensors.pause()
        self._frozen.start()
        self._sent = Twist2()

    def _after(self, resets):
        """What a sample may bring about; returns `resets`, those that were carried out by it."""
        for jump in self.localizer.take_jumps():
            if jump.outcome:
                self._tell('{}: {}'.format(jump.text[0].upper() + jump.text[1:], jump.outcome),
                           warning=True)
            if self.permission.stands and self.machine.begun and self.machine.active:
                self.machine.give_up(jump.text)
        if resets:
            self.machine.restart()
            self._pause()
        return resets


def _check_distance(pose):
    if math.hypot(pose.x, pose.y) > MAX_DISTANCE:
        raise ValueError('({}) is farther than {:.0f} m from the local origin; x and y are in '
                         'metres'.format(pose, MAX_DISTANCE))
