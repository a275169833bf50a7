"""A turn on the spot by the IMU: the IMU lab's law and a precise one.

Units: radians, counter-clockwise positive; the lab's own constants are in degrees, as in the
handout. A turn is asked for as an angle, not as a heading: 180 and -180 are two turns, and 360 is
one all the way round. Only the handout's law cannot tell them apart.
Source: LabTurn is the IMU lab's handout, number by number; PreciseTurn brakes by
:mod:`tb3_labs.control.approach`.
"""
import math
from dataclasses import dataclass

from tb3_labs.config import Config, setting
from tb3_labs.control.approach import Approach, Response
from tb3_labs.control.settling import REST_ANGULAR, RestingMean, Settling
from tb3_labs.control.speed_laws import LawStep, Twist2, proportional
from tb3_labs.geometry.angles import continuous, difference
from tb3_labs.robot.turtlebot3 import CONTROL_RATE

#: Two moments as near as this are one, but for rounding [s].
SAME_MOMENT = 1e-6
#: What the keyboard calls a turn [deg].
WORDS = {'l': 90.0, 'r': -90.0, 'b': 180.0}


def degrees_of(text):
    """The turn that `text` asks for [deg]: a word, or a number; else ``ValueError``."""
    try:
        return WORDS[text] if text in WORDS else float(text)
    except ValueError:
        raise ValueError('{!r} is not valid: l (90 degrees left), r (90 right), b (180, about '
                         'turn), a number of degrees (left positive), q (quit)'.format(
                             text[:20])) from None


@dataclass(frozen=True)
class TurnConfig(Config):
    """How to turn."""

    law: str = setting('precise', "precise, or lab for the handout's own law",
                       choices=('precise', 'lab'))
    k_hdg: float = setting(0.1, "lab: rate of turn for each degree that is left", 'rad/s',
                           low=0.001, high=10.0)
    hdg_tol: float = setting(10.0, 'lab: the turn is over this near to its goal', 'deg',
                             low=0.1, high=45.0)
    min_ang_z: float = setting(0.5, 'lab: slowest turn', 'rad/s', low=0.0, high=5.0)
    max_ang_z: float = setting(1.5, "fastest turn; the robot's own limit holds as well", 'rad/s',
                               low=0.1, high=5.0)
    tolerance_deg: float = setting(0.35, 'precise: how near counts as turned', 'deg',
                                   low=0.2, high=45.0)
    angular_acceleration: float = setting(45.0, 'precise: speeding up; a quarter of it for braking',
                                          'rad/s^2', low=1.0, high=80.0)

    def __post_init__(self):
        super().__post_init__()
        if self.min_ang_z > self.max_ang_z:
            raise ValueError('min_ang_z = {:g} is not valid: a number up to max_ang_z, which is '
                             '{:g} rad/s'.format(self.min_ang_z, self.max_ang_z))


def make_turn(config, model, response=None):
    """The turn that `config` (TurnConfig) asks for, for a turtlebot3.RobotModel; `response`: the
    approach.Response that was learned of this robot so far."""
    if config.law == 'lab':
        return LabTurn(config, model)
    return PreciseTurn(min(config.max_ang_z, model.max_angular), config.angular_acceleration,
                       math.radians(config.tolerance_deg), response or Response())


class LabTurn:
    """The handout's law: proportional, clamped, over inside the tolerance.

    It knows the goal as a heading alone and goes there the short way round; it stops as soon as
    it is inside the tolerance, so it ends short by most of that.
    """

    period = 0.1    # [s]: 10 Hz
    MAX_ANGLE = math.pi
    MAX_ANGLE_IN_WORDS = "the handout's law goes the short way round, at most 180"
    #: Every turn is counted from where the robot looks when it is asked, also during another.
    extends = False
    carries_error = False

    def __init__(self, config, model):
        self._gain = config.k_hdg
        self._tolerance = config.hdg_tol
        self._slowest = min(config.min_ang_z, model.max_angular)
        self._fastest = min(config.max_ang_z, model.max_angular)

    def start(self, yaw, angle):
        """Turn by `angle`, beginning at `yaw`."""
        self._goal = yaw + angle

    def step(self, yaw, rate, dt, age=0.0, noise=0.0):
        """What to command, facing `yaw`."""
        error = math.degrees(difference(self._goal, yaw))
        command = proportional(error, self._gain, self._slowest, self._fastest)
        return LawStep(Twist2(0.0, command), math.radians(error), abs(error) < self._tolerance)


