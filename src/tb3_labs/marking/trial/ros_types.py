"""The classes of a student's messages and services, without a line of their code.

Importing a student's modules would run the student's code in the marker. Code that is generated
from a student's messages may do so too. Therefore a sandbox makes an example of each type, as bytes
(see message_examples.py). Here a few fields of it are replaced, and nothing is read from it.
"""
import importlib
import struct
from types import SimpleNamespace
from typing import Any, BinaryIO, Dict, List, Optional

import genpy

from tb3_labs.marking.intake.message_examples import FIELD_FORMATS, example_of
from tb3_labs.marking.names import is_name

#: The packages of the services that the handout, its skeletons and the sheets call. A service of a
#: student with the checksum of one of these is the same.
KNOWN_SERVICES = 'tb3_labs', 'std_srvs'


class Types:
    """Knows the types that this process can import, or of which a sandbox made examples."""

    def __init__(self, described: Optional[Dict[str, Any]] = None) -> None:
        """`described`: the answer of workspace.build; None: the student defined no types."""
        described = described or {'msg': {}, 'srv': {}}
        self._messages, self._services = described['msg'], described['srv']

    def message(self, kind: str) -> Any:
        """The class of a message type ('lab2/MouseController'), an Example; None if unknown."""
        known = _imported(kind, 'msg')
        example = example_of(known) if known else self._messages.get(kind)
        return example and _example(kind, example['sum'], example['data'], example['fields'])

    def service(self, kind: str) -> Any:
        """The class of a service type; None if it is unknown."""
        example = self._services.get(kind)
        return _imported(kind, 'srv') or example and self.by_sum().get(example['sum'])

    def by_sum(self) -> Dict[str, Any]:
        """Returns checksum -> class of all known services."""
        found = {example['sum']: SimpleNamespace(
            _type=kind, _md5sum=example['sum'],
            _request_class=_example(kind, example['sum'], example['request']),
            _response_class=_example(kind, example['sum'], example['response']))
            for kind, example in self._services.items()}
        for package in KNOWN_SERVICES:
            found.update({kind._md5sum: kind for kind in vars(importlib.import_module(
                package + '.srv')).values() if hasattr(kind, '_request_class')})
        return found


class Example(genpy.Message):
    """A message as bytes: at first the bytes of the example of its type."""

    fields: List[List[Any]] = []    # name, type and place of each

    def __init__(self) -> None:
        self._data = bytearray(self._example)

    def put(self, name: str, *value: Any) -> None:
        """Replace the value of a field whose type is in FIELD_FORMATS; of a header the stamp."""
        of, place = {field: rest for field, *rest in self.fields}[name]
        struct.pack_into(FIELD_FORMATS[of], self._data, place, *value)

    def serialize(self, buff: BinaryIO) -> None:
        """Write the message into a stream, as genpy's messages do."""
        buff.write(self._data)

    def deserialize(self, data: bytes) -> 'Example':
        """Nothing is read: the message stays the example."""
        return self


def _example(kind, checksum, data, fields=()):
    return type(kind.partition('/')[2], (Example,), {
        '_type': kind, '_md5sum': checksum, '_full_text': '', '_slot_types': [],
        '_example': bytes.fromhex(data), 'fields': list(fields)})


def _imported(kind, what):
    package, _, name = kind.partition('/')
    try:
        return is_name(package) and is_name(name) and getattr(
            importlib.import_module(f'{package}.{what}'), name, None)
    except ImportError:
        return None
