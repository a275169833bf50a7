"""The search for a time in a sorted array of times."""
from typing import Any

import numpy as np


def last_until(times: Any, time: Any) -> Any:
    """Returns the index of the last of `times` that is not after `time`; -1 if all are after it.
    `times` are sorted. If `time` is an array, an array of indices is returned."""
    return np.searchsorted(times, time, side='right') - 1


def last_before(times: Any, time: Any) -> Any:
    """Returns the same as `last_until`, but leaves out times that equal `time`."""
    return np.searchsorted(times, time, side='left') - 1
