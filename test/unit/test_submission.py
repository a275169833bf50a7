"""The node of a submission is found, repaired and built, as real students keep it; resets are filled
and read."""
import math
import os
import resource
import shutil
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path
from types import SimpleNamespace

import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped, Quaternion
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.intake import messages
from tb3_labs.marking.intake.imports import imports_of
from tb3_labs.marking.intake.submissions import Submission
from tb3_labs.marking.lab_names import NODES
from tb3_labs.marking.intake.packages import NotJudged, SourceFile, choose, find_node, is_aside, source_of
from tb3_labs.marking.intake.reading import Reading, _read, read
from tb3_labs.marking.labs.ros_gamepad import is_origin, is_unit
from tb3_labs.marking.labs.ros_move2goal import fill_pose
from tb3_labs.marking.marker import forget_overlays
from tb3_labs.marking.intake.sandbox import NoSandbox
from tb3_labs.marking.intake.workspace import COPY, elsewhere, prepare
from tb3_labs.msg import MouseController
from tb3_labs.srv import ResetPoseRequest, SetInitialPoseRequest

TURN, PAD, LAB = NODES['turn'], NODES['gamepad'], NODES['move2goal']
MANIFEST = '<package format="2"><name>{}</name></package>'
NODE = '#!/usr/bin/env python3\nprint("runs")\n'


def hand_in(folder, **files):
    """Write files; '__' in a keyword stands for '/', and a name without a dot gets '.py'."""
    for name, text in files.items():
        path = folder / (name.replace('__', '/') + ('' if '.' in name else '.py'))
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder


def read_here(tmp_path, folder, lab):
    """What the process of its own says of a folder: parts of a Reading, or why it is not judged."""
    return _read('bob', [str(folder)], [], str(tmp_path / 'ws' / COPY), lab, '', '')


def prepared(tmp_path, folder, lab=LAB):
    """What is prepared of a folder, and what was read of it, in this process."""
    said = read_here(tmp_path, folder, lab)
    assert isinstance(said, dict), said
    reading = Reading(**said)
    ready = prepare(reading, tmp_path / 'ws', {})
    ready.remarks = reading.remarks + ready.remarks
    return ready, reading


@pytest.mark.parametrize('found', [
    'lab7__scripts__move2goal', 'a__b__src__Move2Goal_TF', 'move2goal'])
def test_a_node_is_found_wherever_it_is(tmp_path, found):
    folder = hand_in(tmp_path, **{found: NODE, 'lab7__scripts__other': NODE})
    assert find_node(folder, LAB) == (found.replace('__', '/') + '.py', [], [])


@pytest.mark.parametrize('code, words', [
    (NODE.replace('\n', '\r\n'), 'Windows line endings'), ('\ufeff' + NODE, 'byte order mark')])
def test_a_node_that_could_not_be_started_is_made_to_run(tmp_path, code, words):
    folder = hand_in(tmp_path / 'bob', lab7__scripts__move2goal=code,
                     **{'lab7__package.xml': MANIFEST.format('lab7')})
    before = (folder / 'lab7' / 'scripts' / 'move2goal.py').read_bytes()
    ready, _ = prepared(tmp_path, folder)
    assert (ready.package, ready.executable) == ('lab7', 'move2goal.py')
    assert any(words in remark for remark in ready.remarks)
    assert any('not executable' in remark for remark in ready.remarks)
    assert subprocess.check_output([ready.program]) == b'runs\n'
    assert (folder / 'lab7' / 'scripts' / 'move2goal.py').read_bytes() == before
    assert ready.environment['ROS_PACKAGE_PATH'].startswith(str(tmp_path / 'ws' / 'src' / 'lab7'))


def test_a_node_without_a_first_line_for_python_is_told_so(tmp_path):
    ready, _ = prepared(tmp_path, hand_in(tmp_path / 'bob', lab7__scripts__move2goal='print("runs")\n'))
    assert ('move2goal.py does not begin with #!/usr/bin/env python3, so that rosrun cannot start it.'
            in ready.remarks)
    copy, = (tmp_path / 'ws').rglob('move2goal.py')
    assert copy.read_text() == 'print("runs")\n'


