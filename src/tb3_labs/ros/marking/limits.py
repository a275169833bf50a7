"""Watches what the programs in a box use, and ends them all if that is too much.

Linux counts memory for each process alone, and old versions of bubblewrap give the folders of a box
no size: so what all of them use together is added up here.
"""
import os
import signal
import threading

#: The most that the programs of a box may use together: memory [bytes], files in their own folders
#: [bytes], processes.
MEMORY, OWN_DISK, PROCESSES = 2 * 10 ** 9, 300 * 10 ** 6, 100
#: How often it is looked at [s].
PERIOD = 0.25
PAGE = os.sysconf('SC_PAGE_SIZE')


class Watch:
    """Watches the box whose outermost process is `pid`, until :meth:`end`."""

    def __init__(self, pid, own_folders):
        """`own_folders`: of the box, as its programs know them."""
        self._pid, self._own = pid, own_folders
        self._over = threading.Event()
        #: What was too much, a clause; '' so far.
        self.exceeded = ''
        threading.Thread(target=self._look, daemon=True).start()

    def end(self):
        """Watch no more."""
        self._over.set()

    def _look(self):
        while not self._over.wait(PERIOD):
            self.exceeded = self._excess()
            if self.exceeded:
                try:
                    os.kill(self._pid, signal.SIGKILL)      # the box ends with it
                except ProcessLookupError:
                    pass    # it has ended already
                return

    def _excess(self):
        processes = below(self._pid)
        if len(processes) > PROCESSES:
            return 'more than {} processes'.format(PROCESSES)
        if sum(map(_memory, processes)) > MEMORY and sum(map(_own_memory, processes)) > MEMORY:
            return 'more than {:g} GB of memory'.format(MEMORY / 1e9)
        if processes and sum(_used(processes[-1], own) for own in self._own) > OWN_DISK:
            return 'files of more than {:g} MB'.format(OWN_DISK / 1e6)
        return ''


def below(pid):
    """The numbers of all processes that descend from one."""
    found, open_ = [], [pid]
    while open_:
        parent = open_.pop()
        try:
            for thread in os.listdir('/proc/{}/task'.format(parent)):
                with open('/proc/{}/task/{}/children'.format(parent, thread)) as file:
                    children = [int(number) for number in file.read().split()]
                found += children
                open_ += children
        except OSError:
            pass    # it has ended meanwhile
    return found


def _memory(pid):
    """What a process uses, without files [bytes]; what it shares since a fork counts for each."""
    try:
        with open('/proc/{}/statm'.format(pid)) as file:
            _, resident, shared = file.read().split()[:3]
    except OSError:
        return 0
    return (int(resident) - int(shared)) * PAGE


def _own_memory(pid):
    """The same, but of what several share each has its part; slower [bytes]."""
    try:
        with open('/proc/{}/smaps_rollup'.format(pid)) as file:
            return 1024 * next(int(line.split()[1]) for line in file if line.startswith('Pss:'))
    except (OSError, StopIteration):
        return _memory(pid)


def _used(pid, folder):
    """The size of the files in a box's own folder, of which a process sees the box [bytes]."""
    try:
        state = os.statvfs('/proc/{}/root{}'.format(pid, folder))
    except OSError:
        return 0
    return (state.f_blocks - state.f_bfree) * state.f_frsize
