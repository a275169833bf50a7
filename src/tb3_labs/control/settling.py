"""Does the robot rest, and where, as its samples show?

A robot has settled when its samples show it at rest for `SETTLING_TIME`, by the times at which they
were measured. One sample is not enough, however often it is looked at: it may be old, and the robot
elsewhere. The heading at rest is the mean of the samples: the more there are, the smaller is its
error.

Units: seconds on one clock, on which the samples were measured; radians.
"""
import math
from typing import Optional

#: A robot that is slower than this rests, as far as its samples show [m/s], [rad/s].
REST_LINEAR = 0.005
REST_ANGULAR = 0.03
#: Samples at rest must span this time [s], nearly one control period of the robot.
SETTLING_TIME = 0.03
#: In 95 of 100 cases the true value is within two standard errors of the mean.
STANDARD_ERRORS = 2.0


class Settling:
    """Watches the samples of one motion."""

    def __init__(self) -> None:
        #: When the first of the samples at rest was measured [s]; None while the robot moves.
        self.since: Optional[float] = None
        self._last = 0.0      # and the newest [s]

    def look(self, at_rest: bool, measured_at: float) -> None:
        """Take the newest sample in: does it show a robot at rest, and when was it measured?"""
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


class RestingMean:
    """The mean of a noisy angle that is measured of a robot at rest."""

    def __init__(self) -> None:
        self._sum, self._count = 0.0, 0

    def add(self, angle: float) -> None:
        """Take in a sample of the robot at rest [rad]."""
        self._sum += angle
        self._count += 1

    def mean_or(self, angle: float) -> float:
        """The mean of the samples at rest, or `angle` where there is none [rad]."""
        return self._sum / self._count if self._count else angle

    def uncertainty(self, noise: float) -> float:
        """The error that the mean may have [rad], given one sample's standard deviation; for a
        robot that moves it is that deviation."""
        return STANDARD_ERRORS * noise / math.sqrt(self._count) if self._count else noise
