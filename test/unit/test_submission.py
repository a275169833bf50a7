"""The intake finds the node of a submission with the faults of real ones, repairs it, and builds its
messages. The requests of its reset services are filled and read."""
import math
import os
import re
import resource
import shlex
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from unittest import mock

import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped, Quaternion
from sandboxes import hand_in, ros_alone  # noqa: F401
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking import trial_runner
from tb3_labs.marking.intake import submissions, workspace
from tb3_labs.marking.intake.archives import NotJudged
from tb3_labs.marking.intake.find_node import UNPACKING_RULES, find_node
from tb3_labs.marking.intake.packages import is_old_or_copy, module_folders, node_package
from tb3_labs.marking.intake.sandbox import Protection
from tb3_labs.marking.intake.submissions import Submission, read_in_this_process, read_submission
from tb3_labs.marking.intake.workspace import COPY_FOLDER, prepare_workspace
from tb3_labs.marking.labs.ros_gamepad import is_origin, is_unit, nonzero_fields
from tb3_labs.marking.labs.ros_move2goal import fill_pose
from tb3_labs.marking.student_nodes import LAB_NODES
from tb3_labs.marking.trial.observation import NodeProcess
from tb3_labs.msg import MouseController
from tb3_labs.srv import ResetPoseRequest, SetInitialPose, SetInitialPoseRequest

pytestmark = pytest.mark.usefixtures('ros_alone', 'built_once')
TURN, PAD, LAB = LAB_NODES['turn'], LAB_NODES['gamepad'], LAB_NODES['move2goal']
PYTHON = '#!/usr/bin/env python3\n'
NODE = PYTHON + 'print("runs")\n'


@pytest.fixture(scope='module')
def built_once():
    """The modules of equal messages are made once: most tests have lab1's message."""
    made, make = {}, workspace._run_make_modules

    def examples_of(definitions, environment, sandbox):
        key = repr((definitions, type(sandbox)))
        if key not in made:
            made[key] = make(definitions, environment, sandbox)
        return made[key]
    with mock.patch.object(workspace, '_run_make_modules', examples_of):
        yield


def manifest(name):
    return '<package format="2"><name>{}</name></package>'.format(name)


def prepared(tmp_path, files, lab=TURN):
    """Returns (the NodeStart, the ParsedSubmission with all remarks). May raise NotJudged."""
    folder = files if not isinstance(files, dict) else hand_in(tmp_path / 'bob', files)
    reading = read_in_this_process({str(folder): ''}, str(tmp_path / 'ws' / COPY_FOLDER), lab, '', '')
    return prepare_workspace(reading, tmp_path / 'ws', os.environ), reading


#: The node of lab2 in a course's repository.
MINE = 'lab2/src/turtlebot_controller.py'
LAB1_MESSAGE = 'Header header\nbool activestatus\nfloat32 xPos\nfloat32 yPos\n'


def course(node, **more):
    """Returns the files of a course's repository."""
    return dict({
        MINE: node, 'lab1/msg/MouseController.msg': LAB1_MESSAGE, 'lab1/package.xml': manifest('lab1'),
        'lab2/package.xml': manifest('lab2'), 'lab3/package.xml': manifest('lab3'),
        'lab3/CMakeLists.txt': 'message(FATAL_ERROR "never built")'}, **more)


USES_LAB1 = PYTHON + 'from lab1.msg import MouseController\nprint(MouseController().activestatus)\n'
UNUSED = PYTHON + ('import cv3\nimport math as tags; import os\nfrom nothing_here.msg import Tag, Tags\n'
                   'from lab1.msg import MouseController\nprint(MouseController().activestatus, tags)\n')
GUARDED = ('\ufeff' + USES_LAB1 + 'try:\n    import cv3\nexcept ImportError:\n    cv3 = None\n').replace(
    '\n', '\r\n')
LATIN = PYTHON.encode() + '# -*- coding: latin-1 -*-\nimport cv3\nprint("M\xfcller")\n'.encode('latin-1')
OUTER = {'turtlebot_controller.py': PYTHON + 'from beside import O\nprint(O().inner.value)\n',
         'beside.py': 'from outer.msg import O\n', 'outer/msg/O.msg': 'inner/I inner\n',
         'inner/msg/I.msg': 'float32 value\n'}
BARE = {'turtlebot_controller.py': PYTHON + 'from lab2.msg import MouseController\n'
        'print(MouseController().status.data)\n'}
BROKEN = course(USES_LAB1, **{
    'lab1/msg/Broken.msg': 'nowhere/Type t\n', 'lab1/srv/S.srv': 'no type here\n---\n'})
LAWS = dict(course(PYTHON + 'from lab2.laws import name\nfrom lab1.laws import name as other\n'
                   'print(name, other)\n'), **{
    '{}/{}'.format(place, file): text for place, name in (
        ('lab2', 'lab2'), ('lab2/lab1', 'lab1'), ('old/a/lab1', 'lab1')) for file, text in (
            ('package.xml', manifest(name)), ('setup.py', ''),
            ('src/{}/laws.py'.format(name), 'name = {!r}\n'.format(place)))})
