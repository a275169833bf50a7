"""The timeline of a run: no recorded value is far from its curve, and the page needs nothing else."""
import json
import math
import re
import shutil
import subprocess

import numpy as np
import pytest
from hypothesis import given, strategies
from made_run import TIME, X, ZERO, made, poses

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from tb3_labs.report import timeline  # noqa: E402
from tb3_labs.report.again import control_moment, parting, sentences  # noqa: E402
from tb3_labs.report.drives import drives  # noqa: E402
from tb3_labs.report.run_data import Commands, ImuSamples, LogLines, Values  # noqa: E402
from tb3_labs.robot.turtlebot3 import robot_model  # noqa: E402

BURGER = robot_model('burger')
CHROMIUM = shutil.which('chromium')


def decoded(track):
    """(times, columns, breaks) as arrays."""
    return np.array(track['time']), list(map(np.array, track['columns'])), track['breaks']


def data_of(run):
    return timeline.timeline(run, BURGER, timeline.marks(run, [], drives(run, BURGER)))


# Tracks -------------------------------------------------------------------------------------------

@given(strategies.lists(strategies.floats(-0.02, 0.02), min_size=2, max_size=300),
       strategies.integers(0, 2 ** 32 - 1))
def test_no_value_is_farther_from_its_track_than_the_bound(steps, seed):
    values = np.cumsum(steps)
    time = np.cumsum(np.random.RandomState(seed).uniform(0.002, 0.05, len(values)))
    at, (column,), _ = decoded(timeline.track(time, [values], ['m']))
    assert np.abs(np.interp(time, at, column) - values).max() <= (
        timeline.BOUNDS['m'] + 0.001 * 0.02 / 0.002)    # a time is rounded, too


def test_a_straight_line_keeps_its_ends():
    at, (column,), breaks = decoded(timeline.track(TIME, [0.3 * TIME], ['m']))
    assert list(at) == [0.0, 10.0] and list(column) == pytest.approx([0.0, 3.0]) and breaks == []


def test_a_step_is_not_smoothed():
    at, (column,), _ = decoded(timeline.track(TIME, [(TIME >= 5.0) * 1.0], ['m']))
    assert list(at) == pytest.approx([0.0, 4.95, 5.0, 10.0])
    assert list(column) == pytest.approx([0.0, 0.0, 1.0, 1.0])


def test_a_silence_is_a_break_and_not_a_line():
    time = TIME[(TIME < 3.0) | (TIME > 5.0)]
    at, _, (gap,) = decoded(timeline.track(time, [time], ['m']))
    assert at[gap - 1] == pytest.approx(2.95) and at[gap] == pytest.approx(5.05)


def test_ten_minutes_with_noise_fit_a_page():
    """120,000 samples of a gyro with the noise of the real Burger's, while it turns to and fro."""
    time = np.arange(120000) / 200.0
    noise = np.random.RandomState(3).normal(0.0, 1.0, (2, len(time)))
    run = made(duration=600.0, imu=ImuSamples(
        time, time, 2.0 * np.sin(time / 3.0) + math.radians(0.03) * noise[0],
        2.0 / 3.0 * np.cos(time / 3.0) + 0.01 * noise[1]))
    assert len(timeline.section(data_of(run))) < 1e6


# The run ------------------------------------------------------------------------------------------

def test_the_robot_is_where_it_was_recorded():
    data = data_of(made())
    at, (x, y, yaw), _ = decoded(data['odom'])
    assert np.interp([0.5, 3.5, 9.0], at, x) == pytest.approx([0.0, 0.5, 1.0], abs=0.002)
    assert not y.any() and not yaw.any()
    assert [state for _, state, _ in data['goals']][:2] == ['ROTATE_TO_GOAL', 'MOVE_FORWARD']
    assert data['goals'][0][2] == [1.0, 0.0, 0.0]


