"""The report's page and its table, for a made-up run."""
import math
import re

import numpy as np
import pytest
from made_motion import driven, values
from made_run import (
    STATES, TIME, X, ZERO, goals, made, poses, rows_of, states, table_in, without_pictures)

from tb3_labs.report.run_data import Commands, ImuSamples, OdometrySamples, Poses, States
from tb3_labs.report.tables import number, table
from tb3_labs.robot.turtlebot3 import robot_model

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from tb3_labs.report.movements import completed  # noqa: E402
from tb3_labs.report.page import write_csv, write_report  # noqa: E402

BURGER = robot_model('burger')


def table_of(run, path):
    write_csv(run, path)
    return table_in(path)


# The table ----------------------------------------------------------------------------------------

def test_a_row_has_what_was_recorded_at_its_time(tmp_path):
    own = TIME[::2]
    run = made(
        odometry=OdometrySamples(own, own, 2.0 + 0.0 * own, 0.1 * own, 0.01 * own, 0.3 * own,
                                 0.0 * own),
        imu=ImuSamples(TIME, TIME, 0.02 * TIME, 0.5 * TIME),
        local_pose=poses(X, 0.1 * ZERO, ZERO + 0.5, TIME), ground_truth=poses(5.0 + X))
    row = table_of(run, tmp_path / 'run.csv')[30]                    # 3 s
    expected = dict(
        time_s=3.0, odom_x_m=2.0, odom_y_m=0.3, odom_yaw_deg=math.degrees(0.03), local_x_m=0.4,
        local_y_m=0.0, local_yaw_deg=math.degrees(0.5), truth_x_m=5.4, truth_y_m=0.0,
        truth_yaw_deg=0.0, imu_yaw_deg=math.degrees(0.06), distance_error_m=0.6,
        angle_error_deg=math.degrees(-0.5), linear_m_s=0.9, angular_rad_s=1.5)
    for name, value in expected.items():
        assert float(row[name]) == pytest.approx(value, abs=6e-4 if 'deg' in name else 6e-5), name
        assert len(row[name].split('.')[1]) == (3 if 'deg' in name else 4), name
    assert row['state'] == 'MOVE_FORWARD' and row['linear_commanded_m_s'] == ''
    assert list(row)[0] == 'time_s' and list(row)[-1] == 'state' and len(row) == 18


@pytest.mark.parametrize('apart, known', [(0.019, True), (-0.019, True), (0.021, False)])
def test_a_pose_within_twenty_milliseconds_is_of_the_same_instant(apart, known, tmp_path):
    odometry = made().odometry.take(slice(20, 181, 20))
    run = made(odometry=odometry, local_pose=poses(time=TIME[::20] + apart, x=X[::20],
                                                   y=ZERO[::20], yaw=ZERO[::20]))
    rows = table_of(run, tmp_path / 'run.csv')
    assert len(rows) == 9 and all((row['local_x_m'] != '') == known for row in rows)


def test_the_nearest_pose_counts(tmp_path):
    time, x = np.array([2.985, 3.01, 3.019]), np.array([1.0, 2.0, 3.0])
    near = Poses(time, time, x, 0.0 * x, 0.0 * x)
    table = table_of(made(local_pose=near), tmp_path / 'run.csv')
    assert [(row['time_s'], row['local_x_m']) for row in table if row['local_x_m']] == [
        ('3.0000', '2.0000')]


def test_a_command_holds_until_the_next_one_or_its_timeout(tmp_path):
    sent = np.array([1.0, 1.2, 5.0])
    run = made(commands=Commands(sent, sent, np.array([0.1, 0.2, 0.3]), np.array([1.0, 2.0, 3.0])))
    rows = {float(row['time_s']): row for row in table_of(run, tmp_path / 'run.csv')}
    for time, linear, angular in ((0.95, '', ''), (1.0, '0.1000', '1.0000'),
                                  (1.15, '0.1000', '1.0000'), (1.2, '0.2000', '2.0000'),
                                  (1.65, '0.2000', '2.0000'), (1.75, '', '')):
        assert (rows[time]['linear_commanded_m_s'],
                rows[time]['angular_commanded_rad_s']) == (linear, angular), time


# The page -----------------------------------------------------------------------------------------

def words_of(run, folder):
    with without_pictures():
        return write_report(run, BURGER, folder).read_text(encoding='utf-8')


@pytest.fixture(scope='module')
def page(tmp_path_factory):
    yaw = np.radians(np.interp(TIME, [1.3, 6.0], [0.0, 3.0]))
    run = made(
        start=1.7e9, goals=goals([0.5, 8.5], [1.03, 3.0], 0.04, 0.1), local_pose=poses(yaw=yaw),
        states=states(*STATES[:3], (6.5, 'stopped: no imu'), (7.0, 'GOAL_REACHED'),
                      (8.5, 'ROTATE_TO_GOAL')),
        imu=ImuSamples(TIME, TIME, yaw + 0.5, ZERO).take((TIME < 8.01) | (TIME > 8.59)),
        odometry=made().odometry, dropped={'imu': 7}, topics={'imu': '/robot3/imu'})
    return words_of(run, str(tmp_path_factory.mktemp('page') / 'a' / 'b'))


