"""The skeletons are the plain nodes without what the handouts leave to the student."""
import ast
import difflib
import re
import runpy
import stat
import xml.etree.ElementTree as ET

import pytest
from pages import ROOT, SCRIPTS
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader
from test_refusals import main_of

from tb3_labs.marking.student_nodes import LAB_NODES

PROGRAM = runpy.run_path(str(SCRIPTS / 'skeleton.py'))
TEMPLATES = ROOT / PROGRAM['FOLDER']
#: {lab: a part of the code in the place of each TODO of the handout, in order}
ANSWERS = {
    'imu': ['import Imu', 'rospy.Subscriber(', 'Quaternion(', '.to_euler(', '[2]'],
    'turn': ['import Quaternion', 'MAX_ANG_Z = ', 'self.turning = False', 'rospy.Subscriber(',
             'return 360 + yaw', '.to_euler(', 'input("'],
    'move2goal': ['rospy.Service(', 'self.local_yaw = ', 'dx = global_x', 'self.local_y = ',
                  'dx = self.goal_x - self.local_x'],
    'gamepad': ['rospy.ServiceProxy(', 'position.y = ', 'orientation.w = ', '.covariance = '],
}
#: The first line that a student replaces has a TODO, or a pose that TODO 5 of move2goal names.
BEGIN = re.compile(r' *# TODO (\d+)\b|.* - self\.(x|y|yaw)\b')
#: A line below the comment of a TODO.
PLACEHOLDER = re.compile(r'rospy\.logwarn_once\(|return\b|(self\.)?\w+ = (0\.0|None)$|'
                         r'if self\.\w+ is None:$|.*(- |^)self\.(x|y|yaw)\b')
#: A line of a plain node that its handout does not have.
ADDED = re.compile(r' # added\b')


def files_of(lab, package=None):
    return PROGRAM['package_files'](TEMPLATES / lab, package or LAB_NODES[lab].packages[0])


def node_of(lab, package=None):
    return files_of(lab, package)['src/' + LAB_NODES[lab].files[0]]


def plain_node(lab):
    name = LAB_NODES[lab].files[0]
    path = ROOT / 'scripts' / ('plain_' + name)
    return (path if path.exists() else path.with_name(name)).read_text(encoding='utf-8')


def lines_of(code):
    """The lines below the docstring that are not blank."""
    return [line for line in code.split('"""\n', 1)[1].splitlines() if line.strip()]


def differences(lab):
    """[(lines of the skeleton, lines of the plain node)] wherever the two are not the same."""
    given = lines_of(node_of(lab, 'tb3_labs'))
    plain = [line for line in lines_of(plain_node(lab)) if not ADDED.search(line)]
    return [(given[a:b], plain[c:d]) for tag, a, b, c, d in difflib.SequenceMatcher(
        None, given, plain, False).get_opcodes() if tag != 'equal']


def answers(lab):
    """The lines of the plain node that a student writes."""
    return [line for _, done in differences(lab) for line in done]


by_lab = pytest.mark.parametrize('lab', sorted(ANSWERS))


@by_lab
def test_a_skeleton_is_the_plain_node_with_todos_in_place_of_the_answers_and_nothing_else(lab):
    todos = [todo for todo, _ in differences(lab)]
    assert all(BEGIN.match(todo[0]) for todo in todos), todos
    text = '\n'.join(answers(lab))
    parts = [text.index(answer) for answer in ANSWERS[lab]]
    assert parts == sorted(parts) and 'TODO ' not in plain_node(lab)


@by_lab
def test_todos_are_numbered_and_have_no_answer(lab):
    lines = [line.strip() for todo, _ in differences(lab) for line in todo]
    assert sorted({int(line.split()[2].strip(':,')) for line in lines if line.startswith('# TODO')}) \
        == list(range(1, len(ANSWERS[lab]) + 1))
    told = {line.strip(' #') for line in lines} & {line.strip() for line in answers(lab)}
    assert told == set()
    assert [line for line in lines if line[0] != '#' and not PLACEHOLDER.match(line)] == []


