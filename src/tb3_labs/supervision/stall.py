"""Does the robot obey? It is stalled if it is told to move and gets no nearer to its goal; it has
settled when its samples show it at rest.

Units: metres or radians for the remaining way, per second for speeds; seconds on one clock.
"""
import math
from typing import Optional

#: The robot counts as stalled when it got no nearer for this long while it was told to move [s].
STALL_TIME = 1.3
#: The robot got nearer if the remaining way is less by at least this much [m or rad].
STALL_STEP = 0.004
#: A drive waits for the robot to settle for at most this long, the sum of all its rests [s].
LONGEST_REST = 4.0
#: The goal counts as missed when the remaining way grows again by this much, half a second at full
#: speed [m or rad]. A short stall of the network makes the robot overshoot by less.
AWAY_LIMIT = 0.8
#: A robot that is faster than this moves [m/s or rad/s].
MOVING = 0.005
#: Samples at rest must span this time, nearly one control period of the robot [s].
SETTLING_TIME = 0.03


class StallWatch:
    """Watches the remaining way of one state of a drive, or of one turn."""

    def __init__(self) -> None:
        self._least: Optional[float] = math.inf    # None: the next remaining way is the least
        self._stalled_for = 0.0
        self._rested_for = 0.0
        self._problem = ''

    def resume(self) -> None:
        """The robot stood while its sensors were silent: its remaining way may have grown.

        The time for which it got no nearer is kept. Otherwise a stalled robot on a bad network
        would be driven for ever.
        """
        self._least = None

    def update(self, remaining: float, linear: float, angular: float, dt: float,
               told_to_move: bool = True) -> None:
        """Take in the remaining way [m or rad], the measured speeds [m/s, rad/s], the time since
        the last update [s], and whether the robot is told to move, or to rest.
        """
        if not told_to_move:
            self._rested_for += dt
            self._problem = '' if self._rested_for <= LONGEST_REST else (
                'the robot does not settle although it is told to rest (a noisy IMU?)')
            return
        remaining = abs(remaining)
        if self._least is None:
            self._least = remaining
        if remaining <= self._least - STALL_STEP:
            self._least = remaining
            self._stalled_for = 0.0
        else:
            self._stalled_for += dt
        if remaining <= self._least + AWAY_LIMIT and self._stalled_for <= STALL_TIME:
            self._problem = ''
        elif abs(linear) > MOVING or abs(angular) > MOVING:
            self._problem = 'the robot moves, but no longer nearer to its goal: it has missed it'
        else:
            self._problem = (
                'the robot does not move although it is told to (stuck, or motors off?)')

    def problem(self) -> str:
        """The problem that the last update found; '' if it found none."""
        return self._problem


class Settling:
    """Has the robot been at rest for `SETTLING_TIME`, by the samples of one motion?

    Their times of measurement decide: a sample that is read again may be old.
    """

    def __init__(self) -> None:
        #: Time of the first of the samples at rest [s]; None while the robot moves.
        self.since: Optional[float] = None
        self._last = 0.0      # time of the latest sample [s]

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
