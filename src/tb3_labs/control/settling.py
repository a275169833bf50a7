"""Does the robot rest, as its samples show?

A robot has settled when its samples show it at rest for `SETTLING_TIME`, by the times at which they
were measured. One sample is not enough, even if it is read repeatedly: it may be old, and the robot
elsewhere.

Units: seconds on one clock, on which the samples were measured.
"""
from typing import Optional

#: A sample that is slower than this shows a robot at rest [m/s], [rad/s].
REST_LINEAR = 0.005
REST_ANGULAR = 0.03
#: Samples at rest must span this time, nearly one control period of the robot [s].
SETTLING_TIME = 0.03


class Settling:
    """Watches the samples of one motion."""

    def __init__(self) -> None:
        #: Time of the first of the samples at rest [s]; None while the robot moves.
        self.since: Optional[float] = None
        self._last = 0.0      # and of the latest [s]

    def look(self, at_rest: bool, measured_at: float) -> None:
        """Take in the latest sample: does it show a robot at rest, and when was it measured?"""
        if not at_rest:
            self.since = None
        elif self.since is None or measured_at < self.since:
            self.since = measured_at
        self._last = measured_at

    @property
    def rested_for(self) -> float:
        """Time that the samples at rest span [s]; 0 while the robot moves."""
        return self._last - self.since if self.since is not None else 0.0

    @property
    def rests(self) -> bool:
        """Has the robot settled?"""
        return self.rested_for >= SETTLING_TIME
