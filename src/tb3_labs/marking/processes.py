"""The processes of one submission: their environment, their end, the resources that they use.

Each process of a submission has the submission's identity in its environment, so that a process
that left its group is found too. Linux limits the memory of single processes only, and old versions
of bubblewrap cannot limit the size of a folder: this module adds up memory and sizes.
"""
import os
import signal
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Dict, Iterable, List, MutableMapping, Optional

#: The environment variable of the identity; each try of a submission has its own value.
IDENTITY = 'TB3_LABS_SUBMISSION'
#: Variables of the caller that would change the result.
FORGOTTEN = ('ROS_MASTER_URI', 'ROS_IP', 'ROS_NAMESPACE', 'TURTLEBOT3_MODEL', 'ROSCONSOLE_FORMAT',
             'DISPLAY', 'WAYLAND_DISPLAY')
PREFIXES, MODULES = 'CMAKE_PREFIX_PATH', 'PYTHONPATH'
#: Variables that list folders of catkin's workspaces.
LISTS = (PREFIXES, 'LD_LIBRARY_PATH', 'PATH', 'PKG_CONFIG_PATH', MODULES, 'ROS_PACKAGE_PATH')
#: Starts the master without rosout: rosout would write all log lines into a file.
ROSCORE = '<launch/>'
#: Log lines go to the terminal as usual, but to no file.
LOGGING = '''[loggers]
keys=root,rosout
[handlers]
keys=stream
[formatters]
keys=
[logger_root]
handlers=
[logger_rosout]
level=INFO
handlers=stream
propagate=0
qualname=rosout
[handler_stream]
class=rosgraph.roslogging.RosStreamHandler
args=(True,)
'''
#: The most that the programs of a sandbox may use together: memory [bytes], files in their own
#: folders [bytes], processes.
MEMORY, OWN_DISK, PROCESSES = 2 * 10 ** 9, 300 * 10 ** 6, 100
#: The most memory that they may make master, robot and check need together; these need about 180 MB
#: without them [bytes].
OF_OTHERS = 600 * 10 ** 6
#: The period of the watch [s].
PERIOD = 0.25
PAGE = os.sysconf('SC_PAGE_SIZE')


# -- the environment

def environment_in(work: Path, environment: Dict[str, str]) -> Dict[str, str]:
    """The environment of a separate ROS that writes only below `work`, an existing folder."""
    settings = work / 'etc'
    settings.mkdir(exist_ok=True)
    (settings / 'logging.conf').write_text(LOGGING)
    (settings / 'roscore.xml').write_text(ROSCORE)
    given = {name: value for name, value in environment.items() if name not in FORGOTTEN}
    return dict(given, TMPDIR=str(work), ROS_HOSTNAME='localhost', ROS_HOME=str(work / 'ros'),
                ROS_LOG_DIR=str(work / 'log'), ROS_ETC_DIR=str(settings),
                ROS_PYTHON_LOG_CONFIG_FILE=str(settings / 'logging.conf'),
                ROS_TEST_RESULTS_DIR=str(work / 'results'))


def forget_overlays(environment: MutableMapping[str, str] = os.environ,
                    modules: List[str] = sys.path) -> None:
    """Remove the catkin workspaces that come before this package's from `environment` and from
    Python's search path `modules`.

    An instructor's own nodes and messages must not replace those of a submission, nor be read.
    """
    prefixes = [path for path in environment.get(PREFIXES, '').split(':') if path]
    holders = [number for number, prefix in enumerate(prefixes)
               if os.path.isdir(os.path.join(prefix, 'share', 'tb3_labs'))]
    overlays = prefixes[:holders[0]] if holders else []
    sources = {source for prefix in overlays for source in _sources_of(prefix)}

    def stays(path: str) -> bool:
        return path not in sources and not any(
            (path + '/').startswith(prefix.rstrip('/') + '/') for prefix in overlays)
    for name in LISTS:
        if name in environment:
            environment[name] = ':'.join(filter(stays, environment[name].split(':')))
    modules[:] = filter(stays, modules)


