"""Does a node command what a stick or a mouse asks for?"""
from typing import Tuple

import numpy as np

#: The columns of a command.
LINEAR, ANGULAR = 1, 2
UNITS = {LINEAR: 'm/s', ANGULAR: 'rad/s'}
#: The other column of a command must be smaller than this [m/s] or [rad/s].
NEAR = 0.05
#: What rounding may add to a limit [m/s] or [rad/s].
ROUNDING = 0.005


def steers(commands: np.ndarray, name: str, column: int, bounds: Tuple[float, float]) -> str:
    """'' if the latest command is within `bounds` and commands nothing else, else what it was.

    `commands` has rows of time, linear [m/s], angular [rad/s]; `name` is the stimulus; `column` is
    LINEAR or ANGULAR; `bounds` are the least and the greatest value, both allowed.
    """
    if not len(commands) or not commands[-1, 1:].any():
        return 'with the {} nothing was commanded'.format(name)
    low, high = bounds
    other = LINEAR + ANGULAR - column
    if low <= commands[-1, column] <= high and abs(commands[-1, other]) <= NEAR:
        return ''
    return '{}, where {:.2f} to {:.2f} {} and nothing else were asked for'.format(
        'with the {} it commanded {:.2f} m/s and {:.2f} rad/s'.format(name, *commands[-1, 1:]),
        low, high, UNITS[column])


def opposite(bounds: Tuple[float, float]) -> Tuple[float, float]:
    """The same bounds in the opposite direction: backward, or right."""
    low, high = bounds
    return -high, -low