class PreciseTurn:
    """As fast as the limits allow, the way round that was asked for, at rest at the end.

    Also turns a drive to its goal, see :mod:`tb3_labs.control.driving`.
    """

    period = 1.0 / CONTROL_RATE
    MAX_ANGLE = 200.0 * math.pi
    MAX_ANGLE_IN_WORDS = 'a number from -36000 to 36000'
    #: A turn during another moves its goal; one after another makes up for what that left undone.
    extends = True
    carries_error = True
    #: Longest rest in which more samples of a noisy IMU are waited for [s].
    LONGEST_LOOK = 0.6

    def __init__(self, fastest, acceleration, tolerance, response):
        """[rad/s], [rad/s^2], [rad]; `response` is the robot's approach.Response."""
        self._fastest = fastest
        self._tolerance = tolerance
        self._approach = Approach(
            self.period, acceleration, braking=0.25 * acceleration, gain=24.0, slowest=0.04,
            close_enough=0.002, leave_alone=0.8 * tolerance, response=response,
            speed_is_prompt=True)

    def start(self, yaw, angle):
        """Turn by `angle`, beginning at `yaw`, with a robot that stands."""
        self._face = yaw + angle
        #: The angle that is left; it keeps the way round, also over many turns.
        self.remaining = angle
        self._time = self._measured_at = 0.0
        self._settling = Settling()
        self._mean = RestingMean()    # of the angle that is left
        self._approach.start()

    def extend(self, angle):
        """Turn by `angle` more (or less): from the goal, while the robot is on its way there."""
        self._face += angle
        self.remaining += angle
        self._mean = RestingMean()
        self._approach.extend(angle)

    def aim(self, face):
        """Face another heading from now on, the short way from the last one."""
        self._face = face
        self._mean = RestingMean()

    def step(self, yaw, rate, dt, age=0.0, noise=0.0):
        """What to command, facing `yaw` and turning at `rate`, `dt` after the last step, as a
        sample of that `age` [s] and that `noise` (one standard deviation [rad]) says.

        Finished when settled: at rest inside the tolerance, as far as the noise lets that be known.
        """
        self._time += dt
        raw = continuous(self._face - yaw, self.remaining)
        self._look(raw, rate, age)
        self.remaining = self._mean.mean_or(raw)
        uncertainty = self._mean.uncertainty(noise)
        command = self._approach.step(self.remaining, rate, self._fastest, dt,
                                      uncertainty=uncertainty)
        return LawStep(Twist2(0.0, command), self.remaining,
                       self._settling.rests and self._is_near(uncertainty))

    def _look(self, raw, rate, age):
        """Take a sample in, unless it is the one that was taken in before."""
        measured_at = self._time - age
        if measured_at - self._measured_at < SAME_MOMENT:
            return
        self._measured_at = measured_at
        rests = abs(rate) <= REST_ANGULAR and self._approach.told_to_rest(age)
        self._settling.look(rests, measured_at)
        if rests:
            self._mean.add(raw)
        else:
            self._mean = RestingMean()

    def _is_near(self, uncertainty):
        if uncertainty <= 0.5 * self._tolerance:
            return abs(self.remaining) <= self._tolerance
        return (self._settling.rested_for >= self.LONGEST_LOOK
                and abs(self.remaining) <= self._tolerance + uncertainty)
