"""The sandboxes in which the programs of submissions run; bubblewrap makes them.

own network   one submission's rostest, master, robot, check and node have a network of their own,
              which has only a loopback, and end together with the marker.
sandbox       the submission's program, the node, has its own processes, its own /tmp and home. It
              sees only the parts of the system that it needs, read-only. Its processes, memory and
              disk are limited.

For an ordinary user a sandbox is a user namespace. Root's program becomes a user that owns nothing,
because Linux does not count the processes of root.
"""
import functools
import inspect
import json
import os
import platform
import random
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Dict, Iterable, List, Mapping

import rospkg

from tb3_labs.marking.intake.launch import FILES_LIMITED, HOME, IDENTITY, OWN_FOLDERS, OWN_PACKAGE

#: Variables that list the folders of workspaces, and of Python's modules.
PREFIXES, MODULES = 'CMAKE_PREFIX_PATH', 'PYTHONPATH'
#: The parts of this package for a student's program: messages, services, and files to find them.
SHARED = ('package.xml', 'cmake', 'msg', 'srv')
LOGS = HOME + '/.ros/log'
#: The protection that is left without sandboxes.
UNPROTECTED = "No sandboxes: a submission's program can read and delete your files and use the " \
    'network; it can write no large file, and every process of it that can be found is killed.'
#: Size of each of a program's own folders [bytes].
ROOM = 100 * 10 ** 6
#: Limits: the address space of one process [bytes], the number of threads and processes together.
#: (A numpy on 64 cores starts 64 threads, and reserves 3 GB for them.)
ADDRESS_SPACE, TASKS = 6 * 10 ** 9, 500
#: Limits of each process of master, robot, check and node.
LIMITED = FILES_LIMITED + [f'--as={ADDRESS_SPACE}']
#: Users that own nothing, for root's sandboxes; systemd has these for the same purpose.
USERS = range(61184, 65519)
#: Parts of /etc that a sandbox has: names, time zone, libraries, fonts, ROS.
ETC = ('alternatives fonts host.conf hosts ld.so.cache ld.so.conf ld.so.conf.d localtime '
       'matplotlibrc mime.types nsswitch.conf python3 ros timezone').split()
#: A sandbox gets the variables of the instructor's environment whose names begin with these.
KEPT_VARIABLES = ('ROS', 'PYTHON', PREFIXES, 'PKG_CONFIG_PATH', 'LD_LIBRARY_PATH', 'PATH', 'LANG',
                  'LC_', 'TZ', 'TERM', IDENTITY)
#: SIZED: the version of bubblewrap that first has `--size` for a tmpfs. COUNTED: the version of
#: Linux that first counts the processes of each user namespace separately.
SIZED, COUNTED = (0, 8), (5, 14)
#: A sandbox that works has started within this time [s].
SANDBOX_START = 20.0
READ_ONLY, READ_ONLY_TRY, EMPTY = '--ro-bind', '--ro-bind-try', '--tmpfs'


@functools.lru_cache(maxsize=2)
def problem(is_sandbox: bool = True) -> str:
    """Tries a sandbox, or another user: why it does not work here, a clause; '' if it works."""
    sandbox = Sandbox([]) if is_sandbox else OtherUser()
    command = sandbox.own_network(sandbox.command(
        ['python3', '-c', f'import {OWN_PACKAGE}.msg']))
    try:
        done = subprocess.run(command, env=sandbox.environment(os.environ), timeout=SANDBOX_START,
                              stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, universal_newlines=True)
    except FileNotFoundError:
        return 'bubblewrap is not installed (apt install bubblewrap)'
    except subprocess.TimeoutExpired:
        return 'bubblewrap hangs'
    words = done.stderr.strip().splitlines() or [f'exit status {done.returncode}']
    return '' if done.returncode == 0 else '{} ({})'.format(
        'bubblewrap fails' if is_sandbox else 'another user cannot run them', words[-1])


