"""Quaternion <-> yaw: the one place where this package touches quaternions.

squaternion is w-first and checks nothing: another order of the parts, an all-zero quaternion or
one of norm 2 gives a plausible wrong yaw. So the parts are keywords here, and a quaternion that no
robot on a floor can have is invalid.

Units: radians. Edge case: a yaw is in (-pi, pi]. Source: squaternion (PyPI), REP-103 for the axes.
"""
import math
from typing import Tuple

from squaternion import Quaternion

#: A norm that differs from 1 by more than this is not a rounding error; a real TurtleBot3 sends
#: 0.999996.
NORM_TOLERANCE = 0.05
#: A driving robot is not tilted further than this [rad]. A quaternion whose parts are in a wrong
#: order shows a larger tilt.
MAX_TILT = math.radians(45.0)


def yaw_from_quaternion(*, w: float, x: float, y: float, z: float) -> float:
    """Heading [rad] of a robot that stands on a floor.

    Raises ``ValueError``, saying why, for NaN, infinity, a norm that is not 1, and a tilt of
    more than 45 degrees.
    """
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    if not abs(norm - 1.0) <= NORM_TOLERANCE:  # "not <=" also catches NaN
        raise ValueError('quaternion has norm {:.3g}, not 1'.format(norm))
    roll, pitch, yaw = Quaternion(w / norm, x / norm, y / norm, z / norm).to_euler()
    if abs(roll) > MAX_TILT or abs(pitch) > MAX_TILT:
        raise ValueError('quaternion is tilted by roll {:.0f}, pitch {:.0f} deg: no robot on its '
                         'wheels (or its parts are in the wrong order)'.format(
                             math.degrees(roll), math.degrees(pitch)))
    return math.pi if yaw <= -math.pi else yaw


def quaternion_from_yaw(yaw: float, roll: float = 0.0,
                        pitch: float = 0.0) -> Tuple[float, float, float, float]:
    """(w, x, y, z) of a heading and a tilt [rad]."""
    quaternion = Quaternion.from_euler(roll, pitch, yaw)
    return quaternion.w, quaternion.x, quaternion.y, quaternion.z
