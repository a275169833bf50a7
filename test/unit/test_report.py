"""The run report, from bag to page: pictures, tables, CSV files, the command and its refusals."""
import base64
import importlib.util
import json
import math
import pathlib
import re
import sys
from dataclasses import replace

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

from tb3_labs.report.movements import completed  # noqa: E402
from tb3_labs.report.page import write_report  # noqa: E402
from tb3_labs.report.path_figures import paths  # noqa: E402
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
    assert [(row['run'], row['drive'], row['distance_error_m'])
            for row in table_in(tmp_path / 'out' / 'drives.csv')] == [
        ('run.bag', '1', '0.0120'), ('run.bag', '2', '0.5000')]
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
    if what == 'none':
        return [folder / 'none.bag']
    if what == 'text':
        path.write_text('#ROSBAG V1.2')
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
    ('none', 'none.bag: there is no such file'), ('text', 'not a bag of version 2'), ('short', 'bag'),
    ('unindexed', 'rosbag reindex'),
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


def test_the_rows_of_two_runs_fit_into_one_spreadsheet(tmp_path, no_pictures):
    """Turns beyond 90 deg; and drives, a turn to the left, 0.8 m, a turn back, each of which ends
    0.2 m beyond its goal."""
    goal, rows = Pose2(0.0, 0.6, 0.0), {'turns': [], 'drives': []}
    for name, turned, last in (
            ('lab', (92.0, 94.0, 99.0), -90.0), ('precise', (90.5, -91.5), -80.0)):
        turns = [turn(2.0 + 4.0 * k, degrees) for k, degrees in enumerate(turned)]
        for word, moves in (('turns', turns), ('drives', drive(2.0, 90.0, 0.8, last))):
            run = replace(completed(driven(moves), goal), name=name)
            write_report(run, BURGER, tmp_path / name)
            rows[word] += table_in(tmp_path / name / (word + '.csv'))
    assert [(row['run'], row['turn']) for row in rows['turns']] == [
        ('lab', '1'), ('lab', '2'), ('lab', '3'), ('precise', '1'), ('precise', '2')]
    assert [float(row['turned_deg']) for row in rows['turns']] == pytest.approx(
        [92.0, 94.0, 99.0, 90.5, -91.5], abs=0.15)
    assert [float(row['asked_deg']) for row in rows['turns']] == [90.0] * 4 + [-90.0]
    assert [float(row['error_deg']) for row in rows['turns']] == pytest.approx(
        [2.0, 4.0, 9.0, 0.5, 1.5], abs=0.15)
    assert [(row['run'], row['drive']) for row in rows['drives']] == [
        ('lab', '1'), ('precise', '1')]
    assert [float(row['distance_error_m']) for row in rows['drives']] == pytest.approx(
        [0.2, 0.2], abs=0.5e-3)
    assert [float(row['angle_error_deg']) for row in rows['drives']] == pytest.approx(
        [0.0, -10.0], abs=0.5)


def test_movements_by_hand_are_marks(tmp_path, no_pictures):
    """Beside a turn of the lab: a spin, and a line of 0.4 m without a turn."""
    run = completed(driven([turn(1.0, 90.0), turn(4.0, -720.0), (15.0, 17.0, 0.2, 0.0)]))
    text = write_report(run, BURGER, tmp_path).read_text(encoding='utf-8')
    assert [row[:3] for row in rows_of(text) if len(row) == 9] == [['1', '1.00', '+90']]
    marks = json.loads(re.search(r'json">(.*?)</script>', text).group(1))['marks']
    spin, line = (mark for mark in marks if mark['kind'] == 'hand')
    assert spin['begin'] == 4.0 and (line['begin'], line['end']) == (15.0, 17.0)
    way, turned = re.search('by hand: (.*) m, turned (.*) deg', spin['text']).groups()
    assert way == '0.00' and float(turned) == pytest.approx(-720.0, abs=1.5)
    assert line['text'] == 'by hand: 0.39 m, turned +0.0 deg'


def test_a_turn_that_the_run_does_not_have_is_one_line(bag, tmp_path, capsys):
    assert lab_report(bag, '-o', tmp_path / 'out', '--turn', 3) == 1
    line, = capsys.readouterr().err.splitlines()
    assert line.endswith('run.bag has 0 turns') and '--turn 3' in line
