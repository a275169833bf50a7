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

MISSING = importlib.util.find_spec('mypy') is None
pytestmark = [
    pytest.mark.skipif(MISSING, reason='mypy is not installed (TB3_LABS_TESTS=1 ./scripts/setup.sh installs it)'),
    # Debian 11 has 0.812
    pytest.mark.skipif(not MISSING and importlib.metadata.version('mypy').startswith('0.'),
                       reason='a mypy below 1.0 takes a function in a dataclass for a method')]


@pytest.fixture(scope='module')
def cache(pytestconfig, tmp_path_factory):
    """mypy's cache, shared by its runs: beside pytest's own if that is kept. mypy looks itself at what
    has changed since."""
    kept = getattr(pytestconfig, 'cache', None)
    if kept is None:
        return tmp_path_factory.mktemp('mypy')
    return (kept.mkdir if hasattr(kept, 'mkdir') else kept.makedir)('mypy')    # as pytest's version has it


def complaints(cache, modules, more=''):
    """mypy's lines about modules of the sources, or of the folder `more`."""
    command = [sys.executable, '-m', 'mypy', '--config-file', str(HERE / 'types.ini'),
               '--cache-dir', str(cache), '--no-error-summary']
    for module in modules:
        command += ['-m', module]
    result = subprocess.run(
        command, cwd=str(SOURCES), timeout=600.0,
        env=dict(os.environ, MYPYPATH=os.pathsep.join(filter(None, (str(SOURCES), str(more))))),
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False)
    assert result.returncode in (0, 1), result.stdout
    return result.stdout.splitlines()


def test_the_pure_rooms_have_no_wrong_hint(cache):
    assert len(PURE) > 10
    assert complaints(cache, PURE) == []


@pytest.mark.skipif(not (SOURCES / 'tb3_labs' / 'control' / 'goal_machine.py').exists(),
                    reason="the laws are not in the students' edition")
def test_what_is_no_law_is_noticed(cache, tmp_path):
    (tmp_path / 'mistakes.py').write_text(
        'from tb3_labs.control.goal_machine import GoalMachine\n'
        'from tb3_labs.control.turning import LabTurn, TurnConfig\n'
        'from tb3_labs.robot.turtlebot3 import robot_model\n'
        'GoalMachine(LabTurn(TurnConfig(), robot_model(3)))\n')
    said = '\n'.join(complaints(cache, ['mistakes'], tmp_path))
    assert 'expected "DrivingLaw"' in said
    assert 'Argument 1 to "robot_model"' in said
