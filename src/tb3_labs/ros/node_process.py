"""A node as a process of its own, and all that it prints: for whoever judges nodes."""
import os
import pty
import signal
import subprocess
import threading
import time


class NodeProcess:
    """``rosrun package executable arguments...`` in a process group of its own.

    With `terminal` it gets a pseudo-terminal to read from and print to, as if a person had started
    it; else it reads what is given as `typed` and then finds the end of its input. What it prints,
    errors too, is one text.
    """

    def __init__(self, package, executable, *arguments, terminal=False, typed='', environment=None):
        self._changed = threading.Condition()
        self._text = ''
        output, theirs = pty.openpty() if terminal else os.pipe()
        self._keyboard = output if terminal else None
        self._process = subprocess.Popen(
            ['rosrun', package, executable] + list(arguments),
            stdin=theirs if terminal else subprocess.PIPE, stdout=theirs, stderr=theirs,
            # else what is printed to a pipe is seen at the end only
            env=dict(os.environ, PYTHONUNBUFFERED='1', **(environment or {})),
            start_new_session=True)
        os.close(theirs)
        if not terminal:
            self._process.stdin.write(typed.encode())
            self._process.stdin.close()
        self._reader = threading.Thread(target=self._read, args=(output,), daemon=True)
        self._reader.start()

    def _read(self, output):
        while True:
            try:
                chunk = os.read(output, 65536)
            except OSError:    # a pseudo-terminal whose other side has gone
                chunk = b''
            with self._changed:
                self._text += chunk.decode(errors='replace').replace('\r\n', '\n')
                self._changed.notify_all()
            if not chunk:
                return

    @property
    def text(self):
        """All that it printed so far."""
        with self._changed:
            return self._text

    @property
    def lines(self):
        """All that it printed so far, line by line."""
        return self.text.splitlines()

    @property
    def status(self):
        """Exit status, or None while it runs."""
        return self._process.poll()

    def type(self, line):
        """Type a line, and Enter."""
        os.write(self._keyboard, line.encode() + b'\n')

    def wait_for(self, words, seconds=20.0, times=1):
        """Wait until `words` were printed so many times; RuntimeError with the output if not."""
        deadline = time.monotonic() + seconds
        with self._changed:
            while self._text.count(words) < times:
                left = deadline - time.monotonic()
                if left <= 0.0:
                    raise RuntimeError('waited {:.0f} s in vain for {!r}; printed: {}'.format(
                        seconds, words, self._text))
                self._changed.wait(left)

    def send(self, number):
        """Send a signal to the whole group."""
        try:
            os.killpg(self._process.pid, number)
        except ProcessLookupError:
            pass    # it has ended already

    def end(self, number=signal.SIGINT, seconds=10.0):
        """Send a signal and wait for the end; the exit status. RuntimeError if it goes on."""
        self.send(number)
        return self.wait(seconds)

    def wait(self, seconds=10.0):
        """Wait for the end, of its output too; the exit status. RuntimeError if it goes on."""
        try:
            status = self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            raise RuntimeError('it still runs after {:.0f} s; printed: {}'.format(
                seconds, self.text)) from None
        self._reader.join(1.0)    # a child of its own may keep the output open
        return status

    def kill(self):
        """Whatever it does, it ends."""
        self.send(signal.SIGKILL)
        self._process.wait()
