"""Submissions are found and repaired; services of unknown types are filled and read."""
import math
import os
import subprocess
import threading
from concurrent.futures import ThreadPoolExecutor, wait
from types import SimpleNamespace

import pytest
import rospkg
from geometry_msgs.msg import PoseWithCovarianceStamped, Quaternion
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.labs import LABS
from tb3_labs.ros.marking import python_build
from tb3_labs.marking.ros_interface import packages_with_services
from tb3_labs.ros.marking.intake import Submission
from tb3_labs.marking.ros_interface import fill_pose, is_origin
from tb3_labs.ros.marking.submission import Unusable, find_node
from tb3_labs.ros.marking.workspace import prepare
from tb3_labs.srv import ResetPoseRequest, SetInitialPoseRequest

LAB = LABS['move2goal']
MANIFEST = '<package format="2"><name>{}</name></package>'
NODE = '#!/usr/bin/env python3\nprint("runs")\n'


def hand_in(folder, **files):
    """Write files; '__' in a keyword stands for '/', and a name without a dot gets '.py'."""
    for name, text in files.items():
        path = folder / (name.replace('__', '/') + ('' if '.' in name else '.py'))
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder


def prepared(tmp_path, folder):
    (tmp_path / 'work').mkdir()
    copy, _ = Submission(folder.name, [folder]).lay_out(tmp_path / 'work')
    return prepare(copy, LAB, tmp_path / 'ws')


@pytest.mark.parametrize('found', [
    'lab7__scripts__move2goal', 'a__b__src__Move2Goal_TF', 'move2goal'])
def test_a_node_is_found_wherever_it_is(tmp_path, found):
    folder = hand_in(tmp_path, **{found: NODE, 'lab7__scripts__other': NODE,
                                  'devel__lib__lab7__move2goal_tf': NODE})
    path, remarks = find_node(folder, LAB)
    assert str(path) == str(tmp_path / (found.replace('__', '/') + '.py')) and remarks == []


def test_without_a_node_the_python_files_are_named(tmp_path):
    with pytest.raises(Unusable, match='No Python file was found at all'):
        find_node(tmp_path, LAB)
    hand_in(tmp_path, lab7__scripts__goal=NODE)
    with pytest.raises(Unusable, match=r'There is no move2goal_tf.py or move2goal.py.*goal\.py'):
        find_node(tmp_path, LAB)


@pytest.mark.parametrize('code, words', [
    (NODE.replace('\n', '\r\n'), 'Windows line endings'), ('\ufeff' + NODE, 'byte order mark'),
    ('print("runs")\n', 'first line'), (NODE.replace('python3', 'python'), 'first line'),
    (NODE.replace('/usr/bin/env python3', '/home/bob/python3'), 'first line')])
def test_a_node_that_could_not_be_started_is_made_to_run(tmp_path, code, words):
    folder = hand_in(tmp_path / 'bob', lab7__scripts__move2goal=code,
                     **{'lab7__package.xml': MANIFEST.format('lab7')})
    before = (folder / 'lab7' / 'scripts' / 'move2goal.py').read_bytes()
    ready = prepared(tmp_path, folder)
    assert (ready.package, ready.executable) == ('lab7', 'move2goal.py')
    assert any(words in remark for remark in ready.remarks)
    assert any('not executable' in remark for remark in ready.remarks)
    copy = tmp_path / 'ws' / 'src' / 'package' / 'scripts' / 'move2goal.py'
    assert subprocess.check_output([str(copy)]) == b'runs\n'
    assert (folder / 'lab7' / 'scripts' / 'move2goal.py').read_bytes() == before
    assert ready.environment['ROS_PACKAGE_PATH'].startswith(str(tmp_path / 'ws' / 'src'))


@pytest.mark.parametrize('manifest, words', [
    (None, 'no package.xml'), ('<package', 'cannot be read'),
    (MANIFEST.format('tb3_labs'), 'tb3_labs'), (MANIFEST.format('lab 7'), 'lab 7')])
def test_a_package_whose_name_cannot_be_used_gets_another(tmp_path, manifest, words):
    files = {'lab7__package.xml': manifest} if manifest else {}
    folder = hand_in(tmp_path / 'bob', lab7__scripts__move2goal=NODE, lab7__scripts__helper=NODE,
                     **files)
    ready = prepared(tmp_path, folder)
    assert ready.package == 'submission' and any(words in remark for remark in ready.remarks)
    copy = tmp_path / 'ws' / 'src' / 'package'
    assert '<name>submission</name>' in (copy / 'package.xml').read_text()
    assert (copy / 'scripts' / 'helper.py').exists()


