"""Is a source alive: never heard, exactly at the timeout, a clock that goes back."""
import math

import pytest

from tb3_labs.freshness import SENSOR_TIMEOUT, Freshness, SensorWatch


def heard_at(time, name='imu', timeout=0.25):
    source = Freshness(name, timeout)
    source.heard(time)
    return source


def test_what_was_never_heard_is_infinitely_old():
    source = Freshness('imu')
    assert source.age(0.0) == source.age(1e9) == math.inf
    assert not source.is_fresh(0.0)
    assert source.complaint(5.0) == 'no imu yet'


@pytest.mark.parametrize('age, fresh', [(0.0, True), (0.25, True), (0.2501, False), (60.0, False)])
def test_the_timeout_itself_is_still_fresh(age, fresh):
    source = heard_at(8.0)
    assert source.age(8.0 + age) == pytest.approx(age)
    assert source.is_fresh(8.0 + age) is fresh
    assert (source.complaint(8.0 + age) == '') is fresh


def test_the_newest_message_counts():
    source = heard_at(1.0)
    source.heard(3.0)
    assert source.age(3.5) == 0.5


def test_zero_is_a_time_like_any_other():
    assert heard_at(0.0).age(0.125) == 0.125


def test_a_clock_that_goes_back_does_not_make_a_source_fresh_for_ever():
    source = heard_at(1000.0)
    assert source.age(10.0) == 0.0
    assert source.is_fresh(10.25)
    assert not source.is_fresh(10.26)


def test_the_usual_timeout_is_5_cm_of_a_burger_at_full_speed():
    assert Freshness('imu').timeout == SENSOR_TIMEOUT
    assert SENSOR_TIMEOUT * 0.2108 == pytest.approx(0.05, abs=0.005)


def test_complaints_name_each_silent_source_and_how_long():
    imu, odom, joy = heard_at(10.0, 'imu'), heard_at(8.74, 'odom'), Freshness('joy')
    assert SensorWatch(imu, odom, joy).complaint(10.0) == 'no odom for 1.3 s, no joy yet'
    assert SensorWatch(imu).complaint(10.1) == SensorWatch().complaint(10.0) == ''
