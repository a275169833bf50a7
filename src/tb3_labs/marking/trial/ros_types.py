"""Makes classes for a student's messages and services without running the student's code.

An import of a student's modules, even of generated modules, would run the student's code in the
marker. Therefore a sandbox makes an example message of each type, as bytes (message_examples.py).
A message of the marker is a copy of these bytes, in which the marker replaces a few fields.
"""
import importlib
import struct
from types import SimpleNamespace
from typing import Any, BinaryIO, Dict, List, Optional

import genpy

from tb3_labs.marking.intake.message_examples import FIELD_FORMATS, example_of
from tb3_labs.marking.student_nodes import is_valid_name

#: The packages of the services that handout, skeletons and sheets use. If a student's service has
#: the checksum of a service in these packages, the two have the same fields.
SERVICE_PACKAGES = 'tb3_labs', 'std_srvs'


class KnownTypes:
    """The types that this process can import, and the types for which a sandbox made examples."""

    def __init__(self, student_types: Optional[Dict[str, Any]] = None) -> None:
        """`student_types` is the result of workspace.build; None if a student defined no types."""
        if student_types is None:
            student_types = {'msg': {}, 'srv': {}}
        self._messages, self._services = student_types['msg'], student_types['srv']

    def message_class(self, type_name: str) -> Any:
        """Returns a subclass of Example for a message type, such as 'lab2/MouseController'; None
        for an unknown type."""
        known_class = _class_in_a_package(type_name, 'msg')
        example = example_of(known_class) if known_class else self._messages.get(type_name)
        if example is None:
            return None
        return _example_class(type_name, example['sum'], example['data'], example['fields'])

    def service_class(self, type_name: str) -> Any:
        """Returns the class of a service type; None for an unknown type."""
        known_class = _class_in_a_package(type_name, 'srv')
        if known_class is None and type_name in self._services:
            return self.services_by_checksum()[self._services[type_name]['sum']]
        return known_class

    def services_by_checksum(self) -> Dict[str, Any]:
        """Returns {checksum: class} of all known services."""
        classes: Dict[str, Any] = {}
        for type_name, example in self._services.items():
            checksum = example['sum']
            classes[checksum] = SimpleNamespace(
                _type=type_name, _md5sum=checksum,
                _request_class=_example_class(type_name, checksum, example['request']),
                _response_class=_example_class(type_name, checksum, example['response']))
        for package in SERVICE_PACKAGES:
            for service in vars(importlib.import_module(package + '.srv')).values():
                if hasattr(service, '_request_class'):
                    classes[service._md5sum] = service
        return classes


class Example(genpy.Message):
    """A message as bytes. A new message is a copy of its type's example."""

    fields: List[List[Any]] = []    # [name, type, number of the first byte] of each field

    def __init__(self) -> None:
        self._data = bytearray(self._example)

    def put(self, name: str, *value: Any) -> None:
        """Replace the value of a field, or the stamp of a header. The field's type must be in
        FIELD_FORMATS."""
        for field, type_name, first_byte in self.fields:
            if field == name:
                struct.pack_into(FIELD_FORMATS[type_name], self._data, first_byte, *value)

    def serialize(self, buff: BinaryIO) -> None:
        """Write the message into a stream, as genpy's messages do."""
        buff.write(self._data)

    def deserialize(self, data: bytes) -> 'Example':
        """Returns the unchanged message. genpy calls this method."""
        return self


def _example_class(type_name, checksum, data, fields=()):
    return type(type_name.partition('/')[2], (Example,), {
        '_type': type_name, '_md5sum': checksum, '_full_text': '', '_slot_types': [],
        '_example': bytes.fromhex(data), 'fields': list(fields)})


def _class_in_a_package(type_name, submodule):
    package, _, name = type_name.partition('/')
    if not (is_valid_name(package) and is_valid_name(name)):
        return None
    try:
        return getattr(importlib.import_module(f'{package}.{submodule}'), name, None)
    except ImportError:
        return None
