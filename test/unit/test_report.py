"""The run report, from bag to page: pictures, tables, CSV files, the command and its refusals."""
import base64
import csv
import math
import re
import runpy
import shutil
import subprocess
import sys
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from made_run import (
    STATES, TIME, ZERO, drive, driven, goals, imu_samples, made, poses, rows_of, speeds_sent,
    states, table_in, turn, without_pictures)
from pages import SCRIPTS
from recorded_run import (  # noqa: F401
    BURGER, bag, odometry_jumps, run, sensors, write_bag)
from recorded_trial import write_trial

from tb3_labs.command_line import write_output
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.trial.observation import NodeProcess, Observation, Stimulus
from tb3_labs.recording.run_data import MIN_LEAP, LogLines, OdometrySamples, Poses, Texts
from tb3_labs.report.page.document import number_text, table

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from tb3_labs.recording.ros_bag import read_run
from tb3_labs.report.motion.drives import drive_reports
from tb3_labs.report.motion.movements import with_derived_fields
from tb3_labs.report.page.printed_figures import paths_figure
from tb3_labs.report.page.files import COMPUTED_NOTE, NO_DRIVE, samples_csv, write_report


def lab_report(*words):
    """The exit status of the command."""
    return runpy.run_path(str(SCRIPTS / 'lab_report.py'))['main']([str(word) for word in words])


def with_goals_of_trial(run):
    return runpy.run_path(str(SCRIPTS / 'lab_report.py'))['with_goals_of_trial'](run)


def words_of(run, folder):
    with without_pictures():
        return write_report(run, BURGER, folder)[0].read_text(encoding='utf-8')


# The command --------------------------------------------------------------------------------------

def test_the_bag_of_a_trial_has_the_goals_and_resets_of_the_marker(tmp_path):
    drive_stimulus = Stimulus('first drive', 1.0, 5.0, facts={'goal': [0.8, -0.4, 0.15]})
    seen = Observation('move2goal', 'lab7_tf/move2goal_tf.py', processes=[NodeProcess(0.0)], stimuli=[drive_stimulus])
    write_trial(tmp_path / 'trial.bag', seen)
    assert with_goals_of_trial(read_run(str(tmp_path / 'trial.bag'))).goals.pose(0) == Pose2(0.8, -0.4, 0.15)


@pytest.mark.parametrize('goal', ['["a", "b", "c"]', '[1]', 'null', '[NaN, 0, 0]', '[1e999, 0, 0]'])
def test_the_events_of_a_strangers_bag_may_be_any_texts(goal):
    trial = ['{"kind": "trial", "lab": "x", "node": "y"}', '{"kind": "begin", "name": "z"}',
             '{"kind": "end", "facts": {"goal": %s}}' % goal]
    for texts in (['5'], ['{}'], ['hello'], ['{"kind": "end"}'], trial):
        run = made(events=states(*((float(k), text) for k, text in enumerate(texts))))
        assert with_goals_of_trial(run) is run


def test_the_page_the_pictures_and_the_csv(bag, tmp_path, capsys):
    (tmp_path / 'out').mkdir()                                   # a report may be written again
    assert lab_report(bag, '-o', tmp_path / 'out') == 0
    assert capsys.readouterr().out == (
        'Report: {}/report.html\nBeside it: run.csv, turns.csv, drives.csv, paths.png\n'.format(tmp_path / 'out'))
    page = (tmp_path / 'out' / 'report.html').read_text(encoding='utf-8')
    assert '0.99 m driven, resets: 1.' in page
    images = re.findall(r'alt="(\w+)" src="data:image/png;base64,([^"]*)"', page)
    assert [name for name, _ in images] == ['paths']
    for name, coded in images:
        png = base64.b64decode(coded)
        assert png[:4] == b'\x89PNG' and png == (tmp_path / 'out' / (name + '.png')).read_bytes()
    text = re.sub('base64,[^"]*', '', page)
    assert not re.search('https?:|<script src|<link|url\\(', text)
    first, second = (row for row in rows_of(text) if len(row) == 12)
    assert first[5:11] == ['reached', '6.50', '0.0120', '-0.70', '0.0500', '-2.00']
    assert second[5:6] + second[7:11] == [
        'gave up: it is stuck, alas', '0.5000', '-90.00', '0.5000', '-90.00']
    assert [(row['run'], row['drive'], row['distance_error_m'])
            for row in table_in(tmp_path / 'out' / 'drives.csv')] == [
        ('run.bag', '1', '0.0120'), ('run.bag', '2', '0.5000')]
    rows = table_in(tmp_path / 'out' / 'run.csv')
    assert len(rows) == 241


