"""Computes with arrays of angles and of times, which come from recorded runs.

Units: radians. An infinite angle becomes NaN and raises no error, so that one invalid sample does
not hide the valid samples.
"""
from typing import Any, Sequence, Tuple, Union

import numpy as np

from tb3_labs.geometry.angles import WHOLE_TURN


def wrap_all(angles: Union[float, Sequence[float], np.ndarray],
             whole_turn: float = WHOLE_TURN) -> np.ndarray:
    """Returns `angles`, an array of any shape, wrapped to (-pi, pi]. For angles in degrees,
    `whole_turn` is 360, and the result is in (-180, 180]."""
    angles = np.asarray(angles, dtype=float)
    half_turn = whole_turn / 2.0
    with np.errstate(invalid='ignore'):
        wrapped = angles - whole_turn * np.round(angles / whole_turn)
        wrapped = np.clip(wrapped, -half_turn, half_turn)    # rounding may exceed the bounds
        return np.where(wrapped == -half_turn, half_turn, wrapped)


def euler_angles(w: np.ndarray, x: np.ndarray, y: np.ndarray,
                 z: np.ndarray) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns roll, pitch and yaw [rad] of quaternions."""
    return (np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)),
            np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def index_at_or_before(times: Any, time: Any) -> Any:
    """Returns the index of the latest entry in the sorted `times` that is not after `time`; -1 if
    all entries are later. For an array of times, returns an array of indices."""
    return np.searchsorted(times, time, side='right') - 1


def index_before(times: Any, time: Any) -> Any:
    """Returns the index of the latest entry in the sorted `times` that is before `time`, or -1."""
    return np.searchsorted(times, time, side='left') - 1
