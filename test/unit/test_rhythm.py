"""Moments at a fixed rate, also where the rate changes while it runs."""
import pytest

from tb3_labs.simulation.sensors import Rhythm


def test_moments_are_counted_from_the_start():
    rhythm = Rhythm(4.0, 10.0)
    assert rhythm.due == 10.25
    assert [rhythm.take() for _ in range(3)] == [10.25, 10.5, 10.75] and rhythm.due == 11.0
    assert Rhythm(4.0).due == 0.25


def test_a_moment_at_the_end_itself_is_left():
    rhythm = Rhythm(4.0)
    assert rhythm.take_until(0.25) == []
    assert rhythm.take_until(1.0) == [0.25, 0.5, 0.75] and rhythm.due == 1.0
    assert rhythm.take_until(1.1) == [1.0] and rhythm.take() == 1.25


def test_another_rate_counts_from_now():
    rhythm = Rhythm(4.0)
    rhythm.take_until(1.1)
    rhythm.set_rate(10.0, 1.125)
    assert rhythm.due == pytest.approx(1.225)
    assert rhythm.take_until(1.45) == pytest.approx([1.225, 1.325, 1.425])
    assert rhythm.take() == pytest.approx(1.525)


def test_the_same_rate_changes_nothing():
    rhythm = Rhythm(4.0)
    rhythm.take()
    rhythm.set_rate(4.0, 0.3)
    assert [rhythm.take() for _ in range(2)] == [0.5, 0.75]


def test_no_rounding_adds_up():
    rhythm = Rhythm(30.0)
    assert rhythm.take_until(1000.0)[-1] == pytest.approx(29999 / 30.0, abs=1e-12)
    assert rhythm.due == 1000.0
