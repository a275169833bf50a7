"""The heading of the IMU exercise: from 0 up to 360, never 360 itself."""
import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from known_motion import angle_between
from tb3_labs.geometry.angles import TURN
from tb3_labs.localization.heading import compass_degrees


@pytest.mark.parametrize('yaw_deg, heading', [
    (0, 0), (90, 90), (180, 180), (-180, 180), (-90, 270), (-1, 359), (360, 0), (-360, 0),
    (720, 0), (450, 90)])
def test_compass(yaw_deg, heading):
    assert compass_degrees(math.radians(yaw_deg)) == pytest.approx(heading, abs=1e-9)


@given(st.floats(-100.0, 100.0))
def test_compass_tells_the_direction(yaw):
    # what would round up to 360 is 0, which is 2.7e-7 rad away
    assert angle_between(math.radians(compass_degrees(yaw)), yaw) < 3e-7


@given(st.floats(-100.0, 100.0))
@example(-1e-17)
@example(-5e-324)
@example(-TURN)
@example(-2e-16)
def test_compass_is_never_360(yaw):
    assert 0.0 <= compass_degrees(yaw) < 360.0


@pytest.mark.parametrize('yaw', [-1e-16, -1e-12, -1e-9, -5e-9, TURN - 5e-9])
def test_the_labs_line_never_shows_360(yaw):
    line = 'Current heading is %f degrees.' % compass_degrees(yaw)
    assert line == 'Current heading is 0.000000 degrees.'


@pytest.mark.parametrize('yaw', [math.inf, -math.inf])
def test_infinity_is_no_heading(yaw):
    with pytest.raises(ValueError):
        compass_degrees(yaw)


def test_nan_stays_nan():
    assert math.isnan(compass_degrees(math.nan))
