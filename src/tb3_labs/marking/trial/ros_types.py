"""The classes of a student's messages and services, made from a description of their fields.

Importing a student's modules would run the student's code in the marker. Code that is generated
from a student's messages may do so too. Therefore a sandbox reads the messages (see
messages.describe). Here no code is generated: values are written and read, field by field.

The message of the mouse is a student's own, too: its fields are found by name, else by type and
position.

Numbers are little-endian. A text, and an array of any length, begin with their length, a uint32.
Source: https://wiki.ros.org/msg, "Fields".
"""
import importlib
import re
import struct
from io import BytesIO
from types import SimpleNamespace
from typing import Any, BinaryIO, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import genpy

from tb3_labs.marking.intake.packages import is_name, is_type

#: Type of a field -> format of its bytes.
NUMBERS = {'bool': '?', 'byte': 'b', 'char': 'B', 'int8': 'b', 'uint8': 'B', 'int16': 'h',
           'uint16': 'H', 'int32': 'i', 'uint32': 'I', 'int64': 'q', 'uint64': 'Q',
           'float32': 'f', 'float64': 'd'}
TIMES = {'time': ('<II', genpy.Time), 'duration': ('<ii', genpy.Duration)}
LENGTH = '<I'
TEXT = 'string'
#: A type, and the length if it is an array: 'float32', 'float32[]', 'lab2/Wheel[4]'.
KIND = re.compile(r'([A-Za-z0-9_/]+)(?:\[([0-9]*)\])?')
#: A new message has at most this many values.
MOST_VALUES = 20000


class Types:
    """Knows the types that this process can import, and those of a description."""

    def __init__(self, described: Optional[Dict[str, Any]] = None) -> None:
        """`described`: the answer of messages.describe; None: the student defined no types."""
        described = described or {'fields': {}, 'sums': {}}
        self._sums = described['sums']
        self._fields = {kind: fields for kind, fields in described['fields'].items()
                        if is_type(kind) and all(map(_is_field, fields))}
        self._classes: Dict[str, Any] = {}

    def message(self, kind: str) -> Any:
        """The class of a message type ('lab2/MouseController'); None if it is unknown."""
        return _imported(kind, 'msg') or self._made(kind)

    def service(self, kind: str) -> Any:
        """Returns the class of a service type; None if it is unknown."""
        return _imported(kind, 'srv') or self._service(kind)

    def own_services(self) -> List[Any]:
        """Returns the classes of all services of the description."""
        return list(filter(None, map(self._service, sorted(self._sums))))

    def _service(self, kind):
        request, response = self._made(kind, 'Request'), self._made(kind, 'Response')
        return request and response and SimpleNamespace(
            _type=kind, _md5sum=self._sums[kind], _request_class=request,
            _response_class=response)

    def _made(self, kind, part=''):
        """The class of a message, or of this part of a service; None if its description is missing
        or invalid."""
        try:
            made = self._class_of(kind + part)
            made._md5sum = self._sums[kind]
            made()
            return made
        except (KeyError, ValueError, RecursionError):
            return None

    def _class_of(self, kind):
        if kind not in self._classes:
            fields = self._fields[kind]
            self._classes[kind] = type(kind.partition('/')[2], (_Message,), {
                '__slots__': [name for _, name in fields], '_slot_types': [of for of, _ in fields],
                '_type': kind, '_md5sum': '', '_full_text': '', '_codec': self,
                '_has_header': ['std_msgs/Header', 'header'] in map(list, fields)})
        return self._classes[kind]

    # -- values, by the type of their field

    def first(self, kind: str, room: Iterator[int]) -> Any:
        """Returns the first value of a field; `room`: an iterator with one item for each value."""
        if next(room, None) is None:
            raise ValueError('a new message has more than {} values'.format(MOST_VALUES))
        base, length = _split(kind)
        if length is not None:
            return [self.first(base, room) for _ in range(max(length, 0))]
        if base in TIMES:
            return TIMES[base][1]()
        if base in NUMBERS or base == TEXT:
            return {TEXT: '', 'bool': False, 'float32': 0.0, 'float64': 0.0}.get(base, 0)
        made = self._class_of(base)
        return made(*(self.first(inner, room) for inner in made._slot_types))

    def write(self, kind: str, value: Any, out: BinaryIO) -> None:
        """Write a value into a stream."""
        base, length = _split(kind)
        if length is not None:
            out.write(struct.pack(LENGTH, len(value)) if length < 0 else b'')
            for item in value:
                self.write(base, item, out)
        elif base in NUMBERS:
            out.write(struct.pack('<' + NUMBERS[base], value))
        elif base in TIMES:
            out.write(struct.pack(TIMES[base][0], value.secs, value.nsecs))
        elif base == TEXT:
            data = value.encode()
            out.write(struct.pack(LENGTH, len(data)) + data)
        else:
            for inner, name in self._fields[base]:
                self.write(inner, getattr(value, name), out)

    def read(self, kind: str, stream: '_Stream') -> Any:
        """Read a value from a :class:`_Stream`."""
        base, length = _split(kind)
        if length is not None:
            if length < 0:
                length, = stream.unpack(LENGTH)
                stream.check(length)        # else items of 0 bytes would fill the memory
            return [self.read(base, stream) for _ in range(length)]
        if base in NUMBERS:
            return stream.unpack('<' + NUMBERS[base])[0]
        if base in TIMES:
            return TIMES[base][1](*stream.unpack(TIMES[base][0]))
        if base == TEXT:
            return stream.take(*stream.unpack(LENGTH)).decode(errors='replace')
        made = self._class_of(base)
        return made(*(self.read(inner, stream) for inner in made._slot_types))


