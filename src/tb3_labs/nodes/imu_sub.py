"""The heading that the IMU exercise prints.

Edge case: a heading is in [0, 360) and never shows 360.0.
"""
import math

from tb3_labs.geometry.angles import wrap

#: A little more than half a step of a 32-bit number below 360 [deg].
HALF_STEP = 1.6e-5


def compass_degrees(yaw: float) -> float:
    """`yaw` in radians as the lab's heading: degrees in [0, 360).

    A heading that would round up to 360, printed by %f or sent as a 32-bit number, is 0.
    """
    heading = math.degrees(wrap(yaw)) % 360.0
    return 0.0 if heading >= 360.0 - HALF_STEP else heading