@pytest.mark.parametrize('manifest, words', [
    (None, 'no package.xml'), ('<package', 'cannot be read'), (b'\xff\xfe<\0p', 'cannot be read'),
    (MANIFEST.format('tb3_labs'), 'tb3_labs'), (MANIFEST.format('lab 7'), 'lab 7'),
    ('<!DOCTYPE p [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><package><name>&b;</name></package>',
     'it has entities'),
    ('<?xml version="1.0" encoding="utf-9"?><package>', 'cannot be read'), ('<p>' * 9000, 'cannot'),
    ('<package><name/></package>', "called ''"), (MANIFEST.format('../../etc'), 'etc'),
    (MANIFEST.format('lab7\N{KELVIN SIGN}'), 'got another name')])
def test_a_package_whose_name_cannot_be_used_gets_another(tmp_path, manifest, words):
    files = {'lab7__package.xml': manifest} if manifest else {}
    folder = hand_in(tmp_path / 'bob', lab7__scripts__move2goal=NODE, lab7__scripts__helper=NODE,
                     **files)
    ready, _ = prepared(tmp_path, folder)
    assert ready.package == 'submission' and any(words in remark for remark in ready.remarks)
    copy = tmp_path / 'ws' / 'src' / 'lab7'
    assert '<name>submission</name>' in (copy / 'package.xml').read_text()
    assert (copy / 'scripts' / 'helper.py').exists()


def test_no_link_is_followed(tmp_path):
    """A manifest that is a link to a file of the instructor's, modules that are one to a folder.
    Devices and large files are left out as well."""
    home = hand_in(tmp_path / 'home', bashrc='mine\n', ssh__key='secret')
    folder = hand_in(tmp_path / 'bob', move2goal='import keys\n' + NODE, keys__setup='',
                     keys__src__other='', **{'keys__package.xml': MANIFEST.format('keys'),
                                             'keys__msg__Key.msg': 'int32 k\n'})
    (folder / 'package.xml').symlink_to(home / 'bashrc.py')
    (folder / 'keys' / 'src' / 'keys').symlink_to(home / 'ssh')
    (folder / 'keys' / 'src' / 'soft.py').symlink_to(home / 'ssh' / 'key.py')
    os.link(str(home / 'ssh' / 'key.py'), str(folder / 'keys' / 'src' / 'hard.py'))
    os.mkfifo(str(folder / 'pipe'))
    with open(str(folder / 'core'), 'wb') as file:
        file.truncate(30000000)
    hand_in(folder, **{'run.bag': 'x', '.git__config': 'x', 'devel__lib__move2goal': NODE})
    prepared(tmp_path, folder)
    assert sorted(os.listdir(str(tmp_path / 'ws' / 'src'))) == [
        'keys', 'move2goal.py', 'package.xml']
    assert (home / 'bashrc.py').read_text() == 'mine\n'
    copied = [path for path in (tmp_path / 'ws').rglob('*') if path.is_file()]
    assert tmp_path / 'ws' / 'python' / 'keys' / 'msg' / '_Key.py' in copied
    assert [path for path in copied if b'secret' in path.read_bytes()] == []


@pytest.mark.parametrize('name', [
    'move2goal "$(find rospy)".py', '-move2goal.py', os.fsdecode(b'move2goal\xfc.py')])
def test_a_node_with_an_odd_name_gets_another_one(tmp_path, name):
    folder = hand_in(tmp_path / 'bob', **{
        name: 'class MoveToGoal: pass\nrospy.init_node("move_to_goal")\n'})
    ready, _ = prepared(tmp_path, folder)
    assert ready.executable == 'node.py'
    assert ready.program == str(tmp_path / 'ws' / 'src' / 'node.py')
    assert 'got another name' in ' '.join(ready.remarks)


@pytest.mark.parametrize('code', ['x = ' + '-' * 50000 + '1', 'x = ' + '(' * 500 + ')' * 500,
                                  'x = ' + 'a.' * 50000 + 'a', 'x = \0'],
                         ids=['signs', 'brackets', 'points', 'zero'])
def test_an_expression_that_is_too_deep_ends_nothing(tmp_path, code):
    ready, _ = prepared(tmp_path, hand_in(tmp_path / 'bob', move2goal=code))
    assert ready.executable == 'move2goal.py'


@pytest.mark.parametrize('code, message', [
    ('\n' * 300000, ''), ('import rospy\n' * 30000, ''), ('import lab7.msg', '\n' * 300000)],
    ids=['lines', 'imports', 'message'])