del LAWS['lab1/package.xml'], LAWS['lab1/msg/MouseController.msg']
TWICE = course(NODE.replace('runs', 'src'), **{
    'lab2/scripts/turtlebot_controller.py': NODE.replace('runs', 'scripts')})

#: These modules import lab1's message for the node. They are in a folder beside the node, in the package of a setup.py,
#: and in a folder where Python does not look.
THROUGH = {path: 'import cv3\nfrom lab1.msg import MouseController\n' + more for path, more in (
    ('lab2/src/utils/mouse.py', 'from . import near\n'), ('lab2/src/lab2/mouse.py', 'from .near import name\n'),
    ('lab2/lib/helper.py', ''))}
THROUGH.update({'lab2/src/utils/near.py': 'import nothing_here.msg\n',
                'lab2/src/lab2/near.py': 'import cv4\nname = 1\n'})


def through(module, path=''):
    """Returns the files of a node that imports lab1's message from one of these modules."""
    return dict(course(PYTHON + path + 'from {} import MouseController\nprint(MouseController().activestatus)\n'.format(
        module)), **THROUGH, **{'lab2/setup.py': 'setup(packages=["lab2"], package_dir={"": "src"})'})


def imported(line, kind='MouseController'):
    """Returns a single file that imports a type of the course by this line."""
    return {'turtlebot_controller.py': PYTHON + line + '\nprint({}()._md5sum)\n'.format(kind)}


#: A package with a message and no package.xml. CMakeLists.txt or only the import names the package. The message is
#: loose, or in another folder of the package.
OWN_MESSAGE = PYTHON + 'from lab2.msg import MouseController\nprint(MouseController().activestatus)\n'
UNNAMED = [{'my work/' + path: text for path, text in files.items()} for files in (
    {'src/turtlebot_controller.py': OWN_MESSAGE, 'msg/MouseController.msg': LAB1_MESSAGE,
     'CMakeLists.txt': '# project(a)\nproject( lab2 LANGUAGES CXX )'},
    {'src/turtlebot_controller.py': OWN_MESSAGE, 'msg/MouseController.msg': LAB1_MESSAGE},
    {'turtlebot_controller.py': OWN_MESSAGE, 'MouseController.msg': LAB1_MESSAGE},
    {'turtlebot_controller.py': OWN_MESSAGE, 'messages/MouseController.msg': LAB1_MESSAGE,
     'package.xml': manifest('lab2')})]
STANDS_IN = 'stand in for these packages, which were not handed in: lab1.'
FORMS = ['from lab1.msg import *', 'import lab1.msg\nMouseController = lab1.msg.MouseController',
         'import lab1.msg as m\nMouseController = m.MouseController',
         'from lab1 import msg\nMouseController = msg.MouseController',
         'from lab1.msg._MouseController import MouseController']

#: {name: (files of a submission, begin of the node's output, part of a line for the student or the instructor)}
HANDED_IN = {
    'unused modules': (course(UNUSED), "False <module 'math'", 'cv3, nothing_here.msg: imported, but not used'),
    'Windows': (course(GUARDED), 'False\n', 'Windows line endings'),
    'byte order mark': (course('\ufeff' + NODE), 'runs\n', 'byte order mark: removed'),
    'its bytes': (course(LATIN), 'M\xfcller\n', 'cv3: imported'),
    'packages without a manifest': (OUTER, '0.0\n', 'no package.xml with a valid name'),
    "the skeleton's message": (BARE, 'False\n', 'stand in for these packages, which were not handed in: lab2.'),
    'broken messages': (BROKEN, 'False\n', 'lab1/Broken.msg cannot be built: Cannot locate message [Type]: '
                        'unknown package [nowhere]. lab1/S.srv cannot be built: Invalid declaration: no type here.'),
    'own modules, and the nearer package': (LAWS, 'lab2 lab2/lab1\n', 'is not executable'),
    'two files of a name': (TWICE, 'scripts\n', '2 files can be the node; judged was '),
    'a folder of modules': (through('utils.mouse'), 'False\n', 'cv3, cv4, nothing_here.msg: imported, but not'),
    'the modules of a setup.py': (through('lab2.mouse'), 'False\n', 'cv3, cv4, nothing_here.msg: imported, but not'),
    'a changed path': (through('helper', 'import sys\nsys.path.append(sys.path[0] + "/../lib")\n'), 'False\n',
                       'cv3: imported, but not used'),
    **{'unnamed {}'.format(number): (files, 'False\n', '') for number, files in enumerate(UNNAMED)},
    **{line: (imported(line), MouseController._md5sum, STANDS_IN) for line in FORMS},
    'a service': (imported('from lab7_tf.srv import SetInitialPose, SetInitialPoseResponse', 'SetInitialPose'),
                  SetInitialPose._md5sum, 'which were not handed in: lab7_tf.'),
    'another package of its own': (dict(course(
        PYTHON + 'import rospkg\nprint(rospkg.RosPack().get_path("config")[-3:])'), **{
            'c/one/package.xml': manifest('config')}), 'one\n', ''),
    'no screen': (course(PYTHON + 'from pynput import mouse\nprint(1)'), '1\n', 'pynput: imported, but not used'),
    'another Python': (course('#!/usr/bin/python3.1\n'), None, '#!/usr/bin/python3.1, which this machine lacks'),
    'no first line': (course('print(1)'), None, 'turtlebot_controller.py does not begin with #!/usr/bin/env '
                      'python3, so that rosrun cannot start it.'),
    'a shell': (course('#!/bin/sh\necho hello\n'), 'hello\n', ''),
}


