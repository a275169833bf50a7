"""The launch files can be loaded, have few arguments, and refuse arguments that they do not have."""
import re
import shlex
import subprocess
import xml.etree.ElementTree as ET
from subprocess import Popen
from unittest import mock

import pytest
from roslaunch.arg_dump import get_args
from roslaunch.config import ROSLaunchConfig
from roslaunch.rlutil import check_roslaunch
from roslaunch.xmlloader import XmlLoader

from pages import ROOT
from tb3_labs.marking.marks import LABS
from tb3_labs.ros import launch_arguments

pytestmark = pytest.mark.usefixtures('among_namesakes')
LAUNCH = ROOT / 'launch'
#: These files need packages that may be missing. robot.test runs robot.launch.
ELSEWHERE = ('robot', 'gamepad', 'view')
FILES = sorted(LAUNCH.glob('*.launch'))
#: The recorded topics, in the robot's namespace or absolute.
RECORDED = ('imu', 'odom', 'cmd_vel', 'heading', 'ground_truth', 'local_pose', 'goal_state',
            'current_goal', 'ctrl_relinq', 'control_holder', 'joy', 'turn', 'mouse_info', 'reset',
            'initialpose', '/rosout', '/tf', '/tf_static', '/diagnostics')
every_file = pytest.mark.parametrize('path', FILES, ids=lambda path: path.stem)


@pytest.fixture(autouse=True)
def environment(monkeypatch):
    for name in 'TURTLEBOT3_MODEL', 'ROS_NAMESPACE', 'TB3_LABS_PANEL_ADDRESS':
        monkeypatch.delenv(name, raising=False)


def loaded(name, *arguments):
    """Returns the configuration of a launch file, without roscore's part."""
    def start(words, **options):    # the check of the arguments would start Python for each file
        return Popen(['true'] if 'launch' in words else words, **options)

    config = ROSLaunchConfig()
    with mock.patch('subprocess.Popen', start):
        XmlLoader().load(str(LAUNCH / (name + '.launch')), config, argv=list(arguments), verbose=False)
    return config


@pytest.mark.parametrize('path', [path for path in FILES if path.stem not in ELSEWHERE],
                         ids=lambda path: path.stem)
def test_roslaunch_loads_each_launch_file(path):
    assert check_roslaunch(str(path)) is None


@every_file
def test_a_file_has_few_arguments_and_checks_them(path):
    arguments = [arg for arg in ET.parse(str(path)).getroot().findall('arg') if not arg.get('value')]
    assert len(arguments) <= 10 and all(arg.get('doc') for arg in arguments)
    text = path.read_text()
    assert 'eval' not in text
    # the path may have blanks
    assert f'''command='python3 "$(dirname)/run.py" launch "$(dirname)/{path.name}"\'''' in text
    # Debian 11's roslaunch uses the included file's folder for $(dirname) in an include
    given = [arg.get('value') for include in ET.parse(str(path)).iter('include') for arg in include]
    assert [value for value in given if 'dirname' in value] == []


@every_file
def test_only_required_arguments_have_no_default(path):
    required = {name for name, (_, default) in get_args([str(path)]).items() if not default}
    expected = {'robot'} if path.stem == 'robot' else set()
    assert required - {'user'} == expected


@pytest.mark.parametrize('file, given, line', [
    ('turn', 'sm:=true', 'sm:=true: turn.launch has no argument sm; is sim:= meant?'),
    ('turn', 'slip:=0.1', 'turn.launch has no argument slip; its arguments: roslaunch --ros-args'),
    ('record', 'zzz:=1', 'no argument zzz; its arguments: roslaunch --ros-args tb3_labs record.launch'),
    ('robot', 'user:=pi', 'robot:= is missing: name or address of the robot'),
    ('turn', 'set:={max_ang_z:1}', 'set:={max_ang_z:1}: parameters are given in braces, with a blank after each '
     'colon, and a point in numbers: set:="{max_ang_z: 1}"'),
    ('fake_robot', 'set:=slip=0.1', 'in braces'), ('fake_robot', 'set:={slip:', 'in braces'),
    ('fake_robot', 'set:={slip:0,5}', 'a point in numbers'),
    ('turn', 'sim:=true robot_set:={slip:1}', '="{slip: 0.1}"'),
    ('gamepad', 'pad:=lab9', 'pad:=lab9: there is no params/pad_lab9.yaml; pad:= is one of '),
    ('turn', 'node:=plian', 'node:=plian: there is no nodes/plian.xml; node:= is one of finished, plain'),
    ('record', 'bag:=20261127161033', ''),
    ('gamepad', 'pad:=xbox set:={}', ''), ('turn', 'sim:=true node:=plain', ''), ('robot', 'robot:=robot3', ''),
    ('turn', 'model:=waffle __ns:=robot3 params:=my.yaml', '')])
