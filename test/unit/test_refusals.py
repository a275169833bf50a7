"""Tools print one line about a typo or an invalid value, at once. The line has the reason and the valid values."""
import os
import runpy
import signal
import subprocess
import sys
import threading
import time
from unittest import mock

import pytest

from pages import ROOT, SCRIPTS

DYNPARAM = '../src/tb3_labs/ros/dynparam.py'
NO_MASTER = 'http://localhost:1'
AT_ONCE = 2.0       # [s]
MARK = ['.', '--lab', 'turn', '-o', '../marks']
YAW, METRES = 'a number from -360 to 360 deg', 'a number from -100 to 100 m'
#: (script, typed words, words of the answer). Of argparse's own refusals, only words of this package are compared.
CASES = [
    ('mark.py', [], ('SUBMISSIONS, --lab, -o', '; --help tells more')),
    ('mark.py', ['.', '--lab', 'trun', '-o', 'x'], ('--lab', 'trun', 'gamepad', '; --help tells more')),
    ('mark.py', MARK + ['--job', '2'], 'unrecognized arguments: --job 2'),
    ('mark.py', ['nowhere'] + MARK[1:], 'nowhere does not exist'),
    ('mark.py', ['miller/node.py'] + MARK[1:], 'miller/node.py is not a folder'),
    ('mark.py', MARK + ['--points', 'nowhere'], 'the points, nowhere, cannot be read: No such file'),
    ('mark.py', MARK + ['--parts', 'turn'], 'IMU lab has these parts: turns, mouse,'),
    ('mark.py', MARK + ['--pad', 'xbx'], "there is no pad 'xbx'; valid: "),
    ('mark.py', MARK + ['--jobs', '17'], '--jobs: invalid choice: '),
    ('mark.py', MARK + ['--only', 'millr'], 'no submission is called millr; these are: miller'),
    ('mark.py', ['.', '--lab', 'turn', '-o', 'inside'], 'the marks would lie among the submissions'),
    ('lab_report.py', ['run_1.bag', 'run_2.bag'], 'run_2.bag'),
    ('skeleton.py', ['turn', '.', 'x\ny'], 'x\\ny'),
    ('mystery.py', ['7', 'imu offset', '130', 'deg'], 'unrecognized arguments: deg'),
    ('mystery.py', ['7', 'imu', '130'], "FAULT: invalid choice: 'imu'"),
    ('send_goal.py', ['1', '1', '90', 'deg'], 'usage: send_goal.py X Y YAW_DEG'),
    ('lab_report.py', ['nowhere.bag'], 'nowhere.bag: cannot be read (No such file or directory)'),
    ('lab_report.py', ['x.bag', '--goal', '1', '1', 'up'], "--goal: yaw_deg = 'up' is not valid: " + YAW),
    ('send_goal.py', ['1,0'], 'with blanks between them, such as: 1 1 90'),
    ('send_goal.py', ['1', '1', '900'], 'yaw_deg = 900.0 is not valid: ' + YAW),
    ('send_goal.py', ['nan', '1', '0'], 'x = nan is not valid: ' + METRES),
    ('send_goal.py', ['1', '1', '0'], 'no ROS master answers at http://localhost:1: start a launch file'),
    (DYNPARAM, ['sett'], 'usage: dynparam set NODE NAME VALUE'),
    (DYNPARAM, ['set', '/x', 'a', '1'], 'no ROS master answers at http://localhost:1: start a launch file'),
    ('doctor.py', ['9-'], '9- is not a namespace, such as robot3'),
    ('skeleton.py', ['turn', '~nobody_at_all/src'], 'skeleton.py: '),
    ('skeleton.py', ['turn', 'nowhere'], 'nowhere/lab2: No such file or directory'),
]


def main_of(script):
    """Returns the function main of a script, which is not run."""
    return runpy.run_path(str(SCRIPTS / script))['main']


