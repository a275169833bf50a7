"""One rhythm for commands and samples: when is the next step due, and which samples are read?

A step reads the newest samples and gives one command. The robot obeys the newest command once in
each of its control periods (turtlebot3.CONTROL_RATE), so a law asks for one step in each period
(its ``period``), and `Pace` says when that step is due.

Between two steps no sample of the IMU needs to be looked at: the next step wants a fresh one, and
the IMU sends several in a period. To wake up for each of them is what a rospy node costs most. So
`Listening` leaves the stream alone after a sample, until shortly before the next step. A sample
that waited meanwhile is read then, of several only the newest, and the next sample that arrives
takes the step. Nodes (:func:`tb3_labs.ros.topics.subscribe`) and roll-outs
(:mod:`tb3_labs.simulation.rollout`) both read their samples in this rhythm.

Units: seconds on the caller's clock (`now`). Edge cases: a clock that goes back makes a command
due, and ends a pause in listening; the first step, and the first after a pause, counts as one
period.
"""
import math
from typing import Callable, List, Optional, Sequence, TypeVar

from tb3_labs.control.speed_laws import clamp

#: A node that looks for due steps whenever an IMU sample arrives comes up to 5 ms late. A late
#: command is worse than an early one, since the robot drives on with the one before: after the
#: first one the steps are planned early by this [s].
EARLY = 0.0035
#: A stream of samples is left alone for this long at most [s],
LONGEST_IDLE = 0.03
#: and no longer than until this before the next step [s]: the step then takes the next sample, a
#: fresh one.
LOOK_AHEAD = 0.001

Sample = TypeVar('Sample')


class Pace:
    """Steps at `period` on average [s]; a step that came late is not made up for."""

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
        """Time for which no sample needs to be looked at [s]."""
        return clamp(self._next - now - LOOK_AHEAD, 0.0, LONGEST_IDLE)

    def step(self, now: float) -> float:
        """Take a step; returns the time since the last one [s]."""
        last, self._last = self._last, now
        if last is None:
            self._next = now + self._period - EARLY
            return self._period
        self.skip(now)
        return max(0.0, now - last)

    def skip(self, now: float) -> None:
        """A step that was due needs nothing; the next one is a period later."""
        self._next = clamp(self._next + self._period, now + 0.5 * self._period, now + self._period)

    def pause(self) -> None:
        """The robot stands, or something else drives it: the next step counts as the first."""
        self._last = None


class Listening:
    """One stream of samples, read in the rhythm of a driver's steps."""

    def __init__(self, idle_for: Callable[[float], float]) -> None:
        """`idle_for(now)`: time for which the driver needs no sample [s], see Pace.idle_for."""
        self._idle_for = idle_for
        self._since = self._until = -math.inf

    def reads(self, now: float) -> bool:
        """Is a sample that arrives now read?"""
        return not self._since <= now < self._until

    def rest(self, now: float) -> float:
        """A sample was read: the stream is left alone from now on, for the returned time [s]."""
        idle = self._idle_for(now)
        self._since, self._until = now, now + idle
        return idle


def newest_of(samples: Sequence[Sample], kind: type) -> List[Sample]:
    """The samples that are read of those that arrived together: all, but of a `kind` the newest."""
    last = max((index for index, sample in enumerate(samples) if isinstance(sample, kind)),
               default=None)
    return [sample for index, sample in enumerate(samples)
            if index == last or not isinstance(sample, kind)]
