"""A launch that cannot do what was typed is refused, with the reason and the valid values."""
import os
import pathlib
import shlex
import shutil
import signal
import subprocess

import pytest
import yaml

from tb3_labs.ros.launching import optional, rehearsal
from tb3_labs.ros.launching.arguments import LABS, arguments_of
from tb3_labs.ros.launching.command import read
from tb3_labs.ros.launching.parent import Roslaunch
from tb3_labs.ros.launching.recording import problem_of_folder

LAUNCH = pathlib.Path(__file__).resolve().parents[2] / 'launch'
#: No master answers there.
NOWHERE = 'http://localhost:1'


@pytest.fixture(autouse=True)
def machine(monkeypatch, tmp_path):
    """A machine with all optional programs, without a master; the folder is empty."""
    for name in 'TURTLEBOT3_MODEL', 'ROS_NAMESPACE', 'TB3_LABS_PANEL_ADDRESS':
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv('ROS_MASTER_URI', NOWHERE)
    monkeypatch.setenv('DISPLAY', ':9')
    monkeypatch.setenv('PWD', str(tmp_path))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(rehearsal, 'path_of', lambda package, what: '/somewhere')
    monkeypatch.setattr(shutil, 'which', lambda name: '/somewhere')


def problem(words):
    file, *arguments = words.split()
    return rehearsal.problem_of(read([str(LAUNCH / file)] + arguments))


@pytest.mark.parametrize('words', [
    'classroom.launch robots:=13 model:=waffle', 'demo.launch stay:=True slip:=0.1 port:=8090',
    'fake_robot.launch', 'gamepad.launch pad:=ps4 max_linear:=0.1', 'gazebo.launch',
    'imu_sub.launch max_rate:=5', 'move2goal.launch sim:=gazebo has_control:=true', 'panel.launch',
    'record.launch bag:=lab', 'robot.launch robot:=robot3 lab:=turn hdg_tol:=2 user:=pi web:=true',
    'turn.launch sim:=true xterm:=true rviz:=true record:=true bag:=lab', 'view.launch',
    'fake_robot.launch __ns:=robot3 model:=default'])
def test_a_launch_that_can_be_carried_out_is(words):
    assert problem(words) == ''


@pytest.mark.parametrize('words, line', [
    # unknown names
    ('demo.launch gaol_x:=1', 'gaol_x:=1: demo.launch has no argument gaol_x; is goal_x:= meant?'),
    ('turn.launch simm:=true', 'simm:=true: turn.launch has no argument simm; is sim:= meant?'),
    ('demo.launch _goal_x:=1', 'demo.launch has no argument _goal_x; is goal_x:= meant?'),
    ('record.launch zzz:=1', 'no argument zzz; its arguments: roslaunch --ros-args tb3_labs record.launch'),
    # known, but of a file that does not take part
    ('move2goal.launch slip:=0.1', 'slip:=0.1 has no effect: it belongs to fake_robot.launch, which '
     'is not part of this launch; see sim:='),
    ('demo.launch web:=false port:=8090', 'it belongs to panel.launch, which is not part of this '
     'launch; see web:='),
    # choices
    ('demo.launch stay:=maybe', 'stay:=maybe is not valid: true or false'),
    ('demo.launch record:=yes', 'record:=yes is not valid: true or false'),
    ('turn.launch mouse:=no', 'mouse:=no is not valid: true or false'),
    ('turn.launch sim:=yes', 'sim:=yes is not valid: true, false or gazebo'),
    ('gamepad.launch pad:=none', 'pad:=none is not valid: one of f310_d, f310_x, handout, ps4, xbox'),
    ('robot.launch robot:=r lab:=trun',
     'lab:=trun is not valid: none, turn, move2goal, gamepad or imu_sub'),
    ('turn.launch hdg_tol:=(10)', 'hdg_tol:=(10) is not valid: a value in parentheses counts as not given'),
    ('view.launch model:=burgr', 'model:=burgr is not valid: burger, waffle or waffle_pi'),
    # values of parameters, as each node reads them
    ('demo.launch goal_x:=two', "/move_to_goal/goal_x = 'two' is not valid: a number from -100 to 100 m"),
    ('demo.launch drives:=0', '/demo/drives = 0 is not valid: a whole number from 1 to 100'),
    ('demo.launch use_sim_time:=true speed:=fast', "/turtlebot3/speed = 'fast' is not valid: a number"),
    ('imu_sub.launch max_rate:=lots', "/imu_sub/max_rate = 'lots' is not valid: a number from 0"),
    ('gamepad.launch dead_zone:=-0.1', '/gamepad/dead_zone = -0.1 is not valid: a number from 0 to 0.9'),
    ('turn.launch min_ang_z:=2.0', '/controller/min_ang_z = 2 is not valid: a number up to max_ang_z'),
    ('turn.launch mouse_rate:=0', '/mouse/rate = 0'),
    ('panel.launch port:=http', "/panel/port = 'http' is not valid: a whole number"),
    ('fake_robot.launch mystery:=10000', '/turtlebot3/mystery = 10000 is not valid'),
    ('classroom.launch robots:=0', 'robots must be a whole number, 1 or more'),
    ('classroom.launch robots:=many', 'robots must be a whole number, 1 or more'),
    # files and folders
    ('demo.launch params:=my.yaml', 'params:=my.yaml is not valid: a YAML file; this one cannot be '
     'read (No such file or directory)'),
    ('demo.launch record:=true bag:=/nowhere/run', 'nothing can be recorded in /nowhere (No such '
     'file or directory): go to another folder, or bag:=PATH'),
    ('record.launch bag:=/proc/run', 'nothing can be recorded in /proc')])
