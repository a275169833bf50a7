"""A node as a process of its own, watched: for tests, and for marking somebody else's node."""
import errno
import os
import pty
import signal
import subprocess
import threading
import time


class NodeProcess:
    """Starts ``rosrun package type arguments...`` in a process group of its own.

    With `terminal` it gets a pseudo-terminal, as if a person had started it; else nothing to read
    (or what is given as `stdin`). Output and errors are one text.
    """

    def __init__(self, package, executable, *arguments, terminal=False, stdin=subprocess.DEVNULL,
                 environment=None):
        self._changed = threading.Condition()
        self._text = ''
        self._keyboard = None
        output, theirs = pty.openpty() if terminal else os.pipe()
        if terminal:
            self._keyboard = stdin = output, theirs
        self._process = subprocess.Popen(
            ['rosrun', package, executable] + list(arguments),
            stdin=theirs if terminal else stdin, stdout=theirs, stderr=theirs,
            env=dict(os.environ, **(environment or {})), start_new_session=True)
        os.close(theirs)
        self._reader = threading.Thread(target=self._read, args=(output,), daemon=True)
        self._reader.start()

    def _read(self, output):
        while True:
            try:
                chunk = os.read(output, 65536)
            except OSError as problem:
                if problem.errno != errno.EIO:    # a pseudo-terminal's way to say it is over
                    raise
                chunk = b''
            with self._changed:
                self._text += chunk.decode(errors='replace').replace('\r\n', '\n')
                self._changed.notify_all()
            if not chunk:
                return