def test_a_long_file_holds_nobody_up(tmp_path, code, message):
    begun = time.process_time()
    prepared(tmp_path, hand_in(tmp_path / 'bob', move2goal=code, **{'lab7__msg__M.msg': message}))
    assert time.process_time() - begun < 10.0


# -- the choice of a node

MOUSE_ONLY = """class Controller:
    rospy.Subscriber('mouse_info', M, f)
rospy.init_node('controller')"""
IMU_TOO = MOUSE_ONLY + "\nrospy.Subscriber('imu', Imu, f)"


def repository(**texts):
    """SourceFiles; '__' stands for '/', and the first folder is a package if it has a digit."""
    files = []
    for name, text in texts.items():
        path = name.replace('__', '/') + '.py'
        first = path.split('/')[0]
        files.append(SourceFile(path, first if any(c.isdigit() for c in first) else '', text))
    return files


@pytest.mark.parametrize('texts, expected, said', [
    (dict(lab1__src__turtlebot_controller=MOUSE_ONLY, lab2__src__turtlebot_controller=IMU_TOO,
          lab3__src__turtlebot_controller=IMU_TOO), 'lab2/src/turtlebot_controller.py',
     '3 files can be the node; judged was lab2/src/turtlebot_controller.py, because it is in the '
     'package lab2. The others: lab3/src/turtlebot_controller.py, lab1/src/turtlebot_controller.py.'
     ),
    # the package goes before the name
    (dict(lab1__turtlebot_controller=IMU_TOO, lab2__src__controller=IMU_TOO),
     'lab2/src/controller.py', 'in the package lab2'),
    # the name goes before the signs
    (dict(lab2__src__turtlebot_controller='', lab2__src__first=IMU_TOO),
     'lab2/src/turtlebot_controller.py', 'the usual name'),
    # the signs go before the folder
    (dict(lab2__scripts__turtlebot_controller=MOUSE_ONLY,
          lab2__src__turtlebot_controller=IMU_TOO), 'lab2/src/turtlebot_controller.py',
     'it listens to imu'),
    # a package that is called nearly so goes before any other, but lab20 is no lab2
    (dict(lab2_final__turtlebot_controller=IMU_TOO, a__turtlebot_controller=IMU_TOO),
     'lab2_final/turtlebot_controller.py', 'in the package lab2'),
    (dict(lab20__turtlebot_controller=IMU_TOO, a__turtlebot_controller=IMU_TOO),
     'a/turtlebot_controller.py', 'it comes first (there is no package lab2)'),
    # a helper of lab2 is not the node of lab2
    (dict(lab1__turtlebot_controller=MOUSE_ONLY, lab2__helper='x = 1'),
     'lab1/turtlebot_controller.py', ''),
    # the node's class and name tell it, too
    (dict(lab2__src__node=MOUSE_ONLY), 'lab2/src/node.py',
     'There is no turtlebot_controller.py; judged was lab2/src/node.py, which has the class '
     'Controller and is the node controller.'),
])
def test_package_then_name_then_signs(texts, expected, said):
    path, remarks, _ = choose(TURN, repository(**texts))
    assert path == expected
    assert said in ' '.join(remarks) if said else remarks == []


def test_what_listens_can_be_the_node():
    for line in ("rospy.Subscriber('imu', Imu, f)", 'rospy.Subscriber("/imu", Imu, f)',
                 'Subscriber( name="robot3/imu" , data_class=Imu)'):
        assert choose(TURN, repository(a__b=line))[0] == 'a/b.py'
    for line in ("# rospy.Subscriber('imu', Imu, f)", "rospy.Subscriber('imu_raw', Imu, f)",
                 'class Controllers:', "rospy.Publisher('imu', Imu)"):
        with pytest.raises(NotJudged, match=r'There is no turtlebot_controller\.py, .*a/b\.py'):
            choose(TURN, repository(a__b=line))
    with pytest.raises(NotJudged, match='No Python file was found at all'):
        choose(TURN, [])


@pytest.mark.parametrize('files, said', [
    ({}, 'Nothing was handed in.'), ({'lab2__work.ipynb': '{}', 'b.txt': ''},
                                     'Handed in: b.txt, lab2/work.ipynb.')])
def test_what_was_handed_in_without_a_program_is_named(tmp_path, files, said):
    with pytest.raises(NotJudged, match='No Python file was found at all. ' + said):
        find_node(hand_in(tmp_path, **files), TURN)


