"""Runs a program and records its output. Kills a submission's program if it has too many processes
or uses too much memory or disk.

Linux limits the memory of single processes only, and old versions of bubblewrap cannot limit the
size of a folder. Therefore this module adds up the memory of processes and the sizes of files.
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

from tb3_labs.marking.limits import (
    MAX_DISK_BYTES, MAX_NODE_MEMORY_BYTES, MAX_OTHER_MEMORY_BYTES, MAX_PROCESSES)

LIMITS_POLL_PERIOD = 0.25       # [s]
READ_RATE = 1e6     # [bytes/s] for the output, so that a long output does not load the computer
#: If a program prints more characters in one second, only the last characters are recorded. If the
#: bag is full, a tenth of this number is recorded.
MAX_CHARACTERS_PER_SECOND = 20000


class RunningProgram:
    """Runs a command in its own process group and pseudo-terminal, as a shell does. The command is
    a list of words. ``on_text(text)`` is called with each piece of the command's output."""

    def __init__(self, command, environment, on_text, files=None):
        """`files` are three file descriptors: the end that this object reads and writes, the
        program's input, and the program's output. The default is a pseudo-terminal."""
        self._on_text = on_text
        if files is None:
            own_end, program_end = pty.openpty()
            files = own_end, program_end, program_end
        self._terminal, program_input, program_output = files
        self._process = subprocess.Popen(
            command, stdin=program_input, stdout=program_output, stderr=program_output,
            # without PYTHONUNBUFFERED, Python collects its output before it writes into a pipe
            env=dict(environment, PYTHONUNBUFFERED='1', PYTHON_COLORS='0'),
            start_new_session=True)
        os.close(program_output)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        while True:
            try:
                chunk = os.read(self._terminal, 65536)
            except OSError:    # the program has closed the terminal
                chunk = b''
            self._on_text(chunk.decode(errors='replace').replace('\r\n', '\n'))
            if not chunk:
                return
            time.sleep(len(chunk) / READ_RATE)

    @property
    def pid(self):
        return self._process.pid

    @property
    def status(self):
        """The exit status of the program; None while the program runs."""
        return self._process.poll()

    def type(self, line):
        os.write(self._terminal, line.encode() + b'\n')

    def send(self, signal_number):
        """Send a signal to the whole process group."""
        with suppress(ProcessLookupError):      # the group has ended already
            os.killpg(self._process.pid, signal_number)

    def kill(self):
        """End the process group by SIGKILL."""
        self.send(signal.SIGKILL)
        self._process.wait()


class NodeOutput:
    """Records the output of one process of the node, at most MAX_CHARACTERS_PER_SECOND."""

    def __init__(self, bag):
        self._bag = bag
        self._lock = threading.Lock()
        self._unrecorded = ''
        #: The numbers of characters and lines that were dropped from the start of `_unrecorded`.
        self._omitted_characters, self._omitted_lines = 0, 0
        #: Before this time [s], the output is collected, and only `flush` records it.
        self._collects_until = 0.0
        #: The output since the last call of `flush`, or the last part of a long output.
        self.latest_text = ''

    def add(self, text):
        """Record a piece of the output. A piece that comes too soon is recorded later, by `flush`
        or with the next piece."""
        with self._lock:
            self.latest_text = (self.latest_text + text)[-MAX_CHARACTERS_PER_SECOND:]
            self._unrecorded += text
            excess = len(self._unrecorded) - self._max_characters
            if excess > 0:
                dropped, self._unrecorded = self._unrecorded[:excess], self._unrecorded[excess:]
                self._omitted_characters += len(dropped)
                self._omitted_lines += dropped.count('\n')
            if self._bag.now >= self._collects_until:
                self._record()

    @property
    def _max_characters(self):
        return MAX_CHARACTERS_PER_SECOND // 10 if self._bag.is_full else MAX_CHARACTERS_PER_SECOND

    def flush(self):
        """Record the waiting output. Called before an event that must come after this output."""
        with self._lock:
            self._record()
            self.latest_text = ''

    def _record(self):
        if not self._unrecorded:
            return
        if self._omitted_characters:
            self._bag.add_event('unprinted', characters=self._omitted_characters,
                                lines=self._omitted_lines)
        output_time = self._bag.add_output(self._unrecorded)
        self._collects_until = output_time + len(self._unrecorded) / self._max_characters
        self._unrecorded = ''
        self._omitted_characters, self._omitted_lines = 0, 0


class ResourceWatch:
    """Kills a process group if it exceeds a limit. The event `stop_requested` ends the watch."""

    def __init__(self, pid: int, own_folders: Iterable[str], check_parent_pid: int) -> None:
        """`pid` is the number of the group's first process, which starts the sandbox. The size of
        the files in `own_folders`, paths in the sandbox, is limited. `check_parent_pid` is the
        number of the process that started the master, the robot and check_lab.py."""
        self._pid = pid
        self._own_folders = own_folders
        self._check_parent_pid = check_parent_pid
        self.stop_requested = threading.Event()
        #: A clause on the exceeded limit; '' if no limit was exceeded.
        self.exceeded_limit = ''
        threading.Thread(target=self._watch_limits, daemon=True).start()

    def _watch_limits(self):
        while not self.stop_requested.wait(LIMITS_POLL_PERIOD):
            self.exceeded_limit = self._find_exceeded_limit()
            if self.exceeded_limit:
                with suppress(ProcessLookupError):      # the group has ended already
                    os.killpg(self._pid, signal.SIGKILL)    # the signal ends the whole sandbox
                return

    def _find_exceeded_limit(self):
        processes = _descendants(self._pid)
        if len(processes) > MAX_PROCESSES:
            return f'more than {MAX_PROCESSES} processes'
        if sum(map(_memory, processes)) > MAX_NODE_MEMORY_BYTES:
            return f'more than {MAX_NODE_MEMORY_BYTES / 1e9:g} GB of memory'
        all_processes = {self._check_parent_pid, *_descendants(self._check_parent_pid)}
        others = all_processes - {self._pid, *processes}
        if sum(map(_memory, others)) > MAX_OTHER_MEMORY_BYTES:
            return (f'more than {MAX_OTHER_MEMORY_BYTES / 1e6:g} MB of the memory of master, robot '
                    'and check')
        if not processes:
            return ''
        inner_pid = processes[-1]       # this process runs in the sandbox and sees its folders
        if sum(_disk_used(inner_pid, folder) for folder in self._own_folders) > MAX_DISK_BYTES:
            return f'files of more than {MAX_DISK_BYTES / 1e6:g} MB'
        return ''


def _descendants(pid):
    """Returns the numbers of all descendants of a process. A parent comes before its children."""
    family = [pid]
    for parent in family:       # the loop lengthens the list `family`
        with suppress(OSError):     # the process may have ended
            for thread in Path(f'/proc/{parent}/task').iterdir():
                family += map(int, (thread / 'children').read_text().split())
    return family[1:]


def _memory(pid):
    """Returns the memory [bytes] of a process, without mapped files. Memory that processes share
    after a fork counts in full for each process."""
    try:
        _, resident, shared, *_ = Path(f'/proc/{pid}/statm').read_text().split()
    except OSError:
        return 0
    return (int(resident) - int(shared)) * os.sysconf('SC_PAGE_SIZE')


def _disk_used(pid, folder):
    """Returns the size [bytes] of the files in a folder of a sandbox. `pid` is the number of a
    process in the sandbox."""
    try:
        file_system = os.statvfs(f'/proc/{pid}/root{folder}')
    except OSError:
        return 0
    return (file_system.f_blocks - file_system.f_bfree) * file_system.f_frsize