def _sources_of(prefix):
    try:
        return Path(prefix, '.catkin').read_text().split(';')
    except OSError:
        return ()


# -- the end

def sweep(identity: str) -> None:
    """Kill every process that has this identity in its environment, until none is left."""
    mark = '{}={}'.format(IDENTITY, identity).encode()
    looks = 0
    while looks < 2:        # a process that starts a program has no environment for a moment
        found = [process for process in Path('/proc').glob('[0-9]*')
                 if mark in _environment_of(process)]
        looks = 0 if found else looks + 1
        for process in found:
            _kill(int(process.name))


def _environment_of(process):
    try:
        return (process / 'environ').read_bytes().split(b'\0')
    except OSError:
        return ()


def _kill(pid):
    with suppress(ProcessLookupError):      # it has ended already
        os.kill(pid, signal.SIGKILL)


# -- the resources

class ResourceWatch:
    """Watches a sandbox until `over` is set; kills its programs if they use too much."""

    def __init__(self, pid: int, own_folders: Iterable[str], others: Optional[int] = None) -> None:
        """`pid`: the outermost process of the sandbox; `own_folders`: the sandbox's own folders,
        as its programs see them; `others`: the first of the processes that its programs can fill,
        master, robot and check."""
        self._pid, self._own, self._others = pid, own_folders, others
        self.over = threading.Event()
        #: The limit that was exceeded, a clause; '' if none was.
        self.exceeded = ''
        threading.Thread(target=self._look, daemon=True).start()

    def _look(self):
        while not self.over.wait(PERIOD):
            self.exceeded = self._excess()
            if self.exceeded:
                _kill(self._pid)      # the sandbox ends with it
                return

    def _excess(self):
        processes = _below(self._pid)
        if len(processes) > PROCESSES:
            return 'more than {} processes'.format(PROCESSES)
        if sum(map(_memory, processes)) > MEMORY and sum(map(_own_memory, processes)) > MEMORY:
            return 'more than {:g} GB of memory'.format(MEMORY / 1e9)
        if self._others is not None:
            others = {self._others, *_below(self._others)} - {self._pid, *processes}
            if sum(map(_memory, others)) > OF_OTHERS:
                return 'more than {:g} MB of the memory of master, robot and check'.format(
                    OF_OTHERS / 1e6)
        if processes and sum(_used(processes[-1], own) for own in self._own) > OWN_DISK:
            return 'files of more than {:g} MB'.format(OWN_DISK / 1e6)
        return ''


def _below(pid):
    family = [pid]
    for parent in family:       # the list grows meanwhile
        with suppress(OSError):     # it has ended meanwhile
            for thread in Path('/proc/{}/task'.format(parent)).iterdir():
                family += map(int, (thread / 'children').read_text().split())
    return family[1:]


def _memory(pid):
    """The memory of a process, without files [bytes]; shared pages count in full."""
    try:
        _, resident, shared, *_ = Path('/proc/{}/statm'.format(pid)).read_text().split()
    except OSError:
        return 0
    return (int(resident) - int(shared)) * PAGE


def _own_memory(pid):
    """The memory of a process [bytes]; of shared pages only its part counts. Slower."""
    try:
        with open('/proc/{}/smaps_rollup'.format(pid)) as file:
            return 1024 * next(int(line.split()[1]) for line in file if line.startswith('Pss:'))
    except (OSError, StopIteration):
        return _memory(pid)


def _used(pid, folder):
    """The size of the files in a sandbox's own folder [bytes]; `pid`: a process in it."""
    try:
        state = os.statvfs('/proc/{}/root{}'.format(pid, folder))
    except OSError:
        return 0
    return (state.f_blocks - state.f_bfree) * state.f_frsize
