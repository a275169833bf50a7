"""The records of a bag file, in the order in which they were recorded.

A bag may come from a stranger. Its index is not used, so each byte is read once, and a recording
that was cut off is read up to its last whole record. The definitions of its messages are not used.
Memory and time are limited by a ReadLimits.

Source: http://wiki.ros.org/Bags/Format/2.0
"""
import bz2
import os
import stat
import struct
from io import BytesIO
from shlex import quote
from typing import BinaryIO, Callable, Dict, Iterator, NamedTuple, Tuple

from tb3_labs.report.bag import read_limits
from tb3_labs.report.bag.read_limits import (
    MIB, MOST_CONNECTION, MOST_HEADER, MOST_MESSAGE, ReadLimits, TooLarge)

#: A bag begins with this.
BAG_VERSION = b'#ROSBAG V2'
#: The kinds of records.
MESSAGE, FILE, CHUNK, CONNECTION = 2, 3, 5, 7
LENGTH, LONG, TIME = struct.Struct('<I'), struct.Struct('<Q'), struct.Struct('<II')
CONVERT = 'convert it: pip install rosbags; rosbags-convert --src {} --dst run.bag'
#: First bytes of other files that users take for bags: (the kind of file, the remedy).
OTHERS = (
    (b'#ROSBAG V1', 'a bag of version 1',
     'convert it where it was recorded: rosbag fix {} run.bag'),
    (b'SQLite format 3', 'a bag of ROS 2', CONVERT), (b'\x89MCAP', 'a bag of ROS 2', CONVERT),
    (b'version https://git-lfs', 'a pointer of Git LFS', 'fetch the recording: git lfs pull'),
    (b'<', 'a web page or XML', 'download the file itself: the link led to a page, of a login '
     'perhaps'),
    (b'PK', 'a zip archive', 'unpack it: unzip {}'),
    (b'\x1f\x8b', 'a gzip archive', 'unpack it: gunzip -c {} > run.bag'),
    (b'BZh', 'a bzip2 archive', 'unpack it: bunzip2 -c {} > run.bag'),
    (b'\xfd7zXZ', 'an xz archive', 'unpack it: xz -dc {} > run.bag'))


class BagProblem(ValueError):
    """A bag cannot be reported. The message is one line with the reason and the remedy."""


class Connection(NamedTuple):
    """A sender of messages of a type on a topic; `checksum` is of the type's definition."""

    topic: str
    kind: str
    checksum: str
    sender: str


class Record(NamedTuple):
    """A recorded message: `time` [s since 1970, ns], `data` b'' if too large or not wanted."""

    connection: Connection
    time: Tuple[int, int]
    data: bytes


