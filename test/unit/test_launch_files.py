"""Every launch file can be loaded, and all that it starts and depends on exists.

By the function of ``roslaunch-check``, in one process: a process of its own for each file takes 20 s
of computing.
"""
import pathlib

import pytest
from roslaunch.rlutil import check_roslaunch

LAUNCH = pathlib.Path(__file__).resolve().parents[2] / 'launch'
#: Its node is on the robot only; robot.test runs it.
ELSEWHERE = 'robot.launch'
FILES = sorted(path for path in LAUNCH.glob('*.launch') if path.name != ELSEWHERE)


@pytest.mark.parametrize('path', FILES, ids=lambda path: path.name)
def test_it_can_be_launched(path):
    assert check_roslaunch(str(path)) is None


def test_a_node_that_does_not_exist_is_found(tmp_path):
    path = tmp_path / 'wrong.launch'
    path.write_text('<launch><node pkg="tb3_labs" type="nobody.py" name="nobody"/></launch>')
    assert 'cannot find node [nobody.py] in package [tb3_labs]' in check_roslaunch(str(path))
