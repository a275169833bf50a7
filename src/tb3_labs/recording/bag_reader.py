"""Reads the records of a bag file, in the order in which they were recorded.

A bag may come from a stranger, so this reader runs no code from a bag, and limits its memory. A
recording that was cut off is read up to its last whole record.

Source: http://wiki.ros.org/Bags/Format/2.0
"""
import bz2
import math
import mmap
import os
import struct
from shlex import quote
from typing import Callable, Dict, List, NamedTuple, Optional, Tuple, Union

#: An hour of record.launch needs 1.2e9 bytes, or 1.6e9 bytes if the bag is packed.
MAX_MEMORY_BYTES = 2e9
#: A message, or a connection, needs this memory in addition to its data.
MESSAGE_OVERHEAD_BYTES = 500
CONNECTION_OVERHEAD_BYTES = 10000
MAX_HEADER_BYTES = 10000
MAX_NAME_BYTES = 200
MAX_MESSAGE_BYTES = 2 ** 18
MAX_CHUNK_BYTES = 2 ** 26
#: A busy recorder may exchange two messages of a sender that are less than this time [s] apart.
MIN_SET_BACK_TIME = 0.2
#: A longer silence [s] shows that the clock was set forward, or that the computer slept.
MAX_SILENCE = 3600.0
#: When the clock jumps, the reading ends, because all later times are wrong.
CLOCK_JUMPED = "the recording computer's clock was set, or the computer slept"
BAG_VERSION = b'#ROSBAG V2.0\n'
MESSAGE, CHUNK, CONNECTION = b'\2', b'\5', b'\7'      # values of the header field `op`
UINT32 = struct.Struct('<I')
TIME = struct.Struct('<II')     # seconds, nanoseconds
NOT_A_BAG = (
    'not a bag of ROS 1, version 2.0. If it is packed, unpack it. If it is of ROS 2, convert it: '
    'pip install rosbags; rosbags-convert --src {} --dst run.bag')


class BagProblem(ValueError):
    """A bag cannot be read. The text is one line with the reason and the remedy."""


class ReadingEnded(Exception):
    """The reading ends before the end of the bag. The text names the reason."""


class Connection(NamedTuple):
    """A node that sends messages of one type on a topic. `checksum` is the md5sum of the type."""

    topic: str
    message_type: str
    checksum: str
    sender: str


#: (arrival [s since the first message], bytes) of each message of a connection, in the order of the
#: file. If a message is too large, its bytes are b''.
Stream = List[Tuple[float, bytes]]