def test_the_template_has_the_name_of_the_figure_of_turns(tmp_path):
    page, *others = write_report(with_derived_fields(driven([turn(1.0, 90.0), turn(4.0, -90.0)])), BURGER, tmp_path)
    names = [path.name for path in others]
    assert names == ['run.csv', 'turns.csv', 'drives.csv', 'turns.png']
    text = page.read_text(encoding='utf-8')
    assert 'Beside this page: {}.'.format(', '.join(names)) in text and 'File: turns.png.' in text
    template = (SCRIPTS.parent / 'doc' / 'report_template.md').read_text(encoding='utf-8')
    assert re.findall(r'`(\w+\.png)`', template) == ['turns.png']


def test_no_output_goes_through_a_link(bag, tmp_path, capsys, monkeypatch):
    """A zip from a stranger may hold the report's folder, with links to files of the reader."""
    monkeypatch.setattr('tb3_labs.report.page.printed_figures.png', lambda figure: b'')
    theirs, folder = tmp_path / 'profile', tmp_path / 'out'
    theirs.write_text('mine')
    folder.mkdir()
    names = 'report.html', 'run.csv', 'turns.csv', 'drives.csv', 'paths.png'
    for name in names:
        (folder / name).symlink_to(theirs)
    assert lab_report(bag, '-o', folder) == 0
    assert theirs.read_text() == 'mine' and sorted(folder.iterdir()) == sorted(
        folder / name for name in names if not (folder / name).is_symlink())
    (tmp_path / 'link').symlink_to(folder)
    assert lab_report(bag, '-o', tmp_path / 'link') == 1
    line, = capsys.readouterr().err.splitlines()
    assert 'link: it is a link to another folder; choose another folder with -o' in line


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    (tmp_path / 'run.csv').write_text('old')
    with pytest.raises(TypeError):
        write_output(tmp_path / 'run.csv', None)
    (tmp_path / 'folder').mkdir()
    with pytest.raises(OSError):
        write_output(tmp_path / 'folder', 'new')
    write_output(tmp_path / 'new', b'new')
    assert sorted(path.name for path in tmp_path.iterdir()) == ['folder', 'new', 'run.csv']
    assert (tmp_path / 'run.csv').read_text() == 'old'
    assert (tmp_path / 'new').stat().st_mode == (tmp_path / 'run.csv').stat().st_mode


def test_a_bag_of_sensors_only(tmp_path):
    with without_pictures():
        assert lab_report(write_bag(tmp_path / 'sensors.bag', sources=(sensors,))) == 0
    page = (tmp_path / 'sensors_report' / 'report.html').read_text(encoding='utf-8')
    assert 'No drives are listed' in page and COMPUTED_NOTE in page


@pytest.fixture(scope='module')
def odd_bags(bag, tmp_path_factory):
    """A folder of bags that cannot be reported, and a good one."""
    folder = tmp_path_factory.mktemp('odd')
    shutil.copy(str(bag), str(folder))
    (folder / 'text.bag').write_text('#ROSBAG V1.2')
    write_bag(folder / 'still.bag', keep=lambda name: name != 'odom')
    return folder


@pytest.mark.parametrize('words, said', [
    ('none.bag', 'none.bag: cannot be read (No such file or directory)'),
    ('text.bag', 'not a bag of ROS 1, version 2.0'),
    ('.', 'cannot be read (Is a directory)'),
    ('still.bag', 'no nav_msgs/Odometry'), ('run.bag -o text.bag/report', 'choose another folder')])
def test_a_bag_that_cannot_be_reported_gives_one_line(words, said, odd_bags, monkeypatch, capsys):
    monkeypatch.chdir(odd_bags)
    assert lab_report(*words.split()) == 1
    line, = capsys.readouterr().err.strip().splitlines()
    assert said in line


def test_settings_for_matplotlib_in_the_folder_of_a_stranger_do_nothing(tmp_path):
    """matplotlib reads matplotlibrc in the current folder. By this file it would run LaTeX, or draw nothing."""
    (tmp_path / 'matplotlibrc').write_text('lines.linewidth: nonsense\ntext.usetex: True\n'
                                           'figure.facecolor: red\n')
    seen = subprocess.check_output(
        [sys.executable, '-c', 'from tb3_labs.report.page.printed_figures import matplotlib as m; '
         "print(m.rcParams['text.usetex'], m.rcParams['figure.facecolor'], m.rcParams['lines.linewidth'])"],
        cwd=str(tmp_path), stderr=subprocess.STDOUT, universal_newlines=True)
    assert seen == 'False white 1.5\n'


def test_a_missing_matplotlib_gives_one_line(bag, monkeypatch, capsys):
    for name in [name for name in sys.modules if name.startswith(
            ('matplotlib', 'tb3_labs.report'))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, 'matplotlib', None)
    monkeypatch.delattr('tb3_labs.report', raising=False)
    assert lab_report(bag) == 1
    said, = capsys.readouterr().err.splitlines()
    assert 'sudo apt install --no-install-recommends python3-matplotlib' in said