def test_a_launch_that_cannot_be_carried_out_is_refused_with_the_reason(words, line):
    said = problem(words)
    assert line in said and '\n' not in said


def test_a_file_of_ones_own_is_checked_as_well(tmp_path):
    for text, reason in (('goal_x: two', "/move_to_goal/goal_x = 'two' is not valid: a number from"),
                         ('goal_x: [', 'a YAML file; this one has an error in line 1'),
                         ('goal_x', 'a YAML file with lines as in launch/params')):
        (tmp_path / 'my.yaml').write_text(text)
        assert reason in problem('move2goal.launch params:=my.yaml')


def test_the_environment_is_checked_as_well(monkeypatch):
    monkeypatch.setenv('TURTLEBOT3_MODEL', 'burgr')
    assert "TURTLEBOT3_MODEL = 'burgr' is not valid: one of burger" in problem('turn.launch')
    assert problem('turn.launch model:=waffle') == ''


@pytest.mark.parametrize('words, package', [
    ('view.launch', 'rviz'), ('move2goal.launch rviz:=true', 'rviz'),
    ('turn.launch sim:=gazebo', 'turtlebot3_gazebo'), ('record.launch', 'rosbag'),
    ('imu_sub.launch record:=true', 'rosbag')])
def test_a_program_that_is_not_installed_is_named(words, package, monkeypatch):
    monkeypatch.setattr(rehearsal, 'path_of', lambda name, what: '' if name == package else '/x')
    assert problem(words) == optional.how_to_install(package)
    assert 'sudo apt install' in problem(words)


def test_a_pad_that_cannot_be_read_leaves_the_gamepad_to_the_page(monkeypatch):
    monkeypatch.setattr(rehearsal, 'path_of', lambda name, what: '')
    assert problem('gamepad.launch') == ''


def test_a_namespace_and_a_prefix_reach_the_frames(monkeypatch):
    def frame(*words):
        config = rehearsal.loaded(read([str(LAUNCH / 'view.launch'), *words]))
        assert '/robot_description' in ''.join(config.params)
        node, = [node for node in config.nodes if node.name == 'rviz']
        return shlex.split(node.args)[-1]

    assert frame() == 'odom'
    assert frame('prefix:=robot4/') == 'robot4/odom'
    monkeypatch.setenv('ROS_NAMESPACE', '/robot3/')
    assert frame() == 'robot3/odom'


@pytest.mark.parametrize('namespace, words, prefix', [
    (None, [], ''), ('/robot3', [], 'robot3'), (None, ['multi_robot_name:=4'], '4')])
def test_a_real_robot_is_told_the_prefix_of_its_frames_even_none(
        namespace, words, prefix, monkeypatch):
    """The board asks its serial node for ~tf_prefix, which complains if there is none."""
    monkeypatch.delenv('ROS_NAMESPACE', raising=False)
    if namespace:
        monkeypatch.setenv('ROS_NAMESPACE', namespace)
    params = rehearsal.loaded(read([str(LAUNCH / 'robot.launch'), 'robot:=x', *words])).params
    assert params[(namespace or '') + '/turtlebot3_core/tf_prefix'].value == prefix