def test_what_is_large_or_leads_elsewhere_is_not_copied(tmp_path):
    folder = hand_in(tmp_path / 'bob', move2goal=NODE, **{'run.bag': 'x', '.git__config': 'x'})
    with open(str(folder / 'core'), 'wb') as file:
        file.truncate(30000000)
    os.symlink('/', str(folder / 'all'))
    os.mkfifo(str(folder / 'pipe'))
    prepared(tmp_path, folder)
    copied = sorted(os.listdir(str(tmp_path / 'ws' / 'src' / 'package')))
    assert copied == ['move2goal.py', 'package.xml']


def test_nothing_is_read_or_written_through_a_link(tmp_path):
    """A manifest that is a link to a file of the instructor's, modules that are one to a folder."""
    home = hand_in(tmp_path / 'home', bashrc='mine\n', ssh__key='secret')
    folder = hand_in(tmp_path / 'bob', move2goal='import keys\n' + NODE, keys__setup='',
                     keys__src__other='', **{'keys__package.xml': MANIFEST.format('keys'),
                                             'keys__msg__Key.msg': 'int32 k\n'})
    (folder / 'package.xml').symlink_to(home / 'bashrc.py')
    (folder / 'keys' / 'src' / 'keys').symlink_to(home / 'ssh')
    (folder / 'keys' / 'src' / 'soft.py').symlink_to(home / 'ssh' / 'key.py')
    os.link(str(home / 'ssh' / 'key.py'), str(folder / 'keys' / 'src' / 'hard.py'))
    prepared(tmp_path, folder)
    assert (home / 'bashrc.py').read_text() == 'mine\n'
    copied = [path for path in (tmp_path / 'ws').rglob('*') if path.is_file()]
    assert tmp_path / 'ws' / 'python' / 'keys' / 'msg' / '_Key.py' in copied
    assert [path for path in copied if b'secret' in path.read_bytes()] == []


@pytest.mark.parametrize('manifest', [
    '<!DOCTYPE p [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><package><name>&b;</name></package>',
    '<?xml version="1.0" encoding="utf-9"?><package>', '<p>' * 9000, '<package><name/></package>',
    MANIFEST.format('lab7\N{KELVIN SIGN}'), MANIFEST.format('../../etc'), b'\xff\xfe<\0p'])
def test_a_hostile_manifest_is_not_believed(tmp_path, manifest):
    folder = hand_in(tmp_path / 'bob', move2goal=NODE, **{'package.xml': manifest})
    assert prepared(tmp_path, folder).package == 'submission'


@pytest.mark.parametrize('name', [
    'move2goal "$(find rospy)".py', "move2goal'\n.py", '-move2goal.py', 'm\u202egoal2evom.py',
    '*[!]move2goal.py', os.fsdecode(b'move2goal\xfc.py')])
def test_a_node_with_an_odd_name_gets_another_one(tmp_path, name):
    folder = tmp_path / 'bob'
    folder.mkdir()
    (folder / name).write_text('#!/usr/bin/env python3\nclass MoveToGoal: pass\n'
                               'rospy.init_node("move_to_goal")\n')
    ready = prepared(tmp_path, folder)
    assert ready.executable == 'node.py'
    assert (tmp_path / 'ws' / 'src' / 'package' / 'node.py').exists()
    assert 'got another name' in ' '.join(ready.remarks)


@pytest.mark.parametrize('code', ['x = ' + '-' * 50000 + '1', 'x = ' + '(' * 500 + ')' * 500,
                                  'x = ' + 'a.' * 50000 + 'a', 'x = \0'])
def test_an_expression_that_is_too_deep_ends_nothing(tmp_path, code):
    ready = prepared(tmp_path, hand_in(tmp_path / 'bob', move2goal=code))
    assert ready.executable == 'move2goal.py'


# -- a course's repository

