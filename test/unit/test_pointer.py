"""The place of the mouse on the screen, whatever the size of the screen."""
import runpy

import pytest
from pages import SCRIPTS

screen_position = runpy.run_path(str(SCRIPTS / 'mouse_client.py'))['screen_position']


@pytest.mark.parametrize('pixel, position', [
    ((0, 0), (-1.0, 1.0)), ((1919, 1079), (1.0, -1.0)), ((1919, 0), (1.0, 1.0)),
    ((959.5, 539.5), (0.0, 0.0)), ((2500, -3), (1.0, 1.0)),
    ((-3, 2500), (-1.0, -1.0))])
def test_pixels_are_scaled_over_the_whole_screen(pixel, position):
    assert screen_position(*pixel, 1920, 1080) == pytest.approx(position)


def test_a_screen_of_one_pixel_has_edges():
    assert screen_position(0, 0, 1, 1) == (-1.0, 1.0) and screen_position(1, 1, 1, 1) == (1.0, -1.0)
