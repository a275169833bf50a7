"""The dead man switch of pages: one page drives, until its person lets go or the page is lost.

A page is a pad in a browser. Several may be open, but the node `gamepad` reads one pad. A DeadMan
counts the stops: STOP on any page, a False on `ctrl_relinq`, a cancel, the loss of the page that
drives. Each message of a page has the number of stops that the page knew when its person acted. If
the robot was stopped since, or this process slept, the message is rejected: neither a delayed
message nor a page that comes back moves a robot, or its frame. A page's stop is never rejected.

Units: seconds on a clock that never stands still and never goes back (`now`).
"""
from typing import Optional

from tb3_labs.supervision.timeouts import PAD_TIMEOUT, Freshness, SleepWatch


class DeadMan:
    """Knows which page drives. Any object can identify a page."""

    def __init__(self) -> None:
        #: The page that drives, or None.
        self.page: Optional[object] = None
        #: The number of stops so far.
        self.stops = 0
        self._source = Freshness('page', PAD_TIMEOUT)
        self._sleep = SleepWatch()

    def begin(self, now: float) -> None:
        """Begin with a first page: from now on :meth:`silence` is called often."""
        self._sleep.start(now)

    def check(self, known_stops: Optional[int], now: float, lateness: float, most: float) -> None:
        """Raises ``ValueError`` if the robot was stopped after a person's act with `known_stops`,
        or if the act is, or may be, older than `most` [s]."""
        self._sleep.update(now)
        if known_stops != self.stops:
            raise ValueError('the robot was stopped meanwhile: let go, and ask again')
        if lateness > most:
            raise ValueError(f'this came {lateness:.1f} s late, and does not count: ask again')
        if self._sleep.doubt:
            raise ValueError(f'this does not count, {self._sleep.doubt}: ask again')

    def hold(self, page: object, known_stops: Optional[int], now: float, lateness: float,
             is_first: bool) -> bool:
        """Let `page`, which a person grips, drive. Raises ``ValueError`` if it may not drive.

        `lateness`: the delay of the message [s]. If it is more than `PAD_TIMEOUT`, the message is
        ignored (False): late messages are treated as silence. `is_first`: is it the first message
        of this grip? If the first one is missing, the robot would begin to move later than the
        person expects.
        """
        if lateness > PAD_TIMEOUT:
            return False
        self.check(known_stops, now, lateness, PAD_TIMEOUT)
        if self.page not in (None, page):
            raise ValueError('another page drives: it must let go first, or be stopped')
        if self.page is None and not is_first:
            raise ValueError('the begin of this grip came late: let go, and grip again')
        self.page = page
        self._source.received(now)
        return True

    def let_go(self, page: object) -> bool:
        """End the grip on `page`. Returns whether this page drove."""
        drove = self.page is page
        if drove:
            self.page = None
        return drove

    def stop(self) -> None:
        """Count a stop: no page drives until a person acts again."""
        self.stops += 1
        self.page = None

    def silence(self, now: float) -> float:
        """Returns for how long the page that drives was silent, if it is lost [s]; else 0."""
        self._sleep.update(now)
        is_lost = self.page is not None and not self._source.is_fresh(now)
        return self._source.age(now) if is_lost else 0.0