def test_a_reset_is_a_mark_and_the_frame_jumps_there():
    """At 8 s the robot, 1 m from the origin, is declared to be at (0, 0)."""
    run = made(local_pose=poses(x=X - (TIME >= 8.0)))
    data = data_of(run)
    (reset,) = [mark for mark in data['marks'] if mark['kind'] == 'reset']
    assert reset['begin'] == pytest.approx(8.0, abs=0.051)
    at, (x, _, _), (jump,) = decoded(data['frame'])
    assert list(x[:jump]) == pytest.approx([0.0] * jump, abs=0.002)
    assert list(x[jump:]) == pytest.approx([1.0] * (len(x) - jump), abs=0.002)
    assert at[jump] == pytest.approx(8.0, abs=0.051)


def test_the_true_robot_stands_in_odom_where_its_first_pose_says():
    """The truth has a frame of its own: turned by 90 degrees, and elsewhere."""
    truth = poses(x=5.0 - ZERO, y=2.0 + X, yaw=ZERO + math.pi / 2.0)
    at, (x, y, yaw), _ = decoded(data_of(made(ground_truth=truth))['truth'])
    assert np.interp([0.5, 3.5, 9.0], at, x) == pytest.approx([0.0, 0.5, 1.0], abs=0.004)
    assert list(y) == pytest.approx(0.0 * y, abs=0.004) and list(yaw) == pytest.approx(0.0 * yaw)


def test_marks_name_stops_silences_and_who_may_drive():
    keep = TIME[(TIME < 2.0) | (TIME > 3.0)]
    run = made(imu=ImuSamples(keep, keep, 0.0 * keep, 0.0 * keep),
               control=Values(*np.array([(0.5, 4.0), (0.5, 4.0), (1.0, 0.0)])))
    words = [(mark['kind'], mark['text']) for mark in data_of(run)['marks']]
    assert ('lost', 'imu silent for 1.1 s') in words
    assert [word for word in words if 'control' in word[1]] == [
        ('start', 'control given to the node'), ('stop', 'control taken from the node')]


def test_a_command_ends_with_the_robots_timeout():
    run = made(commands=Commands(*np.array([(1.0, 1.1, 4.0), (1.0, 1.1, 4.0), (0.1, 0.1, 0.2),
                                            (0.0, 0.0, 0.0)])))
    assert data_of(run)['commands'] == [
        [1.0, 0.1, 0.0], [1.6, None, None], [4.0, 0.2, 0.0], [4.5, None, None]]


# Another node in the same run ---------------------------------------------------------------------

def commanded(*rows):
    """Commands at 10 Hz: (from, until, m/s, rad/s) of each stretch."""
    times = np.concatenate([np.arange(begin, end - 1e-9, 0.1) for begin, end, _, _ in rows])
    speeds = np.concatenate([[row[2:]] * int(round((row[1] - row[0]) * 10)) for row in rows])
    return Commands(times, times, *speeds.T)


RECORDED = (1.0, 3.0, 0.0, 0.7), (3.0, 6.0, 0.15, 0.0), (6.0, 6.1, 0.0, 0.0)


@pytest.mark.parametrize('rows, time', [
    (RECORDED, None),
    ([(begin + 0.15, end + 0.15, *speeds) for begin, end, *speeds in RECORDED], None),   # later
    ([(begin, end, v, 1.1 * w) for begin, end, v, w in RECORDED], None),
    ([(1.0, 3.0, 0.0, -0.7), *RECORDED[1:]], 1.0),                                # the other way
    ([*RECORDED[:1], (3.0, 9.0, 0.15, 0.0)], 6.2),                                # without an end
    ([*RECORDED[:1], (3.0, 6.0, 0.19, 0.0)], 3.0),                                # faster
    (RECORDED[:1], 3.0),                                                          # no drive
    ([(1.5, 3.0, 0.0, 0.7), *RECORDED[1:]], 1.2)])                                # begins late
def test_two_nodes_part_when_one_commands_what_the_other_does_not(rows, time):
    found = parting(made(commands=commanded(*RECORDED)), commanded(*rows))
    assert (found is None) == (time is None)
    assert time is None or found.time == pytest.approx(time, abs=0.21)
    assert len(sentences(found)) == 2


def test_a_person_who_drives_is_not_compared():
    """Control is taken at 3.5 s, and a person drives on."""
    run = made(commands=commanded(*RECORDED), control=Values(*np.array([
        (0.5, 3.5), (0.5, 3.5), (1.0, 0.0)])))
    assert parting(run, commanded(RECORDED[0], (3.0, 3.5, 0.15, 0.0), (3.5, 3.6, 0.0, 0.0))) is None
    assert parting(run, commanded(RECORDED[0])).time == pytest.approx(3.0, abs=0.05)


