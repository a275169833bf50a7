"""Does the robot rest, and where, as its samples show?

A robot rests when samples say so that were measured one after the other for `SETTLING_TIME`. One
sample is not enough, however often it is looked at: it may be old, and the robot elsewhere. While
the robot rests its heading is the mean of the samples, which is known the better the more there
are.

Units: seconds on one clock, on which the samples were measured; radians.
"""
import math

#: A robot that is slower than this rests, as far as its samples show [m/s], [rad/s].
REST_LINEAR = 0.005
REST_ANGULAR = 0.03
#: Samples at rest must span this time [s], nearly one control period of the robot.
SETTLING_TIME = 0.03
#: Two standard errors hold the truth in 95 of 100 cases.
STANDARD_ERRORS = 2.0


class Settling:
    """Watches the samples of one motion."""

    def __init__(self):
        #: When the first of the samples at rest was measured [s]; None while the robot moves.
        self.since = None
        self._last = None     # and the newest

    def look(self, at_rest, measured_at):
        """Take the newest sample in: does it show a robot at rest, and when was it measured?"""
        if not at_rest:
            self.since = None
        elif self.since is None or measured_at < self.since:
            self.since = measured_at
        self._last = measured_at

    @property
    def rested_for(self):
        """Time that the samples at rest span [s]; 0 while the robot moves."""
        return self._last - self.since if self.since is not None else 0.0

    @property
    def rests(self):
        """Is the robot at rest for good?"""
        return self.rested_for >= SETTLING_TIME


class RestingMean:
    """The mean of a noisy angle that is measured of a robot at rest."""

    def __init__(self):
        self._sum, self._count = 0.0, 0

    def add(self, angle):
        """Take in a sample of the robot at rest [rad]."""
        self._sum += angle
        self._count += 1

    def mean_or(self, angle):
        """The mean of the samples at rest, or `angle` where there is none [rad]."""
        return self._sum / self._count if self._count else angle

    def uncertainty(self, noise):
        """By so much the mean may be off [rad], given one sample's standard deviation; that itself
        for a robot that moves."""
        return STANDARD_ERRORS * noise / math.sqrt(self._count) if self._count else noise
