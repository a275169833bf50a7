"""Is a source alive? The arrivals of its messages decide that, never their stamps.

Units: seconds on the receiver's clock (`now`). Edge cases: a source that was never heard has an
infinite age. If the clock goes back, the last message counts as just received; otherwise it would
count as fresh for too long.
"""
import math
from enum import Enum
from typing import Any, Optional

#: A sensor that is silent for longer than this is lost [s]; a robot at full speed drives 5 cm in
#: this time.
SENSOR_TIMEOUT = 0.22
#: After a silence of the sensors of at most this length a motion goes on by itself [s].
RESUME_TIME = 2.0


class Freshness:
    """Remembers when one source was last heard."""

    def __init__(self, name: str, timeout: float = SENSOR_TIMEOUT) -> None:
        self.name = name
        self.timeout = timeout
        #: Number of valid messages so far, and of invalid ones, which were dropped.
        self.count = self.dropped = 0
        self._heard_at: Optional[float] = None
        self._longest_gap = 0.0
        self._reading: Any = None
        self._is_new = False

    def heard(self, now: float, reading: Any = None) -> None:
        """A valid message arrived at `now`; `reading`: its contents without the stamp."""
        if self._heard_at is not None and self.count > 1:
            self._longest_gap = max(self._longest_gap, now - self._heard_at)
        self._heard_at = now
        self.count += 1
        if reading != self._reading:
            self._reading, self._is_new = reading, True

    def take_new(self) -> bool:
        """Has the reading changed since the last call?"""
        is_new, self._is_new = self._is_new, False
        return is_new

    def take_longest_gap(self) -> float:
        """The longest silence between two messages since the last call [s].

        It shows also a silence during which the process slept.
        """
        gap, self._longest_gap = self._longest_gap, 0.0
        return gap

    def clock_went_back(self, now: float) -> None:
        """The receiver's clock may have gone back to `now`: the last message counts as just heard.
        """
        if self._heard_at is not None:
            self._heard_at = min(self._heard_at, now)

    def age(self, now: float) -> float:
        """Seconds since the last message; infinite before the first."""
        return math.inf if self._heard_at is None else max(0.0, now - self._heard_at)

    def is_fresh(self, now: float) -> bool:
        """True while the last message is at most `timeout` old."""
        return self.age(now) <= self.timeout

    def is_overdue(self, now: float) -> bool:
        """Is the last message older than half the timeout? If another source is lost, this one is
        then reported as lost, too."""
        return self.age(now) > 0.5 * self.timeout

    @property
    def silence(self) -> str:
        """The text for a source that is not fresh: 'no imu', or 'no imu yet'."""
        return 'no {}{}'.format(self.name, ' yet' if self._heard_at is None else '')

    def silence_with_age(self, now: float) -> str:
        """The same with its duration: 'no imu for 1.2 s'."""
        age = self.age(now)
        return self.silence if math.isinf(age) else '{} for {:.1f} s'.format(self.silence, age)


class Sight(Enum):
    """The state of the sensors of a robot that is being driven."""

    FRESH = 'go on'
    SILENT = 'stand'
    BACK_SOON = 'fresh again after a short silence: go on, knowing that it stood'
    BACK_LATE = 'fresh again after a long silence: give up, the robot may be anywhere'


class SensorWatch:
    """Watches all sensors that a motion needs, and measures their silence during the motion."""

    def __init__(self, *sources: Freshness) -> None:
        self._sources = sources
        #: The Sight as of the last :meth:`update`. After a silence, exactly one update finds
        #: BACK_SOON or BACK_LATE.
        self.sight = Sight.SILENT
        #: The reason why the robot stands; '' while all sensors are fresh.
        self.hold_reason = ''
        #: Length of the last silence [s].
        self.silent_for = 0.0

    def update(self, now: float) -> None:
        """To be called at each step while the robot is being driven."""
        for source in self._sources:
            source.clock_went_back(now)
        if not (self.are_fresh(now) and self._have_begun):
            # The first reason is kept, so that it does not change with each further lost source.
            self.hold_reason = self.hold_reason or self.problem(now)
            self.sight = Sight.SILENT
            return
        self.hold_reason = ''
        gap = max(source.take_longest_gap() for source in self._sources)
        if gap <= min(source.timeout for source in self._sources):
            self.sight = Sight.FRESH
        else:
            self.silent_for = gap
            self.sight = Sight.BACK_SOON if gap <= RESUME_TIME else Sight.BACK_LATE

    def pause(self) -> None:
        """The robot is not being driven: no silence until now counts."""
        self.hold_reason = ''
        for source in self._sources:
            source.take_longest_gap()

    def problem(self, now: float, with_age: bool = False) -> str:
        """'' while all sensors are fresh, else the lost ones, in words.

        If one is lost, others that are overdue count as lost, too.
        """
        if self.are_fresh(now):
            return ''
        return ', '.join(source.silence_with_age(now) if with_age else source.silence
                         for source in self._sources if source.is_overdue(now))

    def are_fresh(self, now: float) -> bool:
        """True while all sensors are fresh."""
        return all(source.is_fresh(now) for source in self._sources)

    @property
    def _have_begun(self) -> bool:
        """Has each sensor sent more than one message?

        A TurtleBot3 that was just connected sends one, and calibrates its gyro then, for 2.6 s in
        which it must not move.
        """
        return all(source.count > 1 for source in self._sources)