def test_the_true_path_is_drawn_along_an_odometry_that_is_set_to_zero(run):
    here = run.odometry.pose(np.searchsorted(run.odometry.time, 3.99))
    run = odometry_jumps(run, 4.0, here.inverse())
    in_odom, in_local = paths_figure(run, drive_reports(run)).axes
    lines = [line for line in in_odom.get_lines() if len(line.get_xdata()) > 5]
    star = [line for line in in_odom.get_lines() if line.get_marker() == '*'][0]      # the goal of the first drive
    goal = here.inverse() @ Pose2(2.0, 1.0, 0.5) @ Pose2(1.0, 0.0, 0.0)
    assert star.get_xydata()[0] == pytest.approx((goal.x, goal.y), abs=1e-6)
    # the path and the truth, before the reset and after it
    assert [line.get_color() == '#bbbbbb' for line in lines] == 2 * [False, True]
    for line in lines:
        x, y = line.get_data()
        assert np.nanmax(np.hypot(np.diff(x), np.diff(y))) < MIN_LEAP
        near = np.hypot(x[:, None] - run.odometry.x, y[:, None] - run.odometry.y).min(axis=1)
        assert np.nanmax(near) < 0.06                  # the drive truly ends 0.05 m beside the goal
    true_in_local = [line for line in in_local.get_lines() if line.get_color() == '#bbbbbb'][0]
    assert true_in_local.get_xydata()[-1] == pytest.approx((0.97, 0.04), abs=1e-3)


# The tables as CSV --------------------------------------------------------------------------------

def test_the_rows_of_two_runs_fit_into_one_spreadsheet(tmp_path):
    """Turns beyond 90 deg, and a drive: a turn to the left, 0.8 m, a turn back. It ends 0.2 m beyond its goal."""
    runs = (('lab', [turn(2.0, 92.0), turn(6.0, 94.0)]), ('precise', [turn(2.0, -91.5)]),
            ('precise', drive(2.0, 90.0, 0.8, -80.0)))
    rows = {'turns': [], 'drives': []}
    for name, moves in runs:
        words_of(replace(with_derived_fields(driven(moves), Pose2(0.0, 0.6, 0.0)), name=name), tmp_path)
        for word, known in rows.items():
            known += table_in(tmp_path / (word + '.csv'))
    assert [row['run'] + row['turn'] for row in rows['turns']] == ['lab1', 'lab2', 'precise1']
    assert [row['run'] + row['drive'] for row in rows['drives']] == ['precise1']
    for word, column, expected, bound in (
            ('turns', 'turned_deg', [92.0, 94.0, -91.5], 0.15), ('turns', 'asked_deg', [90.0, 90.0, -90.0], 0.0),
            ('turns', 'error_deg', [2.0, 4.0, 1.5], 0.15), ('drives', 'distance_error_m', [0.2], 0.5e-3),
            ('drives', 'angle_error_deg', [-10.0], 0.5)):
        assert [float(row[column]) for row in rows[word]] == pytest.approx(expected, abs=bound)


def test_a_spreadsheet_reads_no_formula_in_a_state(tmp_path):
    words_of(made(states=states(*STATES[:3], (7.0, '=1+1'))), tmp_path)
    assert [row['outcome'] for row in table_in(tmp_path / 'drives.csv')] == ["'=1+1"]


def csv_of(**parts):
    """The rows of run.csv of a made run."""
    return list(csv.DictReader(StringIO(samples_csv(made(**parts)))))


def test_a_row_has_what_was_recorded_at_its_time():
    own = TIME[::2]
    row = csv_of(
        odometry=OdometrySamples(
            own, own, 2.0 + 0.0 * own, 0.1 * own, 0.01 * own, 0.3 * own, 0.0 * own),
        imu=imu_samples(TIME, TIME, 0.02 * TIME, 0.5 * TIME))[30]                    # 3 s
    expected = dict(
        time_s=3.0, odom_x_m=2.0, odom_y_m=0.3, odom_yaw_deg=math.degrees(0.03),
        imu_yaw_deg=math.degrees(0.06), linear_m_s=0.9, angular_rad_s=1.5)
    for name, value in expected.items():
        assert float(row[name]) == pytest.approx(value, abs=6e-5), name
    assert row['linear_commanded_m_s'] == '' and list(row)[0] == 'time_s' and len(row) == 9


def test_a_command_holds_until_the_next_one_or_its_timeout():
    sent = np.array([1.0, 1.2, 5.0])
    rows = {float(row['time_s']): (row['linear_commanded_m_s'], row['angular_commanded_rad_s'])
            for row in csv_of(commands=speeds_sent(
                sent, sent, np.array([0.1, 0.2, 0.3]), np.array([1.0, 2.0, 3.0])))}
    assert rows[0.95] == rows[1.75] == ('', '')
    assert rows[1.0] == rows[1.15] == ('0.1000', '1.0000')
    assert rows[1.2] == rows[1.65] == ('0.2000', '2.0000')


