"""The processes of one submission: their output, and the resources that they use.

Linux limits the memory of single processes only, and old versions of bubblewrap cannot limit the
size of a folder: this module adds up memory and sizes.
"""
import os
import pty
import signal
import subprocess
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Iterable

#: The most that the programs of a sandbox may use together: memory [bytes], files in their own
#: folders [bytes], processes.
MEMORY, OWN_DISK, PROCESSES = 2 * 10 ** 9, 300 * 10 ** 6, 100
#: The most memory that they may make master, robot and check need together; these need about 180 MB
#: without them [bytes].
OF_OTHERS = 600 * 10 ** 6
#: The period of the watch [s].
LIMITS_POLL_PERIOD = 0.25


# -- a program, observed from outside

class Program:
    """Runs ``command`` (a list of words) in a process group and a pseudo-terminal of its own, as if
    a person had started it.

    ``on_text(text)`` is called with each part of its output and errors. `ends`: three files in
    place of the terminal, for reading its output, for its input and for its output.
    """

    def __init__(self, command, environment, on_text, ends=None):
        self._on_text = on_text
        if ends is None:
            source, theirs = pty.openpty()
            ends = source, theirs, theirs
        self._source, typed, printed = ends
        self._process = subprocess.Popen(
            command, stdin=typed, stdout=printed, stderr=printed,
            # otherwise text that is printed to a pipe is seen only at the end
            env=dict(environment, PYTHONUNBUFFERED='1', PYTHON_COLORS='0'),
            start_new_session=True)
        os.close(printed)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        while True:
            try:
                chunk = os.read(self._source, 65536)
            except OSError:    # the other side of a pseudo-terminal is closed
                chunk = b''
            self._on_text(chunk.decode(errors='replace').replace('\r\n', '\n'))
            if not chunk:
                return
            time.sleep(len(chunk) / 1e6)    # a long output does not load the computer

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
        with suppress(ProcessLookupError):      # it has ended already
            os.killpg(self._process.pid, number)

    def kill(self):
        """End it at once (SIGKILL)."""
        self.send(signal.SIGKILL)
        self._process.wait()


# -- the resources

class ResourceWatch:
    """Watches a program until `over` is set; kills its group if it uses too much."""

    def __init__(self, pid: int, own_folders: Iterable[str], others: int) -> None:
        """`pid`: the leader of the group, the outermost process of a sandbox; `own_folders`: the
        sandbox's own folders, as its programs see them; `others`: the first of the processes that
        its programs can fill, master, robot and check."""
        self._pid, self._own, self._others = pid, own_folders, others
        self.over = threading.Event()
        #: The limit that was exceeded, a clause; '' if none was.
        self.exceeded = ''
        threading.Thread(target=self._look, daemon=True).start()

    def _look(self):
        while not self.over.wait(LIMITS_POLL_PERIOD):
            self.exceeded = self._excess()
            if self.exceeded:
                with suppress(ProcessLookupError):      # it has ended already
                    os.killpg(self._pid, signal.SIGKILL)    # the sandbox ends with it
                return

    def _excess(self):
        processes = _below(self._pid)
        if len(processes) > PROCESSES:
            return f'more than {PROCESSES} processes'
        if sum(map(_memory, processes)) > MEMORY and sum(map(_own_memory, processes)) > MEMORY:
            return f'more than {MEMORY / 1e9:g} GB of memory'
        others = {self._others, *_below(self._others)} - {self._pid, *processes}
        if sum(map(_memory, others)) > OF_OTHERS:
            return f'more than {OF_OTHERS / 1e6:g} MB of the memory of master, robot and check'
        if processes and sum(_used(processes[-1], own) for own in self._own) > OWN_DISK:
            return f'files of more than {OWN_DISK / 1e6:g} MB'
        return ''


def _below(pid):
    family = [pid]
    for parent in family:       # the list grows meanwhile
        with suppress(OSError):     # it has ended meanwhile
            for thread in Path(f'/proc/{parent}/task').iterdir():
                family += map(int, (thread / 'children').read_text().split())
    return family[1:]


def _memory(pid):
    """The memory of a process, without files [bytes]; with all shared pages."""
    try:
        _, resident, shared, *_ = Path(f'/proc/{pid}/statm').read_text().split()
    except OSError:
        return 0
    return (int(resident) - int(shared)) * os.sysconf('SC_PAGE_SIZE')


def _own_memory(pid):
    """The memory of a process [bytes]; with its part of shared pages. Slower."""
    try:
        with open(f'/proc/{pid}/smaps_rollup') as file:
            return 1024 * next(int(line.split()[1]) for line in file if line.startswith('Pss:'))
    except (OSError, StopIteration):
        return _memory(pid)


def _used(pid, folder):
    """The size of the files in a sandbox's own folder [bytes]; `pid`: a process in it."""
    try:
        state = os.statvfs(f'/proc/{pid}/root{folder}')
    except OSError:
        return 0
    return (state.f_blocks - state.f_bfree) * state.f_frsize
