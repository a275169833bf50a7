"""mypy finds no error in the type hints of the pure rooms; types.ini has its settings."""
import importlib.metadata
import importlib.util
import os
import pathlib
import subprocess
import sys

import pytest

HERE = pathlib.Path(__file__).resolve().parent
SOURCES = HERE.parents[1] / 'src'
PURE = sorted('.'.join(path.relative_to(SOURCES).with_suffix('').parts)
              for path in (SOURCES / 'tb3_labs').rglob('*.py')
              if 'ros' not in path.parts and not path.name.startswith(('ros_', '__')))
LAWS = (SOURCES / 'tb3_labs' / 'control' / 'goal_machine.py').exists()
MISTAKES = '''
from tb3_labs.control.goal_machine import GoalMachine
from tb3_labs.control.turning import LabTurn, TurnConfig
from tb3_labs.robot.turtlebot3 import robot_model
GoalMachine(LabTurn(TurnConfig(), robot_model(3)))
''' if LAWS else ''

MISSING = importlib.util.find_spec('mypy') is None
pytestmark = [
    pytest.mark.skipif(MISSING, reason='mypy is not installed (TB3_LABS_TESTS=1 ./scripts/setup.sh installs it)'),
    # Debian 11 has 0.812
    pytest.mark.skipif(not MISSING and importlib.metadata.version('mypy').startswith('0.'),
                       reason='a mypy below 1.0 takes a function in a dataclass for a method')]


@pytest.fixture(scope='module')
def complaints(pytestconfig, tmp_path_factory):
    """mypy's lines about the pure rooms, and about mistakes that are made here."""
    made, cache = tmp_path_factory.mktemp('mistakes'), getattr(pytestconfig, 'cache', None)
    (made / 'wrong_hints.py').write_text(MISTAKES)
    if cache is None:
        kept = made
    else:    # beside pytest's own, as pytest's version has it
        kept = (cache.mkdir if hasattr(cache, 'mkdir') else cache.makedir)('mypy')
    command = [sys.executable, '-m', 'mypy', '--config-file', str(HERE / 'types.ini'),
               '--cache-dir', str(kept), '--no-error-summary', '-m', 'wrong_hints']
    for module in PURE:
        command += ['-m', module]
    result = subprocess.run(
        command, cwd=str(SOURCES), timeout=600.0,
        env=dict(os.environ, MYPYPATH=os.pathsep.join((str(SOURCES), str(made)))),
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False)
    assert result.returncode in (0, 1), result.stdout
    return result.stdout.splitlines()


def test_the_pure_rooms_have_no_wrong_hint(complaints):
    assert len(PURE) > 10
    # a tool's files with ROS, named ros_*.py, have no hints, as ros/
    assert [line for line in complaints if '/ros' not in line and 'wrong_hints.py' not in line] == []


@pytest.mark.skipif(not LAWS, reason="the laws are not in the students' edition")
def test_what_is_no_law_is_noticed(complaints):
    said = '\n'.join(complaints)
    assert 'expected "DrivingLaw"' in said
    assert 'Argument 1 to "robot_model"' in said
