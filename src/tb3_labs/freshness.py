"""Is a source alive? Judged by when its messages arrive, never by their stamps.

Units: seconds on the receiver's clock (`now`). Edge cases: a source that was never heard has an
infinite age; a clock that goes back makes it just heard, not fresh for ever.
"""
import math

#: Silence after which a sensor counts as lost [s]: a robot at full speed drives 5 cm in it.
SENSOR_TIMEOUT = 0.25


class Freshness:
    """Remembers when one source was last heard."""

    def __init__(self, name, timeout=SENSOR_TIMEOUT):
        self.name = name
        self.timeout = timeout
        self._heard_at = None

    def heard(self, now):
        """A good message arrived at `now`."""
        self._heard_at = now

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


def complaints(sources, now):
    """What is wrong with any of `sources`, joined; '' when all are fresh."""
    return ', '.join(filter(None, (source.complaint(now) for source in sources)))
