"""Is a source alive? Judged by when its messages arrive, never by their stamps, and by whether they
say anything new while the robot moves.

Units: seconds on the receiver's clock (`now`). Edge cases: a source that was never heard has an
infinite age; a clock that goes back makes it just heard, not fresh for ever.
"""
import math
from enum import Enum

#: Silence after which a sensor counts as lost [s]: a robot at full speed drives 5 cm in it.
SENSOR_TIMEOUT = 0.22
#: After a silence of the sensors up to this long a motion goes on by itself [s].
RESUME_TIME = 2.0
#: A sensor that repeats itself for this long, though the robot is told to move, is frozen [s]: more
#: than a slow network and lazy motors take to make it move.
FROZEN_TIME = 0.6


class Freshness:
    """Remembers when one source was last heard."""

    def __init__(self, name, timeout=SENSOR_TIMEOUT):
        self.name = name
        self.timeout = timeout
        #: Messages so far, and how many more were dropped because they could not be true.
        self.count = self.dropped = 0
        self._heard_at = None
        self._longest_gap = 0.0
        self._reading = None
        self._is_new = False

    def heard(self, now, reading=None):
        """A good message arrived at `now`; `reading`: what it says, its stamp aside."""
        if self._heard_at is not None:
            self._longest_gap = max(self._longest_gap, now - self._heard_at)
        self._heard_at = now
        self.count += 1
        if reading != self._reading:
            self._reading, self._is_new = reading, True

    def take_new(self):
        """Has it said anything else since the last call?"""
        is_new, self._is_new = self._is_new, False
        return is_new

    def take_longest_gap(self):
        """The longest silence between two messages since the last call [s].

        A silence shows here also if nobody looked while it lasted, because the process slept.
        """
        gap, self._longest_gap = self._longest_gap, 0.0
        return gap

    def age(self, now):
        """Seconds since the last message; infinite before the first."""
        return math.inf if self._heard_at is None else max(0.0, now - self._heard_at)

    def clock_went_back(self, now):
        """The receiver's clock may have gone back to `now`: the last message counts as just heard.
        """
        if self._heard_at is not None:
            self._heard_at = min(self._heard_at, now)

    def is_fresh(self, now):
        """True while the last message is at most `timeout` old."""
        return self.age(now) <= self.timeout

    def is_overdue(self, now):
        """True after half the timeout: as good as lost, where another source is lost."""
        return self.age(now) > 0.5 * self.timeout

    @property
    def complaint(self):
        """What is wrong with a source that is not fresh: 'no imu', or 'no imu yet'."""
        return 'no {}{}'.format(self.name, ' yet' if self._heard_at is None else '')

    def complaint_with_age(self, now):
        """The same, and for how long: 'no imu for 1.2 s'."""
        age = self.age(now)
        return self.complaint if math.isinf(age) else '{} for {:.1f} s'.format(self.complaint, age)


class Sight(Enum):
    """What the sensors let a robot do that is being driven."""

    FRESH = 'go on'
    SILENT = 'stand'
    BACK_SOON = 'fresh again after a short silence: go on, knowing that it stood'
    BACK_LATE = 'fresh again after a long silence: give up, the robot may be anywhere'


class SensorWatch:
    """Watches all sensors that a motion needs, and how long they were silent in the midst of it."""

    def __init__(self, *sources):
        self._sources = sources
        #: What is wrong, in words, since :meth:`look` found the sensors silent; else ''.
        self.hold_reason = ''
        #: How long the last silence took [s].
        self.silent_for = 0.0

    def complaint(self, now, with_age=False):
        """What is wrong with any of the sensors, in words; '' when all are fresh.

        Where one is lost, others that are overdue are as good as lost, too.
        """
        if self.are_fresh(now):
            return ''
        return ', '.join(source.complaint_with_age(now) if with_age else source.complaint
                         for source in self._sources if source.is_overdue(now))

    def are_fresh(self, now):
        """True while all of them are."""
        return all(source.is_fresh(now) for source in self._sources)

    def look(self, now):
        """Called while the robot is being driven: the Sight of this moment."""
        for source in self._sources:
            source.clock_went_back(now)
        if not self.are_fresh(now):
            # the first reason stands: it would change with each source that is lost after it
            self.hold_reason = self.hold_reason or self.complaint(now)
            return Sight.SILENT
        self.hold_reason = ''
        gap = max(source.take_longest_gap() for source in self._sources)
        if gap <= min(source.timeout for source in self._sources):
            return Sight.FRESH
        self.silent_for = gap
        return Sight.BACK_SOON if gap <= RESUME_TIME else Sight.BACK_LATE

    def pause(self):
        """The robot is not being driven: no silence until now counts."""
        self.hold_reason = ''
        for source in self._sources:
            source.take_longest_gap()


class FrozenWatch:
    """Notices a source that says the very same again and again, though the robot is told to move.

    Real sensors never repeat themselves, drivers that hang do.
    """

    def __init__(self):
        self._repeated = {}    # source: for how long it has repeated itself [s]

    def start(self):
        """The robot stood until now: a source may well have repeated itself."""
        self._repeated = {}

    def complaint(self, source, must_change, dt):
        """'' or what is wrong with a Freshness, `dt` after the last look [s]."""
        repeats = not source.take_new() and must_change
        self._repeated[source] = self._repeated.get(source, 0.0) + dt if repeats else 0.0
        return '' if self._repeated[source] <= FROZEN_TIME else (
            '{} says the very same again and again though the robot is told to move (its driver '
            'hangs?)'.format(source.name))