@pytest.mark.parametrize('name', HANDED_IN)
def test_a_node_is_found_repaired_and_built(tmp_path, name):
    files, prints, told = HANDED_IN[name]
    ready, reading = prepared(tmp_path, files)
    assert os.path.basename(ready.program) == 'turtlebot_controller.py'
    assert told in ' '.join(reading.remarks + reading.findings)
    assert bool(reading.findings) is (
        name in ('two files of a name', 'another Python', 'no first line'))
    if prints is not None:
        said = subprocess.check_output([ready.program], env=ready.environment, text=True)
        assert said.startswith(prints)
    for path, text in files.items():    # a submission itself is not changed
        assert (tmp_path / 'bob' / path).read_bytes() == (text if isinstance(text, bytes) else text.encode())
    if files is BARE:
        assert ready.types['msg']['lab2/MouseController']['sum'] == MouseController._md5sum


@pytest.mark.parametrize('place', ['src', 'scripts'])
def test_a_node_finds_modules_and_messages_of_one_package(tmp_path, place):
    """The folder src of the package has a module of the package's name, also beside the node."""
    ready, _ = prepared(tmp_path, {
        'lab2/{}/turtlebot_controller.py'.format(place):
            PYTHON + 'import lab2.laws, lab2.msg, tools\nimport tools.msg as unused\nprint(tools.word)\n',
        'lab2/src/lab2/laws.py': '', 'lab2/src/tools/__init__.py': 'word = "runs"\n',
        'lab2/package.xml': manifest('lab2'), 'lab2/msg/M.msg': 'int32 x\n',
        'lab2/setup.py': 'setup(packages=["lab2", "tools"], package_dir={"": "src"})'})
    assert subprocess.check_output([ready.program], env=ready.environment, text=True) == 'runs\n'


@pytest.mark.parametrize('place, packages', [
    ('', ''), ('', 'package_dir={"": "."}'), ('src/', 'package_dir={"": "src"}'),
    ('src/deep/', 'package_dir={"": "src/deep"}'), ('python/', "package_dir={'lab2': 'python/lab2'}")])
def test_the_modules_of_a_package_lie_where_its_setup_says(tmp_path, place, packages):
    hand_in(tmp_path, {'setup.py': 'setup(packages=["lab2"], {})'.format(packages), place + 'lab2/__init__.py': '',
                       place + 'other/__init__.py': '', 'msg/M.msg': ''})
    assert module_folders(tmp_path, 'lab2') == [tmp_path / place / 'lab2']


FAILS = 'turtlebot_controller.py needs modules that do not work on the marking machine: {}.'


@pytest.mark.parametrize('files, said', [
    (course(PYTHON + 'import apriltag_rosx as tags\nprint(tags)'), FAILS.format('apriltag_rosx')),
    (course(PYTHON + 'import maths, tags\nmaths.pi, tags'), FAILS.format('maths, tags')),
    # a message that is not in the submission
    ({'turtlebot_controller.py': 'from lab2.msg import Mouse\nMouse()\n'}, FAILS.format('lab2.msg')),
    # a module uses a name that it imports for the node
    ({'turtlebot_controller.py': PYTHON + 'from beside import Tag\nTag()\n', 'beside.py': 'from tags import Tag\n'},
     FAILS.format('tags')),
    (course(PYTHON + 'from rclpy.node import Node\nNode()'), FAILS.format('rclpy.node')),
    (course(PYTHON + 'from pynput import mouse\nmouse.Listener()'), FAILS.format('pynput')),
    ({'lab2/turtlebot_controller.py.txt': '', 'n.py': ''},
     'Handed in: n.py, lab2/turtlebot_controller.py.txt. ' + UNPACKING_RULES),
    ({'x/.keep': '', 'build/turtlebot_controller.py': ''},
     'Handed in: x/.keep. ' + UNPACKING_RULES),
    (course(''), MINE + ' is empty.'),
    (course('\ufeff \r\n\n'), MINE + ' is empty.')])