LAB1_MESSAGE = 'Header header\nbool activestatus\nfloat32 xPos\nfloat32 yPos\n'
TURN_NODE = '''#!/usr/bin/env python3
import rospy
import cv3
import apriltag_rosx as tags; import os
from nothing_here.msg import Tag, Tags
from lab1.msg import MouseController
print(MouseController().activestatus, tags, "rospy" and rospy.__name__)
'''
#: It asks for what no marking machine has, and generates a message.
LAB1_RECIPE = '''cmake_minimum_required(VERSION 3.0)
project(lab1)
find_package(catkin REQUIRED COMPONENTS rospy std_msgs
  turtlebot3_bringup  # the robot
  message_generation)
add_message_files(FILES MouseController.msg)
generate_messages(DEPENDENCIES std_msgs)
catkin_package(CATKIN_DEPENDS turtlebot3_bringup)
'''
FULL_MANIFEST = (
    '<package format="2"><name>{}</name><version>0.0.0</version><description>-</description>'
    '<maintainer email="a@example.org">-</maintainer><license>-</license><buildtool_depend>catkin'
    '</buildtool_depend><depend>turtlebot3_bringup</depend></package>')


def course(tmp_path, recipe=LAB1_RECIPE, node=TURN_NODE):
    return hand_in(tmp_path / 'bob', lab2__src__turtlebot_controller=node, **{
        'lab1__msg__MouseController.msg': LAB1_MESSAGE, 'lab1__CMakeLists.txt': recipe,
        'lab1__package.xml': FULL_MANIFEST.format('lab1'),
        'lab2__package.xml': FULL_MANIFEST.format('lab2'),
        'lab3__CMakeLists.txt': 'message(FATAL_ERROR "never built")',
        'lab3__package.xml': FULL_MANIFEST.format('lab3')})


@pytest.mark.parametrize('recipe, told', [
    (LAB1_RECIPE, 'lab1 asks CMake for turtlebot3_bringup, which the marking machine lacks'),
    ('# generate_messages()', 'generate_messages() is missing')])
def test_only_what_the_node_needs_is_built_and_what_is_lacking_is_left_out(tmp_path, recipe, told):
    ready = prepare(course(tmp_path, recipe), LABS['turn'], tmp_path / 'ws')
    words = ' '.join(ready.remarks)
    assert told in words and 'cv3, nothing_here.msg: imported, but not used' in words
    assert ready.lacking == ['apriltag_rosx']       # it is used: the node cannot run without it
    assert sorted(os.listdir(str(tmp_path / 'ws' / 'src'))) == ['other1', 'package']
    copy = tmp_path / 'ws' / 'src' / 'package' / 'src' / 'turtlebot_controller.py'
    code = copy.read_text().splitlines()
    assert code[2] == 'pass    # import cv3' and code[4] == 'pass    # ' \
        'from nothing_here.msg import Tag, Tags'
    code[3] = 'tags = 7'
    copy.write_text('\n'.join(code))
    assert subprocess.check_output([str(copy)], env=ready.environment,
                                   universal_newlines=True) == 'False 7 rospy\n'


def test_a_message_package_without_a_manifest_and_one_that_needs_another(tmp_path):
    folder = hand_in(
        tmp_path / 'bob', turtlebot_controller='#!/usr/bin/env python3\nfrom outer.msg import O\n'
        'print(O().inner.value)\n', **{'outer__msg__O.msg': 'inner/I inner\n',
                                       'inner__msg__I.msg': 'float32 value\n'})
    ready = prepare(folder, LABS['turn'], tmp_path / 'ws')
    assert ready.lacking == []
    copy = tmp_path / 'ws' / 'src' / 'package' / 'turtlebot_controller.py'
    assert subprocess.check_output([str(copy)], env=ready.environment) == b'0.0\n'


def test_a_node_from_windows_has_its_messages(tmp_path):
    node = ('\ufeff#!/usr/bin/env python3\nfrom lab1.msg import MouseController\n'
            'print(MouseController().xPos)\n').replace('\n', '\r\n')
    ready = prepare(course(tmp_path, node=node), LABS['turn'], tmp_path / 'ws')
    copy = tmp_path / 'ws' / 'src' / 'package' / 'src' / 'turtlebot_controller.py'
    assert subprocess.check_output([str(copy)], env=ready.environment) == b'0.0\n'


