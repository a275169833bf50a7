"""Silent sensors: before the first message, exactly at the timeout, and if the clock goes back."""
import pytest

from tb3_labs.supervision.motion_monitors import Sensor, SensorMonitor, SensorStatus
from tb3_labs.supervision.timeouts import FROZEN_TIME


def received_at(time, name='imu'):
    source = Sensor(name)
    source.on_message(time)
    source.on_message(time)    # one message alone is not enough
    return source


def status_at(watch, now):
    watch.update(now)
    return watch.status


def test_a_sensor_is_fresh_after_two_messages():
    imu = Sensor('imu')
    watch = SensorMonitor(imu)
    assert (watch.status, watch.reason_to_stand, watch.silent_for) == (SensorStatus.SILENT, '', 0.0)
    imu.on_message(10.0)
    assert status_at(watch, 10.0) is SensorStatus.SILENT
    imu.on_message(12.6)
    assert status_at(watch, 12.6) is SensorStatus.FRESH


def test_the_problem_text_names_each_silent_sensor_and_its_silence():
    imu, odom, joy = received_at(10.0, 'imu'), received_at(8.74, 'odom'), Sensor('joy')
    watch = SensorMonitor(imu, odom, joy)
    assert watch.problem_text(10.0, with_age=True) == 'no odom for 1.3 s, no joy yet'
    assert watch.problem_text(10.0) == 'no odom, no joy yet'
    assert watch.problem_text(10.10) == 'no odom, no joy yet'        # half of the IMU's timeout: 0.11 s
    assert watch.problem_text(10.12) == 'no imu, no odom, no joy yet'
    assert SensorMonitor(imu).problem_text(10.1) == ''


@pytest.mark.parametrize('silence, sight', [
    (0.21, SensorStatus.FRESH), (0.23, SensorStatus.RECOVERED), (2.0, SensorStatus.RECOVERED),
    (2.1, SensorStatus.TIMED_OUT)])
@pytest.mark.parametrize('looked_at', [True, False])
def test_the_length_of_a_silence_does_not_depend_on_updates(
        silence, sight, looked_at):
    """A process that sleeps does not look at the clock."""
    imu = received_at(10.0)
    watch = SensorMonitor(imu)
    assert status_at(watch, 10.0) is SensorStatus.FRESH
    if looked_at:
        for tick in range(1, round(100 * silence)):
            status_at(watch, 10.0 + 0.01 * tick)
    imu.on_message(10.0 + silence)
    assert status_at(watch, 10.0 + silence) is sight
    if sight is not SensorStatus.FRESH:
        assert watch.silent_for == pytest.approx(silence)
    assert status_at(watch, 10.0 + silence) is SensorStatus.FRESH    # found once


def test_a_silence_is_found_after_the_clock_went_back():
    watch = SensorMonitor(received_at(1000.0))
    for now, sight in ((10.0, SensorStatus.FRESH), (10.21, SensorStatus.FRESH), (10.23, SensorStatus.SILENT)):
        assert status_at(watch, now) is sight


DT = 0.05
#: This many looks are longer than FROZEN_TIME.
MANY = round(FROZEN_TIME / DT) + 2


@pytest.mark.parametrize('reading, must_change, frozen', [
    (lambda k: 7, True, True), (lambda k: 7, False, False), (lambda k: k % 2, True, False)])
def test_a_sensor_that_repeats_a_reading_is_frozen(reading, must_change, frozen):
    imu = Sensor('imu')
    for k in range(MANY):
        imu.on_message(DT * k, reading(k))
        imu.update_repetition(must_change, DT * k)
    assert ('imu repeats one reading' in SensorMonitor(imu).frozen_text()) is frozen
