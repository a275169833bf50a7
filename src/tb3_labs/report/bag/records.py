"""The records of a bag file, in the order in which they were recorded.

A bag may come from a stranger. Its index is not used: each byte is read once, and a recording that
was cut off is read up to its last whole record. The bag's definitions of messages are not used.
Each read, unpacked piece, record and sample is subtracted from the budget of a ReadLimits. So
memory and time are bounded, whatever the file claims.

Source: http://wiki.ros.org/Bags/Format/2.0
"""
import bz2
import os
import stat
import struct
import time
from io import BytesIO
from shlex import quote
from typing import BinaryIO, Callable, Dict, Iterator, NamedTuple, Tuple

#: The budget of one reading. `MiB` limits the bytes that are read or unpacked. A recording of one
#: hour by record.launch has 1.4 million records, and is read in 20 s.
MAX_READ = {'records': 2000000, 'connections': 20000, 'samples': 1500000, 'MiB': 1024}
#: The most processor time of one reading [s].
MAX_CPU_TIME = 30.0
#: The clock of the processor time is slow, so `spend` reads it only in each 64th call.
CLOCK_EVERY = 64
MIB = 2.0 ** 20
#: The largest header, connection and message, and the longest name [bytes].
MAX_HEADER_BYTES, MAX_NAME_BYTES = 10000, 200
MAX_CONNECTION_BYTES, MAX_MESSAGE_BYTES = 2 ** 20, 2 ** 18
#: The largest packed chunk, when it is unpacked [bytes].
MAX_CHUNK_BYTES = 2 ** 26
#: The size of the parts in which a packed chunk is read, and of the pieces in which it is unpacked
#: [bytes].
PACKED_PART, UNPACKED_PIECE = 2 ** 12, 2 ** 20
#: The first bytes of a bag.
BAG_VERSION = b'#ROSBAG V2'
#: The kinds of records, by the field `op` of their headers.
MESSAGE, FILE, CHUNK, CONNECTION = 2, 3, 5, 7
UINT32, UINT64, TIME = struct.Struct('<I'), struct.Struct('<Q'), struct.Struct('<II')
CONVERT_BAG = 'convert it: pip install rosbags; rosbags-convert --src {} --dst run.bag'
#: Files that users take for bags, each (first bytes, the kind of file, the remedy).
OTHER_FILES = (
    (b'#ROSBAG V1', 'a bag of version 1',
     'convert it where it was recorded: rosbag fix {} run.bag'),
    (b'SQLite format 3', 'a bag of ROS 2', CONVERT_BAG),
    (b'\x89MCAP', 'a bag of ROS 2', CONVERT_BAG),
    (b'version https://git-lfs', 'a pointer of Git LFS', 'fetch the recording: git lfs pull'),
    (b'<', 'a web page or XML', 'download the file itself: the link led to a page, of a login '
     'perhaps'),
    (b'PK', 'a zip archive', 'unpack it: unzip {}'),
    (b'\x1f\x8b', 'a gzip archive', 'unpack it: gunzip -c {} > run.bag'),
    (b'BZh', 'a bzip2 archive', 'unpack it: bunzip2 -c {} > run.bag'),
    (b'\xfd7zXZ', 'an xz archive', 'unpack it: xz -dc {} > run.bag'))


class BagProblem(ValueError):
    """A bag cannot be read. The text of this error is one line with the reason and the remedy."""


class TooLarge(Exception):
    """The budget of a reading is used up. The text of this error names the limit."""


class ReadLimits:
    """The rest of the budget of one reading."""

    def __init__(self) -> None:
        self._left: Dict[str, float] = dict(MAX_READ)
        self._end = time.thread_time() + MAX_CPU_TIME
        self._calls = 0

    def spend(self, what: str, amount: float = 1) -> None:
        """Subtract `amount` from the budget of `what`, a key of MAX_READ. May raise TooLarge."""
        self._left[what] -= amount
        if self._left[what] < 0:
            raise TooLarge(f'it has more than {MAX_READ[what]:,} {what}')
        self._calls += 1
        if self._calls % CLOCK_EVERY == 0 and time.thread_time() > self._end:
            raise TooLarge(f'to read it takes longer than {MAX_CPU_TIME:g} s')


class Connection(NamedTuple):
    """A sender of messages on a topic. The messages have the type `kind`, with this checksum."""

    topic: str
    kind: str
    checksum: str
    sender: str


class Record(NamedTuple):
    """A recorded message. `time` is (seconds since 1970, nanoseconds). `data` has the bytes of the
    message; it is empty if the message is too large or not wanted."""

    connection: Connection
    time: Tuple[int, int]
    data: bytes