class Bag:
    """An open bag file. `problem`: why not all of it was read; '' if it was."""

    def __init__(self, file: BinaryIO, path: str) -> None:
        """Raises BagProblem if the file is not a bag of version 2."""
        self._file, self.problem = file, ''
        self._size = os.fstat(file.fileno()).st_size
        first = file.read(100)
        if not first.startswith(BAG_VERSION):
            raise BagProblem(_other(first, str(path)))
        self._begin = first.find(b'\n') + 1

    def messages(self, is_wanted: Callable[[Connection], bool],
                 limits: ReadLimits) -> Iterator[Record]:
        """Yields the messages of all connections, with the data of those that are wanted."""
        self._file.seek(self._begin)
        # by its number: the connection, and whether its messages are wanted
        self._connections: Dict[int, Tuple[Connection, bool]] = {}
        self._limits, self._is_whole, self.problem = limits, False, ''
        try:
            yield from self._records(self._file, is_wanted)
            if not self._is_whole:
                raise EOFError
        except EOFError:
            self.problem = 'the recording was cut off'
        except TooLarge as problem:
            self.problem = str(problem)
        except (ValueError, LookupError, struct.error, OSError):
            self.problem = f'the file is damaged near byte {self._file.tell()}'

    def _records(self, source: BinaryIO,
                 is_wanted: Callable[[Connection], bool]) -> Iterator[Record]:
        while True:
            length = source.read(LENGTH.size)
            if not length:
                return
            self._limits.spend('records')
            # its header, and the size of its data
            head = self._read(source, LENGTH.unpack(length)[0] + LENGTH.size, MOST_HEADER)
            header, size = _fields(head[:-LENGTH.size]), LENGTH.unpack(head[-LENGTH.size:])[0]
            kind = header[b'op'][0]
            if kind == MESSAGE:
                connection, wanted = self._connections[LENGTH.unpack(header[b'conn'])[0]]
                data = self._read(source, size) if wanted and size <= MOST_MESSAGE else b''
                seconds, nanoseconds = TIME.unpack(header[b'time'])
                yield Record(connection, (seconds, nanoseconds), data)
                if data:
                    continue
            elif kind == CONNECTION:
                connection = _connection(header, self._read(source, size, MOST_CONNECTION))
                self._limits.spend('connections')
                self._connections[LENGTH.unpack(header[b'conn'])[0]] = (
                    connection, is_wanted(connection))
                continue
            elif kind == CHUNK and header[b'compression'] == b'none':
                continue    # its records follow
            elif kind == CHUNK and source is self._file:
                yield from self._records(self._unpacked(header[b'compression'], size), is_wanted)
                continue
            elif kind == FILE:
                self._is_whole = 0 < LONG.unpack(header[b'index_pos'])[0] <= self._size
            source.seek(size, os.SEEK_CUR)

    def _read(self, source: BinaryIO, size: int, most: int = MOST_MESSAGE) -> bytes:
        if size > most:
            raise ValueError(f'{size} bytes in place of {most} at most')
        if source is self._file:        # the bytes of an unpacked chunk were spent before
            self._limits.spend('MiB', size / MIB)
        data = source.read(size)
        if len(data) < size:
            raise EOFError
        return data

    def _unpacked(self, compression: bytes, size: int) -> BinaryIO:
        """Returns the records of the packed chunk that begins here, `size` bytes long."""
        pieces_of, chunk = _unpacker(compression), BytesIO()
        for at in range(0, size, read_limits.PART):
            for piece in pieces_of(self._read(self._file, min(read_limits.PART, size - at))):
                self._limits.spend('MiB', len(piece) / MIB)
                if chunk.tell() + len(piece) > read_limits.MOST_CHUNK:
                    raise TooLarge('a packed chunk holds more than {:g} MiB'.format(
                        read_limits.MOST_CHUNK / MIB))
                chunk.write(piece)
        chunk.seek(0)
        return chunk


def open_bag(path: str) -> BinaryIO:
    """Returns the open file. Raises BagProblem if it is not a file."""
    mode = os.stat(str(path)).st_mode
    if stat.S_ISDIR(mode):
        raise BagProblem('a folder, not a bag; a bag of ROS 2 is a folder: ' + CONVERT.format(
            quote(str(path))))
    if not stat.S_ISREG(mode):
        raise BagProblem('not a file')
    return open(str(path), 'rb')


def _other(first: bytes, path: str) -> str:
    """Returns what the file is, since it is not a bag, and what to do."""
    if not first:
        return 'the file is empty; copy or download it again, and look at its size: ls -l'
    begin = first.lstrip(b'\xef\xbb\xbf \t\r\n')
    for known, words, remedy in OTHERS:
        if begin.startswith(known):
            return f'not a bag of ROS 1, but {words}; {remedy.format(quote(path))}'
    return 'not a bag of version 2, since it does not begin with {}; give the file that rosbag ' \
        'record has written'.format(BAG_VERSION.decode())


def _unpacker(compression: bytes) -> Callable[[bytes], Iterator[bytes]]:
    """Returns the function that unpacks the next part of a chunk, in pieces."""
    if compression == b'bz2':
        unpacker = bz2.BZ2Decompressor()

        def pieces_of(part: bytes) -> Iterator[bytes]:
            yield unpacker.decompress(part, read_limits.PIECE)
            while not (unpacker.needs_input or unpacker.eof):
                yield unpacker.decompress(b'', read_limits.PIECE)
        return pieces_of
    if compression == b'lz4':
        import roslz4    # only for the bags that need it
        unpack = roslz4.LZ4Decompressor().decompress
        return lambda part: iter([unpack(part)])
    raise ValueError(f'packed by {compression!r}')


def _connection(header: Dict[bytes, bytes], data: bytes) -> Connection:
    known = _fields(data)
    return Connection(*(value[:read_limits.MOST_NAME].decode(errors='replace') for value in (
        header[b'topic'], *(known.get(name, b'?') for name in (b'type', b'md5sum', b'callerid')))))


def _fields(data: bytes) -> Dict[bytes, bytes]:
    fields, at = {}, 0
    while at < len(data):
        begin = at + LENGTH.size
        at = begin + LENGTH.unpack_from(data, at)[0]
        name, equals, value = data[begin:at].partition(b'=')
        if not equals:
            raise ValueError('not a header')
        fields[name] = value
    return fields
