"""Quaternions of a robot on a floor, and the mistakes that squaternion does not notice."""
import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from known_motion import angle_between
from tb3_labs.geometry.angle_arrays import yaws_from_quaternions
from tb3_labs.geometry.angles import quaternion_from_yaw, yaw_from_quaternion

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
    """The function for arrays returns the same yaw, and NaN if the function for one quaternion raises."""
    w, x, y, z = (scale * part for part in quaternion)
    of_array, = yaws_from_quaternions(*map(np.atleast_1d, (w, x, y, z)))
    try:
        yaw = yaw_from_quaternion(w=w, x=x, y=y, z=z)
    except ValueError:
        assert math.isnan(of_array)
        raise
    assert -math.pi < of_array <= math.pi and angle_between(of_array, yaw) < 1e-12
    return yaw


def assert_yaw(quaternion, yaw, scale=1.0):
    found = yaw_of(quaternion, scale)
    assert angle_between(found, yaw) < 1e-7
    assert -math.pi < found <= math.pi


@given(st.one_of(YAWS, st.sampled_from(AWKWARD)))
def test_there_and_back_and_a_quaternions_negative_is_the_same_attitude(yaw):
    assert quaternion_from_yaw(yaw) == pytest.approx(about_z(yaw), abs=1e-12)
    assert_yaw(about_z(yaw), yaw)
    assert_yaw(about_z(yaw), yaw, scale=-1.0)


@given(YAWS, st.sampled_from([0.999996, 0.96, 1.04]))
def test_a_norm_that_is_nearly_one_does_not_bend_the_angle(yaw, norm):
    assert_yaw(about_z(yaw), yaw, scale=norm)


@given(YAWS, st.sampled_from([0.0, 1e-300, 0.5, 0.94, 1.06, 2.0, 1e200, math.inf, math.nan]))
@example(math.pi / 2, 2.0)
def test_a_norm_that_is_not_one_is_refused(yaw, norm):
    with pytest.raises(ValueError, match='norm'):
        yaw_of(about_z(yaw), scale=norm)


@given(st.floats(math.radians(46), math.radians(134)), st.sampled_from([1, -1]))
def test_ros_order_mistaken_for_w_first_and_the_other_way_round_are_refused(yaw, side):
    w, x, y, z = about_z(side * yaw)
    for parts in ((x, y, z, w), (z, w, x, y)):
        with pytest.raises(ValueError, match='order'):
            yaw_of(parts)


@given(YAWS, st.floats(-40.0, 40.0), st.sampled_from('xy'))
def test_a_ramp_does_not_hide_the_heading(yaw, tilt_deg, axis):
    assert_yaw(then_tilted(yaw, math.radians(tilt_deg), axis), yaw)


@given(YAWS, st.floats(50.0, 310.0), st.sampled_from('xy'))
def test_a_robot_on_its_side_is_refused(yaw, tilt_deg, axis):
    # Over 130 deg of pitch is the same attitude as a roll over, so no tilt here is below 45 deg.
    with pytest.raises(ValueError, match='roll'):
        yaw_of(then_tilted(yaw, math.radians(tilt_deg), axis))
