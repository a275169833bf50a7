"""Angles on the circle, and numbers kept within limits.

Units: radians, counter-clockwise positive, except where a name ends in ``degrees``.
Edge cases: a wrapped angle is in (-pi, pi], so that exactly half a turn is +pi. NaN stays NaN.
Infinity raises ``ValueError`` (from :func:`math.remainder`). In an array infinity becomes NaN,
since one invalid sample must not hide the others.
"""
import math
from typing import Sequence, Union

import numpy as np

WHOLE_TURN = 2.0 * math.pi
#: One number or many, in any form that numpy takes.
Numbers = Union[float, Sequence[float], np.ndarray]


def clamp(value: float, low: float, high: float) -> float:
    """`value` clipped to [low, high]; NaN stays NaN (min and max would make it a limit)."""
    return value if math.isnan(value) else max(low, min(high, value))


def wrap(angle: float) -> float:
    """The same direction as `angle`, in (-pi, pi]."""
    wrapped = math.remainder(angle, WHOLE_TURN)
    return math.pi if wrapped <= -math.pi else wrapped


def wrap_all(angles: Numbers) -> np.ndarray:
    """:func:`wrap` for an array of any shape."""
    angles = np.asarray(angles, dtype=float)
    with np.errstate(invalid='ignore'):
        wrapped = np.minimum(angles - WHOLE_TURN * np.round(angles / WHOLE_TURN), math.pi)
        return np.where(wrapped <= -math.pi, math.pi, wrapped)


def difference(target: float, start: float) -> float:
    """The turn from `start` to `target` the short way round, in (-pi, pi]."""
    return wrap(target - start)


def difference_degrees(target: float, start: float) -> float:
    """The turn from `start` to `target` the short way round, in (-180, 180] [deg]."""
    turn = math.remainder(target - start, 360.0)
    return 180.0 if turn <= -180.0 else turn


def continuous(angle: float, previous: float) -> float:
    """`angle` plus the whole turns that bring it nearest to `previous`: no jump at +/-pi."""
    return previous + difference(angle, previous)


def interpolate_angle(start: float, end: float, fraction: float) -> float:
    """The angle `fraction` (0 to 1) of the short way from `start` to `end`, in (-pi, pi]."""
    return wrap(start + fraction * difference(end, start))


def continuous_at(at: Numbers, times: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """The angles at the times `at`, interpolated between the samples `angles`, shape (n,).

    There are no jumps at +/-pi. Before the first sample the first angle holds, after the last
    sample the last one.
    """
    return np.interp(np.asarray(at, dtype=float), times, np.unwrap(angles))
