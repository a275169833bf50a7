"""roslaunch calls launch/env_robot.sh on the robot. The script sets variables, or prints one line about a fault."""
import os
import shutil
import socket
import subprocess
import sys

import pytest

from pages import ROOT

pytestmark = pytest.mark.usefixtures('among_namesakes')
LOADER = ROOT / 'launch' / 'env_robot.sh'
#: The value of SSH_CONNECTION: the laptop's address and port, the robot's address and port.
FROM_HERE = '127.0.0.1 40000 127.0.0.1 22'
FROM_ELSEWHERE = '192.0.2.5 40000 192.0.2.9 22'
SHOW = 'echo $TURTLEBOT3_MODEL $LDS_MODEL $ROS_MASTER_URI $ROS_IP ${ROS_HOSTNAME-none} $WORKSPACE'


@pytest.fixture
def robot(tmp_path):
    """Returns call(words of a command, setup=, model=, variables...), which returns (exit status, output, errors)."""
    workspace = tmp_path / 'setup.bash'
    workspace.write_text('roslaunch() { :; }; export WORKSPACE=mine\n')
    programs = tmp_path / 'bin'    # nothing else: no ROS of this computer
    programs.mkdir()
    for name in ('bash', 'echo'):
        (programs / name).symlink_to(shutil.which(name))
    (programs / 'python3').symlink_to(os.path.realpath(sys.executable))

    def call(*command, setup=workspace, model='burger', **variables):
        lines = LOADER.read_text(encoding='utf-8').splitlines()
        for key, value in (('setup=', setup), ('model=', model)):
            number, = [number for number, line in enumerate(lines) if line.startswith(key)]
            lines[number] = key + str(value)
        loader = tmp_path / 'env_robot.sh'
        loader.write_text('\n'.join(lines) + '\n')
        loader.chmod(0o700)
        environment = dict({'PATH': str(programs), 'HOME': str(tmp_path),
                            'SSH_CONNECTION': FROM_HERE}, **variables)
        done = subprocess.run([str(loader), *command], env=environment, timeout=600.0,
                              stdin=subprocess.DEVNULL, capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr
    return call


def test_the_command_finds_the_robots_environment(robot):
    assert robot('bash', '-c', SHOW, model='waffle_pi', ROS_HOSTNAME='wrong',
                 ROS_MASTER_URI='http://127.0.0.1:11399') == (
        0, 'waffle_pi LDS-02 http://127.0.0.1:11399 127.0.0.1 none mine\n', '')


def test_without_a_master_the_laptop_of_the_login_has_the_master(robot):
    assert robot('bash', '-c', 'echo $ROS_MASTER_URI "$1"; exit 7', '-', 'two  words') == (
        7, 'http://127.0.0.1:11311 two  words\n', '')


@pytest.mark.parametrize('options, words', [
    (dict(setup='/nowhere/setup.bash'), '/nowhere/setup.bash is missing: set the right setup='),
    (dict(setup='/dev/null'), '/dev/null does not lead to roslaunch'),
    (dict(model='vacuum'), 'model=vacuum is not valid: burger, waffle or waffle_pi'),
    (dict(ROS_MASTER_URI='http://robot99.invalid:11311'), 'no way from here to ROS_MASTER_URI='),
    (dict(ROS_MASTER_URI='http://localhost:11311', SSH_CONNECTION=FROM_ELSEWHERE),
     'ROS_MASTER_URI=http://localhost:11311 is this robot itself: on the laptop set ROS_IP')])
def test_an_invalid_setting_gives_one_line_and_starts_nothing(robot, options, words):
    status, output, errors = robot('echo', 'it ran', **options)
    assert (status, output) == (1, '')
    assert errors.count('\n') == 1
    assert words in errors
    assert socket.gethostname() in errors    # on the laptop's screen: which machine says so
