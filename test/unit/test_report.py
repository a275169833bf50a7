"""The run report, from bag to page: pictures, tables, the command and its refusals; several runs on
one page."""
import base64
import importlib.util
import math
import pathlib
import re
import sys
from unittest import mock

import numpy as np
import pytest
from made_motion import drive, driven, turn
from made_run import rows_of, table_in, without_pictures
from recorded_run import (  # noqa: F401
    BURGER, MISS, MISS_DEG, bag, odometry_jumps, rosbag, run, sensors, write_bag)
from sensor_msgs.msg import Imu

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.ros_bag import read_run

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from tb3_labs.report.compare import (  # noqa: E402
    drive_errors, summarize, write_comparison)
from tb3_labs.report.movements import completed  # noqa: E402
from tb3_labs.report.page import write_report  # noqa: E402
from tb3_labs.report.path_figures import paths, ways  # noqa: E402
from tb3_labs.report.run_data import LEAP  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]


def script():
    """The command as a module."""
    spec = importlib.util.spec_from_file_location('lab_report', str(ROOT / 'scripts/lab_report.py'))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def lab_report(*words):
    """The exit status of the command."""
    return script().main([str(word) for word in words])


def test_the_page_the_pictures_and_the_csv(bag, tmp_path, capsys):
    (tmp_path / 'out').mkdir()                                   # a report may be written again
    assert lab_report(bag, '-o', tmp_path / 'out') == 0
    assert str(tmp_path / 'out' / 'report.html') in capsys.readouterr().out
    page = (tmp_path / 'out' / 'report.html').read_text(encoding='utf-8')
    assert '0.99 m driven, 1 reset. ' in page
    images = re.findall(r'alt="(\w+)" src="data:image/png;base64,([^"]*)"', page)
    assert [name for name, _ in images] == ['paths', 'errors', 'heading', 'speeds']
    for name, image in images:
        png = base64.b64decode(image)
        assert png[:4] == b'\x89PNG' and png == (tmp_path / 'out' / (name + '.png')).read_bytes()
    text = re.sub('base64,[^"]*', '', page)
    assert not re.search('https?:|<script src|<link|url\\(', text)
    first, second = (row for row in rows_of(text) if len(row) == 11)
    assert first[4:] == ['reached', '6.50', '4.74', '0.0120', '-0.70', '0.0500', '-2.00']
    assert second[4:5] + second[7:] == [
        'gave up: it is stuck, alas', '0.5000', '-90.00', '0.5000', '-90.00']
    table = table_in(tmp_path / 'out' / 'run.csv')
    assert len(table) == 241 and table[-1]['state'] == 'gave up: it is stuck, alas'


@pytest.fixture
def no_pictures():
    with without_pictures():
        yield


def test_a_bag_of_sensors_only(tmp_path, no_pictures):
    path = write_bag(tmp_path / 'sensors.bag', sources=(sensors,))
    poses = completed(read_run(path)).local_pose
    assert (poses.x[-1], poses.y[-1], math.degrees(poses.yaw[-1])) == pytest.approx(
        (1.0 - MISS, 0.0, MISS_DEG), abs=1e-6)
    assert lab_report(path) == 0
    page = (tmp_path / 'sensors_report' / 'report.html').read_text(encoding='utf-8')
    assert 'No drives are listed' in page and 'declared (0, 0, 0)' in page


def test_the_true_path_is_drawn_along_an_odometry_that_is_set_to_zero(run):
    here = run.odometry.pose(np.searchsorted(run.odometry.time, 3.99))
    run = odometry_jumps(run, 4.0, here.inverse())
    in_odom, in_local = paths(run, BURGER).axes
    lines = [line for line in in_odom.get_lines() if len(line.get_xdata()) > 5]
    truth = [line for line in lines if line.get_color() == '#bbbbbb']
    star = [line for line in in_odom.get_lines() if line.get_marker() == '*'][0]
    goal = here.inverse() @ Pose2(2.0, 1.0, 0.5) @ Pose2(1.0, 0.0, 0.0)     # of the first drive
    assert star.get_xydata()[0] == pytest.approx((goal.x, goal.y), abs=1e-6)
    assert len(truth) == 3 and len(lines) == 6    # two pieces before the reset, one after it
    for line in lines:
        x, y = line.get_data()
        assert np.hypot(np.diff(x), np.diff(y)).max() < LEAP
        near = np.hypot(x[:, None] - run.odometry.x, y[:, None] - run.odometry.y).min(axis=1)
        assert near.max() < 0.06                  # it truly ends 0.05 m beside
    true_in_local = [line for line in in_local.get_lines() if line.get_color() == '#bbbbbb'][0]
    assert true_in_local.get_xydata()[-1] == pytest.approx((0.97, 0.04), abs=1e-3)


