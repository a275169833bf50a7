"""A node, or another program, as a process of its own, and its output; for tests."""
import os
import pty
import signal
import subprocess
import time

from tb3_labs.ros.testing.output import Output


class Program:
    """``command`` (a list of words) in a process group of its own.

    With `terminal` it reads from and prints to a pseudo-terminal, as if a person had started it.
    Else its input is `typed` and then ends. Output and errors are one text, of which head and tail
    are kept. `environment` comes on top of this process's own; with `clean` it is all there is.
    """

    def __init__(self, command, terminal=False, typed='', environment=None, clean=False):
        output, theirs = pty.openpty() if terminal else os.pipe()
        self._keyboard = output if terminal else None
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
        self._output = Output(output)

    @property
    def text(self):
        """Everything printed so far."""
        return str(self._output)

    @property
    def lines(self):
        """The lines printed so far."""
        return self.text.splitlines()

    @property
    def printed(self):
        """The amount printed so far: (characters, lines)."""
        return self._output.size

    def text_since(self, characters):
        """The text printed after the first `characters`, as far as it is kept."""
        return self._output.since(characters)

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
        os.write(self._keyboard, line.encode() + b'\n')

    def wait_for(self, words, seconds=20.0, times=1):
        """Wait until `words` were printed `times` times; RuntimeError with the output if not."""
        self._output.wait_for(words, seconds, times)

    def wait_for_match(self, pattern, seconds=20.0):
        """Wait until the regular expression `pattern` is found in the output; RuntimeError with the
        output if not."""
        self._output.wait_for_match(pattern, seconds)

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
        self._output.wait_for_the_end(1.0)    # a child of its own may keep the output open
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