def test_what_cannot_be_judged_says_why(tmp_path, files, said):
    with pytest.raises(NotJudged) as problem:
        prepared(tmp_path, files)
    assert str(problem.value).endswith(said)


@pytest.mark.parametrize('text', [
    None, '<package', manifest('tb3_labs'),
    '<!DOCTYPE p [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><package><name>&b;</name></package>',
    '<?xml version="1.0" encoding="utf-9"?><package>', '<p>' * 9000, manifest('../../etc'),
    manifest('lab7\N{KELVIN SIGN}')],
    ids=['none', 'cut', 'own', 'entities', 'encoding', 'deep', 'path', 'sign'])
def test_a_package_whose_name_cannot_be_used_is_shown_as_submission(tmp_path, text):
    files = {'lab7/scripts/move2goal.py': NODE, 'lab7/scripts/helper.py': NODE}
    ready, reading = prepared(tmp_path, dict(files, **{'lab7/package.xml': text} if text else {}), LAB)
    assert ready.name == 'submission/move2goal.py'
    assert ('no package.xml with a valid name' in ' '.join(reading.remarks)) is (text != manifest('tb3_labs'))
    assert ready.environment['ROS_PACKAGE_PATH'].startswith(str(tmp_path / 'ws' / 'src' / 'lab7'))


def test_no_link_is_followed(tmp_path):
    """The package.xml and the modules are links to the instructor's files. Devices and large files are left out
    too."""
    home = hand_in(tmp_path / 'home', {'bashrc': 'mine\n', 'ssh/key': 'secret'})
    folder = hand_in(tmp_path / 'bob', {
        'move2goal.py': 'import keys\n' + NODE, 'keys/setup.py': '', 'keys/src/other.py': '',
        'keys/package.xml': manifest('keys'), 'keys/msg/Key.msg': 'int32 k\n', 'run.bag': 'x',
        '.git/config': 'x', 'devel/lib/move2goal.py': NODE})
    (folder / 'package.xml').symlink_to(home / 'bashrc')
    (folder / 'keys' / 'src' / 'keys').symlink_to(home / 'ssh')
    (folder / 'keys' / 'src' / 'soft.py').symlink_to(home / 'ssh' / 'key')
    os.link(str(home / 'ssh' / 'key'), str(folder / 'keys' / 'src' / 'hard.py'))
    os.mkfifo(str(folder / 'pipe'))
    with open(str(folder / 'core'), 'wb') as file:
        file.truncate(30000000)
    prepared(tmp_path, folder, LAB)
    assert sorted(os.listdir(str(tmp_path / 'ws' / 'src'))) == ['keys', 'move2goal.py']
    assert (home / 'bashrc').read_text() == 'mine\n'
    copied = [path for path in (tmp_path / 'ws').rglob('*') if path.is_file()]
    assert tmp_path / 'ws' / 'python' / 'keys' / 'msg' / '_Key.py' in copied
    assert [path for path in copied if b'secret' in path.read_bytes()] == []


@pytest.mark.parametrize('name', [
    'move2goal "$(find rospy)".py', '-move2goal.py', os.fsdecode(b'move2goal\xfc.py')])
def test_an_odd_name_of_a_node_is_not_shown(tmp_path, name):
    ready, _ = prepared(tmp_path, {
        name: PYTHON + 'class MoveToGoal: pass\nprint("runs")\n"""rospy.init_node("move_to_goal")"""\n'}, LAB)
    assert ready.name == 'submission/node.py'
    assert subprocess.check_output([ready.program], env=ready.environment, text=True) == 'runs\n'


@pytest.mark.parametrize('code, message', [
    ('x = ' + '-' * 50000 + '1', ''), ('x = ' + '(' * 500 + ')' * 500, ''), ('x = ' + 'a.' * 50000 + 'a', ''),
    ('x = \0', ''), ('import rospy\n' * 10000, ''), ('import lab7.msg', '\n' * 300000)],
    ids=['signs', 'brackets', 'points', 'zero', 'imports', 'message'])
def test_a_file_that_is_too_deep_or_too_long_ends_nothing(tmp_path, code, message):
    begun = time.process_time()
    ready, _ = prepared(tmp_path, {'move2goal.py': code, 'lab7/msg/M.msg': message}, LAB)
    assert os.path.basename(ready.program) == 'move2goal.py' and time.process_time() - begun < 5.0


def test_whatever_eats_the_memory_of_its_reader_ends_the_reader_alone(tmp_path, monkeypatch):
    """Python needs 2.7 GB to parse this file."""
    monkeypatch.setattr(submissions, 'LIMIT_READER_COMMAND', ['prlimit', '--as=300000000'])
    folder = hand_in(tmp_path / 'eve', {'turtlebot_controller.py': 'import ' + 'a.' * 50000 + 'a\n'})
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss     # the most of all earlier tests
    try:
        parsed = read_submission(Submission('eve', {folder: ''}), tmp_path / 'copy', TURN)
        assert parsed.node == 'turtlebot_controller.py'
    except NotJudged as error:
        assert 'its reading takes too much memory' in str(error)
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < max(3.3e5, before + 1)


