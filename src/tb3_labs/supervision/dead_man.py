"""The dead man switch of pages: a page drives until the person lets go or the page is lost.

A page is a gamepad in a browser. Several pages may be open. A DeadMan counts the stops. The robot
is stopped by STOP on a page, by a False on `ctrl_relinq`, by a cancel, or by the loss of the page
that drives. Each message of a page contains the number of stops that the page knew when the person
acted. A message is rejected if the robot was stopped, or this process slept, after the person
acted. So a delayed message cannot move the robot or reset its pose. Nor can a page that was lost
and comes back. No stop is rejected.
"""
from typing import Optional

from tb3_labs.supervision.timeouts import INPUT_TIMEOUT, Freshness, SleepMonitor


class DeadMan:
    """Remembers the page that drives. Any object may stand for a page."""

    def __init__(self) -> None:
        self.driving_page: Optional[object] = None
        self.stops = 0    # number of stops so far
        self._freshness = Freshness('page', INPUT_TIMEOUT)
        self._sleep = SleepMonitor()

    def start(self, now: float) -> None:
        """Call this when the first page opens. Then call :meth:`driving_page_lost_for` often."""
        self._sleep.start(now)

    def refuse_if_old(self, known_stops: Optional[int], now: float, lateness: float,
                      max_lateness: float) -> None:
        """Raises ``ValueError`` if a person's message must be rejected. `known_stops` is the number
        of stops that the person knew. `lateness` is the delay [s] of the message."""
        self._sleep.update(now)
        if known_stops != self.stops:
            raise ValueError('the robot was stopped meanwhile: let go, and ask again')
        if lateness > max_lateness:
            raise ValueError(f'this came {lateness:.1f} s late, and does not count: ask again')
        if self._sleep.reason_to_refuse:
            raise ValueError(f'this does not count, {self._sleep.reason_to_refuse}: ask again')

    def hold(self, page: object, known_stops: Optional[int], now: float, lateness: float,
             is_first: bool) -> bool:
        """Let `page` drive. Raises ``ValueError`` if the page must not drive.

        `lateness` is the delay [s] of the message. If the delay is more than `INPUT_TIMEOUT`, the
        message counts as silence, and the method returns False. `is_first` is True for the first
        message since the person took hold. If this first message was lost, the page must not
        drive, because the drive would begin too late.
        """
        if lateness > INPUT_TIMEOUT:
            return False
        self.refuse_if_old(known_stops, now, lateness, max_lateness=INPUT_TIMEOUT)
        if self.driving_page not in (None, page):
            raise ValueError('another page drives: it must let go first, or be stopped')
        if self.driving_page is None and not is_first:
            raise ValueError('the start of this grip came late: let go, and grip again')
        self.driving_page = page
        self._freshness.on_message(now)
        return True

    def let_go(self, page: object) -> bool:
        """Let `page` drive no longer. Returns False if another page drives, or none."""
        if self.driving_page is not page:
            return False
        self.driving_page = None
        return True

    def stop(self) -> None:
        """Count a stop. After a stop, a page drives only if a person acts again."""
        self.stops += 1
        self.driving_page = None

    def driving_page_lost_for(self, now: float) -> float:
        """Returns for how long [s] the driving page has been silent; 0 if it is not lost."""
        self._sleep.update(now)
        if self.driving_page is None or self._freshness.is_fresh(now):
            return 0.0
        return self._freshness.age(now)
