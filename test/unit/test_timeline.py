"""The timeline of a run: no recorded value is far from its curve. The page needs no other file."""
import json
import math
import re
import shutil
import subprocess
from html import unescape

import numpy as np
import pytest
from hypothesis import given, strategies
from made_run import (
    TIME, X, ZERO, imu_samples, made, poses, reset_lines, speeds_sent, variables)

from tb3_labs.recording.run_data import LogLines, Numbers, Samples
from tb3_labs.report.motion.drives import drive_reports
from tb3_labs.report.motion.resets_and_goals import frame_intervals
from tb3_labs.report.page import timeline
from tb3_labs.report.page.moments import timeline_events
from tb3_labs.robot.turtlebot3 import robot_model

BURGER = robot_model('burger')
CHROMIUM = shutil.which('chromium')


def decoded(track):
    """(times, columns, breaks) as arrays."""
    return np.array(track['time']), list(map(np.array, track['columns'])), track['breaks']


def data_of(run):
    return timeline.timeline_data(run, BURGER, timeline_events(run, [], drive_reports(run)))


@given(strategies.lists(strategies.floats(-0.02, 0.02), min_size=2, max_size=300),
       strategies.integers(0, 2 ** 32 - 1))
def test_no_value_is_farther_from_its_track_than_the_bound(steps, seed):
    values = np.cumsum(steps)
    time = np.cumsum(np.random.RandomState(seed).uniform(0.002, 0.05, len(values)))
    at, (column,), _ = decoded(timeline.track_data(time, [values], [0.002]))
    assert np.abs(np.interp(time, at, column) - values).max() <= (
        0.002 + 0.00005 + 0.001 * 0.02 / 0.002)    # the value and its time are rounded


@pytest.mark.parametrize('values, times, kept', [
    (0.3 * TIME, [0.0, 10.0], [0.0, 3.0]),
    ((TIME >= 5.0) * 1.0, [0.0, 4.95, 5.0, 10.0], [0.0, 0.0, 1.0, 1.0])], ids=['line', 'step'])
def test_a_straight_line_keeps_its_ends_and_a_step_is_not_smoothed(values, times, kept):
    at, (column,), breaks = decoded(timeline.track_data(TIME, [values], [0.002]))
    assert list(at) == pytest.approx(times) and list(column) == pytest.approx(kept) and not len(breaks)


def test_a_silence_is_a_break_and_not_a_line():
    time = TIME[(TIME < 3.0) | (TIME > 5.0)]
    at, _, (gap,) = decoded(timeline.track_data(time, [time], [0.002]))
    assert at[gap - 1] == pytest.approx(2.95) and at[gap] == pytest.approx(5.05)


def test_ten_minutes_with_noise_fit_a_page():
    """120,000 samples of a gyro with the noise of the real Burger's, while it turns to and fro."""
    time = np.arange(120000) / 200.0
    noise = np.random.RandomState(3).normal(0.0, 1.0, (2, len(time)))
    run = made(duration=600.0, imu=imu_samples(
        time, time, 2.0 * np.sin(time / 3.0) + math.radians(0.03) * noise[0],
        2.0 / 3.0 * np.cos(time / 3.0) + 0.01 * noise[1]))
    assert len(timeline.timeline_html(data_of(run))) < 1e6


def test_the_robot_is_where_it_was_recorded():
    data = data_of(made())
    at, (x, y, yaw), _ = decoded(data['odom'])
    assert np.interp([0.5, 3.5, 9.0], at, x) == pytest.approx([0.0, 0.5, 1.0], abs=0.002)
    assert not y.any() and not yaw.any()
    assert [state for _, state, _ in data['goals']][:2] == ['ROTATE_TO_GOAL', 'MOVE_FORWARD']
    assert data['goals'][0][2] == [1.0, 0.0, 0.0]