def test_xterm_is_named_if_it_is_not_installed(monkeypatch):
    monkeypatch.setattr(shutil, 'which', lambda name: None)
    assert problem('turn.launch xterm:=true') == 'xterm is not installed: sudo apt install xterm'


def test_rviz_needs_a_screen(monkeypatch):
    monkeypatch.delenv('DISPLAY')
    assert 'DISPLAY is not set' in problem('view.launch')


def test_a_folder_in_which_files_can_be_made_is_good(tmp_path):
    assert problem_of_folder(str(tmp_path / 'run')) == problem_of_folder('run') == ''
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('words', [
    '--nodes', '--files', '--ros-args', '--dump-params', '--args=/demo', '--find-node=/demo'])
def test_what_only_lists_is_not_checked(words):
    assert read([words, str(LAUNCH / 'demo.launch')]) is None


def test_what_roslaunch_refuses_by_itself_is_left_to_it():
    path = str(LAUNCH / 'demo.launch')
    for words in ([], ['nowhere.launch'], ['--nonsense', path], [path, 'stay=true'], ['-p', '1']):
        assert read(words) is None


def test_options_are_told_from_files():
    path = str(LAUNCH / 'demo.launch')
    command = read(['--screen', '-p', '11999', path, 'stay:=true', '__ns:=robot3'])
    assert command == (path, ['stay:=true', '__ns:=robot3'], '11999')
    assert command.arguments == {'stay': 'true'}


def test_the_labs_are_those_that_the_launch_file_names():
    path = str(LAUNCH / 'robot.launch')
    doc = arguments_of(path, {})['lab'].doc
    for lab in LABS:
        assert lab in doc and (lab == 'none' or (LAUNCH / (lab + '.launch')).exists())


def test_each_launch_file_begins_with_the_check_of_its_own_name():
    for path in LAUNCH.glob('*.launch'):
        assert '/launch/check.sh {} $(find tb3_labs)/scripts/check_launch.py"'.format(
            path.name) in path.read_text(), path.name


def test_only_the_parent_is_ended(monkeypatch):
    """Not the process that became the parent since."""
    killed = []
    monkeypatch.setattr(os, 'kill', lambda *what: killed.append(what))
    Roslaunch(os.getppid() + 1, []).end()
    assert killed == []
    Roslaunch(os.getppid(), []).end()
    assert killed == [(os.getppid(), signal.SIGTERM)]


@pytest.mark.parametrize('name, words, runs', [
    ('demo.launch', 'roslaunch tb3_labs demo.launch stay:=true', True),
    ('demo.launch', 'python3 /usr/bin/roslaunch /x/launch/demo.launch', True),
    ('fake_robot.launch', 'roslaunch tb3_labs demo.launch', False),    # included
    ('demo.launch', 'roslaunch tb3_labs my_demo.launch', False),
    ('demo.launch', 'rostest tb3_labs demo.launch', False)])
def test_only_the_file_that_roslaunch_was_started_with_is_checked(name, words, runs):
    said = subprocess.run(['sh', '-c', '{}/check.sh {} echo; true'.format(LAUNCH, name)]
                          + words.split(), stdout=subprocess.PIPE, check=True, text=True)
    assert said.stdout == ('\n' if runs else '')


def test_roslaunch_ends_at_once_with_one_line_and_starts_nothing(tmp_path):
    environment = dict(os.environ, ROS_MASTER_URI='http://localhost:11998')
    cases = [(['demo.launch', 'gaol_x:=1'], 'is goal_x:= meant?'),
             (['imu_sub.launch', 'sim:=true', 'max_rate:=lots'], 'a number from 0 to 1000')]
    runs = [subprocess.Popen(['roslaunch', '--skip-log-check', '--disable-title', 'tb3_labs'] + words,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                             # two that start at once in one folder quarrel about its link `latest`
                             env=dict(environment, ROS_LOG_DIR=str(tmp_path / words[0])))
            for words, _ in cases]
    for run, (_, reason) in zip(runs, cases):
        printed, _ = run.communicate(timeout=60.0)    # its end: no node holds the pipe open
        said = [line for line in printed.splitlines() if line and not line.startswith('... logging')]
        assert len(said) == 1 and said[0].startswith('tb3_labs: ') and reason in said[0], printed
        assert run.returncode == -signal.SIGTERM
