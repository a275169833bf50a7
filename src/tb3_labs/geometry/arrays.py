"""Angles and times in arrays, for recorded runs.

Units: radians. An infinite angle becomes NaN, and is not an error, since one invalid sample must
not hide the valid samples.
"""
import math
from typing import Any, Sequence, Union

import numpy as np

from tb3_labs.geometry.angles import MAX_TILT, NORM_TOLERANCE, WHOLE_TURN, euler


def wrap_all(angles: Union[float, Sequence[float], np.ndarray],
             whole_turn: float = WHOLE_TURN) -> np.ndarray:
    """Returns `angles`, an array of any shape, wrapped to (-pi, pi]. For angles in degrees,
    `whole_turn` is 360, and the result is in (-180, 180]."""
    angles = np.asarray(angles, dtype=float)
    half_turn = whole_turn / 2.0
    with np.errstate(invalid='ignore'):
        wrapped = np.minimum(angles - whole_turn * np.round(angles / whole_turn), half_turn)
        return np.where(wrapped <= -half_turn, half_turn, wrapped)


def yaws_from_quaternions(w: np.ndarray, x: np.ndarray, y: np.ndarray,
                          z: np.ndarray) -> np.ndarray:
    """Returns the headings of quaternions [rad]. The heading of an invalid quaternion is NaN."""
    with np.errstate(invalid='ignore', divide='ignore', over='ignore'):
        norm = np.sqrt(w * w + x * x + y * y + z * z)
        roll, pitch, yaw = euler(w / norm, x / norm, y / norm, z / norm)
        is_unit = np.abs(norm - 1.0) <= NORM_TOLERANCE
        is_level = (np.abs(roll) <= MAX_TILT) & (np.abs(pitch) <= MAX_TILT)
    yaw = np.where(yaw <= -math.pi, math.pi, yaw)
    return np.where(is_unit & is_level, yaw, math.nan)


def last_until(times: Any, time: Any) -> Any:
    """Returns the index of the latest of `times` that is at `time` or before; -1 if all are later.
    `times` are sorted. If `time` is an array, an array of indices is returned."""
    return np.searchsorted(times, time, side='right') - 1


def last_before(times: Any, time: Any) -> Any:
    """Returns the same as `last_until`, but leaves out times that equal `time`."""
    return np.searchsorted(times, time, side='left') - 1