@pytest.fixture(scope='module')
def mains():
    return {script: main_of(script) for script in {script for script, _, _ in CASES}}


@pytest.mark.parametrize('script, words, answer', CASES, ids=lambda part: str(part)[:40])
def test_a_typo_is_refused_in_one_line(script, words, answer, mains, tmp_path, monkeypatch, capsys):
    here = tmp_path / 'here'
    (here / 'miller').mkdir(parents=True)
    (here / 'miller' / 'node.py').touch()
    monkeypatch.chdir(here)
    monkeypatch.setenv('ROS_MASTER_URI', NO_MASTER)
    monkeypatch.setattr(sys, 'argv', [script] + words)
    threads, begun = threading.active_count(), time.process_time()
    try:
        with mock.patch.dict(os.environ):       # mark.py makes its own
            status = mains[script](words)
    except SystemExit as ended:
        status = ended.code
    assert time.process_time() - begun < AT_ONCE
    printed, refused = capsys.readouterr()
    assert status in (1, 2) and printed == '', printed
    parts = answer if isinstance(answer, tuple) else (answer,)
    assert len(refused.splitlines()) == 1 and all(part in refused for part in parts), refused
    assert os.listdir(str(tmp_path)) == ['here'] and os.listdir(str(here)) == ['miller']
    assert threading.active_count() <= threads


@pytest.mark.parametrize('line, answer', [
    ('import mystery_key', 'required: FIRST, LAST; --help tells more'),
    ('sys.argv += ["0", "3"]; import mystery_key', 'mystery = 0 is not valid: a whole number from 1 to 9999'),
    ('sys.argv += ["5", "3"]; import mystery_key', 'FIRST = 5 is greater than LAST = 3; --help tells more'),
    ('import make_autograder as made; made.make(made.ROOT / "no/x.zip", ["--lab", "imu"])', 'x.zip: No such file'),
    ('import make_graded, pathlib; make_graded.POINTS = pathlib.Path("no"); make_graded.main()', 'points, no, cannot'),
    ('sys.modules["tb3_labs"] = None; import make_graded', 'type source scripts/setup.sh first'),
    ('import one_line_errors\nGOAL_X, GOAL_Y = 0,8, 0.4', 'too many values to unpack (expected 2) ('),
    ('import one_line_errors; exec("GOAL_X = 0.8 0.4")', 'invalid syntax')])
def test_a_program_of_the_instructor_answers_a_typo_in_one_line(line, answer):
    done = subprocess.run(
        [sys.executable, '-c', f'import sys; sys.path.insert(0, {str(ROOT / "doc" / "instructor")!r})\n{line}'],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True, cwd='/')
    assert done.returncode in (1, 2) and done.stdout == ''
    assert len(done.stderr.splitlines()) == 1 and answer in done.stderr, done.stderr


@pytest.mark.parametrize('first', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_in_quick_succession_interrupt_a_marking_once(first, monkeypatch, capsys):
    """Python handles a later signal inside the handler of the first one. Event.set() inside of set() never returns."""
    mark, numbers, entered = main_of('mark.py'), (signal.SIGINT, signal.SIGTERM, signal.SIGHUP), []
    before = {number: signal.getsignal(number) for number in numbers}

    class InterruptedEvent:
        def set(self):
            entered.append(self)
            for number in numbers if len(entered) < 9 else ():
                signal.raise_signal(number)
    monkeypatch.setitem(mark.__globals__, 'INTERRUPTED', InterruptedEvent())
    monkeypatch.setitem(mark.__globals__, 'mark_class', lambda *_: signal.raise_signal(first))
    signal.signal(signal.SIGHUP, signal.SIG_DFL)        # nohup, in which the tests may run, ignores SIGHUP
    try:
        assert mark(MARK) == 130 and len(entered) == 1
    finally:
        for number, act in before.items():
            signal.signal(number, act)
    assert capsys.readouterr().err == 'mark.py: interrupted\n'
