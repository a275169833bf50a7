"""Protects the instructor from a submission's node by limits, and by a sandbox of bubblewrap.

The rostest, master, robot, check and node of a submission share a network that has only a loopback
interface. All processes of a submission end together with mark.py. The node has its own processes,
its own /tmp and its own home folder. It sees only the parts of the system that it needs and cannot
write them. An ordinary user makes the sandbox with a user namespace. If root runs mark.py, the node
runs as a user that owns nothing, because Linux does not limit the number of root's processes.
"""
import os
import platform
import random
import re
import subprocess
import sys
from pathlib import Path
from typing import Dict, Iterable, List, Mapping

import rospkg

from tb3_labs.marking.limits import LIMIT_COMMAND, LIMIT_FILES_COMMAND, MAX_THREADS_AND_PROCESSES
from tb3_labs.marking.student_nodes import (
    IDENTITY_VARIABLE, OWN_PACKAGE, SANDBOX_HOME, WRITABLE_FOLDERS)

CMAKE_PREFIX_PATH = 'CMAKE_PREFIX_PATH'
PYTHONPATH = 'PYTHONPATH'
#: A sandbox gets only the environment variables whose names begin with one of these words.
INHERITED_PREFIXES = ('ROS', 'PYTHON', CMAKE_PREFIX_PATH, 'PKG_CONFIG_PATH', 'LD_LIBRARY_PATH',
                      'PATH', 'LANG', 'LC_', 'TZ', 'TERM', IDENTITY_VARIABLE)
LOG_FOLDER = SANDBOX_HOME + '/.ros/log'
#: systemd gives these numbers to temporary users, which own nothing.
UNUSED_USER_IDS = range(61184, 65519)
SANDBOX_START_TIMEOUT = 20.0        # [s]
#: Host names, time zone, libraries, fonts and ROS need these parts of /etc in a sandbox.
ETC_PATHS = ('alternatives fonts host.conf hosts ld.so.cache ld.so.conf ld.so.conf.d localtime '
             'matplotlibrc mime.types nsswitch.conf python3 ros timezone').split()
#: A student's program sees only these parts of tb3_labs.
SHARED_PATHS = ('package.xml', 'cmake', 'msg', 'srv')
READ_ONLY, READ_ONLY_IF_EXISTS, EMPTY = '--ro-bind', '--ro-bind-try', '--tmpfs'
#: This program runs a command in a sandbox. The arguments are a user's id, or '', and the command.
#: The program makes the folder of log files, because rospy would fail to set the folder's owner.
ENTER_PROGRAM = f'''import errno, os, signal, sys
user_id, *command = sys.argv[1:]
if user_id:
    for folder in {WRITABLE_FOLDERS}:
        os.chmod(folder, 0o1777)
    os.setgroups([])
    ids = [int(user_id)] * 3
    os.setresgid(*ids)
    os.setresuid(*ids)
os.makedirs('{LOG_FOLDER}', exist_ok=True)
os.environ.pop('{IDENTITY_VARIABLE}', None)
# bubblewrap ignores Ctrl+C, so without this line the command would ignore it
signal.signal(signal.SIGINT, signal.SIG_DFL)
try:
    os.execvp(command[0], command)
except OSError as error:
    wrong_line = 'its first line is not #!/usr/bin/env python3'
    reason = wrong_line if error.errno == errno.ENOEXEC else error.strerror
    sys.exit('rosrun cannot start it: ' + reason)
'''
NO_SANDBOX_WARNING = (
    "No sandboxes: a submission's program can read and delete your files and use the network; it "
    'can write no large file, and every process of it that can be found is killed.')


class Protection:
    """Adds limits to the commands that start a submission's check and programs. A command is a list
    of words. This class has the weakest limits, for an ordinary user without sandboxes."""

    is_sandbox = False

    def check_command(self, words: List[str]) -> List[str]:
        """Returns the command that starts a submission's check."""
        return ['setpriv', '--pdeathsig', 'TERM'] + LIMIT_COMMAND + words

    def program_command(self, words: List[str]) -> List[str]:
        """Returns the command that starts a submission's program."""
        return LIMIT_FILES_COMMAND + words

    def program_environment(self, base: Mapping[str, str]) -> Dict[str, str]:
        """Returns the environment of a submission's program. `base` is the check's environment."""
        return dict(base)

    def hand_over(self, folder: Path) -> None:
        """Make the program's user the owner of `folder`, which must contain only copies."""


