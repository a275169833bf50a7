"""Angles on the circle, and numbers kept within limits.

Units: radians, counter-clockwise positive. Edge cases: a wrapped angle is in (-pi, pi], so that
exactly half a turn is +pi. NaN stays NaN. Infinity raises ``ValueError`` (from
:func:`math.remainder`).
"""
import math

WHOLE_TURN = 2.0 * math.pi


def clamp(value: float, low: float, high: float) -> float:
    """`value` clipped to [low, high]; NaN stays NaN (min and max would make it a limit)."""
    return value if math.isnan(value) else max(low, min(high, value))


def wrap(angle: float) -> float:
    """The same direction as `angle`, in (-pi, pi]."""
    wrapped = math.remainder(angle, WHOLE_TURN)
    return math.pi if wrapped <= -math.pi else wrapped


def difference(target: float, start: float) -> float:
    """The turn from `start` to `target` the short way round, in (-pi, pi]."""
    return wrap(target - start)


def continuous(angle: float, previous: float) -> float:
    """`angle` plus the whole turns that bring it nearest to `previous`: no jump at +/-pi."""
    return previous + difference(angle, previous)


def interpolate_angle(start: float, end: float, fraction: float) -> float:
    """The angle `fraction` (0 to 1) of the short way from `start` to `end`, in (-pi, pi]."""
    return wrap(start + fraction * difference(end, start))
