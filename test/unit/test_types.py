"""mypy finds no error in the type hints of the pure rooms (types.ini has its settings). In all files mypy finds no call
whose arguments do not fit, and no import of a missing name."""
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
MYPY = importlib.util.find_spec('mypy') and importlib.metadata.version('mypy')
pytestmark = pytest.mark.skipif(not str(MYPY).startswith('1.0.'), reason='only mypy 1.0, of Debian 12, checks '
                                'the hints (TB3_LABS_TESTS=1 ./scripts/setup.sh installs it)')


def lines_of_mypy(*words):
    command = [sys.executable, '-m', 'mypy', '--config-file', str(HERE / 'types.ini'), '--no-error-summary',
               '--cache-dir', str(HERE.parents[1] / 'build' / '.ws' / 'mypy'), *words]
    result = subprocess.run(
        command, cwd=str(SOURCES), timeout=600.0, env=dict(os.environ, MYPYPATH=str(SOURCES)),
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False)
    assert result.returncode in (0, 1), result.stdout
    return result.stdout.splitlines()


def test_the_pure_rooms_have_no_wrong_hint():
    assert len(PURE) > 10
    # modules that use ROS are in ros/, or are named ros_*.py, and have no hints
    words = [word for module in PURE for word in ('-m', module)]
    assert [line for line in lines_of_mypy(*words) if '/ros' not in line] == []


def test_each_call_has_the_arguments_of_its_function_and_each_import_exists():
    """A call that no test reaches, such as the last line of a program, would fail on a student's computer."""
    folders = [SOURCES.with_name(folder) for folder in ('src', 'scripts', 'launch')] + [HERE.with_name('ros')]
    files = [str(path) for folder in folders for path in folder.rglob('*.py')]
    lines = lines_of_mypy('--check-untyped-defs', '--namespace-packages', '--explicit-package-bases', *files)
    assert [line for line in lines if '[call-arg]' in line or 'error: Module' in line] == []
