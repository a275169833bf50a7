"""Another program, observed from outside: what it prints."""
import os
import pty
import signal
import subprocess
import threading
import time

#: Number of characters kept from the beginning of an output, and as many from its end.
KEPT_CHARACTERS = 100000
#: Highest speed of reading, so that a long output does not load the computer [characters/s].
FASTEST_READING = 1e6


class Program:
    """Runs ``command`` (a list of words) in a process group of its own.

    With `terminal` the program uses a pseudo-terminal, as if a person had started it. Otherwise its
    input is the text `typed`, and then ends. Output and errors are one text; its beginning and its
    end are kept. `environment` is added to this process's environment; with `clean` it replaces it.
    """

    def __init__(self, command, terminal=False, typed='', environment=None, clean=False):
        self._source, theirs = pty.openpty() if terminal else os.pipe()
        self._process = subprocess.Popen(
            command,
            stdin=theirs if terminal else subprocess.PIPE, stdout=theirs, stderr=theirs,
            # otherwise text that is printed to a pipe is seen only at the end
            env=dict({} if clean else os.environ, **dict(environment or {}, PYTHONUNBUFFERED='1',
                                                           PYTHON_COLORS='0')),
            start_new_session=True)
        os.close(theirs)
        if not terminal:
            self._process.stdin.write(typed.encode())
            self._process.stdin.close()
        self._changed = threading.Condition()    # guards the text
        self._text = BoundedText()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        while True:
            try:
                chunk = os.read(self._source, 65536)
            except OSError:    # the other side of a pseudo-terminal is closed
                chunk = b''
            with self._changed:
                self._text.append(chunk.decode(errors='replace').replace('\r\n', '\n'))
                self._changed.notify_all()
            if not chunk:
                return
            time.sleep(len(chunk) / FASTEST_READING)

    @property
    def text(self):
        """Everything printed so far."""
        with self._changed:
            return str(self._text)

    @property
    def printed(self):
        """(number of characters, number of lines) printed so far."""
        with self._changed:
            return self._text.length, self._text.lines

    def text_since(self, characters):
        """The text printed after the first `characters`, as far as it is kept."""
        with self._changed:
            return self._text.since(characters)

    @property
    def pid(self):
        """The number of the process."""
        return self._process.pid

    @property
    def status(self):
        """Exit status, or None while it runs."""
        return self._process.poll()

    def type(self, line):
        """Type a line, and Enter."""
        os.write(self._source, line.encode() + b'\n')

    def send(self, number):
        """Send a signal to the whole group."""
        try:
            os.killpg(self._process.pid, number)
        except ProcessLookupError:
            pass    # it has ended already

    def kill(self):
        """End it at once (SIGKILL)."""
        self.send(signal.SIGKILL)
        self._process.wait()


class BoundedText:
    """The beginning and the end of an output, which may be endless."""

    def __init__(self, kept=KEPT_CHARACTERS):
        self._kept = kept
        self._head = ''
        self._tail = ''
        #: Number of characters so far, also of dropped ones.
        self.length = 0
        #: Number of line ends so far, also of dropped ones.
        self.lines = 0

    def append(self, text):
        """Add `text` at the end."""
        self.length += len(text)
        self.lines += text.count('\n')
        room = self._kept - len(self._head)
        self._head += text[:room]
        self._tail += text[room:]
        if len(self._tail) > 2 * self._kept:    # not at each call: it copies the text
            self._tail = self._tail[-self._kept:]

    def __str__(self):
        dropped = self.length - len(self._head) - len(self._tail)
        if not dropped:
            return self._head + self._tail
        return '{}\n... {} characters are left out here ...\n{}'.format(
            self._head, dropped, self._tail)

    def since(self, length):
        """The text after the first `length` characters, as far as it is kept."""
        tail_begins = self.length - len(self._tail)
        return self._head[length:] + self._tail[max(0, length - tail_begins):]
