"""The environment of a submission's processes, their end, and the limits of a sandbox."""
import glob
import json
import os
import signal
import subprocess
import threading
import time
from types import SimpleNamespace

import pytest
from sandboxes import MISSING

from tb3_labs.marking import trial_runner
from tb3_labs.marking.intake import sandbox
from tb3_labs.marking.intake.sandbox import UNUSED_USER_IDS, Protection, Sandbox, protection_problem
from tb3_labs.marking.limits import MAX_ADDRESS_SPACE_BYTES, MAX_FILE_BYTES, MAX_THREADS_AND_PROCESSES
from tb3_labs.marking.student_nodes import IDENTITY_VARIABLE, SANDBOX_HOME, WRITABLE_FOLDERS
from tb3_labs.marking.trial import processes
from tb3_labs.marking.trial.processes import ResourceWatch
from tb3_labs.marking.trial_runner import kill_processes, make_trial_environment

needs_sandboxes = pytest.mark.skipif(bool(MISSING), reason=MISSING)
#: This program prints what it sees. Its arguments are a folder of its own, and paths that it must not see.
LOOKS = '''
import importlib.util, json, os, resource, signal, socket, sys
own, *others = sys.argv[1:]
print(json.dumps({
    'variables': dict(os.environ), 'folder': os.getcwd(), 'read': open(own + '/n.txt').read(),
    'there': [os.path.exists(place) for place in others],
    'writable': [place for place in ('/', '/usr', '/dev', own, *%r) if os.access(place, os.W_OK)],
    'limits': [resource.getrlimit(getattr(resource, 'RLIMIT_' + name))[0]
               for name in ('FSIZE', 'AS', 'CORE', 'NPROC')],
    'ctrl_c': signal.getsignal(signal.SIGINT) is signal.default_int_handler, 'user': os.getuid(),
    'network': socket.if_nameindex(),
    'processes': len([name for name in os.listdir('/proc') if name.isdigit()]),
    'modules': [importlib.util.find_spec('tb3_labs.' + name) is not None
                for name in ('msg', 'srv', 'marking', 'nodes')]}))
''' % (WRITABLE_FOLDERS,)


def test_a_ros_of_its_own_writes_below_its_folder_alone(tmp_path):
    made = make_trial_environment(tmp_path, {'HOME': '/home/ann'})
    assert made.pop('HOME') == '/home/ann' and made.pop('ROS_HOSTNAME') == 'localhost'
    assert made.pop('ROS_TEST_RESULTS_DIR') == 'results' and os.path.isdir(made['ROS_HOME'])
    assert set(made) == {'TMPDIR', 'ROS_HOME', 'ROS_LOG_DIR', 'ROS_ETC_DIR', 'ROS_PYTHON_LOG_CONFIG_FILE'}
    assert all(place.startswith(str(tmp_path)) for place in made.values())
    assert os.path.isfile(made['ROS_PYTHON_LOG_CONFIG_FILE'])
    assert os.path.isfile(os.path.join(made['ROS_ETC_DIR'], 'roscore.xml'))


def test_a_protection_works_although_the_current_folder_was_removed(tmp_path, monkeypatch):
    """Python imports no package there. On Debian 11 root's marking was refused in some runs."""
    folder = tmp_path / 'removed'
    folder.mkdir()
    monkeypatch.chdir(folder)
    folder.rmdir()
    assert protection_problem(Protection()) == ''


#: A second run of these tests, on the same machine, must not end the processes of this run.
RUN_IDENTITY = f'of a test of process {os.getpid()}'


@pytest.fixture
def family():
    """A process with two children and an identity. After the test all three are ended."""
    started = subprocess.Popen(['sh', '-c', 'sleep 60 & sleep 60 & wait'], start_new_session=True,
                               env=dict(os.environ, **{IDENTITY_VARIABLE: RUN_IDENTITY}))
    deadline = time.monotonic() + 100.0
    while len(processes._descendants(started.pid)) < 2 and time.monotonic() < deadline:
        time.sleep(0.01)
    yield started
    kill_processes(RUN_IDENTITY)
    started.wait(100.0)


