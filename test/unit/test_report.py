"""The run report, from bag to page: pictures, tables, the command and its refusals."""
import base64
import csv
import importlib.util
import math
import pathlib
import re
import runpy
import sys

import numpy as np
import pytest
from recorded_run import (  # noqa: F401
    BURGER, MISS, MISS_DEG, bag, odometry_jumps, rosbag, run, sensors, write_bag)
from sensor_msgs.msg import Imu

from tb3_labs.report import drives as analysis
from tb3_labs.report.ros_bag import read_run

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from tb3_labs.report.figures import thin  # noqa: E402
from tb3_labs.report.path_figures import LEAP, paths  # noqa: E402

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
    assert not re.search('https?:|<script|<link|url\\(', text)
    rows = [re.findall('<td[^>]*>(.*?)</td>', row) for row in re.findall('<tr>(.*?)</tr>', text)]
    first, second = (row for row in rows if len(row) == 11)
    assert first[4:] == ['reached', '6.50', '4.74', '0.0120', '0.70', '0.0500', '2.00']
    assert second[4:5] + second[7:] == [
        'gave up: it is stuck, alas', '0.5000', '90.00', '0.5000', '90.00']
    assert next(row for row in rows if row[:1] == ['/imu']) == [
        '/imu', '1122', '93.4', '0.800', '1', '0.800', '0']
    with open(str(tmp_path / 'out' / 'run.csv'), newline='') as file:
        table = list(csv.DictReader(file))
    assert len(table) == 241
    row = table[70]                                              # 3.5 s: half the way
    assert float(row['time_s']) == pytest.approx(3.5, abs=1e-3)
    assert (row['local_x_m'], row['local_y_m'], row['local_yaw_deg']) == (
        '0.4940', '0.0000', '0.250')
    assert (row['distance_error_m'], row['linear_m_s'], row['state']) == (
        '0.5060', '0.1976', 'MOVE_FORWARD')
    assert float(row['odom_x_m']) == pytest.approx(2.0 + 0.494 * math.cos(0.5), abs=1e-4)
    assert table[-1]['state'] == 'gave up: it is stuck, alas'


def test_a_bag_of_sensors_only(tmp_path):
    path = write_bag(tmp_path / 'sensors.bag', sources=(sensors,))
    poses = analysis.local_poses(read_run(path))
    assert (poses.x[0], poses.y[0], poses.yaw[0]) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert (poses.x[-1], poses.y[-1], math.degrees(poses.yaw[-1])) == pytest.approx(
        (1.0 - MISS, 0.0, MISS_DEG), abs=1e-6)
    assert lab_report(path) == 0
    page = (tmp_path / 'sensors_report' / 'report.html').read_text(encoding='utf-8')
    assert 'No drives are listed' in page and 'declared (0, 0, 0)' in page


def test_thinning_keeps_extremes_and_ends():
    values = np.zeros(100000)
    values[[777, 54321]] = 5.0, -5.0
    kept = thin(values)
    assert {0, 777, 54321, 99999} <= set(kept) and len(kept) < 3000


def test_the_true_path_is_drawn_along_an_odometry_that_is_set_to_zero(run):
    here = run.odometry.pose(np.searchsorted(run.odometry.time, 3.99))
    run = odometry_jumps(run, 4.0, here.inverse())
    in_odom, _ = paths(run, BURGER).axes
    lines = [line for line in in_odom.get_lines() if len(line.get_xdata()) > 5]
    truth = [line for line in lines if line.get_color() == '#bbbbbb']
    assert len(truth) == 3 and len(lines) == 6    # two pieces before the reset, one after it
    for line in lines:
        x, y = line.get_data()
        assert np.hypot(np.diff(x), np.diff(y)).max() < LEAP
        near = np.hypot(x[:, None] - run.odometry.x, y[:, None] - run.odometry.y).min(axis=1)
        assert near.max() < 0.06                  # it truly ends 0.05 m beside


def test_wrong_usage():
    with pytest.raises(SystemExit) as end:
        lab_report()
    assert end.value.code == 2


def spoil(what, bag, folder):
    """A command line with something invalid."""
    path = folder / 'bad.bag'
    if what == 'text':
        path.write_text('this is no bag')
    elif what == 'empty':
        path.write_bytes(b'')
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
    elif what == 'folder':
        path.mkdir()
    return [path]


@pytest.mark.parametrize('what, said', [
    ('missing', 'no such file'), ('text', 'bag'), ('empty', 'bag'), ('short', 'bag'),
    ('unindexed', 'rosbag reindex'), ('no odometry', 'no nav_msgs/Odometry'),
    ('no folder', 'choose another folder'), ('folder', 'irectory')])
def test_what_cannot_be_reported_is_said_in_one_line(what, said, bag, tmp_path, capsys):
    assert lab_report(*spoil(what, bag, tmp_path)) == 1
    # on a slow machine it also tells how far it is
    lines = [line for line in capsys.readouterr().err.strip().splitlines()
             if not line.startswith('reading: ')]
    assert len(lines) == 1 and said in lines[0], lines


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


@pytest.mark.skipif(not (ROOT / 'scripts' / 'mark.py').exists(), reason='a students\' edition')
def test_marking_without_matplotlib_is_one_line(monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, 'find_spec', lambda name, *more: (
        None if name == 'matplotlib' else find(name, *more)))
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(ROOT / 'scripts' / 'mark.py'), run_name='__main__')
    assert ended.value.code == ('mark.py: matplotlib is missing; install it: sudo apt install '
                                '--no-install-recommends python3-matplotlib')