def test_package_and_name_overrule():
    files = repository(lab1__turtlebot_controller=IMU_TOO, lab2__mine='')
    assert choose(TURN, files, package='lab1')[0] == 'lab1/turtlebot_controller.py'
    assert choose(TURN, files, name='mine.py')[0] == 'lab2/mine.py'
    with pytest.raises(NotJudged, match='There is no mine.py in a package lab1'):
        choose(TURN, files, package='lab1', name='mine.py')


@pytest.mark.parametrize('node, source', [
    ('lab2/scripts/n.py', 'lab2'), ('scripts/n.py', '.'), ('lab2/n.py', 'lab2'), ('n.py', '.'),
    ('lab7/deep/src/n.py', 'lab7')])
def test_the_folder_of_a_node_is_copied(tmp_path, node, source):
    """lab7 alone has a package.xml. The submission may itself be called as a folder of nodes."""
    folder = hand_in(tmp_path / 'src', **{'lab7__package.xml': MANIFEST.format('lab7')})
    assert source_of(folder / node, folder) == folder / source


def test_a_lab_with_several_usual_packages():
    files = repository(lab4_gamepad__gamepad='', lab7__gamepad='', other__gamepad='',
                       **{'a{}__gamepad'.format(n): '' for n in range(9)})
    path, remarks, _ = choose(PAD, files)
    assert path == 'lab4_gamepad/gamepad.py' and remarks[0].endswith(' and 5 more.')


# -- a course's repository

LACKS = ('lab2/src/turtlebot_controller.py imports {}, which neither the submission nor the marking '
         'machine has.')
LAB1_MESSAGE = 'Header header\nbool activestatus\nfloat32 xPos\nfloat32 yPos\n'
TURN_NODE = '''#!/usr/bin/env python3
import rospy
import cv3
import apriltag_rosx as tags; import os
import json
from nothing_here.msg import Tag, Tags
from lab1.msg import MouseController
print(MouseController().activestatus, tags, "rospy" and rospy.__name__)
'''


def course(tmp_path, node=TURN_NODE):
    return hand_in(tmp_path / 'bob', lab2__src__turtlebot_controller=node, **{
        'lab1__msg__MouseController.msg': LAB1_MESSAGE,
        'lab1__package.xml': MANIFEST.format('lab1'),
        'lab2__package.xml': MANIFEST.format('lab2'),
        'lab3__CMakeLists.txt': 'message(FATAL_ERROR "never built")',
        'lab3__package.xml': MANIFEST.format('lab3')})


def ready_in(tmp_path, folder):
    """What is prepared, and what was read."""
    return prepared(tmp_path, folder, TURN)


def output_of(ready):
    return subprocess.check_output([ready.program], env=ready.environment, universal_newlines=True)


def test_only_what_the_node_needs_is_built_and_empty_modules_stand_in_for_unused_ones(tmp_path):
    folder = course(tmp_path)       # it uses apriltag_rosx, and cannot run without it
    assert read_here(tmp_path / 'other', folder, TURN) == LACKS.format('apriltag_rosx')
    ready, _ = ready_in(tmp_path, course(tmp_path, node=TURN_NODE.replace('apriltag_rosx', 'math')))
    assert 'cv3, nothing_here.msg: imported, but not used' in ' '.join(ready.remarks)
    assert sorted(os.listdir(str(tmp_path / 'ws' / 'python'))) == ['cv3', 'lab1', 'nothing_here']
    assert output_of(ready).startswith("False <module 'math'")


@pytest.mark.parametrize('text, used', [
    (b'import a', False), (b'import a.b\na.b.c()', True), (b'import a; x = 1', False),
    (b'x = 1\nimport a\nb = 2', False), (b'from a import *', True), (b'from a import b\nb()', True),
    (b'import a as b\nprint(a)', False), (b'import a as b\nprint(b)', True)])
def test_an_import_is_used_if_its_names_are(text, used):
    found, = imports_of(text)
    assert found.used is used


@pytest.mark.parametrize('code, printed', [
    ('# -*- coding: latin-1 -*-\nimport cv3\nprint("M\xfcller")\n'.encode('latin-1'), 'M\xfcller\n'),
    (b'import sys\rimport cv3\rprint(1)\r', '1\n')])
