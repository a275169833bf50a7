"""Wraps angles, clips numbers, and computes the headings of quaternions.

The library squaternion expects the order w, x, y, z and checks nothing. In another order, or with
a norm that is not 1, the numbers give a plausible but wrong yaw. So the four numbers of a
quaternion must be given by keyword.

Units: radians, counter-clockwise positive (REP-103). Edge cases: A wrapped angle or yaw is in
(-pi, pi], so half a turn is +pi. The angle NaN stays NaN. An infinite angle raises ``ValueError``.
"""
import math
from typing import Tuple

from squaternion import Quaternion

WHOLE_TURN = 2.0 * math.pi
NORM_TOLERANCE = 0.05    # a norm may differ from 1 by this; a real robot sends the norm 0.999996
#: A robot with a larger tilt [rad] would fall over, so the numbers must be in a wrong order.
MAX_TILT = math.radians(45.0)


def clamp(value: float, low: float, high: float) -> float:
    """Returns `value` clipped to [low, high]. NaN stays NaN."""
    return max(min(value, high), low)    # with this order of arguments NaN stays NaN


def wrap(angle: float) -> float:
    """Returns `angle` without whole turns, in (-pi, pi]."""
    wrapped = math.remainder(angle, WHOLE_TURN)
    return math.pi if wrapped <= -math.pi else wrapped


def difference(target: float, start: float) -> float:
    """Returns the turn from `start` to `target` the short way round, in (-pi, pi]."""
    return wrap(target - start)


def unwrap(angle: float, previous: float) -> float:
    """Returns `angle` plus the number of whole turns that brings it nearest to `previous`."""
    return previous + difference(angle, previous)


def interpolate_angle(start: float, end: float, fraction: float) -> float:
    """Returns the angle at a `fraction` (0 to 1) of the short turn from `start` to `end`."""
    return wrap(start + fraction * difference(end, start))


def yaw_from_quaternion(*, w: float, x: float, y: float, z: float) -> float:
    """Returns the heading [rad] of a quaternion. Raises ``ValueError`` if a number is NaN or
    infinite, if the norm is not 1, or if the tilt exceeds MAX_TILT."""
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    is_unit = abs(norm - 1.0) <= NORM_TOLERANCE    # False for NaN
    if not is_unit:
        raise ValueError(f'quaternion has norm {norm:.3g}, not 1')
    # these formulas compute the same as Quaternion.to_euler(), but three times as fast
    w, x, y, z = w / norm, x / norm, y / norm, z / norm
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(clamp(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    if abs(roll) > MAX_TILT or abs(pitch) > MAX_TILT:
        raise ValueError(f'quaternion is tilted by roll {math.degrees(roll):.0f}, pitch '
                         f'{math.degrees(pitch):.0f} deg: no robot on its wheels (or its parts are '
                         'in the wrong order)')
    return math.pi if yaw <= -math.pi else yaw


def quaternion_from_yaw(yaw: float, roll: float = 0.0,
                        pitch: float = 0.0) -> Tuple[float, float, float, float]:
    """Returns the quaternion (w, x, y, z) of the angles `yaw`, `roll` and `pitch` [rad]."""
    quaternion = Quaternion.from_euler(roll, pitch, yaw)
    return quaternion.w, quaternion.x, quaternion.y, quaternion.z
