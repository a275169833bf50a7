"""Bytes on their way into a socket whose other side may not read."""
import socket

#: More than this does not wait for a socket [bytes]: what came later is dropped. An IMU needs about
#: 330 for each message. The kernel's own buffers hold some hundred thousand before that.
CAPACITY = 65536


class Outbox:
    """Sends pieces of data in their order, each as a whole or not at all, and never waits."""

    def __init__(self, stream):
        """`stream` is a connected socket, which nobody else writes to."""
        self._stream = stream
        self._waiting = bytearray()    # begins within a piece

    def send(self, piece):
        """False if `piece` was dropped; OSError if the connection is broken.

        What the socket does not take now goes with the next call.
        """
        if self._waiting:
            self._write()
        if len(self._waiting) > CAPACITY:
            return False
        self._waiting += piece
        self._write()
        return True

    def _write(self):
        try:
            sent = self._stream.send(self._waiting, socket.MSG_DONTWAIT)
        except BlockingIOError:
            return
        del self._waiting[:sent]
