"""From a hand to a velocity.

Units: positions from -1 to 1, x to the right, y up; speeds in m/s and rad/s, left positive.
Source: the IMU lab's handout for the mouse.
"""
import math

from tb3_labs.control.speed_laws import Twist2, clamp

#: Nearer to the middle of the screen than this, in each direction, the mouse means nothing.
MOUSE_DEAD_ZONE = 0.25
#: What the edge of the screen means [m/s], [rad/s]; more than a robot drives, which clips it.
MOUSE_FULL = 0.5


def mouse_twist(x, y):
    """The velocity a mouse at (x, y) asks for: up is forward, left is left.

    Each direction has its own dead zone, the closed interval +/-MOUSE_DEAD_ZONE; outside of it
    the position counts from the middle. Beyond the screen's edge is as at the edge; a position
    that is not finite raises ``ValueError``.
    """
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError('mouse position ({}, {}) is not finite'.format(x, y))
    return Twist2(_scaled(y), _scaled(-x))


def screen_position(pixel_x, pixel_y, width, height):
    """A pixel (counted from the top left corner) as a position on a screen of that size."""
    return (clamp(2.0 * pixel_x / max(width - 1, 1) - 1.0, -1.0, 1.0),
            clamp(1.0 - 2.0 * pixel_y / max(height - 1, 1), -1.0, 1.0))


def _scaled(position):
    if abs(position) <= MOUSE_DEAD_ZONE:
        return 0.0
    return MOUSE_FULL * clamp(position, -1.0, 1.0)