def test_the_bytes_of_a_node_stay(tmp_path, code, printed):
    """But for line endings, which the system could not read."""
    ready, _ = ready_in(tmp_path, course(tmp_path, node=b'#!/usr/bin/env python3' + code[-1:] + code))
    assert ('old Mac: changed' in ready.remarks[0]) is (code[-1:] == b'\r')
    assert output_of(ready) == printed


def test_a_message_package_without_a_manifest_and_one_that_needs_another(tmp_path):
    folder = hand_in(   # a module beside the node imports them
        tmp_path / 'bob', turtlebot_controller='#!/usr/bin/env python3\nfrom beside import O\n'
        'print(O().inner.value)\n', beside='from outer.msg import O\n',
        **{'outer__msg__O.msg': 'inner/I inner\n', 'inner__msg__I.msg': 'float32 value\n'})
    ready, reading = ready_in(tmp_path, folder)
    assert output_of(ready) == '0.0\n'


def test_the_messages_of_the_nodes_own_package_were_not_handed_in(tmp_path):
    """The file of the message was forgotten; package.xml is there."""
    node = '#!/usr/bin/env python3\nfrom lab2.msg import MouseController\nMouseController()\n'
    assert read_here(tmp_path, course(tmp_path, node=node), TURN) == LACKS.format('lab2')


def test_the_skeletons_message_stands_in_for_a_package_that_was_not_handed_in(tmp_path):
    folder = hand_in(tmp_path / 'bob', turtlebot_controller='#!/usr/bin/env python3\n'
                     'from lab2.msg import MouseController\nprint(MouseController().status.data)\n')
    ready, reading = ready_in(tmp_path, folder)
    assert output_of(ready) == 'False\n'
    assert ready.types['msg']['lab2/MouseController']['sum'] == MouseController._md5sum
    assert ('The package lab2 was not handed in: the message MouseController of the skeleton stands in '
            'for its own.') in ready.remarks
    other = hand_in(tmp_path / 'eve', turtlebot_controller='from lab2.msg import Mouse\nMouse()\n')
    assert LACKS.format('lab2').endswith(read_here(tmp_path / 'other', other, TURN))


def test_a_node_from_windows_has_its_messages(tmp_path):
    """An import that its node guards is left alone."""
    node = ('\ufeff#!/usr/bin/env python3\nfrom lab1.msg import MouseController\n'
            'print(MouseController().xPos)\n'
            'try:\n    import cv3\nexcept ImportError:\n    cv3 = None\n').replace('\n', '\r\n')
    ready, reading = ready_in(tmp_path, course(tmp_path, node=node))
    assert 'import cv3' in Path(ready.program).read_text()
    assert output_of(ready) == '0.0\n'


def test_a_message_that_cannot_be_built_stops_no_other(tmp_path):
    folder = course(tmp_path, node=TURN_NODE.replace('apriltag_rosx as tags', 'sys as tags'))
    hand_in(folder, **{'lab1__msg__Broken.msg': 'nowhere/Type t\n',
                       'lab1__srv__S.srv': 'no type here\n---\n'})
    ready, reading = ready_in(tmp_path, folder)
    words = ' '.join(ready.remarks)
    assert 'lab1/Broken.msg cannot be built: Cannot locate message [Type]: unknown package' in words
    assert 'lab1/S.srv cannot be built: Invalid declaration: no type here.' in words
    assert output_of(ready)


def test_messages_that_cannot_be_read_are_told(tmp_path):
    class Fails(NoSandbox):
        def command(self, command):
            return ['false']
    remarks = []
    folder = hand_in(tmp_path / 'lab1', **{'msg__M.msg': 'int32 x\n'})
    built = messages.build({'lab1': folder}, tmp_path / 'python', {}, remarks, Fails())
    assert remarks == ['The messages and services could not be built.']
    assert built['msg'] == {}


def test_a_node_has_its_packages_own_modules_and_of_two_packages_the_nearer(tmp_path):
    folder = course(tmp_path, node='#!/usr/bin/env python3\nfrom lab2.laws import name\n'
                    'from lab1.laws import name as other\nprint(name, other)\n')
    for place, name in (('lab2', 'lab2'), ('lab2/lab1', 'lab1'), ('old/a/lab1', 'lab1')):
        hand_in(folder / place, **{
            'package.xml': MANIFEST.format(name), 'setup.py': '',
            'src__{}__laws'.format(name): 'name = {!r}\n'.format(place)})
    shutil.rmtree(str(folder / 'lab1'))
    ready, reading = ready_in(tmp_path, folder)
    assert output_of(ready) == 'lab2 lab2/lab1\n'


