"""The keyboard, read line by line in the background."""
import os
import signal
import sys
import threading

from tb3_labs.ros.node import guarded


class Keyboard:
    """Calls `on_line(text)` for each line typed or piped in, and `on_end()` once after the last.

    A thread of its own waits for input, so that no callback does. It works in a terminal, in an
    xterm, under roslaunch (which gives its own terminal to its nodes), and from a pipe. Without
    input (no terminal, or a job in the background) `on_end()` is called at once.
    """

    def __init__(self, on_line, on_end):
        self._on_line = guarded(on_line)
        self._on_end = guarded(on_end)
        # A job in the background that reads its terminal is stopped by this signal. Where the
        # signal is ignored, the read fails.
        signal.signal(signal.SIGTTIN, signal.SIG_IGN)
        threading.Thread(target=self._run, name='keyboard', daemon=True).start()

    def _run(self):
        pending = b''
        for chunk in self._chunks():
            *lines, pending = (pending + chunk).split(b'\n')
            for line in lines:
                self._on_line(_text(line))
        if pending:
            self._on_line(_text(pending))
        self._on_end()

    @staticmethod
    def _chunks():
        """The bytes typed, as they come. Unbuffered: a thread that waits in Python's own buffer
        holds a lock that the interpreter needs to end."""
        if sys.stdin is None:      # closed; descriptor 0 may belong to another file by now
            return
        try:
            while True:
                chunk = os.read(0, 4096)
                if not chunk:
                    return
                yield chunk
        except OSError:
            return


def _text(line):
    return line.decode(errors='replace').strip()
