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
        self._reading = None
        self._is_new = False

    def heard(self, now, reading=None):
        """A good message arrived at `now`; `reading`: what it says, its stamp aside."""
        self._heard_at = now
        self.count += 1
        if reading != self._reading:
            self._reading, self._is_new = reading, True

    def take_new(self):
        """Has it said anything else since the last call?"""
        is_new, self._is_new = self._is_new, False
        return is_new

    def age(self, now):
        """Seconds since the last message; infinite before the first."""
        if self._heard_at is None:
            return math.inf
        if now < self._heard_at:
            self._heard_at = now
        return now - self._heard_at

    def is_fresh(self, now):
        """True while the last message is at most `timeout` old."""
        return self.age(now) <= self.timeout

    def complaint(self, now, timeout=None):
        """What is wrong, in words: 'no imu for 1.2 s', or '' while the source is fresh."""
        age = self.age(now)
        if age <= (self.timeout if timeout is None else timeout):
            return ''
        return 'no {} yet'.format(self.name) if math.isinf(age) else 'no {} for {:.1f} s'.format(
            self.name, age)


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
        self._silent_since = None
        #: What is wrong, in words, since :meth:`look` found the sensors silent; else ''.
        self.hold_reason = ''
        #: How long the last silence took [s].
        self.silent_for = 0.0

    def complaint(self, now):
        """What is wrong with any of the sensors, in words; '' when all are fresh.

        Where one is lost, others that are overdue are as good as lost, too.
        """
        if self.are_fresh(now):
            return ''
        return ', '.join(filter(None, (source.complaint(now, 0.5 * source.timeout)
                                       for source in self._sources)))

    def are_fresh(self, now):
        """True while all of them are."""
        return all(source.is_fresh(now) for source in self._sources)

    def look(self, now):
        """Called while the robot is being driven: the Sight of this moment."""
        self.hold_reason = self.complaint(now)
        if self.hold_reason:
            if self._silent_since is None:
                self._silent_since = now
            return Sight.SILENT
        if self._silent_since is None:
            return Sight.FRESH
        self.silent_for, self._silent_since = now - self._silent_since, None
        return Sight.BACK_SOON if 0.0 <= self.silent_for <= RESUME_TIME else Sight.BACK_LATE

    def pause(self):
        """The robot is not being driven: no silence counts."""
        self._silent_since = None
        self.hold_reason = ''


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
