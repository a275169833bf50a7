"""The classes of a student's messages, made from their text without running a line of theirs."""
import io

import pytest
from tb3_labs.msg import MouseController
from tb3_labs.ros.marking.types import Types
from tb3_labs.srv import SetInitialPose

MANIFEST = '<package format="2"><name>lab2</name><version>0.0.0</version><description>x' \
    '</description><maintainer email="a@example.org">x</maintainer><license>x</license></package>'


@pytest.fixture
def folder(tmp_path):
    package = tmp_path / 'src' / 'package'
    for name, text in {
            'package.xml': MANIFEST, '__init__.py': 'raise SystemExit',
            'msg/Mouse.msg': 'Header header\nstd_msgs/Bool status # on?\nfloat32 xPos\nfloat32 yPos\n',
            'msg/Odd.msg': 'string X=\'"""; import os; os.abort()\nInner[2] inner\n',
            'msg/Inner.msg': 'int32 k\n', 'msg/Broken.msg': 'no such type at all\n',
            'msg/Lacking.msg': 'nowhere_msgs/Thing thing\n',
            'srv/Set.srv': 'geometry_msgs/PoseWithCovarianceStamped pose\n---\n'}.items():
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / 'src'


def test_a_message_of_theirs_is_made(folder):
    kind = Types([folder]).message('lab2/Mouse')
    message, data = kind(), io.BytesIO()
    message.status.data, message.xPos = True, 0.5
    message.serialize(data)
    assert kind._type == 'lab2/Mouse' and kind._md5sum == MouseController._md5sum
    assert MouseController().deserialize(data.getvalue()).xPos == 0.5


def test_constants_run_no_code(folder):
    message = Types([folder]).message('lab2/Odd')()
    assert [item.k for item in message.inner] == [0, 0] and not hasattr(message, 'X')


def test_a_service_of_theirs_is_made(folder):
    (folder / 'package' / 'srv' / 'SetInitialPose.srv').write_text(
        '\n---\n'.join('\n'.join('{} {}'.format(kind, name) for kind, name in zip(
            part._slot_types, part.__slots__)) for part in (
                SetInitialPose._request_class, SetInitialPose._response_class)))
    types = Types([folder])
    assert types.service('lab2/SetInitialPose')._md5sum == SetInitialPose._md5sum
    assert types.service('lab2/Set')._request_class().pose.pose.pose.orientation.w == 0.0
    assert len(types.own_services()) == 2 and Types().own_services() == []


@pytest.mark.parametrize('kind', ['lab2/Broken', 'lab2/Lacking', 'lab2/None', 'nowhere/Thing', '*'])
def test_what_cannot_be_made_is_none(folder, kind):
    assert Types([folder]).message(kind) is None and Types([folder]).service(kind) is None


def test_own_types_are_imported():
    assert Types().message('tb3_labs/MouseController') is MouseController
    assert Types().service('tb3_labs/SetInitialPose') is SetInitialPose
