"""One rhythm for commands and samples: when is the next step due, and which samples are read?

A step reads the latest samples and gives one command. The robot obeys the latest command once in
each of its control periods (turtlebot3.CONTROL_RATE). So a law asks for one step in each period
(its ``period``), and `Pace` says when that step is due.

Between two steps no IMU sample needs to be read, and waking up for each of them is the largest
cost of a rospy node. So `Listening` leaves the stream alone until the next step is due. Then it
reads the latest of the samples that waited, which is at most one period of the IMU old.
The nodes read their samples in this rhythm (:func:`tb3_labs.ros.topics.subscribe`).

Units: seconds on the caller's clock (`now`). Edge cases: a clock that goes back makes a command
due, and ends a pause in listening; the first step, and the first after a pause, counts as one
period long.
"""
import math
from typing import Callable, Optional

from tb3_labs.geometry.angles import clamp

#: Steps after the first one are planned earlier by this [s], since the sample for a step may come
#: 5 ms late, and until a late command arrives, the robot obeys the command before.
EARLY = 0.0035
#: A stream of samples is left alone for this long at most [s]: a little more than a control period.
LONGEST_IDLE = 0.036


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


class Listening:
    """One stream of samples, read in the rhythm of a driver's steps."""

    def __init__(self, idle_for: Callable[[float], float]) -> None:
        """`idle_for(now)`: time for which the driver needs no sample [s], see Pace.idle_for."""
        self._idle_for = idle_for
        self._since = self._until = -math.inf

    def reads(self, now: float) -> bool:
        """Is a sample that arrives now to be read?"""
        return not self._since <= now < self._until

    def rest(self, now: float) -> float:
        """A sample was read. Returns the time [s] for which the stream is left alone now."""
        idle = self._idle_for(now)
        self._since, self._until = now, now + idle
        return idle
