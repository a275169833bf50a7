"""Angles on the circle.

Units: radians, counter-clockwise positive, except where a name ends in ``degrees``.
Edge cases: the half-open interval is (-pi, pi], so that exactly half a turn is +pi;
a compass heading is in [0, 360) and never shows 360.0. NaN stays NaN, infinity raises
``ValueError`` (from :func:`math.remainder`).
"""
import math

TURN = 2.0 * math.pi
#: Half a step of a 32-bit number below 360, and a little [deg].
ROUNDING = 1.6e-5


def wrap(angle):
    """The same direction as `angle`, in (-pi, pi]."""
    wrapped = math.remainder(angle, TURN)
    return math.pi if wrapped <= -math.pi else wrapped


def difference(target, start):
    """The turn from `start` to `target` the short way round, in (-pi, pi]."""
    return wrap(target - start)


def continuous(angle, previous):
    """`angle` plus the whole turns that bring it nearest to `previous`.

    Fed with one sample after the other this undoes the jump at +/-pi, as long as two
    samples are less than half a turn apart.
    """
    return previous + difference(angle, previous)


def compass_degrees(yaw):
    """`yaw` in radians as the lab's heading: degrees in [0, 360).

    What would round up to 360, printed by %f or sent as a 32-bit number, is 0.
    """
    heading = math.degrees(wrap(yaw)) % 360.0
    return 0.0 if heading >= 360.0 - ROUNDING else heading