class Bag:
    """The contents of a bag file. `streams` is {Connection: Stream}. The value is None for a
    Connection that is not wanted. `problem` is the reason if the reading ended early, or ''."""

    def __init__(self, path: str, is_wanted: Callable[[Connection], bool]) -> None:
        """Read the messages of each connection that `is_wanted`. May raise BagProblem."""
        self.streams: Dict[Connection, Optional[Stream]] = {}
        self.start: Optional[float] = None      # arrival of the first message [s since 1970]
        self.problem = ''
        self._is_wanted = is_wanted
        self._memory_left = MAX_MEMORY_BYTES
        self._last_arrival = math.inf           # of the last kept message, or inf
        self._stream_by_connection: Dict[bytes, Optional[Stream]] = {}
        with open(path, 'rb') as file:
            if not os.fstat(file.fileno()).st_size:
                raise BagProblem('the file is empty; copy or download it again')
            with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
                if data[:len(BAG_VERSION)] != BAG_VERSION:
                    raise BagProblem(NOT_A_BAG.format(quote(path)))
                try:
                    self._read_records(data, len(BAG_VERSION))
                except ReadingEnded as error:
                    self.problem = str(error)
                except (ValueError, LookupError, struct.error, OSError):
                    self.problem = 'the recording was cut off, or is damaged'

    def _read_records(self, data: Union[bytes, mmap.mmap], index: int) -> None:
        """Read the records in a file or an unpacked chunk from this index."""
        while index < len(data):
            [header_size] = UINT32.unpack_from(data, index)
            header_begin = index + UINT32.size
            header_end = header_begin + header_size
            [data_size] = UINT32.unpack_from(data, header_end)
            begin = header_end + UINT32.size
            end = begin + data_size
            if header_size > MAX_HEADER_BYTES:
                raise ValueError('a header is too long')
            fields = _fields(data[header_begin:header_end])
            op = fields[b'op']
            if op == CHUNK and fields[b'compression'] == b'none':
                index = begin       # the data of the chunk are the next records
                continue

            index = end
            if op == MESSAGE:
                stream = self._stream_by_connection[fields[b'conn']]
                self._keep_message(stream, fields[b'time'], data, slice(begin, end))
            elif op in (CONNECTION, CHUNK) and data_size > MAX_CHUNK_BYTES:
                raise ValueError('a chunk is too large')
            elif op == CONNECTION:
                self._add_connection(fields, data[begin:end])
            elif op == CHUNK:
                self._read_records(self._unpacked(fields[b'compression'], data[begin:end]), 0)
        if index > len(data):
            raise ValueError('the last record is not whole')

    def _spend_memory(self, memory_bytes: int) -> None:
        self._memory_left -= memory_bytes
        if self._memory_left < 0:
            raise ReadingEnded(f'it takes more than {MAX_MEMORY_BYTES:.0e} bytes of memory')

    def _keep_message(self, stream: Optional[Stream], time: bytes,
                      data: Union[bytes, mmap.mmap], span: slice) -> None:
        seconds, nanoseconds = TIME.unpack(time)
        if self.start is None:
            self.start = seconds + 1e-9 * nanoseconds
        if stream is None:
            return
        if span.stop > len(data):
            raise ValueError('the last message is not whole')
        arrival = (seconds - self.start) + 1e-9 * nanoseconds
        previous_arrival = stream[-1][0] if stream else -math.inf
        was_set_back = arrival < previous_arrival - MIN_SET_BACK_TIME
        was_silent = arrival > self._last_arrival + MAX_SILENCE
        if was_set_back or was_silent:
            raise ReadingEnded(CLOCK_JUMPED)
        message = data[span] if span.stop - span.start <= MAX_MESSAGE_BYTES else b''
        self._spend_memory(MESSAGE_OVERHEAD_BYTES + len(message))
        self._last_arrival = arrival
        stream.append((arrival, message))

    def _add_connection(self, header: Dict[bytes, bytes], data: bytes) -> None:
        self._spend_memory(CONNECTION_OVERHEAD_BYTES)
        fields = _fields(data)
        connection = Connection(
            topic=_text(header[b'topic']), message_type=_text(fields.get(b'type', b'')),
            checksum=_text(fields.get(b'md5sum', b'')), sender=_text(fields.get(b'callerid', b'')))
        if connection not in self.streams:
            self.streams[connection] = [] if self._is_wanted(connection) else None
        self._stream_by_connection[header[b'conn']] = self.streams[connection]

    def _unpacked(self, compression: bytes, packed: bytes) -> bytes:
        if compression != b'bz2':
            raise ReadingEnded('its chunks are packed by {}; unpack it: rosbag decompress'.format(
                compression.decode(errors='replace')))
        unpacker = bz2.BZ2Decompressor()
        chunk = unpacker.decompress(packed, MAX_CHUNK_BYTES)
        self._spend_memory(len(chunk))
        if not unpacker.eof:
            raise ValueError('the chunk is too large, or not whole')
        return chunk


def _text(name: bytes) -> str:
    return name[:MAX_NAME_BYTES].decode(errors='replace')


def _fields(data: bytes) -> Dict[bytes, bytes]:
    fields = {}
    end = 0
    while end < len(data):
        [size] = UINT32.unpack_from(data, end)
        begin = end + UINT32.size
        end = begin + size
        name, equals, value = data[begin:end].partition(b'=')
        if not equals:
            raise ValueError('not a header')
        fields[name] = value
    return fields
