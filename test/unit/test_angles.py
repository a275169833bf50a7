"""Angles: both ends of the interval, many turns, NaN and infinity. Quaternions of a robot on a floor, and
the mistakes that squaternion does not notice."""
import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from known_motion import angle_between
from tb3_labs.geometry.angles import (
    WHOLE_TURN, clamp, difference, quaternion_from_yaw, unwrap, wrap, yaw_from_quaternion)
from tb3_labs.geometry.arrays import wrap_all

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
def test_a_wrapped_angle_stays_the_same(angle):
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
    assert wrap_all(target - start, 360.0) == expected


@given(st.floats(-20.0, 20.0), st.lists(st.floats(-3.1, 3.1), max_size=30))
def test_unwrap_follows_turns_of_less_than_half_a_turn(start, turns):
    truth = followed = start
    for turn in turns:
        truth += turn
        sensor = math.atan2(math.sin(truth), math.cos(truth))
        followed = unwrap(sensor, followed)
        assert followed == pytest.approx(truth, abs=1e-9)


@given(st.lists(ANGLES, max_size=20))
@example([PI, -PI, WHOLE_TURN, -WHOLE_TURN, 3 * PI, -3 * PI, 5 * PI, 0.0, 1e4])
def test_an_array_is_wrapped_like_numbers(angles):
    wrapped = wrap_all(angles)
    assert np.all((wrapped > -PI) & (wrapped <= PI))
    for angle, once in zip(angles, wrapped):
        assert angle_between(once, angle) < 1e-8


def test_nan_in_an_array_does_not_change_other_angles():
    angles = np.array([[0.0, 1.0, PI], [-1e-300, -3.14159, 2.0]])
    assert np.array_equal(wrap_all(angles), angles)
    assert np.array_equal(np.isnan(wrap_all([math.nan, 1.0, math.inf])), [True, False, True])


@pytest.mark.parametrize('value, expected', [
    (-3.0, -1.0), (-1.0, -1.0), (0.5, 0.5), (2.0, 2.0), (9.0, 2.0), (math.inf, 2.0),
    (-math.inf, -1.0)])
def test_clamp(value, expected):
    assert clamp(value, -1.0, 2.0) == expected
    assert math.isnan(clamp(math.nan, -1.0, 1.0))


YAWS = st.floats(-math.pi, math.pi)
AWKWARD = [0.0, -0.0, math.pi, -math.pi, math.pi / 2, -math.pi / 2, 1e-12, -1e-12]


def about_z(yaw):
    """(w, x, y, z) from the definition: half the angle about the upright axis."""
    return math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)


def then_tilted(yaw, tilt, axis):
    """(w, x, y, z) of a robot that faces `yaw` and leans by `tilt` about its own x or y."""
    w, _, _, z = about_z(yaw)
    c, s = math.cos(tilt / 2), math.sin(tilt / 2)
    return (w * c, w * s, z * s, z * c) if axis == 'x' else (w * c, -z * s, w * s, z * c)


def yaw_of(quaternion, scale=1.0):
    w, x, y, z = (scale * part for part in quaternion)
    return yaw_from_quaternion(w=w, x=x, y=y, z=z)


def assert_yaw(quaternion, yaw, scale=1.0):
    found = yaw_of(quaternion, scale)
    assert angle_between(found, yaw) < 1e-7
    assert -math.pi < found <= math.pi


@given(st.one_of(YAWS, st.sampled_from(AWKWARD)))
def test_a_quaternion_and_its_negative_have_the_same_yaw(yaw):
    assert quaternion_from_yaw(yaw) == pytest.approx(about_z(yaw), abs=1e-12)
    assert_yaw(about_z(yaw), yaw)
    assert_yaw(about_z(yaw), yaw, scale=-1.0)


@given(YAWS, st.sampled_from([0.999996, 0.96, 1.04]))
def test_a_norm_of_nearly_one_does_not_change_the_yaw(yaw, norm):
    assert_yaw(about_z(yaw), yaw, scale=norm)


@given(YAWS, st.sampled_from([0.0, 1e-300, 0.5, 0.94, 1.06, 2.0, 1e200, math.inf, math.nan]))
@example(math.pi / 2, 2.0)
def test_a_norm_that_is_not_one_is_refused(yaw, norm):
    with pytest.raises(ValueError, match='norm'):
        yaw_of(about_z(yaw), scale=norm)


@given(st.floats(math.radians(46), math.radians(134)), st.sampled_from([1, -1]))
def test_a_wrong_order_of_the_parts_is_refused(yaw, side):
    w, x, y, z = about_z(side * yaw)
    for parts in ((x, y, z, w), (z, w, x, y)):
        with pytest.raises(ValueError, match='order'):
            yaw_of(parts)


@given(YAWS, st.floats(-40.0, 40.0), st.sampled_from('xy'))
def test_a_quaternion_on_a_ramp_has_its_yaw(yaw, tilt_deg, axis):
    assert_yaw(then_tilted(yaw, math.radians(tilt_deg), axis), yaw)


@given(YAWS, st.floats(50.0, 310.0), st.sampled_from('xy'))
def test_a_robot_on_its_side_is_refused(yaw, tilt_deg, axis):
    # Over 130 deg of pitch is the same attitude as a roll over, so no tilt here is below 45 deg.
    with pytest.raises(ValueError, match='roll'):
        yaw_of(then_tilted(yaw, math.radians(tilt_deg), axis))