def test_a_wrong_argument_is_one_line_with_a_correction(file, given, line):
    path = LAUNCH / (file + '.launch')
    for words in (['tb3_labs', path.name], ['--screen', str(path)]):
        problem = launch_arguments.problem_of(words + given.split(), path)
        assert line in problem and bool(line) == bool(problem) and '\n' not in problem
        # a file that another file includes is not checked
        assert launch_arguments.problem_of(words + given.split(), LAUNCH / 'view.launch') == ''


def test_the_arguments_of_a_students_launch_file_are_checked(tmp_path):
    path = tmp_path / 'lab1' / 'launch' / 'turn.launch'
    path.parent.mkdir(parents=True)
    path.write_text('<launch><arg name="sim" default="false"/></launch>')
    (tmp_path / 'lab1' / 'package.xml').write_text('<package><name>lab2</name></package>')
    assert launch_arguments.problem_of(['lab2', 'turn.launch', 'sim:=true'], path) == ''
    assert launch_arguments.problem_of(['lab2', 'turn.launch', 'sym:=true'], path) == (
        'sym:=true: turn.launch has no argument sym; is sim:= meant?')
    assert launch_arguments.problem_of(['tb3_labs', 'turn.launch', 'sym:=true'], path) == ''


@pytest.mark.parametrize('lab', sorted(LABS))
def test_a_check_gets_the_sentence_on_a_wrong_argument(lab):
    path = LAUNCH / 'checks' / 'check_{}.test'.format(lab)
    assert '"$(find tb3_labs)/launch/run.py" launch "$(find tb3_labs)/launch/checks/{}"'.format(path.name) in (
        path.read_text(encoding='utf-8'))
    words = ['--text', 'tb3_labs', path.name, 'part:=lost']
    assert launch_arguments.problem_of(words, path).endswith('has no argument part; is parts:= meant?')
    assert launch_arguments.problem_of([*words[:-1], 'parts:=lost', 'pkg:=a', 'type:=b.py'], path) == ''


@pytest.mark.parametrize('value, is_right', [
    ('{slip: 0,5}', False), ('{slip: }', False), ('{slip: 1', False), ('{slip:0.5}', False),
    ('{slip: 0.5, network: bad,}', True), ('{}', True), ('{ slip: -1 }', True)])
def test_a_decimal_comma_and_a_name_without_a_value_are_reported(value, is_right):
    """YAML reads both as an empty value, at which roslaunch ends with a traceback."""
    words = ['tb3_labs', 'fake_robot.launch', 'set:=' + value]
    assert (launch_arguments.problem_of(words, LAUNCH / 'fake_robot.launch') == '') == is_right


def test_a_later_way_to_give_a_parameter_goes_before_an_earlier_one(tmp_path):
    mine = tmp_path / 'my.yaml'
    mine.write_text('model: waffle\nmax_linear: 0.2\nallow_reverse: true\n')
    given = ['params:={}'.format(mine), 'model:=burger', 'set:={max_linear: 0.1}']
    params = loaded('move2goal', *given).params
    assert [params['/move_to_goal/' + name].value for name in (
        'model', 'max_linear', 'allow_reverse')] == ['waffle', 0.1, True]


def test_a_permission_is_not_a_parameter_because_a_parameter_outlives_its_node():
    for node, words in ('finished', '_has_control:=true'), ('plain', ''):
        config = loaded('move2goal', 'has_control:=true', 'node:=' + node)
        assert [node.args for node in config.nodes] == [words]
        assert not [name for name in config.params if 'has_control' in name]