class NoSandbox:
    """The protection if sandboxes do not work: a program cannot write a large file."""

    isolates = False

    def own_network(self, command: List[str]) -> List[str]:
        """The command that starts the check of a submission, which ends with its parent."""
        return ['setpriv', '--pdeathsig', 'TERM'] + LIMITED + command

    def command(self, command: List[str]) -> List[str]:
        """The command that starts a submission's program."""
        return FILES_LIMITED + command

    def environment(self, environment: Mapping[str, str]) -> Dict[str, str]:
        """The environment of a submission's program."""
        return dict(environment)

    def hand_over(self, folder: Path) -> None:
        """Make the program's user the owner of a folder of copies; without a sandbox do nothing."""


class OtherUser(NoSandbox):
    """The protection of root without sandboxes, as in a container: a program is a user that owns
    nothing, so it can neither write the marks nor signal the marker."""

    def __init__(self) -> None:
        self.user = random.choice(USERS)

    def own_network(self, command: List[str]) -> List[str]:
        # the program cannot read what the check writes
        return ['sh', '-c', 'umask 077; exec "$@"', 'sh'] + super().own_network(command)

    def command(self, command: List[str]) -> List[str]:
        return ['setpriv', f'--reuid={self.user}', f'--regid={self.user}',
                '--clear-groups', '--no-new-privs', '--pdeathsig', 'KILL'] + LIMITED + [
                    f'--nproc={TASKS}'] + command

    def environment(self, environment: Mapping[str, str]) -> Dict[str, str]:
        home = environment.get('TMPDIR', '/tmp') + '/ws'
        return dict(environment, HOME=home, TMPDIR=home, ROS_HOME=home + '/.ros',
                    ROS_LOG_DIR=home + '/.ros/log')

    def hand_over(self, folder: Path) -> None:
        _give(folder, self.user)
        folder.parent.chmod(0o711)


class Sandbox(NoSandbox):
    """Makes commands that run in a sandbox. All of them run as the same user."""

    isolates = True

    def __init__(self, readable: Iterable[Path]) -> None:
        """`readable`: folders that a program may read, besides the system and the folders of ROS;
        they need not exist yet."""
        self._readable = [str(folder) for folder in readable]
        self.user = random.choice(USERS) if os.geteuid() == 0 else None

    def own_network(self, command: List[str]) -> List[str]:
        return ['bwrap', '--die-with-parent', '--unshare-net', '--unshare-pid', '--dev-bind', '/',
                '/', '--proc', '/proc', '--'] + LIMITED + command

    def command(self, command: List[str]) -> List[str]:
        options = ['--die-with-parent', '--unshare-pid', '--unshare-ipc', '--unshare-uts']
        options += ['--unshare-user'] if self.user is None else [
            '--cap-drop', 'ALL', '--cap-add', 'CAP_SETUID', '--cap-add', 'CAP_SETGID']
        hidden, shared = _own_package()
        places = _system() + _ros() + [(EMPTY, folder) for folder in hidden] + shared
        places += [(READ_ONLY_TRY, folder, folder) for folder in self._readable]
        options += _with_parents(places)
        for folder in hidden + ['/dev', '/']:
            options += ['--remount-ro', folder]
        options += ['--chdir', HOME]
        limited = LIMITED + ['--core=0']
        if self.user is not None or _version(platform.release()) >= COUNTED:
            limited.append(f'--nproc={TASKS}')
        entered = {'forget': IDENTITY, 'user': self.user, 'folders': OWN_FOLDERS, 'logs': LOGS}
        # Ctrl+C is for the program: it must not end bubblewrap
        return ['sh', '-c', 'trap "" INT; exec "$@"', 'sh', 'bwrap'] + options + [
            '--'] + limited + ['/usr/bin/python3', '-ISc', ENTER, json.dumps(entered)] + command

    def environment(self, environment: Mapping[str, str]) -> Dict[str, str]:
        kept = {name: value for name, value in environment.items()
                if name.startswith(KEPT_VARIABLES)}
        user = os.path.basename(HOME)
        return dict(kept, HOME=HOME, USER=user, LOGNAME=user,
                    ROS_HOME=HOME + '/.ros', ROS_LOG_DIR=LOGS)

    def hand_over(self, folder: Path) -> None:
        if self.user is not None:
            _give(folder, self.user)


def _give(folder, user):
    for path in [folder] + list(Path(folder).rglob('*')):
        os.chown(str(path), user, user, follow_symlinks=False)