class _Message(genpy.Message):
    """A message that is known by its description only."""

    __slots__: Tuple[str, ...] = ()

    def __init__(self, *values: Any) -> None:
        room = iter(range(1, MOST_VALUES))
        values = values or tuple(self._codec.first(kind, room) for kind in self._slot_types)
        for name, value in zip(self.__slots__, values):
            setattr(self, name, value)

    def serialize(self, buff: BinaryIO) -> None:
        """Write the message into a stream, as genpy's messages do."""
        try:
            self._codec.write(self._type, self, buff)
        except (struct.error, TypeError, AttributeError) as problem:
            raise genpy.SerializationError(str(problem)) from None

    def deserialize(self, data: bytes) -> '_Message':
        """Read the message from bytes, as genpy's messages do."""
        stream = _Stream(data)
        for kind, name in zip(self._slot_types, self.__slots__):
            setattr(self, name, self._codec.read(kind, stream))
        return self


class _Stream(BytesIO):
    """Bytes that are read piece by piece. DeserializationError if there are too few."""

    def check(self, number: int) -> None:
        """Raises DeserializationError if there are fewer bytes left than `number`."""
        if number > self.getbuffer().nbytes - self.tell():
            raise genpy.DeserializationError('the message is too short')

    def take(self, number: int) -> bytes:
        """Returns the next bytes."""
        self.check(number)
        return self.read(number)

    def unpack(self, form: str) -> tuple:
        """Returns the next numbers."""
        return struct.unpack(form, self.take(struct.calcsize(form)))


def _imported(kind, what):
    package, _, name = kind.partition('/')
    try:
        return is_type(kind) and getattr(
            importlib.import_module('{}.{}'.format(package, what)), name, None)
    except ImportError:
        return None


def _split(kind):
    """The type without its brackets, and the length of the array: -1 for any, None for no array."""
    base, length = KIND.fullmatch(kind).groups()
    return base, None if length is None else int(length or -1)


def _is_field(field):
    kind, name = field
    found = KIND.fullmatch(kind)
    return bool(found) and is_name(name) and (
        found[1] in {*NUMBERS, *TIMES, TEXT} or is_type(found[1]))


# -- the message of the mouse

#: The mouse lab's names of fields; MOUSE_FLAGS and MOUSE_NUMBERS are the types that they may have.
STATUS, X, Y = 'status', 'xPos', 'yPos'
MOUSE_FLAGS = ('bool', 'std_msgs/Bool')
MOUSE_NUMBERS = ('float32', 'float64', 'std_msgs/Float32', 'std_msgs/Float64')


class MouseFields(NamedTuple):
    """The names of the fields, the types of each, and sentences about names that differ."""

    names: Tuple[str, str, str]     # of status, x and y
    types: Tuple[str, str, str]
    remarks: List[str]


def mouse_fields(names: Sequence[str], types: Sequence[str]) -> MouseFields:
    """The MouseFields of a message that has fields of these names and types, in this order.

    ``ValueError`` with a clause if the message has no flag, or fewer than two numbers.
    """
    flags = [pair for pair in zip(names, types) if pair[1] in MOUSE_FLAGS]
    numbers = [pair for pair in zip(names, types) if pair[1] in MOUSE_NUMBERS]
    if not flags or len(numbers) < 2:
        raise ValueError('its message has no flag and two numbers, but {}'.format(', '.join(
            '{} {}'.format(kind, name) for name, kind in zip(names, types)) or 'no field'))
    status = _named(STATUS, flags) or flags[0]
    x, y = _named(X, numbers), _named(Y, numbers)
    if not (x and y):
        x, y = numbers[:2]
    chosen = (status[0], x[0], y[0])
    remarks = ['Your {} was taken for {}.'.format(name, usual)
               for name, usual in zip(chosen, (STATUS, X, Y)) if name != usual]
    return MouseFields(chosen, (status[1], x[1], y[1]), remarks)


def _named(usual: str, fields: List[Tuple[str, str]]) -> Optional[Tuple[str, str]]:
    """The field of this name, in any case, with or without `Pos`; None if there is none."""
    for wanted in (usual.lower(), usual.lower().replace('pos', '')):
        for name, kind in fields:
            if name.lower().replace('_', '') == wanted:
                return name, kind
    return None