class OtherUser(Protection):
    """The protection if root cannot make sandboxes, for example in a container. A program runs as a
    user that owns nothing, so it can neither write the marks nor kill mark.py."""

    def __init__(self) -> None:
        self.user_id = random.choice(UNUSED_USER_IDS)

    def check_command(self, words: List[str]) -> List[str]:
        # with this umask, a submission's program cannot read the files that the check makes
        return ['sh', '-c', 'umask 077; exec "$@"', 'sh'] + super().check_command(words)

    def program_command(self, words: List[str]) -> List[str]:
        user_command = ['setpriv', f'--reuid={self.user_id}', f'--regid={self.user_id}',
                        '--clear-groups', '--no-new-privs', '--pdeathsig', 'KILL']
        return user_command + LIMIT_COMMAND + [f'--nproc={MAX_THREADS_AND_PROCESSES}'] + words

    def program_environment(self, base: Mapping[str, str]) -> Dict[str, str]:
        home = base.get('TMPDIR', '/tmp') + '/ws'
        return dict(base, HOME=home, TMPDIR=home, ROS_HOME=home + '/.ros',
                    ROS_LOG_DIR=home + '/.ros/log')

    def hand_over(self, folder: Path) -> None:
        _change_owner(folder, self.user_id)
        folder.parent.chmod(0o711)


class Sandbox(Protection):
    """The protection by a sandbox of bubblewrap. All programs of a Sandbox run as the same user."""

    is_sandbox = True

    def __init__(self, readable_folders: Iterable[Path]) -> None:
        """A program may read the system, the folders of ROS, and `readable_folders`, which need
        not exist yet."""
        self._readable_folders = [str(folder) for folder in readable_folders]
        self.user_id = random.choice(UNUSED_USER_IDS) if os.geteuid() == 0 else None

    def check_command(self, words: List[str]) -> List[str]:
        return ['bwrap', '--die-with-parent', '--unshare-net', '--unshare-pid', '--dev-bind', '/',
                '/', '--proc', '/proc', '--'] + LIMIT_COMMAND + words

    def program_command(self, words: List[str]) -> List[str]:
        options = ['--die-with-parent', '--unshare-pid', '--unshare-ipc', '--unshare-uts']
        if self.user_id is None:
            options.append('--unshare-user')
        else:       # ENTER_PROGRAM needs both capabilities to become another user
            options += ['--cap-drop', 'ALL', '--cap-add', 'CAP_SETUID', '--cap-add', 'CAP_SETGID']
        options += [*_mount_options(self._readable_folders), '--chdir', SANDBOX_HOME]
        limit_command = LIMIT_COMMAND + ['--core=0']
        if self.user_id is not None or _counts_processes_per_sandbox():
            limit_command.append(f'--nproc={MAX_THREADS_AND_PROCESSES}')
        enter_command = ['/usr/bin/python3', '-ISc', ENTER_PROGRAM, str(self.user_id or '')]
        # Ctrl+C must end the program and not bubblewrap
        return ['sh', '-c', 'trap "" INT; exec "$@"', 'sh', 'bwrap', *options, '--',
                *limit_command, *enter_command, *words]

    def program_environment(self, base: Mapping[str, str]) -> Dict[str, str]:
        variables = {name: value for name, value in base.items()
                     if name.startswith(INHERITED_PREFIXES)}
        user_name = os.path.basename(SANDBOX_HOME)
        return dict(variables, HOME=SANDBOX_HOME, USER=user_name, LOGNAME=user_name,
                    ROS_HOME=SANDBOX_HOME + '/.ros', ROS_LOG_DIR=LOG_FOLDER)

    def hand_over(self, folder: Path) -> None:
        if self.user_id is not None:
            _change_owner(folder, self.user_id)


def protection_problem(protection: Protection) -> str:
    """Returns what is wrong with a protection on this machine, or '' if the protection works."""
    command = protection.check_command(protection.program_command(
        ['python3', '-c', f'import {OWN_PACKAGE}.msg']))
    try:
        result = subprocess.run(command, env=protection.program_environment(os.environ),
                                timeout=SANDBOX_START_TIMEOUT, stdin=subprocess.DEVNULL,
                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                universal_newlines=True, cwd='/')    # python -c imports from cwd
    except FileNotFoundError:
        return 'bubblewrap is not installed (apt install bubblewrap)'
    except subprocess.TimeoutExpired:
        return 'bubblewrap hangs'
    if result.returncode == 0:
        return ''
    lines = [f'exit status {result.returncode}', *result.stderr.strip().splitlines()]
    problem = 'bubblewrap fails' if protection.is_sandbox else 'another user cannot run them'
    return f'{problem} ({lines[-1]})'