@pytest.mark.parametrize('at, is_given, moment', [
    (0.5, True, 0.5), (1.4, True, 0.9), (2.5, True, 2.5),       # it drove before: not by this
    (6.4, False, 5.9), (5.0, False, 5.0), (5.75, False, 5.75), (8.0, False, 8.0)])
def test_control_was_heard_before_its_effect(at, is_given, moment):
    assert control_moment(at, is_given, commanded(*RECORDED)) == pytest.approx(moment)


# The page -----------------------------------------------------------------------------------------

LINE = '</script><b>&amp; "'


@pytest.fixture(scope='module')
def page():
    words = [np.array(words, dtype=object) for words in (
        ['info', 'info', 'warning'], ['/node', '/record', '/node'], ['started', 'heard', LINE])]
    run = made(log=LogLines(np.array([0.0, 1.0, 5.0]), np.array([0.0, 1.0, 5.0]), *words),
               local_pose=poses(x=X - (TIME >= 8.0)))
    return timeline.section(data_of(run))


def test_the_page_needs_no_other_file(page):
    assert not re.search(r'\b(src|href)=|^import |https?://|@import', page, re.MULTILINE)


def test_a_log_line_cannot_end_the_data(page):
    inside = page.split('type="application/json">')[1].split('</script>')[0]
    assert json.loads(inside)['log'][1] == [5.0, 'warning', 'node: ' + LINE]


#: Presses a key, or moves the slider, and notes what is seen.
WATCH = '''<a href="#t=6">Watch it</a><pre id="seen"></pre><script>
const seen = [];
const note = () => seen.push(['clock', 'now-state', 'now-pose', 'now-error', 'now-mark'].map(
  (id) => document.getElementById(id).textContent).concat(
  document.querySelectorAll('#run-log li:not(.later)').length));
const key = (name) => {
  document.getElementById('timeline').dispatchEvent(new KeyboardEvent('keydown', {key: name, bubbles: true}));
  note();
};
const slider = document.getElementById('time');
slider.value = 3.5;
slider.dispatchEvent(new Event('input'));
note();
key('ArrowRight'); key('PageDown'); key('End'); key('Home');
document.querySelector('a').click(); key('End');
document.querySelector('a').click(); note();
const curve = document.getElementById('curve-heading'), area = curve.getBoundingClientRect();
curve.dispatchEvent(new MouseEvent('click', {clientX: area.left + 46 + (area.width - 54) / 4}));
note();
document.getElementById('seen').textContent = JSON.stringify(seen);
</script>'''


@pytest.mark.skipif(not CHROMIUM, reason='no browser: sudo apt install chromium')
def test_a_browser_shows_each_moment(page, tmp_path):
    file = tmp_path / 'page.html'
    file.write_text('<!DOCTYPE html><meta charset="utf-8"><body>' + page + WATCH, encoding='utf-8')
    shown = subprocess.run([
        CHROMIUM, '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic',
        '--no-first-run', '--disable-background-networking', '--disable-component-update',
        '--disable-sync', '--user-data-dir={}'.format(tmp_path / 'user'), '--dump-dom',
        file.as_uri()], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=60).stdout
    seen = json.loads(re.search(r'id="seen">(.*?)</pre>', shown.decode()).group(1))
    clocks = [float(row[0].split()[0]) for row in seen]
    assert clocks == pytest.approx([3.5, 4.5, 8.0, 10.0, 0.0, 10.0, 6.0, 2.5], abs=0.06)
    assert [row[1] for row in seen[:5]] == ['MOVE_FORWARD', 'MOVE_FORWARD', 'GOAL_REACHED',
                                        'GOAL_REACHED', '\u2013']
    assert seen[0][2].startswith('0.500 m, 0.000 m') and seen[3][2].startswith('0.000 m')
    assert seen[0][3].startswith('0.500 m') and seen[2][4] == 'reset 1 of local'
    assert [row[5] for row in seen[:5]] == [1, 1, 2, 2, 1]