MOUSE_ONLY = """class Controller:
    rospy.Subscriber('mouse_info', M, f)
rospy.init_node('controller')"""
IMU_TOO = MOUSE_ONLY + "\nrospy.Subscriber('imu', Imu, f)"


def repository(folder, lab, texts):
    """Write files. Each * stands for the usual name of the lab's file. Returns the folder."""
    return hand_in(folder, {name.replace('*', lab.files[0]): text for name, text in texts.items()})


#: A part of the remark on a choice among several files.
CHOSEN = 'files can be the node; judged was '


@pytest.mark.parametrize('lab, texts, expected, said', [
    (TURN, {'lab1/src/*': MOUSE_ONLY, 'lab2/src/*': IMU_TOO, 'lab3/src/*': IMU_TOO}, 'lab2/src/*',
     '3 files can be the node; judged was lab2/src/*. The others: lab3/src/*, lab1/src/*.'),
    # the package decides before the signs, the signs before the name, the name before the folder
    (TURN, {'lab1/*': IMU_TOO, 'lab2/src/controller.py': IMU_TOO}, 'lab2/src/controller.py', CHOSEN),
    (TURN, {'lab2/src/*': MOUSE_ONLY, 'lab2/src/first.py': IMU_TOO}, 'lab2/src/first.py', CHOSEN),
    (TURN, {'lab2/src/*': IMU_TOO, 'lab2/scripts/first.py': IMU_TOO}, 'lab2/src/*', CHOSEN),
    (TURN, {'lab2/scripts/*': MOUSE_ONLY, 'lab2/src/*': IMU_TOO}, 'lab2/src/*', CHOSEN),
    # a package with lab2 in its name is preferred, but lab20 has another number
    (TURN, {'lab2_final/*': IMU_TOO, 'a/*': IMU_TOO}, 'lab2_final/*', CHOSEN),
    (TURN, {'lab20/*': IMU_TOO, 'a/*': IMU_TOO}, 'a/*', CHOSEN),
    # a name with the lab's number is preferred, but not if only the workspace has it
    *[(TURN, {name + '/*': IMU_TOO, 'a/*': IMU_TOO}, name + '/*', CHOSEN) for name in (
        'lab_2', 'lab-02', 'Lab 2', 'my_lab2', 'turtlebot_lab_2b')],
    (TURN, {'lab2/a/*': IMU_TOO, 'lab2/a/package.xml': manifest('lab1'), 'lab2/lab2/*': IMU_TOO,
            'lab2/lab2/package.xml': manifest('lab2')}, 'lab2/lab2/*', CHOSEN),
    # the reset is a sign
    (LAB, {'lab7_tf/*': "rospy.Service('other', S, f)", 'lab7_tf/v2.py': "class MoveToGoal:\n"
           "    rospy.Service('/set_pose', S, f)\nrospy.init_node('move_to_goal')"}, 'lab7_tf/v2.py', CHOSEN),
    (PAD, {'lab4_gamepad/*': IMU_TOO, 'lab7_tf/*': 'rospy.ServiceProxy(RESET, S)'}, 'lab7_tf/*', CHOSEN),
    # a helper of lab2 is not the node of lab2. The node's class and name show it
    (TURN, {'lab1/*': MOUSE_ONLY, 'lab2/helper.py': 'x = 1'}, 'lab1/*', ''),
    (TURN, {'lab2/src/node.py': MOUSE_ONLY}, 'lab2/src/node.py',
     'There is no *; judged was lab2/src/node.py.'),
    # a file that was put aside comes last
    *[(TURN, {aside + '/lab2/*': IMU_TOO, 'lab2/zz/*': IMU_TOO}, 'lab2/zz/*', CHOSEN)
      for aside in ('backup', '.git2', 'Copy of lab2', 'lab2_old', '.Trash-1000')],
    # a lab with several usual packages
    (PAD, dict({'lab4_gamepad/*': '', 'lab7/*': '', 'other/*': ''}, **{'a{}/*'.format(n): '' for n in range(9)}),
     'lab4_gamepad/*', ' and 5 more.'),
    (LAB, {'move2goal.py': '', 'lab7/scripts/other.py': ''}, 'move2goal.py', ''),
    (LAB, {'a/b/src/Move2Goal_TF.py': ''}, 'a/b/src/Move2Goal_TF.py', '')])
def test_package_then_name_then_signs(tmp_path, lab, texts, expected, said):
    path, remarks, _ = find_node(repository(tmp_path, lab, texts), lab)
    assert path == expected.replace('*', lab.files[0])
    assert said.replace('*', lab.files[0]) in ' '.join(remarks) if said else remarks == []