def _change_owner(folder, user_id):
    for path in [folder, *folder.rglob('*')]:
        os.chown(str(path), user_id, user_id, follow_symlinks=False)


def _counts_processes_per_sandbox():
    """Returns True for Linux 5.14 or later, which counts processes per user namespace."""
    major, minor, *_ = re.findall(r'\d+', platform.release())
    return (int(major), int(minor)) >= (5, 14)


def _mount_options(readable_folders):
    """Returns bubblewrap's options for a sandbox whose program may read `readable_folders`. A mount
    is a tuple such as ('--proc', '/proc'), which ends with the path in the sandbox."""
    hidden_folders = _own_folders()
    mounts = _system_mounts() + _ros_mounts() + [(EMPTY, folder) for folder in hidden_folders]
    shared_paths = [f'{folder}/{name}' for folder in hidden_folders for name in SHARED_PATHS]
    mounts += [(READ_ONLY, os.path.realpath(path), path) for path in shared_paths
               if os.path.exists(path)]
    mounts += [(READ_ONLY_IF_EXISTS, folder, folder) for folder in readable_folders]
    options = _with_parents(mounts)
    for folder in [*hidden_folders, '/dev', '/']:
        options += ['--remount-ro', folder]
    return options


def _system_mounts():
    mounts = [(READ_ONLY, '/usr', '/usr'), ('--proc', '/proc'), ('--dev', '/dev'),
              (READ_ONLY_IF_EXISTS, '/sys/devices/system/cpu', '/sys/devices/system/cpu')]
    for name in ('bin', 'sbin', 'lib', 'lib32', 'lib64', 'libx32'):
        if os.path.islink('/' + name):
            mounts.append(('--symlink', os.readlink('/' + name), '/' + name))
        else:
            mounts.append((READ_ONLY_IF_EXISTS, '/' + name, '/' + name))
    mounts += [(READ_ONLY_IF_EXISTS, '/etc/' + name, '/etc/' + name) for name in ETC_PATHS]
    return mounts + [(EMPTY, folder) for folder in WRITABLE_FOLDERS]


def _folders_in(variable):
    return [folder for folder in os.environ.get(variable, '').split(':') if folder]


def _ros_mounts():
    """Returns the mounts of the folders of Python and ROS that are not in /usr."""
    folders = [sys.prefix, sys.base_prefix, '/opt/ros', *_folders_in(PYTHONPATH),
               *_folders_in(CMAKE_PREFIX_PATH), *_folders_in('LD_LIBRARY_PATH')]
    return [(READ_ONLY, folder, folder) for folder in _existing_folders(folders)
            if not (folder + '/').startswith('/usr/')]


def _own_folders():
    """Returns the folders of this package."""
    folders = [rospkg.RosPack().get_path(OWN_PACKAGE)]
    folders += [f'{folder}/{OWN_PACKAGE}' for folder in _folders_in(PYTHONPATH)]
    folders += [f'{prefix}/lib/{OWN_PACKAGE}' for prefix in _folders_in(CMAKE_PREFIX_PATH)]
    return _existing_folders(folders)


def _existing_folders(folders):
    absolute_folders = dict.fromkeys(os.path.abspath(folder) for folder in folders)
    return [folder for folder in absolute_folders if os.path.isdir(folder)]


def _with_parents(mounts):
    """Returns bubblewrap's options for `mounts`, and for the parent folders of each mount. If
    bubblewrap itself made the parent folders, only root could enter some of them."""
    options = []
    made_folders = {Path('/')}
    # a mount hides earlier mounts below its path, so a folder comes before its subfolders
    for mount in sorted(mounts, key=lambda mount: len(Path(mount[-1]).parts)):
        path = Path(mount[-1])
        for folder in reversed(path.parents):
            if folder not in made_folders:
                made_folders.add(folder)
                options += ['--dir', str(folder)]
        options += mount
    return options