class Bag:
    """An open bag file. `problem` is the reason why the file was not read to its end, or ''."""

    def __init__(self, file: BinaryIO, path: str) -> None:
        """Raises BagProblem if the file is not a bag of version 2."""
        self._file = file
        self.problem = ''
        self._size = os.fstat(file.fileno()).st_size
        first = file.read(100)
        if not first.startswith(BAG_VERSION):
            raise BagProblem(_kind_and_remedy(first, str(path)))
        self._begin = first.find(b'\n') + 1

    def messages(self, is_wanted: Callable[[Connection], bool],
                 limits: ReadLimits) -> Iterator[Record]:
        """Yields all messages. Only a message with ``is_wanted(connection)`` has data."""
        self._file.seek(self._begin)
        # {number of a connection: (the connection, whether its messages are wanted)}
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
        """Yields the messages from here to the end of `source`: the file or an unpacked chunk."""
        while True:
            length = source.read(UINT32.size)
            if not length:
                return
            self._limits.spend('records')
            header_size, = UINT32.unpack(length)
            # the size of the record's data follows the header
            head = self._read(source, header_size + UINT32.size, MAX_HEADER_BYTES)
            header = _fields(head[:header_size])
            size, = UINT32.unpack(head[header_size:])
            kind = header[b'op'][0]
            if kind == MESSAGE:
                yield self._message(source, header, size)
            elif kind == CONNECTION:
                self._limits.spend('connections')
                connection = _connection(header, self._read(source, size, MAX_CONNECTION_BYTES))
                self._connections[UINT32.unpack(header[b'conn'])[0]] = (
                    connection, is_wanted(connection))
            elif kind == CHUNK and header[b'compression'] == b'none':
                pass    # the records of the chunk follow
            elif kind == CHUNK and source is self._file:
                yield from self._records(self._unpacked(header[b'compression'], size), is_wanted)
            else:
                if kind == FILE:
                    self._is_whole = 0 < UINT64.unpack(header[b'index_pos'])[0] <= self._size
                source.seek(size, os.SEEK_CUR)

    def _message(self, source: BinaryIO, header: Dict[bytes, bytes], size: int) -> Record:
        connection, is_wanted = self._connections[UINT32.unpack(header[b'conn'])[0]]
        seconds, nanoseconds = TIME.unpack(header[b'time'])
        if is_wanted and size <= MAX_MESSAGE_BYTES:
            return Record(connection, (seconds, nanoseconds), self._read(source, size))
        source.seek(size, os.SEEK_CUR)
        return Record(connection, (seconds, nanoseconds), b'')

    def _read(self, source: BinaryIO, size: int, most: int = MAX_MESSAGE_BYTES) -> bytes:
        if size > most:
            raise ValueError(f'{size} bytes in place of {most} at most')
        if source is self._file:        # `_unpacked` has subtracted the bytes of unpacked chunks
            self._limits.spend('MiB', size / MIB)
        data = source.read(size)
        if len(data) < size:
            raise EOFError
        return data

    def _unpacked(self, compression: bytes, size: int) -> BinaryIO:
        """Returns the records of the packed chunk that begins here, `size` bytes long."""
        pieces_of = _unpacker(compression)
        chunk = BytesIO()
        for at in range(0, size, PACKED_PART):
            for piece in pieces_of(self._read(self._file, min(PACKED_PART, size - at))):
                self._limits.spend('MiB', len(piece) / MIB)
                if chunk.tell() + len(piece) > MAX_CHUNK_BYTES:
                    raise TooLarge(f'a packed chunk holds more than {MAX_CHUNK_BYTES / MIB:g} MiB')
                chunk.write(piece)
        chunk.seek(0)
        return chunk


def open_bag(path: str) -> BinaryIO:
    """Returns the open file. Raises BagProblem if it is not a file."""
    mode = os.stat(str(path)).st_mode
    if stat.S_ISDIR(mode):
        raise BagProblem('a folder, not a bag; a bag of ROS 2 is a folder: ' + CONVERT_BAG.format(
            quote(str(path))))
    if not stat.S_ISREG(mode):
        raise BagProblem('not a file')
    return open(str(path), 'rb')


def _kind_and_remedy(first: bytes, path: str) -> str:
    """Returns the kind of a file that is not a bag, and the remedy. `first` is the file's begin."""
    if not first:
        return 'the file is empty; copy or download it again, and look at its size: ls -l'
    begin = first.lstrip(b'\xef\xbb\xbf \t\r\n')
    for known, kind, remedy in OTHER_FILES:
        if begin.startswith(known):
            return f'not a bag of ROS 1, but {kind}; {remedy.format(quote(path))}'
    return 'not a bag of version 2, since it does not begin with {}; give the file that rosbag ' \
        'record has written'.format(BAG_VERSION.decode())


def _unpacker(compression: bytes) -> Callable[[bytes], Iterator[bytes]]:
    """Returns a function that unpacks the next part of a chunk, and yields the unpacked pieces."""
    if compression == b'bz2':
        unpacker = bz2.BZ2Decompressor()

        def pieces_of(part: bytes) -> Iterator[bytes]:
            yield unpacker.decompress(part, UNPACKED_PIECE)
            while not (unpacker.needs_input or unpacker.eof):
                yield unpacker.decompress(b'', UNPACKED_PIECE)
        return pieces_of
    if compression == b'lz4':
        import roslz4    # imported here, since most bags do not need it
        unpack = roslz4.LZ4Decompressor().decompress
        return lambda part: iter([unpack(part)])
    raise ValueError(f'packed by {compression!r}')


def _connection(header: Dict[bytes, bytes], data: bytes) -> Connection:
    known = _fields(data)
    names = [header[b'topic'], known.get(b'type', b'?'), known.get(b'md5sum', b'?'),
             known.get(b'callerid', b'?')]
    return Connection(*(name[:MAX_NAME_BYTES].decode(errors='replace') for name in names))


def _fields(data: bytes) -> Dict[bytes, bytes]:
    fields = {}
    at = 0
    while at < len(data):
        begin = at + UINT32.size
        at = begin + UINT32.unpack_from(data, at)[0]
        name, equals, value = data[begin:at].partition(b'=')
        if not equals:
            raise ValueError('not a header')
        fields[name] = value
    return fields
