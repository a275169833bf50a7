"""A node, or another program, as a process of its own, and its output, read while it runs; for the
marking and the tests."""
import os
import pty
import signal
import subprocess
import threading
import time

#: Number of characters kept at either end.
KEPT_CHARACTERS = 100000
#: Output is read no faster than this, so that much of it does not load the machine [characters/s].
FASTEST_READING = 1e6


class Program:
    """``command`` (a list of words) in a process group of its own.

    With `terminal` it reads from and prints to a pseudo-terminal, as if a person had started it.
    Else its input is `typed` and then ends. Output and errors are one text, of which head and tail
    are kept. `environment` comes on top of this process's own; with `clean` it is all there is.
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
    def lines(self):
        """The lines printed so far."""
        return self.text.splitlines()

    @property
    def printed(self):
        """The amount printed so far: (characters, lines)."""
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

    def wait_for(self, words, seconds=20.0, times=1):
        """Wait until `words` were printed `times` times; RuntimeError with the output if not."""
        with self._changed:
            if not self._changed.wait_for(lambda: str(self._text).count(words) >= times, seconds):
                raise RuntimeError('waited {:.0f} s in vain for {!r}; printed: {}'.format(
                    seconds, words, self._text))

    def where(self):
        """The stacks of its threads, if it is a node of this package (see ros.signals)."""
        printed, _ = self.printed
        self.send(signal.SIGUSR1)
        time.sleep(0.5)
        return self.text_since(printed)

    def send(self, number):
        """Send a signal to the whole group."""
        try:
            os.killpg(self._process.pid, number)
        except ProcessLookupError:
            pass    # it has ended already

    def end(self, number=signal.SIGINT, seconds=10.0):
        """Send a signal and wait for the end; the exit status. RuntimeError if it still runs."""
        self.send(number)
        return self.wait(seconds)

    def wait(self, seconds=10.0):
        """Wait for the end, also of its output; the exit status. RuntimeError if it still runs."""
        try:
            status = self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            raise RuntimeError('it still runs after {:.0f} s; printed: {}'.format(
                seconds, self.text)) from None
        self._reader.join(1.0)    # a child of its own may keep the output open
        return status

    def kill(self):
        """End it at once (SIGKILL)."""
        self.send(signal.SIGKILL)
        self._process.wait()


class NodeProcess(Program):
    """``rosrun package executable arguments...``, with the same options; `prefix` is a command put
    before it."""

    def __init__(self, package, executable, *arguments, prefix=(), **options):
        super().__init__(list(prefix) + ['rosrun', package, executable] + list(arguments),
                         **options)


class BoundedText:
    """The output of a program that may print for ever."""

    def __init__(self, kept=KEPT_CHARACTERS):
        self._kept = kept
        self._head = ''
        self._tail = ''
        #: Characters and line ends so far, also those that were dropped.
        self.length = 0
        self.lines = 0

    def append(self, text):
        """Add `text` at the end."""
        self.length += len(text)
        self.lines += text.count('\n')
        room = self._kept - len(self._head)
        self._head += text[:room]
        self._tail += text[room:]
        if len(self._tail) > 2 * self._kept:    # not at each call, since it copies
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
