"""Notices that a robot which is told to move does not get on.

Units: metres or radians for what remains, per second for speeds, seconds.
"""
import math

#: The robot counts as stuck when it did not get on for this long [s],
STALL_TIME = 1.3
#: "getting on" being at least this much [m or rad].
STALL_STEP = 0.004
#: The goal counts as missed when what remains grows again by this much: more than a hiccup of the
#: network lets the robot overshoot, half a second at full speed [m or rad].
AWAY_LIMIT = 0.8
#: A robot that is faster than this moves [m/s or rad/s].
MOVING = 0.005


class Progress:
    """Watches one stretch of way: a drive's state, or a turn."""

    def __init__(self):
        self._least = math.inf
        self._stalled_for = 0.0

    def complaint(self, remaining, measured, dt):
        """'' or what is wrong, given what remains now [m or rad], the measured speeds
        (``.linear``, ``.angular``) and the time since the last look [s].
        """
        remaining = abs(remaining)
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
