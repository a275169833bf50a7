"""The marker makes the classes of a student's messages from examples, without the student's code."""
import importlib
import io
import os
import struct
import sys
from unittest import mock

import genpy
import pytest
from sandboxes import hand_in, ros_alone  # noqa: F401
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.intake.sandbox import Protection
from tb3_labs.marking.intake.workspace import build_types
from tb3_labs.marking.labs.ros_gamepad import has_covariance, is_origin, is_unit
from tb3_labs.marking.labs.ros_move2goal import fill_pose
from tb3_labs.marking.trial.ros_types import KnownTypes
from tb3_labs.msg import MouseController
from tb3_labs.srv import SetInitialPose

pytestmark = pytest.mark.usefixtures('ros_alone')
TEXTS = {
    '__init__.py': 'raise SystemExit',
    'msg/Mouse.msg': 'Header header\nstd_msgs/Bool status # on?\nfloat32 xPos\nfloat32 yPos\n',
    'msg/Odd.msg': 'string X=\'"""; import os; os.abort()\nInner[2] inner\nuint8 n\nbool b\nfloat64 e\n'
                   'time t\nstring[] k\nstd_msgs/Float64 f\nHeader h\n',
    'msg/Inner.msg': 'int32 k\n', 'msg/Broken.msg': 'no such type at all\n',
    'msg/Lacking.msg': 'nowhere_msgs/Thing thing\n', 'msg/Itself.msg': 'Itself it\n',
    'msg/Huge.msg': 'float64[900000000] x\n', 'msg/Large.msg': 'Inner[90000] x\n',
    'srv/Set.srv': 'int8 n\ngeometry_msgs/PoseWithCovarianceStamped pose\n---\nbool success\nstring message\n',
    # its fields are those of a service of the handout, so it is the same service
    'srv/Same.srv': 'geometry_msgs/PoseWithCovarianceStamped pose\n---\n'}


def built(tmp_path, texts, remarks):
    """Write these files of a package lab2. Returns the examples of its types."""
    folder = hand_in(tmp_path / 'lab2', texts)
    node = hand_in(tmp_path / 'scripts', {'node.py': 'import lab2.msg'}) / 'node.py'
    return build_types({'lab2': folder}, node, tmp_path / 'python', dict(os.environ), remarks, Protection())


@pytest.fixture(scope='module')
def place(tmp_path_factory):
    return tmp_path_factory.mktemp('types')


@pytest.fixture(scope='module')
def described(place):
    return built(place, TEXTS, [])


@pytest.fixture(scope='module')
def theirs(place, described):
    """The modules of the student's types. In the marking only a sandbox imports them."""
    with mock.patch.object(sys, 'modules', dict(sys.modules)), mock.patch.object(
            sys, 'path', [str(place / 'python')] + sys.path):
        return importlib.import_module('lab2.msg'), importlib.import_module('lab2.srv')


def bytes_of(message):
    data = io.BytesIO()
    message.serialize(data)
    return data.getvalue()


def test_a_message_of_theirs_is_made_and_filled(described, theirs):
    kind = KnownTypes(described).message_class('lab2/Mouse')
    assert (kind._type, kind._md5sum) == ('lab2/Mouse', MouseController._md5sum)
    for made in (kind(), KnownTypes().message_class('tb3_labs/MouseController')()):
        made.put('header', 7, 8)
        made.put('status', True)
        made.put('xPos', 0.5)
        made.put('yPos', -1.0)
        read = MouseController().deserialize(bytes_of(made))
        assert (read.status.data, read.xPos, read.yPos) == (True, 0.5, -1.0)
        assert read.header.stamp == genpy.Time(7, 8)
    odd = KnownTypes(described).message_class('lab2/Odd')()    # its constant is code, which does not run
    assert bytes_of(odd) == bytes_of(theirs[0].Odd())
    for name, value in (('b', True), ('e', 1.5), ('f', -2.5)):
        odd.put(name, value)
    odd.put('h', 7, 8)
    read = theirs[0].Odd().deserialize(bytes_of(odd))
    assert (read.b, read.e, read.f.data) == (True, 1.5, -2.5) and (read.n, read.k) == (0, [])
    assert read.h.stamp == genpy.Time(7, 8)


def test_a_service_of_theirs_is_made(described, theirs):
    """The request declares the origin, and the response reports success."""
    types = KnownTypes(described)
    assert types.service_class('lab2/Same') is types.service_class('tb3_labs/SetInitialPose') is SetInitialPose
    kind = types.service_class('lab2/Set')
    request = kind._request_class()
    assert not fill_pose(request, Pose2(1.0, 2.0, 3.0))
    assert is_origin(request) and is_unit(request) and has_covariance(request)
    read = theirs[1].SetRequest().deserialize(bytes_of(request))
    assert read.pose.pose.pose.orientation.w == 1.0 and is_origin(read) and is_unit(read)
    response = theirs[1].SetResponse().deserialize(bytes_of(kind._response_class()))
    assert response.success is True and response.message == 'reset'
    assert kind._response_class().deserialize(b'\0') and kind._md5sum == theirs[1].Set._md5sum
    assert {kind._md5sum, SetInitialPose._md5sum} <= set(types.services_by_checksum())
    assert kind._md5sum not in KnownTypes().services_by_checksum()


@pytest.mark.parametrize('kind', [
    'lab2/Broken', 'lab2/Lacking', 'lab2/None', 'lab2/Itself', 'lab2/Huge', 'lab2/Large',
    'nowhere/Thing', '*', '', '/', '../x', 'os/path', 'lab2/Mouse\n', 'a\0b/c'])
def test_what_cannot_be_made_is_none(described, kind):
    assert not KnownTypes(described).message_class(kind) and not KnownTypes(described).service_class(kind)


def test_an_example_that_a_box_forged_is_no_more_than_bytes():
    fields = [['__class__', 'bool', 3], ['y', 'float32', 2]]
    forged = {'msg': {'a/B': {'sum': 'x', 'data': '00' * 4, 'fields': fields}}, 'srv': {}}
    made = KnownTypes(forged).message_class('a/B')()
    made.put('__class__', True)
    assert bytes_of(made) == b'\0\0\0\1' and type(made).__name__ == 'B'
    with pytest.raises(struct.error):
        made.put('y', 1.0)


NASTY = ['X"""\nopen("harm","w")\n\'\'\'\nif 1: #', 'A.B', '\u202eX', os.fsdecode(b'X\xfc'), '..',
         'class', '', '\N{KELVIN SIGN}X', 'X\n']


def test_the_name_of_a_file_is_no_code(tmp_path):
    """mark_hostile.test tries more."""
    remarks, long = [], 'x' * 251
    said = built(tmp_path, {'srv/{}.srv'.format(name): '---\n'
                            for name in NASTY + ['Good', long]}, remarks)
    assert list(said['srv']) == ['lab2/Good', 'lab2/' + long]
    assert remarks == []
    assert sorted(os.listdir(str(tmp_path / 'python' / 'lab2' / 'srv'))) == [
        '_Good.py', '__init__.py', '_{}.py'.format(long)]
