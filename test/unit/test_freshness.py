"""Is a source alive: never heard, exactly at the timeout, a clock that goes back."""
import math

import pytest

from tb3_labs.doctor.robot import GIVES_UP, PAUSES
from tb3_labs.supervision.freshness import (
    RESUME_TIME, SENSOR_TIMEOUT, Freshness, SensorWatch, Sight)


def heard_at(time, name='imu', timeout=0.25):
    source = Freshness(name, timeout)
    source.heard(time)
    source.heard(time)      # one message alone does not count yet
    return source


def look(watch, now):
    watch.update(now)
    return watch.sight


def test_one_message_alone_is_no_sensor_yet_and_the_gap_after_it_no_silence():
    imu = Freshness('imu')
    watch = SensorWatch(imu)
    imu.heard(10.0)
    assert look(watch, 10.0) is Sight.SILENT
    imu.heard(12.6)
    assert look(watch, 12.6) is Sight.FRESH


def test_what_was_never_heard_is_infinitely_old():
    source = Freshness('imu')
    assert source.age(0.0) == source.age(1e9) == math.inf
    assert not source.is_fresh(0.0)
    assert source.silence == source.silence_with_age(5.0) == 'no imu yet'


@pytest.mark.parametrize('age, fresh', [(0.0, True), (0.25, True), (0.2501, False), (60.0, False)])
def test_the_timeout_itself_is_still_fresh(age, fresh):
    source = heard_at(8.0)
    assert source.age(8.0 + age) == pytest.approx(age)
    assert source.is_fresh(8.0 + age) is fresh
    assert (SensorWatch(source).problem(8.0 + age) == '') is fresh


def test_the_newest_message_counts():
    source = heard_at(1.0)
    source.heard(3.0)
    assert source.age(3.5) == 0.5


def test_zero_is_a_time_like_any_other():
    assert heard_at(0.0).age(0.125) == 0.125


def test_a_clock_that_goes_back_does_not_make_a_source_fresh_for_ever():
    source = heard_at(1000.0)
    assert source.age(10.0) == 0.0
    source.clock_went_back(10.0)
    assert source.is_fresh(10.25)
    assert not source.is_fresh(10.26)


def test_the_usual_timeout_is_5_cm_of_a_burger_at_full_speed():
    assert Freshness('imu').timeout == SENSOR_TIMEOUT
    assert SENSOR_TIMEOUT * 0.2108 == pytest.approx(0.05, abs=0.005)


def test_complaints_name_each_silent_source_and_how_long():
    imu, odom, joy = heard_at(10.0, 'imu'), heard_at(8.74, 'odom'), Freshness('joy')
    watch = SensorWatch(imu, odom, joy)
    assert watch.problem(10.0, with_age=True) == 'no odom for 1.3 s, no joy yet'
    assert watch.problem(10.0) == 'no odom, no joy yet'
    assert SensorWatch(imu).problem(10.1) == SensorWatch().problem(10.0) == ''


def test_the_words_of_a_lasting_silence_do_not_change():
    imu, odom = heard_at(10.0, 'imu'), heard_at(10.2, 'odom')
    watch = SensorWatch(imu, odom)
    said = set()
    for tick in range(300):
        if look(watch, 10.26 + 0.01 * tick) is Sight.SILENT:
            said.add(watch.hold_reason)
    assert said == {'no imu'}


@pytest.mark.parametrize('silence, sight', [
    (0.24, Sight.FRESH), (0.26, Sight.BACK_SOON), (2.0, Sight.BACK_SOON), (2.1, Sight.BACK_LATE)])
@pytest.mark.parametrize('looked_at', [True, False])
def test_a_silence_counts_from_its_beginning_whether_or_not_somebody_looked(
        silence, sight, looked_at):
    """A process that slept did not look."""
    imu = heard_at(10.0)
    watch = SensorWatch(imu)
    assert look(watch, 10.0) is Sight.FRESH
    if looked_at:
        for tick in range(1, round(100 * silence)):
            look(watch, 10.0 + 0.01 * tick)
    imu.heard(10.0 + silence)
    assert look(watch, 10.0 + silence) is sight
    if sight is not Sight.FRESH:
        assert watch.silent_for == pytest.approx(silence)
    assert look(watch, 10.0 + silence) is Sight.FRESH      # said once


def test_a_silence_before_the_motion_does_not_count():
    imu = heard_at(10.0)
    watch = SensorWatch(imu)
    imu.heard(15.0)
    watch.pause()
    assert look(watch, 15.0) is Sight.FRESH
    imu.heard(15.3)
    assert look(watch, 15.6) is Sight.SILENT and watch.hold_reason == 'no imu'
    watch.pause()
    assert watch.hold_reason == ''


def test_before_the_first_look_the_robot_stands():
    watch = SensorWatch(Freshness('imu'))
    assert (watch.sight, watch.hold_reason, watch.silent_for) == (Sight.SILENT, '', 0.0)


def test_a_watch_stops_the_robot_also_after_the_clock_went_back():
    watch = SensorWatch(heard_at(1000.0))
    assert look(watch, 10.0) is Sight.FRESH
    assert look(watch, 10.3) is Sight.SILENT


def test_of_two_timeouts_the_shorter_one_tells_a_silence():
    imu, joy = heard_at(10.0, 'imu', 0.25), heard_at(10.0, 'joy', 0.5)
    watch = SensorWatch(imu, joy)
    imu.heard(10.3)
    joy.heard(10.3)
    assert look(watch, 10.3) is Sight.BACK_SOON


@pytest.mark.parametrize('age, overdue', [(0.12, False), (0.13, True)])
def test_overdue_is_half_the_timeout(age, overdue):
    assert heard_at(8.0).is_overdue(8.0 + age) is overdue


def test_messages_are_counted_and_new_readings_told_once():
    source = Freshness('imu')
    assert source.count == source.dropped == 0 and not source.take_new()
    for reading, new in ((7, True), (7, False), (8, True)):
        source.heard(1.0, reading)
        assert source.take_new() is new and not source.take_new()
    assert source.count == 3


def test_the_doctor_warns_of_a_silence_that_stops_the_nodes():
    assert (PAUSES, GIVES_UP) == (SENSOR_TIMEOUT, RESUME_TIME)
