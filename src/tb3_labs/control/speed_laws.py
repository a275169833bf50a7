"""The braking law shared by turning and driving, and the rhythm of their steps.

A step reads the latest samples and gives one command. The robot obeys the latest command once in
each of its control periods (turtlebot3.CONTROL_RATE). So a law asks for one step in each period
(its ``period``), and `Pace` says when that step is due. Between two steps no sample of the IMU
needs to be read: the one that is read then is at most one period of the IMU old.

Units: metres or radians for the remaining way, per second for speeds. All laws are odd functions:
they treat both directions alike. Edge cases of a Pace: a clock that goes back makes a step due; the
first step, and the first after a pause, counts as one period long.
"""
import math
from typing import NamedTuple, Optional

from tb3_labs.geometry.angles import clamp
from tb3_labs.robot.turtlebot3 import Twist2

#: Steps after the first one are planned earlier by this [s]. The sample for a step may come 5 ms
#: late, and the robot obeys the command before until a late command arrives.
EARLY = 0.0035
#: A stream of samples is left alone for this long at most [s]: a little more than a control period.
LONGEST_IDLE = 0.036


class LawStep(NamedTuple):
    """A law's answer: the command, the remaining way [m or rad], and whether it is finished."""

    command: Twist2
    remaining: float
    finished: bool


def braking_speed(remaining: float, deceleration: float, gain: float) -> float:
    """Fastest speed from which a robot can stop within the remaining way.

    `deceleration` is in [1/s^2], `gain` in [1/s]. Far away this is the braking profile sqrt(2 a d)
    of constant deceleration a. The slope of that profile is infinite at 0, and no motor can follow
    it. So near the end the speed is the line gain x d. Profile and line meet without a step or a
    kink.
    """
    distance = abs(remaining)
    meeting = deceleration / gain ** 2
    if distance <= meeting:
        return math.copysign(gain * distance, remaining)
    return math.copysign(math.sqrt(deceleration * (2.0 * distance - meeting)), remaining)


class Pace:
    """Steps of `period` [s] on average. The steps after a late one come no faster."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._next = 0.0
        self._last: Optional[float] = None

    @property
    def running(self) -> bool:
        """True from a step to the next pause."""
        return self._last is not None

    def due(self, now: float) -> bool:
        """Is it time for the next step?"""
        return now >= self._next or now < self._next - self._period

    def idle_for(self, now: float) -> float:
        """Time for which no sample needs to be read [s]."""
        return clamp(self._next - now, 0.0, LONGEST_IDLE)

    def step(self, now: float) -> float:
        """Take a step; returns the time since the last one [s]."""
        last, self._last = self._last, now
        if last is None:
            self._next = now + self._period - EARLY
            return self._period
        self.skip(now)
        return max(0.0, now - last)

    def skip(self, now: float) -> None:
        """Leave out a step that was due; the next one is a period later."""
        self._next = clamp(self._next + self._period, now + 0.5 * self._period, now + self._period)

    def pause(self) -> None:
        """The robot stands, or another node drives it: the next step counts as the first."""
        self._last = None