@pytest.mark.parametrize('texts, advised', [
    ({'lab2/*': MOUSE_ONLY, 'lab2/imu.py': IMU_TOO}, r'judged was lab2/imu.py.* --type lab2/\* chooses'),
    ({'lab1/*': IMU_TOO, 'lab2 - Copy/*': IMU_TOO + ' '}, r"judged was lab1/\*.* --type 'lab2 - Copy/\*' chooses"),
    ({'lab1/*': IMU_TOO, 'lab2 - Copy/*': IMU_TOO}, None),
    ({'lab1/*': MOUSE_ONLY, 'lab2/imu.py': IMU_TOO}, None),
    # a second file of the same package, with another content, may be the better one
    ({'lab2/*': IMU_TOO, 'lab2/turn_v2.py': IMU_TOO + ' '}, r'judged was lab2/\*.* --type lab2/turn_v2.py chooses'),
    ({'*': IMU_TOO, 'turn_v2.py': IMU_TOO + ' '}, r'judged was \*.* --type ./turn_v2.py chooses'),
    ({'lab2/*': IMU_TOO, 'lab2/turn_v2.py': IMU_TOO}, None)])
def test_a_choice_against_a_name_is_told_to_the_instructor(tmp_path, texts, advised):
    _, remarks, advice = find_node(repository(tmp_path, TURN, texts), TURN)
    assert remarks and bool(advice) is bool(advised)
    assert advised is None or re.search(advised, advice[0].replace(TURN.files[0], '*'))


START = 'from {} import Controller\nif __name__ == "__main__":\n    Controller()\n'
CLASS = ("import rospy\nLIMIT = abs(-1)\nclass Controller:\n    def __init__(self):\n"
         "        rospy.Subscriber('imu', I, f)\n")


@pytest.mark.parametrize('texts, starts', [
    ({'lab2/src/lab2/controller.py': CLASS, 'lab2/scripts/node.py': START.format('lab2.controller')},
     'scripts/node.py'),
    ({'lab2/src/lab2/*': CLASS, 'lab2/nodes/node': PYTHON + START.format('lab2')}, 'nodes/node'),
    ({'lab2/src/controller.py': CLASS, 'lab2/src/main.py': START.format('controller')}, 'src/main.py'),
    # the module starts by itself, or no program starts it
    ({'lab2/src/*': CLASS + 'Controller()', 'lab2/src/main.py': START.format('turtlebot_controller')}, 'src/*'),
    ({'lab2/src/*': CLASS, 'lab2/src/main.py': 'from turtlebot_controller import Controller'}, 'src/*'),
    ({'lab2/src/*': CLASS, 'lab2/src/main.py': '# turtlebot_controller\nprint()'}, 'src/*')])
def test_the_program_that_starts_the_class_is_the_node(tmp_path, texts, starts):
    folder = repository(tmp_path, TURN, dict(texts, **{
        'lab2/src/lab2/__init__.py': 'from .turtlebot_controller import Controller\n',
        'lab2/package.xml': manifest('lab2'), 'lab2/setup.py': 'setup(packages=["lab2"], package_dir={"": "src"})'}))
    path, remarks, advice = find_node(folder, TURN)
    assert path == 'lab2/' + starts.replace('*', TURN.files[0]) and advice == []
    assert ('which starts lab2/src' in ' '.join(remarks)) is ('*' not in starts)


def test_a_path_chooses_one_of_two_files_that_are_alike_and_the_advice_is_true(tmp_path):
    """Moodle has both files of a student who handed in again under another name. One file is in no folder."""
    files = {'my work.unpacked/lab2/src/*': IMU_TOO, 'work.unpacked/lab2/src/*': IMU_TOO + '\n',
             '*': IMU_TOO, 'src/*': IMU_TOO + ' '}
    folder = repository(tmp_path, TURN, files)
    _, _, (advice,) = find_node(folder, TURN)
    other, = re.findall("--type (.*) chooses another one, with --only and the student's name.", advice)
    assert find_node(folder, TURN, chosen_file=shlex.split(other)[0]).path == (
        'work.unpacked/lab2/src/turtlebot_controller.py')
    for name in files:
        name = ('./' * (name == '*') + name).replace('*', 'turtlebot_controller.py')
        assert find_node(folder, TURN, chosen_file=name).path == name.replace('./', '')
    with pytest.raises(NotJudged, match='There is no lab1/x.py, ') as problem:
        find_node(folder, TURN, chosen_file='lab1/x.py')
    assert problem.value.advice == "--type FILE chooses a file, with --only and the student's name."
    assert '--type' not in str(problem.value)       # a student reads this text


def test_a_folder_that_was_not_put_aside():
    for name in ('gold', 'copyright', 'holder', 'scaffold', '.'):
        assert not is_old_or_copy(name) and not is_old_or_copy(name + '/n.py') and is_old_or_copy(name + '/n_old.py')


