"""Everything `controller` decides, without ROS: turns beside the mouse, and who drives.

Samples, mouse and turns go in with the time of their arrival; :meth:`ControllerCore.command` says
what to send. None means: be silent (after one zero, if the robot was being driven).

Units: seconds on the receiver's clock (`now`), radians, m/s; turns are asked for in degrees.
"""
import math
from dataclasses import dataclass, field, replace
from typing import Optional

from tb3_labs.control.pace import LONGEST_IDLE, Pace
from tb3_labs.control.speed_laws import Twist2
from tb3_labs.geometry.angles import continuous
from tb3_labs.localization.sender_clock import SenderClock
from tb3_labs.localization.yaw_noise import YawNoise
from tb3_labs.news import NewsDesk
from tb3_labs.nodes.mouse import mouse_twist
from tb3_labs.robot.samples import heading_jump
from tb3_labs.supervision.arbitration import DRIVERS, Driver, DriverEvent, after
from tb3_labs.supervision.freshness import RESUME_TIME, Freshness, FrozenWatch, SensorWatch, Sight
from tb3_labs.supervision.stall import Progress

#: An active mouse that is silent for this long is lost [s].
MOUSE_TIMEOUT = 0.2
#: A robot that turns faster than this while nobody here drives is driven by another [rad/s].
DRIVEN_RATE = 0.1
#: A robot that turns slower than this rests, and its turn can be judged [rad/s].
REST_RATE = 0.01


@dataclass
class Turn:
    """One turn, from the moment it was asked for until it is judged."""

    asked: float                  # [rad]
    begun_at: float               # [s]
    start: float                  # [rad], continuous yaw
    goal: float                   # [rad], the same; also makes up for what the last turn left
    progress: Progress = field(default_factory=Progress)
    left: Optional[float] = None  # at its end, by a law that waits for rest [rad]


