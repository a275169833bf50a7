"""Is a source alive? It is lost if it is silent, and frozen if it repeats one reading.

The arrivals of the messages show a silence; their stamps do not. The readings of a working sensor
always change while the robot moves; those of a driver that hangs do not.

Units: seconds on the receiver's clock (`now`), m/s, rad/s. Edge cases: a source that was never
heard has an infinite age. If the clock goes back, the last message counts as just received;
otherwise it would count as fresh for too long.
"""
import math
from enum import Enum
from typing import Any, Optional

#: A sensor that is silent for longer than this is lost [s]; a robot at full speed drives 5 cm in
#: this time.
SENSOR_TIMEOUT = 0.22
#: A motion goes on by itself after a silence of the sensors up to this long [s]. Whatever is asked
#: for in a silence (a grant, a goal, a turn) is void if the silence goes on for longer than this,
RESUME_TIME = 2.0
#: or than this if the robot was never there: its board needs up to 14 s to start [s].
ROBOT_START = 20.0
#: The reason why a robot stands whose sensors are fresh.
UNCHECKED = 'gyro and wheels are not compared yet: the robot must rest for a second'
#: A sensor that repeats itself for longer than this, though the robot is told to move, is frozen
#: [s]. A slow network and slow motors delay the motion by less.
FROZEN_TIME = 0.6
#: If the robot is told to drive faster than this, the readings must show a motion [m/s].
SURELY_DRIVES = 0.02
#: If the robot is told to turn faster than this, the readings must show a motion [rad/s].
SURELY_TURNS = 0.1


class Freshness:
    """Remembers when one source was last heard."""

    def __init__(self, name: str, timeout: float = SENSOR_TIMEOUT) -> None:
        self.name = name
        self.timeout = timeout
        #: Number of valid messages so far, and of invalid ones, which were dropped.
        self.count = self.dropped = 0
        #: Contents of the last message, without its stamp.
        self.reading: Any = None
        #: The reading has not changed for this long, although it must change [s].
        self.repeated_for = 0.0
        self._heard_at: Optional[float] = None
        self._longest_gap = 0.0
        self._is_new = False

    def heard(self, now: float, reading: Any = None) -> None:
        """A valid message arrived at `now`."""
        if self._heard_at is not None and self.count > 1:
            self._longest_gap = max(self._longest_gap, now - self._heard_at)
        self._heard_at = now
        self.count += 1
        if reading != self.reading:
            self.reading, self._is_new = reading, True

    def look(self, must_change: bool, dt: float) -> None:
        """Note whether the reading changed in the last `dt` [s]; `must_change`: it had to."""
        self.repeated_for = self.repeated_for + dt if must_change and not self._is_new else 0.0
        self._is_new = False

    def take_longest_gap(self) -> float:
        """The longest silence between two messages since the last call [s]; a sleep is one, too."""
        gap, self._longest_gap = self._longest_gap, 0.0
        return gap

    def clock_went_back(self, now: float) -> None:
        """The receiver's clock may have gone back to `now`."""
        if self._heard_at is not None:
            self._heard_at = min(self._heard_at, now)

    def age(self, now: float) -> float:
        """Seconds since the last message; infinite before the first."""
        return math.inf if self._heard_at is None else max(0.0, now - self._heard_at)

    def is_fresh(self, now: float) -> bool:
        """True while the last message is at most `timeout` old."""
        return self.age(now) <= self.timeout

    @property
    def silence(self) -> str:
        """The text for a source that is not fresh: 'no imu', or 'no imu yet'."""
        return 'no {}{}'.format(self.name, ' yet' if self._heard_at is None else '')

    def silence_with_age(self, now: float) -> str:
        """The text of `silence` with its duration: 'no imu for 1.2 s'."""
        age = self.age(now)
        return self.silence if math.isinf(age) else '{} for {:.1f} s'.format(self.silence, age)


class Sight(Enum):
    """The state of the sensors of a robot that is being driven."""

    FRESH = 'go on'
    SILENT = 'stand'
    BACK_SOON = 'fresh again after a short silence: go on, knowing that it stood'
    LATE = 'silent for too long, or fresh again after that: give up, the robot may be anywhere'


class SensorWatch:
    """Watches all sensors that a motion needs: finds silent ones, and ones that repeat a reading.

    The owner of the motion calls Freshness.look for the readings.
    """

    def __init__(self, *sources: Freshness) -> None:
        self._sources = sources
        #: The state at the last :meth:`update`. After a silence one update finds BACK_SOON or LATE.
        self.sight = Sight.SILENT
        #: The reason why the robot stands; '' while all sensors are fresh.
        self.hold_reason = ''
        #: Length of the last silence [s]. It begins anew when a motion is asked for.
        self.silent_for = 0.0
        self._patience = ROBOT_START    # longest time that a motion waits for the sensors [s]
        self._since = math.nan          # beginning of the silence; NaN: the next update
        self._were_fresh = False        # at the last update

    def ask(self) -> None:
        """A person or program asks for a motion now."""
        self._since = math.nan

    def update(self, now: float, is_checked: bool = True) -> None:
        """To be called repeatedly, also at each step while the robot is being driven. `is_checked`:
        False until gyro and wheels were compared. A motion waits for this, too, for as long again.
        """
        for source in self._sources:
            source.clock_went_back(now)
        self._since = now if math.isnan(self._since) else min(now, self._since)
        silent_for = now - self._since
        is_late = silent_for > self._patience
        are_fresh = self.are_fresh(now) and self._have_begun
        if are_fresh and (is_checked or not self._were_fresh):
            self._since = now - max(source.age(now) for source in self._sources)
            self._patience = RESUME_TIME
        self._were_fresh = are_fresh
        if not (are_fresh and is_checked):
            # The first reason is kept, so that it does not change with each further lost source.
            self.hold_reason = UNCHECKED if are_fresh else self.hold_reason or self.problem(now)
            self.sight, self.silent_for = Sight.LATE if is_late else Sight.SILENT, silent_for
            return
        self.hold_reason = ''
        gap = max(source.take_longest_gap() for source in self._sources)
        if gap <= min(source.timeout for source in self._sources) and not is_late:
            self.sight = Sight.FRESH
            return
        self.sight, self.silent_for = (
            (Sight.LATE, silent_for) if is_late else (Sight.BACK_SOON, gap))
        self.pause()

    def pause(self) -> None:
        """The robot stood until now: forget silences and repetitions."""
        self.hold_reason = ''
        for source in self._sources:
            source.take_longest_gap()
            source.repeated_for = 0.0

    def problem(self, now: float, with_age: bool = False) -> str:
        """The lost sensors, in words; '' while all sensors are fresh.

        If one is lost, others that are silent for half their timeout count as lost, too.
        """
        if self.are_fresh(now):
            return ''
        return ', '.join(source.silence_with_age(now) if with_age else source.silence
                         for source in self._sources if source.age(now) > 0.5 * source.timeout)

    def frozen(self) -> str:
        """The sensors that are frozen, in words; '' if none is."""
        return ' and '.join(
            '{} repeats one reading though the robot is told to move (its driver '
            'hangs?)'.format(source.name)
            for source in self._sources if source.repeated_for > FROZEN_TIME)

    def are_fresh(self, now: float) -> bool:
        """True while all sensors are fresh."""
        return all(source.is_fresh(now) for source in self._sources)

    @property
    def _have_begun(self) -> bool:
        """Has each sensor sent more than one message?

        A TurtleBot3 that was just connected sends one message. Then it calibrates its gyro for
        2.6 s, in which it must not move.
        """
        return all(source.count > 1 for source in self._sources)
