"""Angles: both ends of the interval, many turns, NaN and infinity."""
import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from known_motion import angle_between
from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.geometry.angles import WHOLE_TURN, clamp, difference, difference_degrees, unwrap, wrap

PI = math.pi
ANGLES = st.floats(-1e4, 1e4)


@pytest.mark.parametrize('angle, expected', [
    (0.0, 0.0), (1.0, 1.0), (PI, PI), (-PI, PI), (PI / 2, PI / 2), (-PI / 2, -PI / 2),
    (1.5 * PI, -PI / 2), (-1.5 * PI, PI / 2), (WHOLE_TURN, 0.0), (-WHOLE_TURN, 0.0), (4 * WHOLE_TURN, 0.0),
    (PI + 1e-9, -PI + 1e-9), (-PI - 1e-9, PI - 1e-9), (100 * WHOLE_TURN + 1.0, 1.0)])
def test_wrap(angle, expected):
    assert wrap(angle) == pytest.approx(expected, abs=1e-12)


@given(st.floats(allow_nan=False, allow_infinity=False))
@example(PI)
@example(-PI)
def test_wrap_ends_in_its_interval_and_wrapping_again_changes_nothing(angle):
    once = wrap(angle)
    assert -PI < once <= PI
    assert wrap(once) == once


def test_nan_stays_nan_and_infinity_is_refused():
    for value in (wrap(math.nan), difference(math.nan, 1.0), difference(1.0, math.nan),
                  unwrap(math.nan, 1.0)):
        assert math.isnan(value)
    with pytest.raises(ValueError):
        wrap(math.inf)


@pytest.mark.parametrize('target, start, expected', [
    (10, 350, 20), (350, 10, -20), (-170, 170, 20), (170, -170, -20), (90, 0, 90), (0, 90, -90),
    (180, 0, 180), (-180, 0, 180), (0, 180, 180), (45, 45, 0), (720, 0, 0)])
def test_difference_goes_the_short_way(target, start, expected):
    turn = difference(math.radians(target), math.radians(start))
    assert math.degrees(turn) == pytest.approx(expected, abs=1e-9)
    assert difference_degrees(target, start) == expected


@given(st.floats(-20.0, 20.0), st.lists(st.floats(-3.1, 3.1), max_size=30))
def test_continuous_follows_any_turning_with_less_than_half_a_turn_between_samples(start, turns):
    truth = followed = start
    for turn in turns:
        truth += turn
        sensor = math.atan2(math.sin(truth), math.cos(truth))
        followed = unwrap(sensor, followed)
        assert followed == pytest.approx(truth, abs=1e-9)


@given(st.lists(ANGLES, max_size=20))
@example([PI, -PI, WHOLE_TURN, -WHOLE_TURN, 3 * PI, -3 * PI, 5 * PI, 0.0, 1e4])
def test_an_array_is_wrapped_as_its_numbers_are(angles):
    wrapped = wrap_all(angles)
    assert np.all((wrapped > -PI) & (wrapped <= PI))
    for angle, once in zip(angles, wrapped):
        assert angle_between(once, angle) < 1e-8


def test_an_array_keeps_its_shape_and_what_is_no_angle_does_not_hide_the_others():
    angles = np.array([[0.0, 1.0, PI], [-1e-300, -3.14159, 2.0]])
    assert np.array_equal(wrap_all(angles), angles)
    assert np.array_equal(np.isnan(wrap_all([math.nan, 1.0, math.inf])), [True, False, True])


@pytest.mark.parametrize('value, expected', [
    (-3.0, -1.0), (-1.0, -1.0), (0.5, 0.5), (2.0, 2.0), (9.0, 2.0), (math.inf, 2.0),
    (-math.inf, -1.0)])
def test_clamp(value, expected):
    assert clamp(value, -1.0, 2.0) == expected
    assert math.isnan(clamp(math.nan, -1.0, 1.0))
