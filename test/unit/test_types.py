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
MYPY = importlib.util.find_spec('mypy') and importlib.metadata.version('mypy')
pytestmark = pytest.mark.skipif(not str(MYPY).startswith('1.0.'), reason='only mypy 1.0, of Debian 12, checks '
                                'the hints (TB3_LABS_TESTS=1 ./scripts/setup.sh installs it)')


def test_the_pure_rooms_have_no_wrong_hint():
    assert len(PURE) > 10
    command = [sys.executable, '-m', 'mypy', '--config-file', str(HERE / 'types.ini'),
               '--cache-dir', str(HERE.parents[1] / 'build' / '.ws' / 'mypy'), '--no-error-summary']
    for module in PURE:
        command += ['-m', module]
    result = subprocess.run(
        command, cwd=str(SOURCES), timeout=600.0, env=dict(os.environ, MYPYPATH=str(SOURCES)),
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False)
    # modules that use ROS are in ros/, or are named ros_*.py, and have no hints
    assert [line for line in result.stdout.splitlines() if '/ros' not in line] == []
    assert result.returncode in (0, 1)
