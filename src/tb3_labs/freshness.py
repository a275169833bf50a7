"""Is a source alive? Judged by when its messages arrive, never by their stamps.

Units: seconds on the receiver's clock (`now`). Edge cases: a source that was never heard has an
infinite age; a clock that goes back makes it just heard, not fresh for ever.
"""
import math
from enum import Enum

#: Silence after which a sensor counts as lost [s]: a robot at full speed drives 5 cm in it.
SENSOR_TIMEOUT = 0.25
#: After a silence of the sensors up to this long a motion goes on by itself [s].
RESUME_TIME = 2.0


class Freshness:
    """Remembers when one source was last heard."""

    def __init__(self, name, timeout=SENSOR_TIMEOUT):
        self.name = name
        self.timeout = timeout
        #: Messages so far.
        self.count = 0
        self._heard_at = None

    def heard(self, now):
        """A good message arrived at `now`."""
        self._heard_at = now
        self.count += 1

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

    def complaint(self, now):
        """What is wrong, in words: 'no imu for 1.2 s', or '' while the source is fresh."""
        age = self.age(now)
        if age <= self.timeout:
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
        """What is wrong with any of the sensors, in words; '' when all are fresh."""
        return ', '.join(filter(None, (source.complaint(now) for source in self._sources)))

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