@by_lab
def test_a_skeleton_is_python_38_with_the_names_of_the_marker(lab):
    code = node_of(lab)
    ast.parse(code, feature_version=(3, 8))
    # the states of move2goal are in global coordinates
    assert len(re.findall(r' - self\.(?:x|y|yaw)\b', code)) == 4 * (lab == 'move2goal')
    assert 'class {}:'.format(LAB_NODES[lab].class_name) in code
    assert "rospy.init_node('{}')".format(LAB_NODES[lab].node_name) in code
    assert code.startswith('#!/usr/bin/env python3\n')


@by_lab
def test_a_package_names_its_dependencies(lab):
    files, package = files_of(lab), LAB_NODES[lab].packages[0]
    assert PROGRAM['PACKAGES'][lab] == package
    manifest = ET.fromstring(files['package.xml'].encode())
    assert manifest.findtext('name') == package
    named = {item.text for item in manifest if item.tag.endswith('depend')}
    texts = [text for name, text in files.items() if name.endswith('.py')] + [plain_node(lab)]
    imported = {name for text in texts for name in re.findall(r'^from (\w+)\.(?:msg|srv)', text, re.M)}
    assert imported - {package} <= named and {'rospy', 'tb3_labs'} <= named
    assert 'project({})'.format(package) in files['CMakeLists.txt']
    launch = ET.fromstring(files['launch/{}.launch'.format(lab)].encode())
    assert [(node.get('pkg'), node.get('type'), node.get('name')) for node in launch.iter('node')][0] \
        == (package, LAB_NODES[lab].files[0], LAB_NODES[lab].node_name)
    assert not any(re.search('@[A-Z_]+@', text) for text in files.values())


@pytest.mark.parametrize('lab', sorted(LAB_NODES))
def test_an_argument_switches_statistics_on(lab, tmp_path, among_namesakes):
    path, name = tmp_path / (lab + '.launch'), '/enable_statistics'
    path.write_text(files_of(lab)['launch/{}.launch'.format(lab)])
    for arguments, wanted in ((['statistics:=true'], True), ([], None)):
        config = ROSLaunchConfig()
        XmlLoader().load(str(path), config, argv=arguments, verbose=False)
        assert (config.params[name].value if name in config.params else None) is wanted


def test_no_template_looks_like_a_program_or_a_launch_file():
    """rosrun and roslaunch search the whole package: for programs, and for launch files by name."""
    for path in TEMPLATES.rglob('*'):
        assert path.is_dir() or not path.stat().st_mode & 0o111
        assert path.suffix != '.launch' and path.name not in ('package.xml', 'CMakeLists.txt')


def test_a_folder_in_which_catkin_finds_no_package_is_refused(tmp_path):
    (tmp_path / 'src').mkdir()
    with pytest.raises(ValueError, match='give .*/src'):
        PROGRAM['write_package']({}, tmp_path / 'lab2')


def test_the_command_prints_the_next_steps_and_overwrites_nothing(tmp_path, capsys):
    main, place = main_of('skeleton.py'), tmp_path.resolve() / 'src'
    place.mkdir()
    assert main(['turn', str(place)]) == 0
    files, target = files_of('turn'), place / 'lab2'
    assert {name: (target / name).read_text() for name in files} == files
    assert {name for name in files if (target / name).stat().st_mode & stat.S_IXUSR} == {
        'src/turtlebot_controller.py'}
    (target / 'src' / 'turtlebot_controller.py').write_text('my work')
    assert re.fullmatch(r'{0}/lab2 is written\..* cd {1}; catkin_make; .* roslaunch lab2 turn\.launch '
                        r'sim:=true\n'.format(place, place.parent), capsys.readouterr().out)
    assert main(['turn', str(place)]) == 2
    assert capsys.readouterr().err == (
        f'skeleton.py: {place}/lab2 exists already: rename it, and type the command again\n')
    assert (target / 'src' / 'turtlebot_controller.py').read_text() == 'my work'
