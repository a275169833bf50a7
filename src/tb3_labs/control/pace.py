"""When is the next command due, and how long ago was the last one?

Units: seconds on the caller's clock (`now`). Edge cases: a clock that goes back makes a command
due; the first step, and the first after a pause, counts as one period.
"""
from tb3_labs.control.speed_laws import clamp

#: Whoever looks for due steps whenever an IMU sample arrives comes up to 5 ms late. A command that
#: comes late is worse than one that comes early, since the robot drives on with the one before:
#: after the first one the steps are planned early by this [s].
EARLY = 0.0035


#: For so long nobody needs to look at a sample at most [s],
LONGEST_IDLE = 0.03
#: and no longer than until this before the next step [s]: what has waited meanwhile is read then,
#: so that the step is taken by the next sample, a fresh one.
LOOK_AHEAD = 0.001


class Pace:
    """Steps at `period` on average, neither catching up nor running ahead."""

    def __init__(self, period):
        self._period = period
        self._next = 0.0
        self._last = None

    @property
    def running(self):
        """True from a step to the next pause."""
        return self._last is not None

    def due(self, now):
        """Is it time for the next step?"""
        return now >= self._next or now < self._next - self._period

    def idle_for(self, now):
        """For so long no sample needs to be looked at [s]."""
        return clamp(self._next - now - LOOK_AHEAD, 0.0, LONGEST_IDLE)

    def step(self, now):
        """Take a step; returns the time since the last one [s]."""
        last, self._last = self._last, now
        if last is None:
            self._next = now + self._period - EARLY
            return self._period
        self.skip(now)
        return max(0.0, now - last)

    def skip(self, now):
        """Nothing to do this time."""
        self._next = clamp(self._next + self._period, now + 0.5 * self._period, now + self._period)

    def pause(self):
        """The robot stands, or is in other hands: the next step starts afresh."""
        self._last = None