def test_of_two_files_with_one_name_the_chosen_one_is_started(tmp_path):
    """rosrun would ask which."""
    folder = course(tmp_path, node=NODE.replace('runs', 'src'))
    hand_in(folder, lab2__scripts__turtlebot_controller=NODE.replace('runs', 'scripts'))
    ready, reading = ready_in(tmp_path, folder)
    assert output_of(ready) == 'scripts\n'
    told, = reading.look_at
    assert 'as likely the node as lab2/src/turtlebot_controller.py, and they differ' in told


@pytest.mark.parametrize('aside', ['backup', '.git2', 'Copy of lab2', 'lab2_old', '.Trash-1000'])
def test_what_was_put_aside_is_judged_last(tmp_path, aside):
    files = repository(**{aside + '__turtlebot_controller': IMU_TOO, 'zz__turtlebot_controller': IMU_TOO})
    assert choose(TURN, [file._replace(package='lab2') for file in files]) == (
        'zz/turtlebot_controller.py', [
            '2 files can be the node; judged was zz/turtlebot_controller.py, because the others were put '
            'aside. The others: {}/turtlebot_controller.py.'.format(aside)], [])
    for name in ('gold', 'copyright', 'holder', 'scaffold', '.'):
        assert not is_aside(name) and not is_aside(name + '/n.py') and is_aside(name + '/n_old.py')


@pytest.mark.parametrize('first, lacks', [
    ('#!/usr/bin/env python3', False), ('#!/usr/bin/python3.1', True), ('#! /usr/bin/env python1', True),
    ('#!/bin/sh', False)])
def test_a_python_that_this_machine_lacks_is_told_to_the_instructor(tmp_path, first, lacks):
    ready, _ = ready_in(tmp_path, course(tmp_path, node=first + '\n'))
    assert [first + ', which this machine lacks' in said for said in ready.look_at] == [True] * lacks


@pytest.mark.parametrize('line, told', [
    ("AttributeError: module 'numpy' has no attribute 'float'.", True),
    ("ImportError: cannot import name 'quat2euler' from 'squaternion' (/usr/x.py)", True),
    ("AttributeError: 'Thread' object has no attribute 'isAlive'", True),
    ("AttributeError: module 'beside' has no attribute 'x'", False),
    ("AttributeError: 'Controller' object has no attribute 'x'", False), ('[INFO] AttributeError', False)])
def test_an_error_that_another_machine_may_not_have_is_told_to_the_instructor(tmp_path, line, told):
    hand_in(tmp_path / 'lab2', beside='')
    assert [line in said for said in elsewhere('Traceback:\n  x\n{}\n'.format(line), tmp_path)] == [
        True] * told


def test_whatever_eats_the_memory_of_its_reader_ends_the_reader_alone(tmp_path):
    """To parse this file Python needs 2.7 GB."""
    folder = hand_in(tmp_path / 'eve', turtlebot_controller='import ' + 'a.' * 50000 + 'a\n')
    try:
        assert read(Submission('eve', [folder]), tmp_path / 'copy', TURN).node == 'turtlebot_controller.py'
    except NotJudged as problem:
        assert 'more than 1 GB' in str(problem)
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < 1.1e6


def test_whoever_asks_while_the_packages_are_looked_up_gets_all_of_them(
        tmp_path, monkeypatch, request):
    half_way, go_on = threading.Event(), threading.Event()

    class Packages:
        def list(self):
            return ['one', 'two']

        def get_path(self, name):
            (tmp_path / name / 'msg').mkdir(parents=True, exist_ok=True)
            if name == 'two':
                half_way.set()
                go_on.wait(100.0)
            return str(tmp_path / name)
    monkeypatch.setattr(messages.rospkg, 'RosPack', Packages)
    messages.system_messages.cache_clear()
    request.addfinalizer(messages.system_messages.cache_clear)
    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(lambda: sorted(messages.system_messages()))
        assert half_way.wait(100.0)
        second = pool.submit(lambda: sorted(messages.system_messages()))
        wait([second], 0.05)
        go_on.set()
        assert first.result() == second.result() == ['one', 'two']


