"""Makes modules of messages and services, and an example of each type. This program runs in a
sandbox, because genpy pastes a submission's names into code, and genmsg evaluates its constants.

The program reads a JSON object. Its `search` is {package of the system: [folder of its messages]}.
Its `definitions` is a list of [package, 'msg' or 'srv', name, text].

The program prints a JSON object. Its `modules` is a list of [package, 'msg' or 'srv', name of the
file, text]. Its `problems` is {file: the reason why the file cannot be built}. Its `msg` and `srv`
are {type: example}; see `example_of`.
"""
import importlib
import io
import json
import os
import struct
import sys
import tempfile
from pathlib import Path

import genmsg
import genpy
from genpy.generate_initpy import write_modules
from genpy.generator import MsgGenerator, SrvGenerator

MAX_EXAMPLE_BYTES = 10 ** 5
GENERATORS = {'msg': MsgGenerator, 'srv': SrvGenerator}
#: {type of a field that the check fills in: format of the module struct}. The check fills in only
#: the stamp of a header.
FIELD_FORMATS = {'bool': '?', 'std_msgs/Bool': '?', 'float32': '<f', 'float64': '<d',
                 'std_msgs/Float32': '<f', 'std_msgs/Float64': '<d', 'std_msgs/Header': '<II'}


def make_modules(search, definitions):
    """Make the modules in the current folder. Returns the object that the program prints."""
    result = {'problems': {}, 'msg': {}, 'srv': {}, 'modules': []}
    for package, kind, name, text in definitions:
        search[package] = [f'in/{package}/msg']
        path = Path('in', package, kind, f'{name}.{kind}')
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding='utf-8')
    for package, kind, name, _ in definitions:
        file = f'{package}/{kind}/{name}.{kind}'
        target = Path('out', package, kind)
        try:
            GENERATORS[kind]().generate(genmsg.MsgContext.create_default(), f'{package}/{name}',
                                        f'in/{file}', str(target), search)
        except Exception as error:    # an invalid file must not end the program
            reason = str(error).replace(f'in/{file}: ', '')
            result['problems'][file] = reason or repr(error)
            (target / f'_{name}.py').unlink(missing_ok=True)
        if target.is_dir():
            write_modules(str(target))
    for module in Path('out').rglob('*.py'):
        package_kind_and_file = module.relative_to('out').parts
        result['modules'].append([*package_kind_and_file, module.read_text(encoding='utf-8')])
    sys.path.insert(0, os.path.abspath('out'))
    for package, kind, name, _ in definitions:
        try:
            module = importlib.import_module(f'{package}.{kind}._{name}')
            result[kind][f'{package}/{name}'] = example_of(getattr(module, name))
        except Exception:   # the type was not built, or its example is too large
            pass
    return result


def example_of(type_class):
    """Returns an example of a message type or a service type, with the checksum of the type.
    A message's example contains the bytes of a new message, and a list of the fields. Each field is
    [name, type, index of its first byte]. A service's example contains the bytes of a request with
    the pose (0, 0, 0), and the bytes of a response that reports success."""
    if not hasattr(type_class, '_request_class'):
        data = _bytes_of(type_class())
        fields = [[name, type_name, _first_byte(type_class(), name, type_name, data)]
                  for name, type_name in zip(type_class.__slots__, type_class._slot_types)]
        return {'sum': type_class._md5sum, 'data': data.hex(), 'fields': fields}
    request, response = type_class._request_class(), type_class._response_class()
    _set_no_rotation(request)
    for name, value in (('success', True), ('message', 'reset')):
        if name in response.__slots__:
            setattr(response, name, value)
    return {'sum': type_class._md5sum, 'request': _bytes_of(request).hex(),
            'response': _bytes_of(response).hex()}


def _bytes_of(message):
    buffer = io.BytesIO()
    message.serialize(buffer)
    if buffer.tell() > MAX_EXAMPLE_BYTES:
        raise ValueError('it is too large')
    return buffer.getvalue()


def _first_byte(message, name, type_name, old_bytes):
    """Returns the index of the field's first byte in a new message, or None if the field's type is
    not in FIELD_FORMATS. To find this byte, the function sets all bytes of the field to 1, and
    compares the message with its `old_bytes`."""
    if type_name not in FIELD_FORMATS:
        return None
    struct_format = FIELD_FORMATS[type_name]
    ones = struct.unpack(struct_format, b'\1' * struct.calcsize(struct_format))
    if type_name == 'std_msgs/Header':
        getattr(message, name).stamp = genpy.Time(*ones)
    elif '/' in type_name:
        getattr(message, name).data = ones[0]
    else:
        setattr(message, name, ones[0])
    has_changed = [old != new for old, new in zip(old_bytes, _bytes_of(message))]
    return has_changed.index(True)


def _set_no_rotation(message):
    """Set each quaternion in a new message to (0, 0, 0, 1), which is no rotation."""
    for name, type_name in zip(message.__slots__, message._slot_types):
        if type_name == 'geometry_msgs/Quaternion':
            getattr(message, name).w = 1.0
        elif hasattr(getattr(message, name), '_slot_types'):
            _set_no_rotation(getattr(message, name))


if __name__ == '__main__':
    with tempfile.TemporaryDirectory() as here:
        os.chdir(here)
        json.dump(make_modules(**json.load(sys.stdin)), sys.stdout)
