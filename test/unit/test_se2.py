"""Poses in the plane: the laws of the group, and the handout's formulas on numbers."""
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.geometry.se2 import Pose2, interpolate

PI = math.pi
IDENTITY = Pose2()
NASTY = [
    IDENTITY, Pose2(1.0, 2.0, 0.0), Pose2(0.0, 0.0, PI), Pose2(0.0, 0.0, -PI),
    Pose2(-0.61, 0.61, PI / 2), Pose2(4.8, -0.3, -PI / 2), Pose2(1e6, -1e6, 1.0),
    Pose2(1e-12, -1e-12, 1e-12), Pose2(3.0, -4.0, PI - 1e-12), Pose2(-3.0, 4.0, -PI + 1e-12),
    Pose2(-0.0, -0.0, -0.0), Pose2(1.0, 1.0, 7.5 * PI), Pose2(0.5, 0.0, -6.0 * PI)]
NUMBERS = st.floats(-100.0, 100.0)
POSES = st.one_of(st.sampled_from(NASTY), st.builds(Pose2, NUMBERS, NUMBERS, NUMBERS))


def matrix(pose):
    """The pose as a homogeneous matrix, from the definition of a rotation."""
    return np.array([[math.cos(pose.yaw), -math.sin(pose.yaw), pose.x],
                     [math.sin(pose.yaw), math.cos(pose.yaw), pose.y],
                     [0.0, 0.0, 1.0]])


def assert_matrix(pose, expected, size):
    np.testing.assert_allclose(matrix(pose), expected, atol=1e-12 * (1.0 + size))
    assert -PI < pose.yaw <= PI


def size(*poses):
    return sum(abs(pose.x) + abs(pose.y) for pose in poses)


@given(POSES, POSES)
def test_chaining_multiplies_matrices(a, b):
    assert_matrix(a @ b, matrix(a) @ matrix(b), size(a, b))


@given(POSES)
def test_the_inverse_inverts_the_matrix(pose):
    assert_matrix(pose.inverse(), np.linalg.inv(matrix(pose)), size(pose))


def test_the_handouts_formulas():
    """B stands at (1, 2) in A, turned a quarter to the left: B's x axis is A's y axis."""
    a_T_b = Pose2(1.0, 2.0, PI / 2)
    p_b, p_a = [[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]], [[1.0, 2.0], [1.0, 5.0], [-2.0, 2.0]]
    np.testing.assert_allclose(a_T_b.act(p_b), p_a, atol=1e-12)
    np.testing.assert_allclose(a_T_b.inverse().act(p_a), p_b, atol=1e-12)


@pytest.mark.parametrize('x, y, bearing_deg', [
    (1, 0, 0), (1, 1, 45), (0, 1, 90), (-1, 1, 135), (-1, 0, 180), (-1, -1, -135), (0, -1, -90)])
def test_bearing_and_distance_are_in_the_parent_frame(x, y, bearing_deg):
    here = Pose2(4.8, -0.3, 1.0)
    there = Pose2(4.8 + x, -0.3 + y, -2.0)
    assert math.degrees(here.bearing_to(there)) == pytest.approx(bearing_deg)
    assert IDENTITY.bearing_to(Pose2(-1.0, -1e-17)) == PI
    assert here.distance_to(there) == pytest.approx(math.sqrt(x * x + y * y))


@pytest.mark.parametrize('start_deg, end_deg, quarter_deg', [
    (0, 40, 10), (40, 0, 30), (170, -150, 180), (-150, 170, -160), (-170, 170, -175),
    (178, -178, 179), (-178, 178, -179)])
def test_interpolation_turns_the_short_way(start_deg, end_deg, quarter_deg):
    between = interpolate(Pose2(0.0, 8.0, math.radians(start_deg)),
                          Pose2(4.0, 0.0, math.radians(end_deg)), 0.25)
    assert_matrix(between, matrix(Pose2(1.0, 6.0, math.radians(quarter_deg))), 1.0)
