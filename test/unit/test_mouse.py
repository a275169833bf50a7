"""Mouse positions into velocities, by the numbers of the handout."""
import math

import pytest

from tb3_labs.nodes.mouse import mouse_twist, screen_position


@pytest.mark.parametrize('x, y, linear, angular', [
    (0.0, 0.0, 0.0, 0.0),
    (0.25, -0.25, 0.0, 0.0),          # the dead zone is closed
    (0.26, 0.0, 0.0, -0.13),          # right is clockwise
    (-0.5, 0.0, 0.0, 0.25),           # left is counter-clockwise
    (0.0, 0.5, 0.25, 0.0),            # up is forward
    (0.1, -1.0, -0.5, 0.0),           # straight back, although not quite in the middle
    (-1.0, 1.0, 0.5, 0.5),
    (1.7, -3.0, -0.5, -0.5),          # beyond the edge of the screen is its edge
])
def test_mouse(x, y, linear, angular):
    twist = mouse_twist(x, y)
    assert twist.linear == pytest.approx(linear)
    assert twist.angular == pytest.approx(angular)


@pytest.mark.parametrize('x, y', [(math.nan, 0.0), (0.0, math.inf), (-math.inf, math.nan)])
def test_a_position_that_is_none_is_refused(x, y):
    with pytest.raises(ValueError, match='not finite'):
        mouse_twist(x, y)


@pytest.mark.parametrize('pixel, position', [
    ((0, 0), (-1.0, 1.0)), ((1919, 1079), (1.0, -1.0)), ((1919, 0), (1.0, 1.0)),
    ((959.5, 539.5), (0.0, 0.0)), ((2500, -3), (1.0, 1.0))])
def test_pixels_are_scaled_over_the_whole_screen(pixel, position):
    assert screen_position(*pixel, 1920, 1080) == pytest.approx(position)
