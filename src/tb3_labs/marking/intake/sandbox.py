"""Protects the marker from a submission's node by limits, and by a sandbox of bubblewrap.

The rostest, master, robot, check and node of a submission share a network that has only a loopback.
All these processes end together with the marker.

The node is in a sandbox inside that network. The sandbox has its own processes, its own /tmp and
home. The node sees only the parts of the system that it needs, and cannot write them. The node's
processes, memory and disk are limited. An ordinary user makes the sandbox with a user namespace.
If root runs mark.py, the node has a user that owns nothing, since Linux does not count root's
processes.
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

from tb3_labs.marking.intake.node_start import (
    FILES_LIMITED, HOME, IDENTITY, OWN_FOLDERS, OWN_PACKAGE)

#: Variables that list the folders of workspaces, and of Python's modules.
PREFIXES, MODULES = 'CMAKE_PREFIX_PATH', 'PYTHONPATH'
#: A sandbox gets each variable of the instructor whose name begins with one of these words.
INHERITED_PREFIXES = ('ROS', 'PYTHON', PREFIXES, 'PKG_CONFIG_PATH', 'LD_LIBRARY_PATH', 'PATH',
                      'LANG', 'LC_', 'TZ', 'TERM', IDENTITY)
#: The folder of rospy's log files in a sandbox.
LOGS = HOME + '/.ros/log'
#: Each of OWN_FOLDERS has at most this size [bytes].
ROOM = 100 * 10 ** 6
#: A sandbox has these parts of /etc: host names, time zone, libraries, fonts and ROS need them.
ETC = ('alternatives fonts host.conf hosts ld.so.cache ld.so.conf ld.so.conf.d localtime '
       'matplotlibrc mime.types nsswitch.conf python3 ros timezone').split()
#: A student's program sees only these parts of this package.
SHARED = ('package.xml', 'cmake', 'msg', 'srv')
#: The limits of the address space of a process [bytes], and of the number of threads and processes
#: together. (On 64 cores numpy starts 64 threads, and reserves 3 GB for them.)
ADDRESS_SPACE, TASKS = 6 * 10 ** 9, 500
#: This command limits the master, the robot, the check, and the node in a sandbox.
LIMITED = FILES_LIMITED + [f'--as={ADDRESS_SPACE}']
#: Root's sandboxes use these users, which own nothing. systemd uses them for the same purpose.
USERS = range(61184, 65519)
#: The first version of bubblewrap that limits the size of a folder.
BUBBLEWRAP_WITH_SIZE = 0, 8
#: The first version of Linux that counts the processes of each user namespace separately.
LINUX_WITH_COUNT = 5, 14
#: A sandbox that has not started within this time does not work [s].
SANDBOX_START = 20.0
READ_ONLY, READ_ONLY_TRY, EMPTY = '--ro-bind', '--ro-bind-try', '--tmpfs'
#: The instructor reads this text if the submissions are marked without sandboxes.
UNPROTECTED = "No sandboxes: a submission's program can read and delete your files and use the " \
    'network; it can write no large file, and every process of it that can be found is killed.'


class NoSandbox:
    """The protection if sandboxes do not work: a program cannot write a large file."""

    isolates = False

    def own_network(self, command: List[str]) -> List[str]:
        """Returns the command that starts a submission's check, which ends with its parent."""
        return ['setpriv', '--pdeathsig', 'TERM'] + LIMITED + command

    def command(self, command: List[str]) -> List[str]:
        """Returns the command that starts a submission's program."""
        return FILES_LIMITED + command

    def environment(self, environment: Mapping[str, str]) -> Dict[str, str]:
        """Returns the environment of a submission's program."""
        return dict(environment)

    def hand_over(self, folder: Path) -> None:
        """Give a folder of copies to the user who runs the program."""


class OtherUser(NoSandbox):
    """The protection if root cannot make sandboxes, as in a container. The program's user owns
    nothing, so the program can neither write the marks nor signal the marker."""

    def __init__(self) -> None:
        self.user = random.choice(USERS)

    def own_network(self, command: List[str]) -> List[str]:
        # the program cannot read the check's files
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
    """The protection by a sandbox. All commands of a sandbox have the same user."""

    isolates = True

    def __init__(self, readable: Iterable[Path]) -> None:
        """A program may read the `readable` folders, the system and the folders of ROS. The
        `readable` folders need not exist yet."""
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
        mounts = _system() + _ros() + [(EMPTY, folder) for folder in hidden] + shared
        mounts += [(READ_ONLY_TRY, folder, folder) for folder in self._readable]
        options += _with_parents(mounts)
        for folder in hidden + ['/dev', '/']:
            options += ['--remount-ro', folder]
        options += ['--chdir', HOME]
        limited = LIMITED + ['--core=0']
        if self.user is not None or _version(platform.release()) >= LINUX_WITH_COUNT:
            limited.append(f'--nproc={TASKS}')
        entered = {'forget': IDENTITY, 'user': self.user, 'folders': OWN_FOLDERS, 'logs': LOGS}
        # Ctrl+C must end the program and not bubblewrap
        return ['sh', '-c', 'trap "" INT; exec "$@"', 'sh', 'bwrap'] + options + [
            '--'] + limited + ['/usr/bin/python3', '-ISc', ENTER, json.dumps(entered)] + command

    def environment(self, environment: Mapping[str, str]) -> Dict[str, str]:
        kept = {name: value for name, value in environment.items()
                if name.startswith(INHERITED_PREFIXES)}
        user = os.path.basename(HOME)
        return dict(kept, HOME=HOME, USER=user, LOGNAME=user,
                    ROS_HOME=HOME + '/.ros', ROS_LOG_DIR=LOGS)

    def hand_over(self, folder: Path) -> None:
        if self.user is not None:
            _give(folder, self.user)