def test_only_what_has_the_identity_is_ended(family):
    children = processes._descendants(family.pid)
    kill_processes('of another test')
    assert family.poll() is None and len(children) == 2
    kill_processes(RUN_IDENTITY)
    assert family.wait(100.0) == -9
    assert processes._descendants(family.pid) == []
    assert [processes._memory(child) for child in children] == [0, 0]
    assert processes._disk_used(family.pid, '/tmp') == 0


class Bomb:
    """Stands in for the module os on a computer whose table of processes is full. If a process is killed or stopped,
    a running process starts another one, as long as the table has room."""

    ROOM = 60

    def __init__(self):
        self.running, self.stopped, self.latest = set(range(self.ROOM)), set(), self.ROOM

    def listdir(self, _folder):
        return ['self', *map(str, self.running | self.stopped)]

    def getpgid(self, pid):
        return pid

    def getpgrp(self):
        return -1

    def kill(self, pid, number):
        if pid not in self.running | self.stopped:
            raise ProcessLookupError
        self.running.discard(pid)
        self.stopped.discard(pid)
        if number == signal.SIGSTOP:
            self.stopped.add(pid)
        if self.running and len(self.running | self.stopped) < self.ROOM:
            self.latest += 1
            self.running.add(self.latest)

    killpg = kill


def test_programs_that_start_others_without_end_are_ended(monkeypatch):
    bomb = Bomb()
    monkeypatch.setattr(trial_runner, 'os', bomb)
    monkeypatch.setattr(trial_runner, '_has_in_environment', lambda pid, variable: pid in bomb.running | bomb.stopped)
    ending = threading.Thread(target=kill_processes, args=('of a bomb',), daemon=True)
    ending.start()
    ending.join(10.0)
    assert bomb.listdir('/proc') == ['self']


@pytest.mark.parametrize('limit, most, words', [
    ('MAX_PROCESSES', 1, 'more than 1 processes'), ('MAX_NODE_MEMORY_BYTES', 10 ** 3, 'more than 1e-06 GB of memory'),
    ('MAX_DISK_BYTES', 0, 'files of more than 0 MB'),
    ('MAX_OTHER_MEMORY_BYTES', 10 ** 6, 'more than 1 MB of the memory of master, robot and check')])
def test_a_sandbox_that_uses_too_much_is_ended(monkeypatch, family, limit, most, words):
    monkeypatch.setattr(processes, 'LIMITS_POLL_PERIOD', 0.01)
    monkeypatch.setattr(processes, 'MAX_OTHER_MEMORY_BYTES', 10 ** 12)
    calm = ResourceWatch(family.pid, [], os.getpid())
    calm.stop_requested.set()
    assert calm._find_exceeded_limit() == ''
    monkeypatch.setattr(processes, limit, most)
    watch = ResourceWatch(family.pid, ['/tmp'], os.getpid())
    assert family.wait(100.0) == -9 and watch.exceeded_limit == words


#: The layouts of a workspace: the paths of this package, of its builds, and of Python.
LAYOUTS = {
    'own folder': ('build/.ws/src/tb3_labs', ['build/.ws/devel'], 'build/.ws/venv'),
    'workspace': ('src/tb3_labs', ['devel', 'src/tb3_labs/build/.ws/devel'],
                  'src/tb3_labs/build/.ws/venv'),
    'installed': ('install/share/tb3_labs', ['install'], 'src/tb3_labs/build/.ws/venv'),
    'all in one': ('tb3_labs', ['tb3_labs', 'tb3_labs/lib'], 'tb3_labs/lib/python3/venv')}


