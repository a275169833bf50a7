"""The classes of a student's messages, made from a description without a line of their code."""
import importlib
import io
import json
import os
import sys
from unittest import mock

import genpy
import pytest
from tb3_labs.marking.intake import describe, messages
from tb3_labs.marking.intake.messages import build
from tb3_labs.marking.trial.ros_types import Types
from tb3_labs.marking.intake.sandbox import NoSandbox
from tb3_labs.msg import MouseController
from tb3_labs.srv import SetInitialPose

TEXTS = {
    '__init__.py': 'raise SystemExit',
    'msg/Mouse.msg': 'Header header\nstd_msgs/Bool status # on?\nfloat32 xPos\nfloat32 yPos\n',
    'msg/Odd.msg': 'string X=\'"""; import os; os.abort()\nInner[2] inner\n',
    'msg/Inner.msg': 'int32 k\n', 'msg/Broken.msg': 'no such type at all\n',
    'msg/Lacking.msg': 'nowhere_msgs/Thing thing\n', 'msg/Itself.msg': 'Itself it\n',
    'msg/Huge.msg': 'float64[900000000] x\n', 'msg/Nested.msg': 'Many[2000] x\n',
    'msg/Many.msg': 'Inner[2000] x\n', 'msg/Flag.msg': 'bool B=1\n',
    'msg/All.msg': 'uint8 BIG=200\nHeader header\nbool a\nint8 b\nuint16 c\nint64 d\nfloat64 e\n'
                   'string f\ntime g\nduration h\nuint8[] i\nfloat32[3] j\nstring[] k\nInner[] l\n'
                   'Inner m\nchar[2] n\n',
    'srv/Set.srv': 'geometry_msgs/PoseWithCovarianceStamped pose\n---\n'}


def built(tmp_path, texts, remarks):
    """The description of a package lab2 with these files."""
    for name, text in texts.items():
        path = tmp_path / 'lab2' / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return build({'lab2': tmp_path / 'lab2'}, tmp_path / 'python', dict(os.environ), remarks,
                 NoSandbox())


@pytest.fixture(scope='module')
def place(tmp_path_factory):
    return tmp_path_factory.mktemp('types')


@pytest.fixture(scope='module')
def described(place):
    """Read in this process, as the program in a sandbox reads it."""
    def read(request, *_):
        here = os.getcwd()
        os.chdir(str(place))
        try:
            return json.loads(json.dumps(describe.describe(**request)))
        finally:
            os.chdir(here)
    own = '\n---\n'.join('\n'.join('{} {}'.format(kind, name) for kind, name in zip(
        part._slot_types, part.__slots__)) for part in (
            SetInitialPose._request_class, SetInitialPose._response_class))
    with mock.patch.object(messages, '_read', read):
        return built(place, dict(TEXTS, **{'srv/SetInitialPose.srv': own}), [])


def bytes_of(message):
    data = io.BytesIO()
    message.serialize(data)
    return data.getvalue()


def test_a_message_of_theirs_is_made(described):
    kind = Types(described).message('lab2/Mouse')
    message = kind()
    message.status.data, message.xPos = True, 0.5
    assert kind._type == 'lab2/Mouse' and kind._has_header
    assert kind._md5sum == MouseController._md5sum
    assert MouseController().deserialize(bytes_of(message)).xPos == 0.5
    odd = Types(described).message('lab2/Odd')()    # its constant is code, which does not run
    assert [item.k for item in odd.inner] == [0, 0] and not hasattr(odd, 'X')


def test_its_bytes_are_those_of_genpy(place, described, monkeypatch):
    """Those of genpy's own modules, which in the marking run in a box alone."""
    ours = Types(described).message('lab2/All')
    monkeypatch.setattr(sys, 'modules', dict(sys.modules))
    monkeypatch.setattr(sys, 'path', [str(place / 'python')] + sys.path)
    theirs = importlib.import_module('lab2.msg')
    made = theirs.All()
    assert bytes_of(ours()) == bytes_of(made) and ours._md5sum == theirs.All._md5sum
    made = theirs.All(a=True, b=-3, c=500, d=-2 ** 40, e=1.5, f='M\xfcller', g=genpy.Time(7, 8),
                      h=genpy.Duration(-1, 5), i=b'\x01\x02', j=[1.0, 2.0, 4.0], k=['a', ''],
                      l=[theirs.Inner(5), theirs.Inner(6)], m=theirs.Inner(-7), n=b'xy')
    made.header.frame_id, made.header.seq = 'odom', 3
    data = bytes_of(made)
    read = ours().deserialize(data)
    assert bytes_of(read) == data
    assert (read.f, read.l[1].k, read.g) == ('M\xfcller', 6, genpy.Time(7, 8))
    for cut in range(len(data)):
        with pytest.raises(genpy.DeserializationError):
            ours().deserialize(data[:cut])
    with pytest.raises(genpy.DeserializationError):
        ours().deserialize(data.replace(b'\x02\0\0\0\x05', b'\xff\xff\xff\xff\x05'))
    read.c = 'no number'
    with pytest.raises(genpy.SerializationError):
        bytes_of(read)


def test_a_service_of_theirs_is_made(described):
    types = Types(described)
    assert types.service('lab2/SetInitialPose')._md5sum == SetInitialPose._md5sum
    assert types.service('lab2/Set')._request_class().pose.pose.pose.orientation.w == 0.0
    assert len(types.own_services()) == 2 and Types().own_services() == []
    assert Types().message('tb3_labs/MouseController') is MouseController
    assert Types().service('tb3_labs/SetInitialPose') is SetInitialPose


@pytest.mark.parametrize('kind', [
    'lab2/Broken', 'lab2/Lacking', 'lab2/None', 'lab2/Itself', 'lab2/Huge', 'lab2/Nested',
    'nowhere/Thing', '*', '', '/', '../x', 'os/path', 'lab2/Mouse\n', 'a\0b/c'])
def test_what_cannot_be_made_is_none(described, kind):
    assert Types(described).message(kind) is None and Types(described).service(kind) is None


def test_a_description_that_a_box_forged_is_not_believed():
    forged = {'fields': {'lab2/A': [['int32', '__class__']], 'lab2/B': [['int32[x]', 'x']], '/': [],
                         'lab2/C': [['lab2/D', 'd']], 'lab2/E': [['lab2/E', 'e']]},
              'sums': dict.fromkeys(('lab2/A', 'lab2/B', '/', 'lab2/C', 'lab2/E'), 'x')}
    assert [Types(forged).message(kind) for kind in forged['sums']] == [None] * 5


NASTY = ['X"""\nopen("harm","w")\n\'\'\'\nif 1: #', 'A.B', '\u202eX', os.fsdecode(b'X\xfc'), '..',
         'class', '', '\N{KELVIN SIGN}X', 'X\n']


def test_the_name_of_a_file_is_no_code(tmp_path):
    """mark_hostile.test tries more."""
    remarks, long = [], 'x' * 251
    said = built(tmp_path, {'srv/{}.srv'.format(name): '---\n'
                            for name in NASTY + ['Good', long]}, remarks)
    assert list(said['sums']) == ['lab2/Good', 'lab2/' + long]
    told = [remark for remark in remarks if 'ROS allows letters' in remark]
    assert len(told) == len(NASTY) and all(remark.isprintable() for remark in told)
    assert sorted(os.listdir(str(tmp_path / 'python' / 'lab2' / 'srv'))) == [
        '_Good.py', '__init__.py', '_{}.py'.format(long)]
