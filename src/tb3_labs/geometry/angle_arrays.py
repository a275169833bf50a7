"""Angles in arrays, and in degrees, as recorded runs have them.

Units: radians, except in ``difference_degrees``. Edge case: infinity becomes NaN, since one invalid
sample must not hide the others.
"""
import math
from typing import Sequence, Union

import numpy as np

from tb3_labs.geometry.angles import WHOLE_TURN


def wrap_all(angles: Union[float, Sequence[float], np.ndarray]) -> np.ndarray:
    """:func:`wrap` for an array of any shape."""
    angles = np.asarray(angles, dtype=float)
    with np.errstate(invalid='ignore'):
        wrapped = np.minimum(angles - WHOLE_TURN * np.round(angles / WHOLE_TURN), math.pi)
        return np.where(wrapped <= -math.pi, math.pi, wrapped)


def difference_degrees(target: float, start: float) -> float:
    """The shortest turn from `start` to `target`, in (-180, 180] [deg]."""
    turn = math.remainder(target - start, 360.0)
    return 180.0 if turn <= -180.0 else turn