def test_what_listens_can_be_the_node(tmp_path):
    """A node of another lab listens to this topic. Its file's name shows its lab, unless it has this lab's class."""
    listens = "rospy.Subscriber('imu', Imu, f)"
    for path, text in (('a/b.py', listens), ('a/b.py', 'rospy.Subscriber("/imu", Imu, f)'),
                       ('a/b.py', 'Subscriber( name="robot3/imu" , data_class=Imu)'),
                       ('ice6/src/imu_sub.py', listens + '\nclass Controller:\n')):
        assert find_node(repository(tmp_path / 'right' / path, TURN, {path: text}), TURN).path == path
    for path, text in (('a/b.py', '# ' + listens), ('a/b.py', "rospy.Subscriber('imu_raw', Imu, f)"),
                       ('a/b.py', 'class Controllers:'), ('a/b.py', "rospy.Publisher('imu', Imu)"),
                       ('ice6/src/imu_sub.py', listens)):
        with pytest.raises(NotJudged, match=r'There is no turtlebot_controller\.py, .*' + path):
            find_node(repository(tmp_path / 'wrong' / path, TURN, {path: text}), TURN)
    with pytest.raises(NotJudged, match='Handed in: nothing.'):
        find_node(workspace.Path('/nowhere'), TURN)


def test_package_and_name_overrule(tmp_path):
    """The package's name in package.xml is used, not only its folder's."""
    folder = repository(tmp_path, TURN, {
        'one/*': IMU_TOO, 'one/package.xml': manifest('lab1'), 'lab2/mine.py': '', 'lab2/mine.txt': ''})
    assert find_node(folder, TURN, chosen_package='lab1').path == 'one/turtlebot_controller.py'
    for name in 'mine.py', 'mine.txt', 'lab2/mine.txt':
        assert find_node(folder, TURN, chosen_file=name).path == 'lab2/' + os.path.basename(name)
    with pytest.raises(NotJudged, match='There is no mine.py in a package lab1, .*: lab2/mine.py, one/'):
        find_node(folder, TURN, chosen_package='lab1', chosen_file='mine.py')


def test_the_package_of_a_node_has_the_package_xml_above_it(tmp_path):
    """Without a package.xml the folder is guessed. The submission itself may have the name of a folder of nodes."""
    folder = hand_in(tmp_path / 'src', {'lab7/package.xml': manifest('lab7')})
    for node, package in (('lab7/deep/src/n.py', 'lab7'), ('lab2/scripts/n.py', 'lab2'), ('scripts/n.py', '.'),
                          ('lab2/n.py', 'lab2')):
        assert node_package(folder / node, folder) == folder / package


def test_messages_that_cannot_be_read_are_told(tmp_path):
    class Fails(Protection):
        def program_command(self, words):
            return ['false']
    remarks = []
    folder = hand_in(tmp_path / 'lab1', {'msg/M.msg': 'int32 x\n'})
    node = hand_in(tmp_path, {'n.py': ''}) / 'n.py'
    built = workspace.build_types({'lab1': folder}, node, tmp_path / 'python', {}, remarks, Fails())
    assert remarks == ['The messages and services could not be built.'] and built['msg'] == {}


def test_threads_that_look_up_the_packages_at_the_same_time_get_all_of_them(tmp_path, monkeypatch, request):
    """The first thread has found one package when the second thread begins."""
    hand_in(tmp_path, {'one/msg/M.msg': '', 'two/msg/M.msg': ''})
    both_look = threading.Barrier(2)

    class Packages:
        def list(self):
            yield 'one'
            both_look.wait(100.0)
            yield 'two'

        def get_path(self, name):
            return str(tmp_path / name)
    monkeypatch.setattr(workspace.rospkg, 'RosPack', Packages)
    workspace.system_messages.cache_clear()
    request.addfinalizer(workspace.system_messages.cache_clear)
    with ThreadPoolExecutor(2) as pool:
        found = [pool.submit(workspace.system_messages) for _ in range(2)]
    assert [sorted(each.result()) for each in found] == [['one', 'two']] * 2


@pytest.mark.parametrize('printed, ready, told', [
    ("Traceback:\n  x\nModuleNotFoundError: No module named 'beside'\n", None, True),
    ("ImportError: cannot import name 'x' from 'squaternion' (/usr/x.py)", None, True),
    ("ModuleNotFoundError: No module named 'beside'\nthat is all\n", None, False),
    ("ModuleNotFoundError: No module named 'beside'", 3.0, False), ('', None, False)])
def test_a_node_that_a_failed_import_ends_at_once_is_not_judged(printed, ready, told):
    ended, later = NodeProcess(0.0, ready=ready, printed=printed), NodeProcess(9.0)
    assert bool(trial_runner.import_error([ended, later])) is told
    assert trial_runner.import_error([]) == ''