@pytest.mark.parametrize('layout', LAYOUTS)
@needs_sandboxes
def test_in_each_layout_a_program_has_messages_and_python_and_no_solution(
        tmp_path, monkeypatch, layout):
    package, prefixes, python = LAYOUTS[layout]
    modules = [prefix + '/lib/python3/dist-packages' for prefix in prefixes]
    here = [package + '/package.xml', package + '/msg/M.msg', python + '/bin/activate']
    here += [folder + '/tb3_labs/msg/_M.py' for folder in modules]
    gone = [package + '/src/tb3_labs/law.py', package + '/.git/config']
    gone += [folder + '/tb3_labs/law.py' for folder in modules]
    gone += [prefix + '/lib/tb3_labs/mark.py' for prefix in prefixes]
    for path in map(tmp_path.joinpath, here + gone):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    monkeypatch.setattr(sandbox.rospkg, 'RosPack', lambda: SimpleNamespace(
        get_path=lambda name: str(tmp_path / package)))
    monkeypatch.setattr(sandbox.sys, 'prefix', str(tmp_path / python))
    for name, folders in (('CMAKE_PREFIX_PATH', prefixes), ('PYTHONPATH', modules)):
        monkeypatch.setenv(name, ':'.join(str(tmp_path / folder) for folder in folders))
    seen = subprocess.check_output(Sandbox([]).program_command(
        ['find', str(tmp_path), '-type', 'f']), timeout=600.0, universal_newlines=True)
    assert set(seen.split()) == {str(tmp_path / path) for path in here}


@needs_sandboxes
def test_a_program_in_a_sandbox_has_what_it_needs_and_no_more(tmp_path):
    assert protection_problem(Sandbox([])) == ''
    own, other = tmp_path / 'own', tmp_path / 'other'
    own.mkdir()
    other.mkdir()
    programs = [prefix + '/lib/tb3_labs' for prefix in os.environ['CMAKE_PREFIX_PATH'].split(':')]
    program, *_ = [path for folder in programs for path in glob.glob(folder + '/panel.py')]
    (own / 'n.txt').write_text('mine')
    (own / 'n.txt').chmod(0o600)
    box = Sandbox([own])
    box.hand_over(own)
    given = dict(os.environ, TOKEN='secret', **{IDENTITY_VARIABLE: 'of a test'})
    seen = json.loads(subprocess.check_output(
        box.check_command(box.program_command([
            'python3', '-c', LOOKS, str(own), str(other), program, '/boot', '/etc/shadow'])),
        env=box.program_environment(given), timeout=600.0))
    variables = seen.pop('variables')
    assert variables['HOME'] == SANDBOX_HOME and variables['PATH'] == given['PATH']
    assert not {'TOKEN', IDENTITY_VARIABLE} & set(variables)
    assert seen.pop('processes') < 5 and [name for _, name in seen.pop('network')] == ['lo']
    assert (seen.pop('user') in UNUSED_USER_IDS) is (os.geteuid() == 0)
    limits = seen.pop('limits')
    assert limits[:3] == [MAX_FILE_BYTES, MAX_ADDRESS_SPACE_BYTES, 0]
    assert limits[3] == MAX_THREADS_AND_PROCESSES or os.geteuid() != 0      # for others only a new Linux counts
    assert seen == {'ctrl_c': True, 'folder': SANDBOX_HOME, 'read': 'mine', 'there': [False] * 4,
                    'writable': list(WRITABLE_FOLDERS), 'modules': [True, True, False, False]}


def test_without_a_sandbox_a_program_keeps_all_but_large_files():
    given = {'PATH': os.environ['PATH'], 'TOKEN': 'x'}
    assert subprocess.check_output(
        Protection().program_command(['sh', '-c', 'echo $TOKEN $(ulimit -f)']), text=True,
        env=Protection().program_environment(given)) == 'x {}\n'.format(MAX_FILE_BYTES // 512)


@pytest.mark.parametrize('ends, words', [
    ((0, ''), ''), ((1, 'one\nno namespace\n'), 'bubblewrap fails (no namespace)'),
    ((3, ''), 'bubblewrap fails (exit status 3)'),
    (FileNotFoundError(), 'bubblewrap is not installed (apt install bubblewrap)'),
    (subprocess.TimeoutExpired('bwrap', 1), 'bubblewrap hangs')])
def test_a_machine_without_sandboxes_says_why(monkeypatch, ends, words):
    def run(command, **options):
        if isinstance(ends, Exception):
            raise ends
        return subprocess.CompletedProcess(command, ends[0], stderr=ends[1])
    monkeypatch.setattr(sandbox.subprocess, 'run', run)
    assert protection_problem(Sandbox([])) == words
