"""The times of messages on one clock, and the line of a reset. No bag is read here."""
import math
import time

import numpy as np
import pytest

from tb3_labs.recording.samples_from_messages import RecordedClock, times_on_recorder_clock
from tb3_labs.watch.printed_pose import declared_pose

#: The robot's clock is ahead of the recorder's by this much [s].
AHEAD = 0.775
SENT = np.arange(100) / 10.0
ROBOT, NUMBER = RecordedClock.of(SENT, SENT + AHEAD), np.arange(100)


def on_own_clock(arrival, stamp):
    return times_on_recorder_clock(arrival, stamp, RecordedClock.of(arrival, stamp))


def arrived_late(begin, end, arrival):
    """The arrivals of messages, if those that were sent from `begin` to `end` arrive at another time."""
    return np.where((SENT > begin - 0.01) & (SENT < end), arrival, SENT)


@pytest.mark.parametrize('set_at', [0.3, 0.5, 0.8])
@pytest.mark.parametrize('by', [1e6, 11.0, -11.0, -1e6])
def test_a_clock_that_is_set_during_the_recording(set_at, by):
    stamp = SENT + AHEAD + np.where(SENT > 10.0 * set_at, by, 0.0)
    assert on_own_clock(SENT, stamp) == pytest.approx(SENT, abs=1e-6)


@pytest.mark.parametrize('arrival', [
    arrived_late(3.0, 5.0, 5.0),       # the recorder was busy, and took all messages at once
    arrived_late(0.0, 0.6, 0.6),       # the recorder was busy at its begin
    arrived_late(9.25, 9.95, 10.6),    # and at its end
    arrived_late(6.0, 8.0, 6.0)])      # its simulated clock stood still
def test_stamps_are_used_while_the_recorder_is_late(arrival):
    assert on_own_clock(arrival, SENT + AHEAD) == pytest.approx(SENT, abs=1e-6)


def one_in_time_of(number):
    """The arrivals if one of this many messages, and the last message, come in time."""
    return SENT + np.where((NUMBER % number == 0) | (NUMBER == 99), 0.0, 0.6)


@pytest.mark.parametrize('arrival, stamp, robot, time', [
    # strange stamps do not count
    (np.array([0.0, 0.1, 2.0, 4.0]), np.array([-100.0, 0.1, 2.0, 4.0]), None, np.array([0.0, 0.1, 2.0, 4.0])),
    (SENT, 0.0 * SENT - 1.7e9, None, SENT), (SENT, np.where(SENT == 5.0, 1e9, SENT), None, SENT),
    # a stamp may be up to ten seconds old; but time does not run back
    (SENT, SENT - 10.5 * (NUMBER == 50), None, SENT),
    (SENT, SENT - 9.5 * (NUMBER == 50), None, SENT - 0.1 * (NUMBER == 50)),
    # senders whose clocks differ by less than a tenth of a second share one
    (SENT, SENT + AHEAD - 0.095, ROBOT, SENT - 0.095), (SENT, SENT + AHEAD + 0.105, ROBOT, SENT),
    # a quarter of the messages must come in time
    (one_in_time_of(4), SENT + AHEAD, ROBOT, SENT),
    (one_in_time_of(5), SENT + AHEAD, ROBOT, np.maximum.accumulate(one_in_time_of(5)))])
def test_the_time_of_a_message(arrival, stamp, robot, time):
    clock = robot or RecordedClock.of(arrival, stamp)
    assert times_on_recorder_clock(arrival, stamp, clock) == pytest.approx(time)


@pytest.mark.parametrize('share, passed_on', [(52, True), (48, False)])
def test_a_sender_that_passes_on_most_stamps_has_the_robots_clock(share, passed_on):
    """These messages come 0.3 s late, and the others have stamps that are 0.033 s newer. A stamp of today that
    is rounded in a float is the same."""
    stamp = SENT + AHEAD + np.where(NUMBER < share, 2e-7, 0.033)
    time = times_on_recorder_clock(SENT + 0.3, stamp, ROBOT)
    assert time[:share] == pytest.approx(SENT[:share] + (0.0 if passed_on else 0.267), abs=1e-5)


@pytest.mark.parametrize('lags, lag', [
    ([0.0, 100.0], 0.0), ([-100.0, 0.1, 0.2], 0.1), ([-100.0, 0.2, 0.3, 100.0], 0.2),
    (np.arange(100) / 1000.0, 0.005), (np.arange(42) / 1000.0, 0.002)])
def test_a_clock_is_computed_from_its_quickest_messages_without_outliers(lags, lag):
    """A twentieth of the messages may be quicker."""
    stamp = np.arange(len(lags)) / 10.0
    assert RecordedClock.of(stamp + lags, stamp).offset == pytest.approx(lag)


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
    found = declared_pose(line)
    assert found == pose if pose is None else (
        (found.x, found.y, found.yaw) == pytest.approx(pose, abs=1e-9))


@pytest.mark.parametrize('line', ['x=1' + ' ' * 50000, 'x=' + '1' * 50000, 'x=1 y=2' + ' ' * 50000 + 'z',
                                  'x=1 y=2 yaw=' + '3' * 50000 + 'e'], ids=list('abcd'))
def test_a_long_line_is_searched_fast(line):
    begun = time.process_time()
    declared_pose('Local pose set to ' + line)
    assert time.process_time() - begun < 2.0