def spoil(what, bag, folder):
    """A command line with something invalid."""
    path = folder / 'bad.bag'
    if what == 'text':
        path.write_text('this is no bag')
    elif what == 'short':
        path.write_bytes(bag.read_bytes()[:len(bag.read_bytes()) // 2])
    elif what == 'unindexed':
        with rosbag.Bag(str(folder / 'open.bag'), 'w', chunk_threshold=100) as growing:
            growing.write('/imu', Imu())
            growing.flush()
            path.write_bytes((folder / 'open.bag').read_bytes())
    elif what == 'no odometry':
        write_bag(path, keep=lambda name: name != 'odom')
    elif what == 'no folder':
        path.write_text('a file in the way')
        return [bag, '-o', path / 'report']
    return [path]


@pytest.mark.parametrize('what, said', [
    ('text', 'bag'), ('short', 'bag'), ('unindexed', 'rosbag reindex'),
    ('no odometry', 'no nav_msgs/Odometry'), ('no folder', 'choose another folder')])
def test_a_bag_that_cannot_be_reported_is_one_line(what, said, bag, tmp_path, capsys):
    assert lab_report(*spoil(what, bag, tmp_path)) == 1
    line, = capsys.readouterr().err.strip().splitlines()
    assert said in line


def test_without_matplotlib(bag, monkeypatch, capsys):
    for name in [name for name in sys.modules if name.startswith(
            ('matplotlib', 'tb3_labs.report'))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, 'matplotlib', None)
    monkeypatch.delattr('tb3_labs.report', raising=False)
    assert lab_report(bag) == 1
    said = capsys.readouterr().err
    assert said.count('\n') == 1
    assert 'sudo apt install --no-install-recommends python3-matplotlib' in said


# Several runs ---------------------------------------------------------------------------------

#: Run: its turns [deg], one after the other.
TURNED = {'lab': (92.0, 94.0, 99.0), 'precise': (90.5, -91.5)}


@pytest.fixture(scope='module')
def summaries():
    return [summarize(completed(driven([turn(2.0 + 4.0 * k, degrees)
                                        for k, degrees in enumerate(turned)])),
                      BURGER, name, name + '/report.html') for name, turned in TURNED.items()]


def test_mean_spread_and_largest(summaries, tmp_path):
    text = write_comparison(summaries, tmp_path, ['third.bag: no such file']).read_text()
    assert 'third.bag: no such file' in text and '<a href="lab/report.html">lab</a>' in text
    rows = [row for row in rows_of(text) if len(row) == 8]
    names, words = [row[:2] for row in rows], [row[2] for row in rows]
    assert names == [['lab', '3'], ['', ''], ['', ''], ['precise', '2'], ['', ''], ['', ''],
                     ['all', '5'], ['', ''], ['', '']]
    assert words == ['mean', 'spread', 'largest'] * 3
    # beyond 90 deg: 2, 4, 9, and 0.5, 1.5
    expected = [5.0, math.sqrt(13.0), 9.0, 1.0, math.sqrt(0.5), 1.5, 3.4, math.sqrt(11.425), 9.0]
    assert [float(row[3]) for row in rows] == pytest.approx(expected, abs=0.15)
    table = table_in(tmp_path / 'turns.csv')
    assert [(row['run'], row['turn']) for row in table] == [
        ('lab', '1'), ('lab', '2'), ('lab', '3'), ('precise', '1'), ('precise', '2')]
    assert [float(row['turned_deg']) for row in table] == pytest.approx(
        [92.0, 94.0, 99.0, 90.5, -91.5], abs=0.15)
    assert [float(row['asked_deg']) for row in table] == [90.0] * 4 + [-90.0]
    assert not (tmp_path / 'ways.png').exists() and (tmp_path / 'turn_errors.png').exists()


def test_bags_side_by_side_and_one_that_cannot_be_read(bag, tmp_path, capsys):
    with mock.patch('tb3_labs.report.page.write_figure', return_value=''):
        assert lab_report(bag, tmp_path / 'none.bag', '-o', tmp_path / 'all') == 1
    out, err = capsys.readouterr()
    assert out.strip() == 'Report: {}'.format(tmp_path / 'all' / 'report.html')
    line, = err.splitlines()
    assert line.startswith('lab_report.py') and 'none.bag: there is no such file' in line
    assert (tmp_path / 'all' / 'run' / 'report.html').exists()
    text = (tmp_path / 'all' / 'report.html').read_text(encoding='utf-8')
    assert 'href="run/report.html"' in text and 'alt="ways"' in text
    assert [(row['run'], row['drive'], row['distance_error_m'])
            for row in table_in(tmp_path / 'all' / 'drives.csv')] == [
        ('run', '1', '0.0120'), ('run', '2', '0.5000')]


def test_each_run_has_a_name_of_its_own():
    bags = [pathlib.Path(path) for path in ('a/run.bag', 'b/run.bag', 'a/lab.bag', 'c/run.bag')]
    assert script().names_of(bags) == ['run', 'run_2', 'lab', 'run_3']


def test_the_drives_of_several_runs(tmp_path, no_pictures):
    """A turn to the left, 0.8 m, a turn back: each drive ends 0.2 m beyond its goal."""
    goal = Pose2(0.0, 0.6, 0.0)
    runs = [summarize(completed(driven(drive(2.0, 90.0, 0.8, degrees)), goal), BURGER, name, 'page')
            for name, degrees in (('one', -90.0), ('other', -80.0))]
    text = write_comparison(runs, tmp_path).read_text()
    assert ['<a href="page">one</a>', '0', '1', '0', '0.80', '20.0'] in rows_of(text)
    off, turned = drive_errors(runs).axes
    for axes, expected in ((off, (200.0, 200.0)), (turned, (0.0, -10.0))):
        points = [line.get_xdata() for line in axes.get_lines() if line.get_marker() == 'o']
        assert np.concatenate(points) == pytest.approx(expected, abs=0.5)
        assert axes.get_lines()[-1].get_xdata() == pytest.approx([0.0, 0.0])     # the line of 0
    assert [label.get_text() for label in off.get_yticklabels()] == ['one', 'other']
    assert off.get_ylim() == (1.6, -0.6)         # the first run is the upper row
    axes, = ways(runs).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ('x in local [m]', 'y in local [m]')
    paths_drawn = [line for line in axes.get_lines() if len(line.get_xdata()) > 5]
    assert [line.get_label() for line in paths_drawn] == ['one', 'other']
    for line in paths_drawn:
        assert line.get_xydata()[-1] == pytest.approx((0.0, 0.8), abs=0.01)


def test_movements_by_hand_are_listed_apart(tmp_path, no_pictures):
    """Beside a turn of the lab: a spin, and a line of 0.4 m without a turn."""
    run = completed(driven([turn(1.0, 90.0), turn(4.0, -720.0), (15.0, 17.0, 0.2, 0.0)]))
    text = write_report(run, BURGER, tmp_path).read_text(encoding='utf-8')
    assert [row[:3] for row in rows_of(text) if len(row) == 9] == [['1', '1.00', '+90']]
    spin, line = (row for row in rows_of(text) if len(row) == 5)
    assert spin[:2] == ['1', '4.00'] and float(spin[4]) == pytest.approx(-720.0, abs=1.5)
    assert line[:4] == ['2', '15.00', '2.00', '0.39'] and '<h2>By hand</h2>' in text


def test_a_turn_that_the_run_does_not_have_is_one_line(bag, tmp_path, capsys):
    assert lab_report(bag, '-o', tmp_path / 'out', '--turn', 3) == 1
    line, = capsys.readouterr().err.splitlines()
    assert line.endswith('run.bag has 0 turns') and '--turn 3' in line
