"""A trail is thin and bounded, however long a robot drives."""
import math

import pytest

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.panel.trail import Trail


def driven(count, step=1.0):
    """The trail of a robot that drove straight on."""
    trail = Trail()
    for number in range(count):
        trail.add(Pose2(step * number))
    return trail


@pytest.mark.parametrize('step, count', [(0.019, 51), (0.021, 101), (1.0, 101)])
def test_points_are_two_centimetres_apart_or_more(step, count):
    points = driven(101, step).points
    assert len(points) == count
    assert min(math.dist(*pair) for pair in zip(points, points[1:])) >= 0.02


@pytest.mark.parametrize('x, y', [(0.02, 0.0), (0.03, 0.0), (-0.03, 0.0), (0.0, 0.03), (0.015, -0.015)])
def test_it_goes_in_any_direction(x, y):
    trail = driven(1)
    trail.add(Pose2(x, y))
    assert trail.points == [(0.0, 0.0), (x, y)]


def test_a_robot_that_stands_or_turns_adds_nothing():
    trail = driven(1)
    for number in range(100):
        trail.add(Pose2(0.0, 0.0, 0.1 * number))
    assert trail.points == [(0.0, 0.0)]


def test_points_are_told_to_the_millimetre():
    trail = Trail()
    trail.add(Pose2(1.23456, -0.98765))
    trail.begin_with([(0.12345, 2.0)])
    assert trail.points == [(0.123, 2.0), (1.235, -0.988)]


def test_a_long_way_keeps_its_beginning_and_end_and_every_other_point_between():
    assert driven(1000).points == [(float(x), 0.0) for x in range(1000)]
    assert driven(1001).points == [(float(x), 0.0) for x in range(0, 1001, 2)]


def test_a_longer_way_is_bounded_and_ends_at_the_robot():
    trail = Trail()
    for x in range(10000):
        trail.add(Pose2(float(x)))
        assert len(trail.points) <= 1000 and trail.points[-1] == (x, 0.0)
    assert trail.points[0] == (0.0, 0.0)


@pytest.mark.parametrize('own', [0, 1, 5])
def test_what_was_driven_before_comes_first(own):
    trail = driven(own)
    trail.begin_with([(-2.0, 0.0), (-1.0, 0.0)])
    assert trail.points == [(-2.0, 0.0), (-1.0, 0.0)] + driven(own).points


@pytest.mark.parametrize('count', [999, 1000, 1001, 5000])
def test_what_was_driven_before_is_bounded_too(count):
    trail = driven(1)
    trail.begin_with([(float(x), 1.0) for x in range(count)])
    assert 500 <= len(trail.points) <= 1000
    assert trail.points[0] == (0.0, 1.0)


def test_it_begins_anew():
    trail = driven(5)
    trail.clear()
    assert trail.points == []
    trail.add(Pose2(4.0))
    assert trail.points == [(4.0, 0.0)]


def test_what_was_handed_out_does_not_change():
    trail = driven(3)
    copy = list(trail.points)
    Trail().add(Pose2(7.0))
    assert trail.points == copy
