"""The times of messages on one clock, and the line of a reset. No bag is read here."""
import math
import time

import numpy as np
import pytest
from real_recordings import arrays_of

from tb3_labs.report.bag.clock import RecordedClock, times_on_recorders_clock
from tb3_labs.report.bag.messages import declared_by
from tb3_labs.report.motion.drives import drives
from tb3_labs.report.motion.movements import completed
from tb3_labs.report.run_data import ImuSamples, OdometrySamples, RunData, yaw_offset
from tb3_labs.robot.turtlebot3 import robot_model

#: The robot's clock is ahead of the recorder's by this much [s].
AHEAD = 0.775
SENT = np.arange(100) / 10.0


def test_a_clock_that_is_set_during_the_recording():
    assert RecordedClock.of(SENT, SENT + AHEAD).lag == pytest.approx(-AHEAD)
    for set_at in 0.3, 0.5, 0.8:
        for by in 1e6, 2.0, -2.0, -1e6:
            stamp = SENT + AHEAD + np.where(SENT > 10.0 * set_at, by, 0.0)
            assert times_on_recorders_clock(SENT, stamp, None) == pytest.approx(SENT, abs=1e-6)


@pytest.mark.parametrize('begin, end, arrival', [
    (3.0, 5.0, 5.0),       # the recorder was busy, and took all messages at once
    (0.0, 0.6, 0.6),       # it was busy at its begin
    (9.25, 9.95, 10.6),    # and at its end
    (6.0, 8.0, 6.0)])      # its simulated clock stood still
def test_stamps_count_where_the_recorder_is_late(begin, end, arrival):
    late = np.where((SENT > begin - 0.01) & (SENT < end), arrival, SENT)
    assert times_on_recorders_clock(late, SENT + AHEAD, None) == pytest.approx(SENT, abs=1e-6)


def test_old_and_strange_stamps():
    arrival = np.array([0.0, 0.1, 2.0, 4.0])
    latched = np.array([-100.0, 0.1, 2.0, 4.0])
    assert times_on_recorders_clock(arrival, latched, None) == pytest.approx(arrival)
    assert times_on_recorders_clock(SENT, 0.0 * SENT - 1.7e9, None) == pytest.approx(SENT)
    from_the_future = np.where(SENT == 5.0, 1e9, SENT)
    assert times_on_recorders_clock(SENT, from_the_future, None) == pytest.approx(SENT)


@pytest.mark.parametrize('apart, shared', [(-0.095, True), (0.105, False)])
def test_senders_whose_clocks_differ_by_less_than_a_tenth_of_a_second_share_one(apart, shared):
    robot = RecordedClock.of(SENT, SENT + AHEAD)
    time = times_on_recorders_clock(SENT, SENT + AHEAD + apart, robot)
    assert time == pytest.approx(SENT + (apart if shared else 0.0))


@pytest.mark.parametrize('share, passed_on', [(52, True), (48, False)])
def test_most_stamps_must_be_passed_on(share, passed_on):
    """They come 0.3 s late, and the others have stamps that are 0.033 s newer. A stamp of today that is rounded in a
    float is the same."""
    robot = RecordedClock.of(SENT, SENT + AHEAD)
    stamp = SENT + AHEAD + np.where(np.arange(100) < share, 2e-7, 0.033)
    time = times_on_recorders_clock(SENT + 0.3, stamp, robot)
    assert time[:share] == pytest.approx(SENT[:share] + (0.0 if passed_on else 0.267), abs=1e-5)


@pytest.mark.parametrize('every, by_stamp', [(4, True), (5, False)])
def test_a_quarter_of_the_messages_must_come_in_time(every, by_stamp):
    robot, number = RecordedClock.of(SENT, SENT + AHEAD), np.arange(100)
    arrival = SENT + np.where((number % every == 0) | (number == 99), 0.0, 0.6)
    time = times_on_recorders_clock(arrival, SENT + AHEAD, robot)
    assert time == pytest.approx(SENT if by_stamp else np.maximum.accumulate(arrival))


