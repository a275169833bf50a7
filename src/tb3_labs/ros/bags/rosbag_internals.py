"""The private parts of rosbag that the reading of recordings uses.

They were read in the source of rosbag 1.15.15 (Debian 12). If rosbag keeps the index of a bag in
another way, reading ends by an AttributeError, or takes the memory of the whole index:
test/unit/test_report.py reads bags of many chunks, compressed ones too.
"""
import rosbag


class BagByChunks(rosbag.Bag):
    """A bag whose index is read chunk by chunk, together with its messages, in the file's order.

    rosbag itself reads the whole index first, an object of 250 bytes for each message of each
    topic. That is more memory than all samples take.
    """

    def __init__(self, path):
        super().__init__(path, skip_index=True)

    def _get_entries(self, connections=None, start_time=None, end_time=None):
        """The index entries for rosbag's read_messages()."""
        wanted = {connection.id for connection in connections}
        for chunk in self._chunks:
            header = self._chunk_headers[chunk.pos]
            self._file.seek(header.data_pos + header.compressed_size)    # its index comes after it
            self._curr_chunk_info = chunk       # rosbag's reader uses this chunk
            entries = []
            for _ in chunk.connection_counts:
                connection, index = self._reader.read_connection_index_record()
                if connection in wanted:
                    entries += index
            yield from sorted(entries, key=lambda entry: entry.offset)
