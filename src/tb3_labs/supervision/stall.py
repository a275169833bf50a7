"""Notices that a robot which is told to move does not get nearer to its goal.

Units: metres or radians for the way that remains, per second for speeds, seconds.
"""
import math
from typing import Optional

#: The robot counts as stuck when it got no nearer for this long while it was told to move [s],
STALL_TIME = 1.3
#: "nearer" being at least this much [m or rad].
STALL_STEP = 0.004
#: A robot that is told to rest settles within this time, all rests taken together [s].
LONGEST_REST = 4.0
#: The goal counts as missed when the way that remains grows again by this much: more than a hiccup
#: of the network lets the robot overshoot, half a second at full speed [m or rad].
AWAY_LIMIT = 0.8
#: A robot that is faster than this moves [m/s or rad/s].
MOVING = 0.005


class Progress:
    """Watches one stretch of way: a drive's state, or a turn."""

    def __init__(self) -> None:
        self._least: Optional[float] = math.inf
        self._stalled_for = 0.0
        self._rested_for = 0.0

    def resume(self):
        """The robot stood for a moment because its sensors were silent.

        What remains may have grown meanwhile. The time for which the robot got no nearer goes on
        counting, or a stuck robot on a bad network would be driven for ever.
        """
        self._least = None

    def complaint(self, remaining, measured, dt, told_to_move=True):
        """'' or what is wrong, given what remains now [m or rad], the measured speeds
        (``.linear``, ``.angular``), the time since the last look [s], and whether the robot is told
        to move, or to rest.
        """
        if not told_to_move:
            self._rested_for += dt
            return '' if self._rested_for <= LONGEST_REST else (
                'the robot does not settle although it is told to rest (a noisy IMU?)')
        remaining = abs(remaining)
        if self._least is None:
            self._least = remaining
        if remaining <= self._least - STALL_STEP:
            self._least = remaining
            self._stalled_for = 0.0
            return ''
        self._stalled_for += dt
        if remaining <= self._least + AWAY_LIMIT and self._stalled_for <= STALL_TIME:
            return ''
        if abs(measured.linear) > MOVING or abs(measured.angular) > MOVING:
            return 'the robot moves, but no longer nearer to its goal: it has missed it'
        return 'the robot does not move although it is told to (stuck, or motors off?)'