@pytest.mark.parametrize('number, by_stamp', [(10, True), (11, False)])
def test_a_clock_that_is_off_for_more_than_a_tenth_of_the_messages_was_set(number, by_stamp):
    """The clock is 0.6 s off: behind at first, ahead at the end."""
    first, last = np.arange(100) < number, np.arange(100) >= 100 - number
    for off in -0.6 * first, 0.6 * last:
        time = times_on_recorders_clock(SENT, SENT + AHEAD + off, None)
        assert time == pytest.approx(SENT + off * by_stamp)


@pytest.mark.parametrize('late, time', [(9.5, 4.9), (10.5, 5.0)])
def test_a_stamp_that_is_ten_seconds_old_says_nothing(late, time):
    """Otherwise the clock is used, but time does not run back."""
    stamp = SENT - np.where(np.arange(100) == 50, late, 0.0)
    assert times_on_recorders_clock(SENT, stamp, None)[50] == pytest.approx(time)


@pytest.mark.parametrize('lags, lag', [
    ([0.0, 100.0], 0.0), ([-100.0, 0.1, 0.2], 0.1), ([-100.0, 0.2, 0.3, 100.0], 0.2),
    (np.arange(100) / 1000.0, 0.005), (np.arange(42) / 1000.0, 0.002)])
def test_a_clock_goes_by_its_quickest_messages_but_for_outliers(lags, lag):
    """A twentieth of the messages may be quicker."""
    stamp = np.arange(len(lags)) / 10.0
    assert RecordedClock.of(stamp + lags, stamp).lag == pytest.approx(lag)


@pytest.mark.parametrize('name, offset_deg, metres', [
    ('burger_drive', 140.56, 4.46), ('burger_static', -105.51, 0.0)])
def test_recordings_of_a_real_robot(name, offset_deg, metres):
    imu, odometry = (table.T for table in arrays_of(name))
    start = odometry[0][0]
    for table in imu, odometry:
        table[:2] -= start
    clock = RecordedClock.of(odometry[0], odometry[1])
    imu, odometry = ([table[0], times_on_recorders_clock(table[0], table[1], clock), *table[2:]]
                     for table in (imu, odometry))
    run = RunData(name=name, start=0.0, duration=float(odometry[0][-1]), imu=ImuSamples(*imu),
                  odometry=OdometrySamples(*odometry))
    offset = yaw_offset(run)
    assert math.degrees(offset.mean) == pytest.approx(offset_deg, abs=0.05)
    assert math.degrees(offset.spread) < 0.1
    assert run.odometry.length == pytest.approx(metres, abs=0.01)
    assert drives(completed(run), robot_model('burger')) == []


@pytest.mark.parametrize('line, pose', [
    ('Local pose set to x=1.50, y=-0.25, yaw=1.57', (1.5, -0.25, 1.57)),            # the handout
    ('Local pose set to x=1.500, y=-0.250, yaw=90.0 deg', (1.5, -0.25, math.pi / 2.0)),
    ('[INFO] Local pose set to x = 1, y = 2 m, yaw = -45 degrees!', (1.0, 2.0, -math.pi / 4.0)),
    ('local pose set to: x: .5, y: 2e-1, yaw: 90', (0.5, 0.2, math.pi / 2.0)),      # > 2 pi
    ('Local pose set to x=0, y=0, yaw=6.28', (0.0, 0.0, 6.28 - 2.0 * math.pi)),
    ('Local pose set to x=0, y=0, yaw=nan', None),
    ('Local pose set to x=0, y=0, yaw=1e999', None), ('Local pose set to the origin', None),
    ('Goal reached!', None)])
def test_the_line_of_a_reset(line, pose):
    found = declared_by(line)
    assert found == pose if pose is None else (
        (found.x, found.y, found.yaw) == pytest.approx(pose, abs=1e-9))


@pytest.mark.parametrize('line', ['x=1' + ' ' * 50000, 'x=' + '1' * 50000, 'x=1 y=2' + ' ' * 50000 + 'z',
                                  'x=1 y=2 yaw=' + '3' * 50000 + 'e'], ids=list('abcd'))
def test_a_long_line_of_a_stranger_holds_nobody_up(line):
    begun = time.process_time()
    declared_by('Local pose set to ' + line)
    assert time.process_time() - begun < 2.0