def test_a_reset_is_an_event_and_the_frame_jumps_there():
    """At 8 s the robot, 1 m from the origin, is declared to be at (0, 0)."""
    run = made(local_pose=poses(x=X - (TIME >= 8.0)), resets=reset_lines(8.0))
    data = data_of(run)
    (reset,) = [event for event in data['marks'] if event['kind'] == 'reset']
    assert reset['begin'] == pytest.approx(8.0, abs=0.051)
    at, (x, _, _), (jump,) = decoded(data['frame'])
    assert list(x[:jump]) == pytest.approx([0.0] * jump, abs=0.002)
    assert list(x[jump:]) == pytest.approx([1.0] * (len(x) - jump), abs=0.002)
    assert at[jump] == pytest.approx(8.0, abs=0.051)


def test_a_reset_of_the_board_is_an_event_but_no_reset_of_local():
    run = made(board_resets=Samples(*np.array([[8.0], [8.0]])))
    event, = [event for event in data_of(run)['marks'] if event['kind'] == 'reset']
    assert event['begin'] == 8.0 and 'board' in event['text'] and len(frame_intervals(run)) == 1


def test_changes_of_control_and_silences_are_events():
    keep = TIME[(TIME < 2.0) | (TIME > 3.0)]
    run = made(imu=imu_samples(keep, keep, 0.0 * keep, 0.0 * keep),
               control=Numbers(*np.array([(0.5, 4.0), (0.5, 4.0), (1.0, 0.0)])))
    words = [(event['kind'], event['text']) for event in data_of(run)['marks']]
    assert ('lost', 'imu silent for 1.1 s') in words
    assert [word for word in words if 'control' in word[1]] == [
        ('start', 'control given to the node'), ('stop', 'control taken from the node')]


def test_a_command_ends_with_the_robots_timeout():
    run = made(commands=speeds_sent(*np.array([
        (1.0, 1.1, 4.0), (1.0, 1.1, 4.0), (0.1, 0.1, 0.2), (0.0, 0.0, 0.0)])))
    assert data_of(run)['commands'] == [
        [1.0, 0.1, 0.0], [1.6, None, None], [4.0, 0.2, 0.0], [4.5, None, None]]


LINE = '</script><b>&amp; "'


@pytest.fixture(scope='module')
def page():
    words = [np.array(words, dtype=object) for words in (
        ['info', 'info', 'warning'], ['/node', '/record', '/node'], ['started', 'heard', LINE])]
    keep = (TIME < 2.0) | (TIME > 3.0)
    run = made(log=LogLines(np.array([0.0, 1.0, 5.0]), np.array([0.0, 1.0, 5.0]), *words),
               imu=imu_samples(TIME[keep], TIME[keep], 0.1 * TIME[keep], ZERO[keep] + 0.1),
               local_pose=poses(x=X - (TIME >= 8.0)), resets=reset_lines(8.0),
               commands=speeds_sent(*np.array([(1.0, 1.4), (1.0, 1.4), (0.1, -0.2), (0.0, 0.0)])),
               variables=variables(
                   goal=TIME ** 2, state=['A'] * 100 + [LINE] * 101, turning=TIME >= 4.0, K_HDG='0.1',
                   has_control=TIME < 4.0,
                   mixed=['None'] * 20 + [*TIME[20:100]] + ['nan', 'inf'] * 10 + [*TIME[120:]],
                   absurd=1.7e308 * np.sin(TIME), words=[f'{at:.1f} s' for at in TIME],
                   **{f'a{k}': 1e299 * np.sin(TIME) for k in range(20)}))
    return timeline.timeline_html(data_of(run))


def test_the_page_needs_no_other_file(page):
    assert not re.search(r'\bsrc=|href="(?!#t=)|^import |https?://|@import', page, re.MULTILINE)


def test_no_text_of_a_node_can_end_the_data(page):
    inside = page.split('type="application/json">')[1].split('</script>')[0]
    data = json.loads(inside)
    assert data['log'][-1] == [5.0, 'warning', 'node: ' + LINE]
    assert data['variables'][1][2] == ['A', LINE, None] and '</script><b>' not in page


