"""Several runs on one page: means and spreads, links, files; and a bag that cannot be read."""
import csv
import math
import pathlib
import re

import pytest
from made_motion import driven, turn
from recorded_run import bag, run  # noqa: F401
from test_report import lab_report, script

from tb3_labs.report.movements import completed
from tb3_labs.robot.turtlebot3 import robot_model

pytest.importorskip('matplotlib', reason='matplotlib is not installed')

from tb3_labs.report.compare import summarize, turn_errors, write_comparison  # noqa: E402
from tb3_labs.report.path_figures import ways  # noqa: E402

BURGER = robot_model('burger')
#: Run: its turns [deg], one after the other.
TURNED = {'lab': (92.0, 94.0, 99.0), 'precise': (90.5, -91.5)}


@pytest.fixture(scope='module')
def summaries():
    return [summarize(completed(driven([turn(2.0 + 4.0 * k, degrees)
                                        for k, degrees in enumerate(turned)])),
                      BURGER, name, name + '/report.html') for name, turned in TURNED.items()]


def rows_of(text):
    return [re.findall('<td[^>]*>(.*?)</td>', row) for row in re.findall('<tr>(.*?)</tr>', text)]


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
    with open(str(tmp_path / 'turns.csv'), newline='') as file:
        table = list(csv.DictReader(file))
    assert [(row['run'], row['turn']) for row in table] == [
        ('lab', '1'), ('lab', '2'), ('lab', '3'), ('precise', '1'), ('precise', '2')]
    assert [float(row['turned_deg']) for row in table] == pytest.approx(
        [92.0, 94.0, 99.0, 90.5, -91.5], abs=0.15)
    assert [float(row['asked_deg']) for row in table] == [90.0] * 4 + [-90.0]
    assert not (tmp_path / 'ways.png').exists() and (tmp_path / 'turn_errors.png').exists()


def test_the_figure_has_a_point_for_each_turn(summaries):
    axes, = turn_errors(summaries).axes
    points = [line.get_xdata() for line in axes.get_lines() if line.get_marker() == 'o']
    assert [len(values) for values in points] == [3, 2]
    assert points[0] == pytest.approx([2.0, 4.0, 9.0], abs=0.15)
    assert [label.get_text() for label in axes.get_yticklabels()] == ['lab', 'precise']
    assert ways(summaries) is None


def test_bags_side_by_side_and_one_that_cannot_be_read(bag, tmp_path, capsys):  # noqa: F811
    assert lab_report(bag, tmp_path / 'none.bag', '-o', tmp_path / 'all') == 1
    out, err = capsys.readouterr()
    assert out.strip() == 'Report: {}'.format(tmp_path / 'all' / 'report.html')
    said = [line for line in err.splitlines() if line.startswith('lab_report.py')]
    assert len(said) == 1 and 'none.bag: there is no such file' in said[0]
    for page in 'report.html', 'run/report.html', 'ways.png', 'drives.csv':
        assert (tmp_path / 'all' / page).exists(), page
    text = (tmp_path / 'all' / 'report.html').read_text(encoding='utf-8')
    assert 'href="run/report.html"' in text
    with open(str(tmp_path / 'all' / 'drives.csv'), newline='') as file:
        table = list(csv.DictReader(file))
    assert [(row['run'], row['drive'], row['distance_error_m']) for row in table] == [
        ('run', '1', '0.0120'), ('run', '2', '0.5000')]


def test_each_run_has_a_name_of_its_own():
    bags = [pathlib.Path(path) for path in ('a/run.bag', 'b/run.bag', 'a/lab.bag', 'c/run.bag')]
    assert script().names_of(bags) == ['run', 'run_2', 'lab', 'run_3']


def test_all_bags_cannot_be_read(tmp_path, capsys):
    assert lab_report(tmp_path / 'a.bag', tmp_path / 'b.bag') == 1
    out, err = capsys.readouterr()
    assert out == '' and len(err.splitlines()) == 2 and not (tmp_path / 'runs_report').exists()


@pytest.mark.parametrize('words', [('--goal', '1', '2'), ('--goal', '1', '2', 'nan')])
def test_a_goal_is_three_finite_numbers(words, capsys):
    with pytest.raises(SystemExit) as end:
        lab_report('run.bag', *words)
    assert end.value.code == 2 and '--goal' in capsys.readouterr().err