def _system():
    """The system, read-only, and the program's own folders."""
    places = [(READ_ONLY, '/usr', '/usr'), ('--proc', '/proc'), ('--dev', '/dev'),
              (READ_ONLY_TRY, '/sys/devices/system/cpu', '/sys/devices/system/cpu')]
    for name in ('bin', 'sbin', 'lib', 'lib32', 'lib64', 'libx32'):
        if os.path.islink('/' + name):
            places.append(('--symlink', os.readlink('/' + name), '/' + name))
        elif os.path.isdir('/' + name):
            places.append((READ_ONLY, '/' + name, '/' + name))
    places += [(READ_ONLY_TRY, '/etc/' + name, '/etc/' + name) for name in ETC]
    size = ('--size', str(ROOM)) if sized() else ()
    return places + [size + (EMPTY, folder) for folder in OWN_FOLDERS]


def _folders_in(*variables):
    return [folder for name in variables
            for folder in os.environ.get(name, '').split(':') if folder]


def _ros():
    """The folders of Python and ROS, besides the system's."""
    folders = [sys.prefix, sys.base_prefix, '/opt/ros'] + _folders_in(
        MODULES, PREFIXES, 'LD_LIBRARY_PATH')
    return [(READ_ONLY, folder, folder) for folder in dict.fromkeys(map(os.path.abspath, folders))
            if os.path.isdir(folder) and not (folder + '/').startswith('/usr/')]


def _own_package():
    """(The usual folders of this package, which are hidden; its shared parts in them)."""
    folders = [rospkg.RosPack().get_path(OWN_PACKAGE)]
    folders += [os.path.join(folder, OWN_PACKAGE) for folder in _folders_in(MODULES)]
    folders += [os.path.join(folder, 'lib', OWN_PACKAGE) for folder in _folders_in(PREFIXES)]
    hidden = list(filter(os.path.isdir, dict.fromkeys(map(os.path.abspath, folders))))
    parts = [os.path.join(folder, name) for folder in hidden for name in SHARED]
    return hidden, [(READ_ONLY, os.path.realpath(path), path)
                    for path in parts if os.path.exists(path)]


def _with_parents(places):
    """bubblewrap's options for these places, each after its parents: Python may be in a hidden
    folder, and a hidden folder in one of ROS. The folders above a place come before it, since
    bubblewrap itself would make some of them so that only root may enter."""
    words, made = [], {Path('/')}
    for place in sorted(places, key=lambda place: len(Path(place[-1]).parts)):
        for folder in reversed(Path(place[-1]).parents):
            if folder not in made:
                made.add(folder)
                words += ['--dir', str(folder)]
        words += place
    return words


@functools.lru_cache(maxsize=1)
def sized() -> bool:
    """Can this bubblewrap limit the size of a folder?"""
    try:
        return _version(subprocess.check_output(
            ['bwrap', '--version'], universal_newlines=True)) >= SIZED
    except (OSError, subprocess.CalledProcessError):
        return False


def _version(text):
    return tuple(int(number) for number in re.findall(r'\d+', text)[:2])


def _enter(forget, user, folders, logs):
    """The first program in a sandbox becomes `user` (None: keeps its user). The variable `forget`
    is removed; the `folders` are writable for the user. The folder `logs` is made, since rospy
    itself would need its parent's owner. The text of this function runs there, without this
    package.
    """
    if user is not None:
        for folder in folders:
            os.chmod(folder, 0o1777)
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
    os.makedirs(logs, exist_ok=True)
    os.environ.pop(forget, None)
    # bubblewrap ignores Ctrl+C, and its child would ignore it too
    signal.signal(signal.SIGINT, signal.SIG_DFL)


#: The text of the first program, for python3 -c. Arguments: JSON for _enter(), then the command.
ENTER = '''import errno, json, os, signal, sys
{}
_enter(**json.loads(sys.argv[1]))
try:
    os.execvp(sys.argv[2], sys.argv[2:])
except OSError as problem:
    sys.exit('rosrun cannot start it: ' + (
        'its first line is not #!/usr/bin/env python3' if problem.errno == errno.ENOEXEC else
        problem.strerror))
'''.format(inspect.getsource(_enter))