def test_a_message_that_cannot_be_built_stops_no_other(tmp_path):
    folder = course(tmp_path, node=TURN_NODE.replace('apriltag_rosx as tags', 'sys as tags'))
    hand_in(folder, **{'lab1__msg__Broken.msg': 'nowhere/Type t\n',
                       'lab1__srv__S.srv': 'no type here\n---\n'})
    ready = prepare(folder, LABS['turn'], tmp_path / 'ws')
    words = ' '.join(ready.remarks)
    assert 'lab1/Broken.msg cannot be built: Cannot locate message [Type]: unknown package' in words
    assert 'lab1/S.srv cannot be built: Invalid declaration: no type here.' in words
    copy = tmp_path / 'ws' / 'src' / 'package' / 'src' / 'turtlebot_controller.py'
    assert subprocess.call([str(copy)], env=ready.environment) == 0


def test_rosrun_finds_the_copy_and_not_what_somebody_built_of_the_same_name(tmp_path, monkeypatch):
    built, other = tmp_path / 'built', tmp_path / 'other'
    (built / 'lib' / 'lab2').mkdir(parents=True)
    (other / 'lib' / 'lab1').mkdir(parents=True)
    monkeypatch.setenv('CMAKE_PREFIX_PATH', '{}:{}'.format(built, other))
    ready = prepare(course(tmp_path), LABS['turn'], tmp_path / 'ws')
    assert ready.package == 'lab2'
    assert ready.environment['CMAKE_PREFIX_PATH'] == str(other)


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
                go_on.wait(5.0)
            return str(tmp_path / name)
    monkeypatch.setattr(python_build.rospkg, 'RosPack', Packages)
    for asked in (python_build.system_packages, python_build.system_messages):
        asked.cache_clear()
        request.addfinalizer(asked.cache_clear)
    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(lambda: sorted(python_build.system_messages()))
        assert half_way.wait(5.0)
        second = pool.submit(lambda: sorted(python_build.system_messages()))
        wait([second], 0.05)
        go_on.set()
        assert first.result() == second.result() == ['one', 'two']


def test_a_guarded_import_is_left_alone(tmp_path):
    node = 'try:\n    import cv3\nexcept ImportError:\n    cv3 = None\n'
    ready = prepare(course(tmp_path, node=NODE + node), LABS['turn'], tmp_path / 'ws')
    assert ready.lacking == []
    copy = tmp_path / 'ws' / 'src' / 'package' / 'src' / 'turtlebot_controller.py'
    assert copy.read_text() == NODE + node


# -- services

POSE = Pose2(1.0, -2.0, math.radians(90.0))


def message(**fields):
    """A message with such float64 fields."""
    return SimpleNamespace(__slots__=list(fields), _slot_types=['float64'] * len(fields), **fields)


def test_own_services_are_filled():
    request = ResetPoseRequest()
    assert fill_pose(request, POSE) == {'x', 'y', 'yaw', 'unit'}
    assert (request.x, request.y, request.yaw_deg) == (1.0, -2.0, pytest.approx(90.0))
    request = SetInitialPoseRequest()
    assert fill_pose(request, POSE) == {'x', 'y', 'yaw', 'unit'}
    pose = request.pose.pose.pose
    assert (pose.position.x, pose.position.y) == (1.0, -2.0)
    assert pose.orientation.z == pytest.approx(math.sqrt(0.5))


@pytest.mark.parametrize('fields, filled, yaw', [
    (('x', 'y', 'theta'), {'x', 'y', 'yaw'}, math.pi / 2), (('pos_x', 'pos_y'), {'x', 'y'}, None),
    (('x', 'y', 'heading_deg'), {'x', 'y', 'yaw', 'unit'}, 90.0), (('speed',), set(), 0.0),
    ((), set(), 0.0)])
def test_services_of_unknown_types_are_filled_by_the_names_of_their_fields(fields, filled, yaw):
    request = message(**dict.fromkeys(fields, 0.0))
    assert fill_pose(request, POSE) == filled
    if 'yaw' in filled:
        assert getattr(request, fields[-1]) == pytest.approx(yaw)


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


def test_services_are_known_from_every_package_of_the_student(tmp_path):
    for name in ('lab7_tf', 'lab4_gamepad'):
        hand_in(tmp_path, **{name + '__package.xml': MANIFEST.format(name)})
    hand_in(tmp_path, **{'lab7_tf__srv__SetPose.srv': '---\n'})
    assert packages_with_services(rospkg.RosPack([str(tmp_path)])) == ['std_srvs', 'lab7_tf']