class ControllerCore:
    """One robot that turns by the IMU and drives by the mouse."""

    def __init__(self, law):
        """`law`: a turning.LabTurn or turning.PreciseTurn."""
        self.driver = Driver.NOBODY
        self._law = law
        self._pace = Pace(law.period)
        self.imu = Freshness('imu')
        self._sensors = SensorWatch(self.imu)
        self._frozen = FrozenWatch()
        self._clock = SenderClock()
        self._noise = YawNoise()
        self._rate = 0.0
        self._yaw = None          # continuous over whole turns,
        self._measured_at = 0.0   # and when it was measured, by the least delay
        self._looked_at = None    # the time of the last command, while a turn is going on
        self._turn = None         # the Turn that is driven, or waits for rest to be judged,
        self._carried = 0.0       # and what the one before left undone
        self.mouse = Freshness('mouse', MOUSE_TIMEOUT)
        self.mouse_active = False
        self._mouse_lost = False  # and not yet seen in the middle again
        self._mouse_twist = Twist2()
        self._mouse_is_new = False
        self._desk = NewsDesk()
        #: Takes the News since the last call.
        self.take_news = self._desk.take
        self._tell = self._desk.tell

    # -- what comes in

    def on_imu(self, sample, now):
        """Take an ImuSample in."""
        yaw = sample.yaw if self._yaw is None else continuous(sample.yaw, self._yaw)
        jump = self._yaw is not None and heading_jump(self._yaw, yaw)
        if jump and self.driver is Driver.TURN:
            self._happens(DriverEvent.TURN_OVER, jump)
        self.imu.heard(now, sample[1:])
        self._yaw, self._rate = yaw, sample.yaw_rate
        time = self._clock.time_of('imu', sample.stamp, now)
        self._measured_at = self._clock.measured_at(time, now)
        self._noise.learn(sample, time)
        if self.driver is Driver.TURN:
            return
        if self._turn is not None and abs(self._rate) <= REST_RATE:
            self._judge_turn(now)
        elif self._turn is None and abs(self._rate) > DRIVEN_RATE:
            self._carried = 0.0

    def on_mouse(self, active, x, y, now):
        """Take a message of the mouse in; ``ValueError`` for a position that is not finite.

        `now` is on a clock that never stands still and never goes back: the mouse is in a hand.
        """
        twist = mouse_twist(x, y)
        centred = twist == Twist2()
        self.mouse.heard(now)
        if not active or centred:
            self._mouse_lost = False
        if not active:
            self._release_mouse('the mouse was deactivated')
        elif not self._mouse_lost:
            self._activate_mouse()
            self._mouse_twist, self._mouse_is_new = twist, True
            self._happens(DriverEvent.MOUSE_CENTRED if centred else DriverEvent.MOUSE_MOVED,
                          'the mouse took over')

    def ask(self, degrees, now):
        """Turn by so many degrees, left positive; ``ValueError`` with the reason of a refusal.

        While a turn is going on, the precise law moves its goal by so much; the handout's begins
        anew from where the robot looks.
        """
        angle = math.radians(degrees)
        under_way = self.driver is Driver.TURN and self._law.extends
        whole = self._turn.goal - self._yaw + angle if under_way else angle
        if not abs(whole) <= self._law.MAX_ANGLE + 1e-9:    # nor NaN
            raise ValueError('cannot turn by {:g} degrees: {}'.format(
                math.degrees(whole), self._law.MAX_ANGLE_IN_WORDS))
        if self.driver is Driver.MOUSE:
            raise ValueError('cannot turn: the mouse is driving; move it to the middle of the '
                             'screen, or scroll up, then ask again')
        complaint = self._sensors.complaint(now, with_age=True)
        if complaint:
            raise ValueError('cannot turn: {} (is the robot running?)'.format(complaint))
        if under_way:
            self._law.extend(angle)
            self._turn = replace(self._turn, asked=self._turn.asked + angle,
                                 goal=self._turn.goal + angle, progress=Progress())
        else:
            self._begin_turn(angle, now)
        self._tell('Turning {:g} degrees'.format(round(math.degrees(self._turn.asked), 6)))
        self._happens(DriverEvent.TURN_ASKED)

    def look_at_mouse(self, now):
        """Release an active mouse that fell silent; `now` as in :meth:`on_mouse`."""
        if self.mouse_active and not self.mouse.is_fresh(now):
            self._mouse_lost = self._mouse_is_new = True
            self._release_mouse('{}: move it to the middle of the screen to use it again'.format(
                self.mouse.complaint_with_age(now)))

    def set_law(self, law):
        """Turn by another law from now on; a turn that is under way goes on to the same goal."""
        self._law = law
        self._pace = Pace(law.period)
        if self.driver is Driver.TURN:
            self._turn.progress = Progress()
            self._start_law()

    # -- what comes out

    @property
    def watched(self):
        """Must somebody look at the clock, even if no message arrives?"""
        return self.driver is not Driver.NOBODY or self.mouse_active

    def sensor_complaint(self, now):
        """What is wrong with the IMU, in words; '' while it is fresh."""
        return self._sensors.complaint(now)

    def due(self, now):
        """Is it time for :meth:`command`?"""
        if self._mouse_is_new:
            return True
        return self.driver is Driver.TURN and (
            self._pace.due(now) or not self._sensors.are_fresh(now))

    def idle_for(self, now):
        """For so long no sample of the IMU needs to be looked at [s]."""
        return self._pace.idle_for(now) if self.driver is Driver.TURN else LONGEST_IDLE

    def command(self, now):
        """The Twist2 to send now, or None: silence."""
        self._mouse_is_new = False
        if self.driver is Driver.MOUSE:
            return self._mouse_twist
        if self.driver is Driver.TURN and self._was_awake(now) and self._sensors_allow(now):
            return self._turn_on(now)
        self._pace.skip(now)
        return None

    # -- turns

    def _begin_turn(self, angle, now):
        if self._turn is not None and self.driver is not Driver.TURN:
            self._judge_turn(now)
        self._turn = Turn(angle, now, self._yaw, self._yaw + self._carried + angle)
        self._start_law()

    def _start_law(self):
        """Begin, or go on after a stop, from where the robot looks."""
        self._law.start(self._yaw, self._turn.goal - self._yaw)
        self._pace.pause()
        self._sensors.pause()
        self._frozen.start()
        self._looked_at = None

    def _was_awake(self, now):
        """Has this process been running? One that slept gives the turn up."""
        before, self._looked_at = self._looked_at, now
        if before is None or now - before <= RESUME_TIME:
            return True
        self._happens(DriverEvent.TURN_OVER, 'this node did not run for {:.1f} s'.format(now - before))
        return False

    def _sensors_allow(self, now):
        sight = self._sensors.look(now)
        if sight is Sight.SILENT:
            if self._pace.running:
                self._tell('Stopped: ' + self._sensors.hold_reason, warning=True)
            self._pace.pause()
        elif sight is Sight.BACK_SOON:
            self._tell('Going on: the IMU is back')
            self._turn.progress.resume()
            self._start_law()
        elif sight is Sight.BACK_LATE:
            self._happens(DriverEvent.TURN_OVER, 'the IMU was silent for {:.1f} s'.format(
                self._sensors.silent_for))
        return self.driver is Driver.TURN and sight is not Sight.SILENT

    def _turn_on(self, now):
        dt = self._pace.step(now)
        age = max(0.0, now - self._measured_at)
        step = self._law.step(self._yaw, self._rate, dt, age, self._noise.deviation)
        frozen = self._frozen.complaint(self.imu, True, dt)
        failure = frozen or ('' if step.finished else self._turn.progress.complaint(
            step.remaining, Twist2(0.0, self._rate), dt, step.command != Twist2()))
        if not step.finished and not failure:
            return step.command
        self._turn.left = step.remaining if self._law.carries_error else None
        self._happens(DriverEvent.TURN_OVER, failure)
        return None

    def _judge_turn(self, now):
        """A turn is over and the robot at rest: how well did it go?"""
        turn, error = self._turn, self._turn.left
        if error is None:
            error = turn.goal - self._yaw
        self._tell('Turned {:.1f} degrees in {:.1f} s: {:.2f} degrees {} the goal'.format(
            math.degrees(turn.goal - error - turn.start), now - turn.begun_at,
            abs(math.degrees(error)), 'short of' if error * turn.asked > 0.0 else 'beyond'))
        self._carried = error if self._law.carries_error else 0.0
        self._turn = None

    # -- the mouse, and who drives

    def _activate_mouse(self):
        if not self.mouse_active:
            self.mouse_active = True
            self._tell('The mouse is active: it drives outside the middle of the screen; scroll '
                       'up to stop')

    def _release_mouse(self, reason):
        if self.mouse_active:
            self.mouse_active = False
            self._tell(reason[0].upper() + reason[1:])
            self._happens(DriverEvent.MOUSE_RELEASED, reason)

    def _happens(self, event, reason=''):
        """The rule of the arbiter; a turn that ends by it for a `reason` has been given up."""
        before, self.driver = self.driver, after(DRIVERS, self.driver, event)
        if self.driver is Driver.MOUSE:
            self._carried = 0.0
        if before is Driver.TURN and self.driver is not Driver.TURN and reason:
            self._tell('Turn given up {:.0f} degrees before its end: {}'.format(
                abs(math.degrees(self._turn.goal - self._yaw)), reason), warning=True)
            self._turn = None
            self._carried = 0.0