@pytest.mark.parametrize('name, robot_set', [
    ('turn', 'robot_set'), ('move2goal', 'robot_set'), ('gamepad', 'robot_set'),
    ('imu_sub', 'robot_set'), ('demo', 'robot_set'), ('fake_robot', 'set')])
def test_the_parameters_of_the_robot_can_be_set(name, robot_set):
    sim = [] if name in ('demo', 'fake_robot') else ['sim:=true']
    params = loaded(name, robot_set + ':={slip: 0.1, network: bad}', 'model:=waffle', *sim).params
    assert [params['/turtlebot3/' + each].value for each in ('slip', 'network', 'model')] == [
        0.1, 'bad', 'waffle']


@pytest.mark.parametrize('web, nodes', [('true', {'panel'}), ('false', {'mouse'})])
def test_the_page_replaces_mouse_and_pad(web, nodes):
    names = {node.name for node in loaded('turn', 'web:=' + web).nodes}
    assert names == {'controller'} | nodes
    assert {'joy', 'panel'} & {node.name for node in loaded('gamepad', 'web:=' + web).nodes} == {
        'panel' if web == 'true' else 'joy'}


@pytest.mark.parametrize('namespace, words', [('', []), ('robot3', ['prefix:=robot3/'])])
def test_a_namespace_reaches_the_frames_and_the_recording(namespace, words, monkeypatch):
    if namespace:
        monkeypatch.setenv('ROS_NAMESPACE', namespace)
    view, prefix = loaded('view', *words), '/{}/'.format(namespace).replace('//', '/')
    publisher, node = view.nodes
    assert publisher.type == publisher.name == 'robot_state_publisher'
    assert '<link name="{}base_link"'.format(prefix[1:]) in view.params[prefix + 'robot_description'].value
    assert node.args.replace("''", '').endswith(' -f {}odom'.format(namespace and namespace + '/'))
    monkeypatch.setenv('PWD', "/home/ann/Ann's lab")
    recorded = shlex.split(loaded('record').nodes[0].args)
    assert recorded[:2] == ['-o', "/home/ann/Ann's lab/run"]
    for name in RECORDED:
        topic = name if name.startswith('/') else prefix + name
        matched = subprocess.run(['grep', '-qxE', recorded[3]], input=topic.encode())
        assert matched.returncode == 0, topic
    for other in ('/robot4/imu', prefix + 'imu_raw'):
        assert subprocess.run(['grep', '-qxE', recorded[3]], input=other.encode()).returncode == 1
    parameters = loaded('robot', 'robot:=x').params.items()
    parameter, = [value for key, value in parameters if key.endswith('/tf_prefix')]
    assert parameter.value == namespace    # the board needs it, even if it is empty


def test_nodes_use_the_topics_of_rviz():
    text = (LAUNCH / 'params' / 'local_frame.rviz').read_text(encoding='utf-8')
    topics = set(re.findall(r'Topic: ([a-z_/]+)$', text, re.MULTILINE))
    assert {'odom', 'local_path', 'goal_marker', 'ground_truth', 'initialpose', 'move_base_simple/goal'} <= topics
    package = ROOT / 'src' / 'tb3_labs'
    code = ''.join(path.read_text(encoding='utf-8') for path in [
        *(package / 'ros').glob('*.py'), *(package / 'nodes').rglob('ros_*.py'),
        package / 'simulation' / 'ros_fake_robot.py'])
    assert [topic for topic in topics if "'{}'".format(topic) not in code] == []


@pytest.mark.parametrize('variable, argument, address', [
    (None, [], '127.0.0.1'), ('0.0.0.0', [], '0.0.0.0'),
    ('0.0.0.0', ['address:=10.0.0.7'], '10.0.0.7')])
def test_a_container_sets_the_address_of_the_page_by_its_environment(
        variable, argument, address, monkeypatch):
    if variable:
        monkeypatch.setenv('TB3_LABS_PANEL_ADDRESS', variable)
    assert loaded('panel', *argument).params['/panel/address'].value == address