# The page -----------------------------------------------------------------------------------------

def test_the_page_has_a_row_for_each_drive(tmp_path):
    """The odometry keeps 0. The IMU is at 0.5 rad until 1.3 s, then turns by 3 deg until 6 s."""
    yaw = np.radians(np.interp(TIME, [1.3, 6.0], [0.0, 3.0]))
    page = words_of(made(
        start=1.7e9, goals=goals([0.5, 8.5], [1.03, 3.0], 0.04, 0.1), local_pose=poses(yaw=yaw),
        states=states(*STATES[:3], (6.5, 'stopped: no imu'), (7.0, 'GOAL_REACHED'),
                      (8.5, 'ROTATE_TO_GOAL')),
        imu=imu_samples(TIME, TIME, yaw + 0.5, ZERO).take((TIME < 8.01) | (TIME > 8.59)),
        notes=('invalid messages: 7',)), str(tmp_path / 'a' / 'b'))
    assert 'Burger on 2023-11-1' in page and (
        '10.0 s, 1.00 m driven, resets: 0.' in page and '<p>Invalid messages: 7.</p>' in page)
    first, second = (row for row in rows_of(page) if len(row) == 12)
    angle = math.degrees(0.1) - 3.0
    assert first[:7] == ['1', '0.50', '1.03', '0.04', '5.7', 'reached', '6.50']
    assert first[7:11] == ['0.0500', '{:+.2f}'.format(angle), '', '']
    assert first[11][0] == '+' and float(first[11]) == pytest.approx(2.97, abs=0.05)
    assert second[:7] == ['2', '8.50', '3.00', '0.04', '5.7', 'recording ended', '1.50']
    assert second[11] == ''


def test_the_page_has_each_exception_once_and_the_open_todos(tmp_path):
    error = 'Traceback (most recent call last):\n  File "a.py", line 7, in f\nValueError: <x>'
    texts = [error, 'all is well', 'TODO 3 is open', error]
    columns = [np.array(column, dtype=object) for column in (['error'] * 4, ['/node'] * 4, texts)]
    page = words_of(made(log=LogLines(np.arange(4.0), np.arange(4.0), *columns)), tmp_path)
    assert '<b>An exception was raised: ValueError: &lt;x&gt;, line 7.</b> (2 times) <a href="#t=0.0">' in page
    assert '<b>The node said: TODO 3 is open.</b> (once) <a href="#t=2.0">' in page


def test_a_drive_without_a_recorded_goal_has_no_errors(tmp_path):
    text = words_of(made(goals=Poses.none()), tmp_path)
    row, = (row for row in rows_of(text) if len(row) == 12)
    assert row[:11] == ['1', '0.50', '', '', '', 'reached', '6.50', '', '', '', '']


@pytest.mark.parametrize('goal, outcome', [
    (None, 'came to rest (the goal is assumed)'), (Pose2(0.0, 0.6, 0.0), 'came to rest')])
def test_the_row_of_a_drive_has_a_note_if_its_goal_is_assumed(goal, outcome, tmp_path):
    text = words_of(with_derived_fields(driven(drive(2.0, 90.0, 0.8, -80.0)), goal), tmp_path)
    row, = (row for row in rows_of(text) if len(row) == 12)
    row_of_csv, = table_in(tmp_path / 'drives.csv')
    assert row[5] == row_of_csv['outcome'] == outcome


def test_a_page_without_drives_has_a_sentence_about_the_lack(tmp_path):
    text = words_of(made(states=Texts.none()), tmp_path)
    assert NO_DRIVE in text and 'None' not in text


def test_a_page_says_that_values_were_not_recorded(tmp_path):
    assert COMPUTED_NOTE in words_of(with_derived_fields(driven(drive(2.0, 90.0, 0.8, -80.0))), tmp_path)
    assert COMPUTED_NOTE[:30] not in words_of(made(), tmp_path)


@pytest.mark.parametrize('value, form, text', [
    (-0.0004, '{:+.2f}', '+0.00'), (-0.0004, '{:.1f}', '0.0'), (-0.006, '{:+.2f}', '-0.01'),
    (math.nan, '{:.2f}', '\u2013'), (math.inf, '{:.2f}', '\u2013')])
def test_a_number_is_never_minus_zero_and_an_unknown_one_is_a_dash(value, form, text):
    assert number_text(value, form) == text


def test_a_cell_of_plain_text_is_escaped():
    assert '<td data-head="&lt;a&gt;">&lt;x&gt;</td>' in table(['<a>'], [['<x>']])
