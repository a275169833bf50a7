"""Angles in arrays, and in degrees, as recorded runs have them.

Units: radians, except in ``difference_degrees``. Edge case: infinity becomes NaN, since one invalid
sample must not hide the others.
"""
import math
from typing import Sequence, Union

import numpy as np

from tb3_labs.geometry.angles import WHOLE_TURN

#: One number or many, in any form that numpy takes.
Numbers = Union[float, Sequence[float], np.ndarray]


def wrap_all(angles: Numbers) -> np.ndarray:
    """:func:`wrap` for an array of any shape."""
    angles = np.asarray(angles, dtype=float)
    with np.errstate(invalid='ignore'):
        wrapped = np.minimum(angles - WHOLE_TURN * np.round(angles / WHOLE_TURN), math.pi)
        return np.where(wrapped <= -math.pi, math.pi, wrapped)


def difference_degrees(target: float, start: float) -> float:
    """The turn from `start` to `target` the short way round, in (-180, 180] [deg]."""
    turn = math.remainder(target - start, 360.0)
    return 180.0 if turn <= -180.0 else turn


def continuous_at(at: Numbers, times: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """The angles at the times `at`, interpolated between the samples `angles`, shape (n,).

    There are no jumps at +/-pi. Before the first sample the first angle holds, after the last
    sample the last one.
    """
    return np.interp(np.asarray(at, dtype=float), times, np.unwrap(angles))