#: Moves the slider, or clicks, and records the page's state.
WATCH = '''<a href="#t=6">Watch it</a><pre id="seen"></pre><script>
const seen = [];
const note = () => seen.push(['clock', 'now-state', 'now-pose', 'now-error', 'now-mark'].map(
  (id) => document.getElementById(id).textContent).concat(
  document.querySelectorAll('#run-log li:not(.later)').length));
const click = (place) => { document.querySelector(place).click(); note(); };
const slider = document.getElementById('time');
slider.value = 3.5;
slider.dispatchEvent(new Event('input'));
note();
click('#after'); click('#after'); click('#before'); click('body > a');
const curve = document.getElementById('curve-heading'), area = curve.getBoundingClientRect();
curve.dispatchEvent(new MouseEvent('click', {clientX: area.left + 46 + (area.width - 54) / 4}));
note();
const all = (place, within = document) => [...within.querySelectorAll(place)].map(
  (each) => each.getAttribute('d') || each.title || each.textContent);
seen.push(all('#curve-heading .measured, #curve-speed .commanded'),
  [...document.querySelectorAll('#variables figure')].map(
    (figure) => [all('figcaption', figure)[0], all('.variable', figure)[0], all('.level', figure)]),
  all('#run-log li'), all('#mark-list a'), all('#marks a'));
document.getElementById('seen').textContent = JSON.stringify(seen);
</script>'''


def points_of(path):
    """The pieces of a line of a curve: arrays of (time, value)."""
    return [np.array([point.split() for point in piece.split('L')], dtype=float) * (1.0, -1.0)
            for piece in path.split('M')[1:]]


@pytest.mark.skipif(not CHROMIUM, reason='no browser: sudo apt install chromium')
def test_a_browser_draws_the_run_and_shows_each_moment(page, tmp_path):
    file = tmp_path / 'page.html'
    file.write_text('<!DOCTYPE html><meta charset="utf-8"><body>' + page + WATCH, encoding='utf-8')
    shown = subprocess.run([
        CHROMIUM, '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic',
        '--no-first-run', '--disable-background-networking', '--disable-component-update',
        '--disable-sync', '--user-data-dir={}'.format(tmp_path / 'user'), '--dump-dom',
        file.as_uri()], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=600).stdout
    *seen, lines, figures, log, mark_list, marks = json.loads(unescape(
        re.search(r'id="seen">(.*?)</pre>', shown.decode()).group(1)))
    clocks = [float(row[0].split()[0]) for row in seen]
    assert clocks == pytest.approx([3.5, 8.0, 10.0, 8.0, 6.0, 2.5], abs=0.06)
    assert [row[1] for row in seen[:3]] == ['MOVE_FORWARD', 'GOAL_REACHED', 'GOAL_REACHED']
    assert seen[0][2].startswith('0.500 m, 0.000 m') and seen[2][2].startswith('0.000 m')
    assert seen[0][3].startswith('0.500 m') and seen[1][4] == 'reset 1 of local'
    assert [row[5] for row in seen[:3]] == [1, 2, 2]
    (before, after), (steps,) = map(points_of, lines)
    assert [tuple(piece[[0, -1], 0]) for piece in (before, after)] == [(0.0, 1.95), (3.05, 10.0)]
    for piece in before, after:
        assert piece[:, 1] == pytest.approx(np.degrees(0.1 * piece[:, 0]), abs=0.2)
    assert steps == pytest.approx(np.array([(1.0, 0.1), (1.4, 0.1), (1.4, -0.2), (1.9, -0.2)]))
    assert log[1] == '5.00 s\u2002node: ' + LINE
    assert marks[1:] == ['imu silent for 1.1 s', 'reset 1 of local'] and len(mark_list) == 3
    assert [name for name, *_ in figures] == [
        'turning', 'state', 'has_control', 'goal', 'mixed', *(f'a{k}' for k in range(7))]
    assert [levels for *_, levels in figures[:3]] == [['False', 'True'], [LINE, 'A'], ['False', 'True']]
    (steps,), _, _, (goal,), mixed = (points_of(line) for _, line, _ in figures[:5])
    assert steps.tolist() == [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [10.0, 1.0]]
    assert goal[::2, 1] == pytest.approx(goal[::2, 0] ** 2, rel=1e-4)
    assert [tuple(piece[[0, -1], 0]) for piece in mixed] == [(1.0, 5.0), (6.0, 10.0)]