def test_the_page_says_what_was_driven(page):
    assert 'Burger on 2023-11-1' in page and '10.0 s, 1.00 m driven, no resets. ' in page
    first, second = (row for row in rows_of(page) if len(row) == 11)
    off = math.hypot(0.03, 0.04)
    angle = math.degrees(0.1) - 3.0
    assert first[:6] == ['1', '1.03', '0.04', '5.7', 'reached', '6.50']
    assert first[7:] == ['{:.4f}'.format(off), '{:+.2f}'.format(angle), '\u2013', '\u2013']
    assert second[:6] == ['2', '3.00', '0.04', '5.7', 'recording ended', '1.50']
    assert float(first[6]) == pytest.approx(
        1.03 / 0.2108 + (math.atan2(0.04, 1.03) + abs(0.1 - math.atan2(0.04, 1.03))) / 1.5, abs=0.1)


def test_the_page_says_how_imu_and_odometry_differ(page):
    """The odometry keeps 0. The IMU is at 0.5 rad until 1.3 s, then turns by 3 deg until 6 s."""
    mean, drift = map(float, re.search(
        r'mean ([+-][0-9.]+) deg, standard deviation [0-9.]+, .* ([+-][0-9.]+)\.',
        page).groups())
    turned = (4.7 * 1.5 + 4.0 * 3.0) / 10.0
    assert mean == pytest.approx(math.degrees(0.5) + turned, abs=0.1)
    assert drift == pytest.approx(3.0, abs=1e-3)


def test_a_drive_of_which_no_goal_was_recorded_has_no_errors(tmp_path):
    text = words_of(made(goals=Poses.none()), tmp_path)
    unknown = '\u2013'
    row, = (row for row in rows_of(text) if len(row) == 11)
    assert row == ['1', unknown, unknown, unknown, 'reached', '6.50'] + [unknown] * 5
    row, = (row for row in rows_of(text) if len(row) == 8)
    assert row[1:6] == ['0.50', '5.00', '1.00', '0.00', unknown]


def test_a_page_without_drives_says_where_local_stood(tmp_path):
    text = words_of(made(states=States.none()), tmp_path)
    assert 'the recorded one' in text and 'None' not in text and 'Along the way' not in text


@pytest.mark.parametrize('parts, rule', [
    (dict(control=values([0.5], [0.0])), 'By the commands and ctrl_relinq'),
    (dict(devices=('joy',)), 'it never gave control'),
    (dict(devices=('mouse_info',)), 'faster than any by the mouse (0.5 rad/s)'),
    ({}, 'a drive is a turn, a straight line and a turn, with pauses under 1 s')])
def test_a_page_without_drives_says_by_which_rule(parts, rule, tmp_path):
    run = completed(driven([(2.0, 6.0, 0.2, 0.0)], **parts))
    assert rule in words_of(run, tmp_path)


def test_the_page_says_what_happened_along_the_way(page):
    first, second = (row for row in rows_of(page) if len(row) == 8)
    for state in 'ROTATE_TO_GOAL', 'MOVE_FORWARD', 'ROTATE_TO_FINAL':
        assert page.count('<th>{} [s]</th>'.format(state)) == 1
    assert first[:5] == ['1', '0.50', '5.00', '0.50', '0.50']        # the stop is half a second
    least = float([row for row in rows_of(page) if len(row) == 11][0][6])
    assert float(first[5]) == pytest.approx(6.5 / least, abs=0.01)
    assert float(first[6]) == pytest.approx(2.97, abs=0.05) and first[6][0] == '+'
    assert float(first[7]) == pytest.approx(2.97, abs=0.05)
    assert second[:5] == ['2', '1.50', '0.00', '0.00', '0.00']
    assert second[6:] == ['\u2013', '\u2013']


def test_the_page_says_how_steadily_the_topics_came(page):
    rows = {row[0]: row for row in rows_of(page) if len(row) == 7}
    assert set(rows) == {'/robot3/imu', 'odometry', 'local_pose'}
    assert rows['/robot3/imu'][1:] == ['190', '18.9', '0.600', '1', '0.600', '7']
    assert rows['odometry'][1:] == ['201', '20.0', '0.050', '0', '0.050', '0']


@pytest.mark.parametrize('value, form, text', [
    (-0.0004, '{:+.2f}', '+0.00'), (-0.0004, '{:.1f}', '0.0'), (-0.006, '{:+.2f}', '-0.01'),
    (math.nan, '{:.2f}', '\u2013'), (math.inf, '{:.2f}', '\u2013')])
def test_a_number_is_never_minus_zero_and_an_unknown_one_is_a_dash(value, form, text):
    assert number(value, form) == text


def test_a_cell_of_plain_text_is_escaped():
    assert '<td>&lt;x&gt;</td>' in table(['a'], [['<x>']])
