"""The position of the mouse does not depend on the size of the screen."""
import runpy

import pytest
from pages import SCRIPTS

screen_position = runpy.run_path(str(SCRIPTS / 'mouse_client.py'))['screen_position']


@pytest.mark.parametrize('pixel, size, position', [
    ((0, 0), (1920, 1080), (-1.0, 1.0)), ((1919, 1079), (1920, 1080), (1.0, -1.0)),
    ((959.5, 539.5), (1920, 1080), (0.0, 0.0)), ((2500, -3), (1920, 1080), (1.0, 1.0)),
    ((0, 0), (1, 1), (-1.0, 1.0)), ((1, 1), (1, 1), (1.0, -1.0))])
def test_a_pixel_is_scaled_over_the_whole_screen(pixel, size, position):
    assert screen_position(*pixel, *size) == pytest.approx(position)