# -- the instructor's own workspaces

def devel_space(folder, *packages):
    """A devel space; its path."""
    for name in packages:
        (folder / 'devel' / 'share' / name).mkdir(parents=True)
    (folder / 'devel' / '.catkin').write_text(str(folder / 'src'))
    return str(folder / 'devel')


def test_what_lies_over_this_package_is_forgotten_and_what_it_needs_stays(tmp_path):
    over = devel_space(tmp_path / 'over', 'lab2')
    # in the other's source folder, as a clone in somebody's own workspace
    own = devel_space(tmp_path / 'over' / 'src' / 'clone' / 'ws', 'tb3_labs')
    under = devel_space(tmp_path / 'under', 'lab2')
    source = {prefix: prefix[:-len('devel')] + 'src' for prefix in (over, own, under)}
    beside, modules = own[:-len('devel')] + 'venv/bin', ['', over + '/lib', own + '/lib']
    environment = {
        'CMAKE_PREFIX_PATH': ':'.join((over, own, under)),
        'ROS_PACKAGE_PATH': ':'.join((source[over], source[own], source[under])),
        'PYTHONPATH': ':'.join((over + '/lib', own + '/lib')),
        'PATH': ':'.join((over + '/bin', beside, '/usr/bin')), 'HOME': over}
    forget_overlays(environment, modules)
    assert environment == {
        'CMAKE_PREFIX_PATH': own + ':' + under,
        'ROS_PACKAGE_PATH': source[own] + ':' + source[under],
        'PYTHONPATH': own + '/lib', 'PATH': beside + ':/usr/bin', 'HOME': over}
    assert modules == ['', own + '/lib']
    for prefixes in (own, own + ':' + under, under, ''):    # nothing lies over this package
        environment = {'CMAKE_PREFIX_PATH': prefixes, 'PYTHONPATH': under + '/lib'}
        before = dict(environment)
        forget_overlays(environment, [])
        assert environment == before


# -- services

POSE = Pose2(1.0, -2.0, math.radians(90.0))


def message(**fields):
    """A message with such float64 fields."""
    return SimpleNamespace(__slots__=list(fields), _slot_types=['float64'] * len(fields), **fields)


def test_a_standard_pose_is_filled():
    request = SetInitialPoseRequest()
    assert fill_pose(request, POSE)
    pose = request.pose.pose.pose
    assert (pose.position.x, pose.position.y) == (1.0, -2.0)
    assert pose.orientation.z == pytest.approx(math.sqrt(0.5))
    request = ResetPoseRequest()
    assert fill_pose(request, POSE) and request == ResetPoseRequest(1.0, -2.0, pytest.approx(90.0))


def test_a_request_without_a_place_for_a_pose_stays():
    request = message(x=0.0, y=0.0, theta=0.0)
    assert not fill_pose(request, POSE) and (request.x, request.theta) == (0.0, 0.0)


def test_a_request_that_declares_the_origin():
    assert is_origin(message(x=0.0, y=0.0, yaw=0.0)) and is_origin(message())
    assert not is_origin(message(x=0.0, y=0.1, yaw=0.0))
    pose = PoseWithCovarianceStamped()
    pose.header.frame_id = 'map'
    pose.pose.pose.orientation = Quaternion(0.0, 0.0, 0.0, 1.0)
    pose.pose.covariance[0] = 0.25
    assert is_origin(SetInitialPoseRequest(pose))
    pose.pose.pose.orientation = Quaternion(0.0, 0.0, 1.0, 0.0)
    assert not is_origin(SetInitialPoseRequest(pose))


@pytest.mark.parametrize('z, w, unit', [
    (0.0, 1.0, True), (0.0, -1.0, True), (0.6, 0.8, True), (0.0, 0.999996, True),
    (0.0, 0.0, False), (0.0, 2.0, False), (1.0, 1.0, False), (0.0, math.nan, False)])
def test_a_quaternion_is_a_rotation_if_its_length_is_1(z, w, unit):
    pose = PoseWithCovarianceStamped()
    pose.pose.pose.orientation = Quaternion(0.0, 0.0, z, w)
    assert is_unit(SetInitialPoseRequest(pose)) is unit
    assert is_unit(message(x=0.0, yaw=0.0))    # it has no quaternion