def test_whatever_is_sourced_a_submission_has_ros_this_package_and_no_other(tmp_path, monkeypatch):
    """The workspace `one` has this package and a lab2, and lies over Noetic. A workspace with a lab1 lies over
    `one`, a workspace with a lab3 under it. The instructor's own modules and programs come first."""
    spaces = [str(tmp_path / name) for name in ('over', 'one', 'under', 'noetic')]
    over, one, under, ros = spaces
    for path in ('over/share/lab1/x', 'over/lib/python3/dist-packages/lab1/msg/x', 'over/lib/python3/'
                 'dist-packages/random.py', 'one/share/lab2/x', 'one/lib/lab2/node.py', 'one/lib/'
                 'python3/dist-packages/lab2/msg/x', 'one/lib/python3/dist-packages/tb3_labs/msg/x',
                 'one/lib/tb3_labs/mark.py', 'src/tb3_labs/launch/x', 'src/lab2/package.xml',
                 'under/share/lab3/x', 'under/share/actionlib/x', 'noetic/share/rospy/x'):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).touch()
    monkeypatch.setattr(trial_runner.rospkg, 'RosPack', lambda: SimpleNamespace(
        get_path=lambda name: str(tmp_path / 'src' / name)))
    made = trial_runner.make_marking_environment(tmp_path / 'own', {
        'CMAKE_PREFIX_PATH': ':'.join(spaces), 'ROS_PACKAGE_PATH': str(tmp_path / 'src') + ':/x',
        'PYTHONPATH': ':'.join(space + '/lib/python3/dist-packages' for space in spaces),
        'PATH': over + '/bin:/home/ann/bin', 'LD_LIBRARY_PATH': over + '/lib', 'HOME': '/home/ann',
        'PYTHONINSPECT': '1', 'PYTHONOPTIMIZE': '1', 'ROS_NAMESPACE': 'robot3', 'LANG': 'de_DE.UTF-8'})
    own = str(tmp_path / 'own')
    for name, folder in (('CMAKE_PREFIX_PATH', ''), ('ROS_PACKAGE_PATH', '/share'), (
            'PYTHONPATH', '/lib/python3/dist-packages'), ('LD_LIBRARY_PATH', '/lib')):
        assert made.pop(name) == '{0}{2}:{1}{2}'.format(own, ros, folder)
    assert made.pop('PATH').split(':')[1:] == [own + '/bin', ros + '/bin', *trial_runner.SYSTEM_PATH.split(':')]
    assert made == {'HOME': '/home/ann', 'LANG': 'de_DE.UTF-8'}
    assert sorted(str(path.relative_to(own)) for path in (tmp_path / 'own').rglob('*')
                  if path.is_symlink()) == ['lib/python3/dist-packages/tb3_labs/msg',
                                            'lib/tb3_labs/mark.py', 'share/tb3_labs/launch']


def message(**fields):
    """A message with these float64 fields."""
    return SimpleNamespace(__slots__=list(fields), _slot_types=['float64'] * len(fields), **fields)


def request_of(z, w):
    """A request for the origin with this rotation, and with numbers that are no part of the place."""
    pose = PoseWithCovarianceStamped()
    pose.header.frame_id, pose.pose.covariance[0] = 'map', 0.25
    pose.pose.pose.orientation = Quaternion(0.0, 0.0, z, w)
    return SetInitialPoseRequest(pose)


def test_a_pose_is_filled_into_a_request_that_has_a_place_for_it():
    goal, request = Pose2(1.0, -2.0, math.radians(90.0)), SetInitialPoseRequest()
    assert fill_pose(request, goal)
    pose = request.pose.pose.pose
    assert (pose.position.x, pose.position.y) == (1.0, -2.0)
    assert pose.orientation.z == pytest.approx(math.sqrt(0.5))
    request = ResetPoseRequest()
    assert fill_pose(request, goal) and request == ResetPoseRequest(1.0, -2.0, pytest.approx(90.0))
    request = message(x=0.0, y=0.0, theta=0.0)
    assert not fill_pose(request, goal) and (request.x, request.theta) == (0.0, 0.0)


def test_a_request_that_declares_the_origin():
    assert all(map(is_origin, (message(x=0.0, y=0.0, yaw=0.0), message(), request_of(0.0, 1.0))))
    assert not any(map(is_origin, (message(x=0.0, y=0.1, yaw=0.0), request_of(1.0, 0.0))))
    assert nonzero_fields(message(x=0.0, y=0.1, yaw=math.nan)) == ['y is 0.1', 'yaw is nan']
    assert nonzero_fields(request_of(1.0, 0.0)) == ['pose.pose.pose.orientation.z is 1']


def test_a_quaternion_is_a_rotation_if_its_length_is_1():
    for z, w in ((0.0, 1.0), (0.0, -1.0), (0.6, 0.8), (0.0, 0.999996)):
        assert is_unit(request_of(z, w))
    for z, w in ((0.0, 0.0), (0.0, 2.0), (1.0, 1.0), (0.0, math.nan)):
        assert not is_unit(request_of(z, w))
    assert is_unit(message(x=0.0, yaw=0.0))    # it has no quaternion