def protection_problem(protection: NoSandbox) -> str:
    """Try a protection. Returns '' if the protection works here, else the reason why it fails."""
    command = protection.own_network(protection.command(
        ['python3', '-c', f'import {OWN_PACKAGE}.msg']))
    try:
        done = subprocess.run(command, env=protection.environment(os.environ),
                              timeout=SANDBOX_START, stdin=subprocess.DEVNULL,
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                              universal_newlines=True)
    except FileNotFoundError:
        return 'bubblewrap is not installed (apt install bubblewrap)'
    except subprocess.TimeoutExpired:
        return 'bubblewrap hangs'
    if done.returncode == 0:
        return ''
    lines = done.stderr.strip().splitlines() or [f'exit status {done.returncode}']
    failure = 'bubblewrap fails' if protection.isolates else 'another user cannot run them'
    return f'{failure} ({lines[-1]})'


def _give(folder, user):
    for path in [folder] + list(Path(folder).rglob('*')):
        os.chown(str(path), user, user, follow_symlinks=False)


# -- the mounts in a sandbox

def _system():
    """Returns the read-only mounts of the system, and the mounts of the program's own folders."""
    mounts = [(READ_ONLY, '/usr', '/usr'), ('--proc', '/proc'), ('--dev', '/dev'),
              (READ_ONLY_TRY, '/sys/devices/system/cpu', '/sys/devices/system/cpu')]
    for name in ('bin', 'sbin', 'lib', 'lib32', 'lib64', 'libx32'):
        if os.path.islink('/' + name):
            mounts.append(('--symlink', os.readlink('/' + name), '/' + name))
        elif os.path.isdir('/' + name):
            mounts.append((READ_ONLY, '/' + name, '/' + name))
    mounts += [(READ_ONLY_TRY, '/etc/' + name, '/etc/' + name) for name in ETC]
    size = ('--size', str(ROOM)) if sized() else ()
    return mounts + [size + (EMPTY, folder) for folder in OWN_FOLDERS]


def _folders_in(*variables):
    return [folder for name in variables
            for folder in os.environ.get(name, '').split(':') if folder]


def _ros():
    """Returns the mounts of the folders of Python and ROS that are not in /usr."""
    folders = [sys.prefix, sys.base_prefix, '/opt/ros'] + _folders_in(
        MODULES, PREFIXES, 'LD_LIBRARY_PATH')
    return [(READ_ONLY, folder, folder) for folder in dict.fromkeys(map(os.path.abspath, folders))
            if os.path.isdir(folder) and not (folder + '/').startswith('/usr/')]


def _own_package():
    """Returns (the hidden folders of this package, the mounts of their SHARED parts)."""
    folders = [rospkg.RosPack().get_path(OWN_PACKAGE)]
    folders += [os.path.join(folder, OWN_PACKAGE) for folder in _folders_in(MODULES)]
    folders += [os.path.join(folder, 'lib', OWN_PACKAGE) for folder in _folders_in(PREFIXES)]
    hidden = list(filter(os.path.isdir, dict.fromkeys(map(os.path.abspath, folders))))
    parts = [os.path.join(folder, name) for folder in hidden for name in SHARED]
    return hidden, [(READ_ONLY, os.path.realpath(path), path)
                    for path in parts if os.path.exists(path)]


def _with_parents(mounts):
    """Returns bubblewrap's options for these mounts.

    A mount comes after the mounts above it, since Python may be in a hidden folder, and a hidden
    folder may be in a folder of ROS. The options also make the folders above a mount. If bubblewrap
    made these folders by itself, only root could enter some of them.
    """
    options, made = [], {Path('/')}
    for mount in sorted(mounts, key=lambda mount: len(Path(mount[-1]).parts)):
        for folder in reversed(Path(mount[-1]).parents):
            if folder not in made:
                made.add(folder)
                options += ['--dir', str(folder)]
        options += mount
    return options


@functools.lru_cache(maxsize=1)
def sized() -> bool:
    """Can this bubblewrap limit the size of a folder?"""
    try:
        return _version(subprocess.check_output(
            ['bwrap', '--version'], universal_newlines=True)) >= BUBBLEWRAP_WITH_SIZE
    except (OSError, subprocess.CalledProcessError):
        return False


def _version(text):
    return tuple(int(number) for number in re.findall(r'\d+', text)[:2])


def _enter(forget, user, folders, logs):
    """If `user` is not None, make the `folders` writable for this user, and become the user. Make
    the folder `logs`, since rospy does not own the folder above it. Remove the variable `forget`.

    The text of this function runs in the sandbox, where this package is missing.
    """
    if user is not None:
        for folder in folders:
            os.chmod(folder, 0o1777)
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
    os.makedirs(logs, exist_ok=True)
    os.environ.pop(forget, None)
    # without this line Ctrl+C would be ignored here, since bubblewrap ignores it
    signal.signal(signal.SIGINT, signal.SIG_DFL)


#: In a sandbox python3 -c first runs this program. Its arguments are the JSON for _enter(), and the
#: command.
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
