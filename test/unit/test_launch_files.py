"""Every launch file can be loaded, and all that it starts and depends on exists.

By the function of ``roslaunch-check``, in one process: a process of its own for each file takes 20 s
of computing.
"""
import pathlib

import pytest
from roslaunch.config import load_config_default
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


@pytest.mark.parametrize('environment, argument, address', [
    ({}, [], '127.0.0.1'), ({'TB3_LABS_PANEL_ADDRESS': '0.0.0.0'}, [], '0.0.0.0'),
    ({'TB3_LABS_PANEL_ADDRESS': ''}, [], '127.0.0.1'),
    ({'TB3_LABS_PANEL_ADDRESS': '0.0.0.0'}, ['address:=10.0.0.7'], '10.0.0.7')])
@pytest.mark.parametrize('name', ['panel.launch', 'fake_robot.launch'])
def test_a_container_says_by_its_environment_where_the_page_is_offered(
        name, environment, argument, address, monkeypatch):
    monkeypatch.delenv('TB3_LABS_PANEL_ADDRESS', raising=False)
    for variable, value in environment.items():
        monkeypatch.setenv(variable, value)
    config = load_config_default([(str(LAUNCH / name), ['web:=true', *argument])], None,
                                 assign_machines=False)
    assert config.params['/panel/address'].value == address
