"""Submissions are found and made to run; services of unknown types are filled and read."""
import math
import os
import subprocess
from types import SimpleNamespace

import pytest
import rospkg
from geometry_msgs.msg import PoseWithCovarianceStamped, Quaternion
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.marking.any_service import packages_with_services
from tb3_labs.ros.marking.requests import fill_pose, is_origin
from tb3_labs.ros.marking.submission import Unusable, find_node
from tb3_labs.ros.marking.workspace import prepare
from tb3_labs.srv import ResetPoseRequest, SetInitialPoseRequest

NAMES = ('move2goal_tf.py', 'move2goal.py')
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
    return prepare(folder, NAMES, tmp_path / 'ws', tmp_path / 'log')


@pytest.mark.parametrize('found', [
    'lab7__scripts__move2goal', 'a__b__src__Move2Goal_TF', 'move2goal'])
def test_a_node_is_found_wherever_it_is(tmp_path, found):
    folder = hand_in(tmp_path, **{found: NODE, 'lab7__scripts__other': NODE,
                                  'devel__lib__lab7__move2goal_tf': NODE})
    path, remarks = find_node(folder, NAMES)
    assert str(path) == str(tmp_path / (found.replace('__', '/') + '.py')) and remarks == []


def test_of_several_nodes_the_one_in_a_package_and_in_scripts_is_taken(tmp_path):
    folder = hand_in(tmp_path, old__move2goal=NODE, lab7__src__move2goal=NODE,
                     lab7__scripts__move2goal=NODE,
                     **{'lab7__package.xml': MANIFEST.format('lab7')})
    path, remarks = find_node(folder, NAMES)
    assert path == tmp_path / 'lab7' / 'scripts' / 'move2goal.py'
    assert '3 files are called move2goal.py; judged was lab7/scripts/move2goal.py' in remarks[0]


def test_without_a_node_the_python_files_are_named(tmp_path):
    with pytest.raises(Unusable, match='No Python file was found at all'):
        find_node(tmp_path, NAMES)
    hand_in(tmp_path, lab7__scripts__goal=NODE)
    with pytest.raises(Unusable, match=r'There is no move2goal_tf.py or move2goal.py.*goal\.py'):
        find_node(tmp_path, NAMES)


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
    assert copied == ['all', 'move2goal.py', 'package.xml']
    assert os.path.islink(str(tmp_path / 'ws' / 'src' / 'package' / 'all'))


def test_other_packages_of_a_submission_come_along(tmp_path):
    folder = hand_in(tmp_path / 'bob', lab7__scripts__move2goal=NODE, **{
        'lab7__package.xml': MANIFEST.format('lab7'), 'lab7_msgs__msg__M.msg': 'bool b',
        'lab7_msgs__package.xml': MANIFEST.format('lab7_msgs'),
        'lab7_old__package.xml': MANIFEST.format('lab7')})
    prepared(tmp_path, folder)
    assert sorted(os.listdir(str(tmp_path / 'ws' / 'src'))) == ['other1', 'package']
    assert (tmp_path / 'ws' / 'src' / 'other1' / 'msg' / 'M.msg').exists()


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
