"""Protects the marker from a submission's node by limits, and by a sandbox of bubblewrap.

The rostest, master, robot, check and node of a submission share a network that has only a loopback.
All these processes end together with the marker.

The node is in a sandbox inside that network. The sandbox has its own processes, its own /tmp and
home. The node sees only the parts of the system that it needs, and cannot write them. The node's
processes, memory and disk are limited. An ordinary user makes the sandbox with a user namespace.
If root runs mark.py, the node has a user that owns nothing, since Linux does not count root's
processes.
"""
import inspect
import json
import os
import platform
import random
import signal
import subprocess
from pathlib import Path
from typing import Dict, Iterable, List, Mapping

from tb3_labs.marking.intake.mounts import CMAKE_PREFIX_PATH, mount_options, version_of
from tb3_labs.marking.node_start import (
    HOME, IDENTITY, LIMIT_FILES_COMMAND, OWN_FOLDERS, OWN_PACKAGE)

#: A sandbox gets each variable of the instructor whose name begins with one of these words.
INHERITED_PREFIXES = ('ROS', 'PYTHON', CMAKE_PREFIX_PATH, 'PKG_CONFIG_PATH', 'LD_LIBRARY_PATH',
                      'PATH', 'LANG', 'LC_', 'TZ', 'TERM', IDENTITY)
#: The folder of rospy's log files in a sandbox.
LOGS = HOME + '/.ros/log'
#: The limit of a process's address space [bytes], and the limit of threads and processes together.
#: (On 64 cores numpy starts 64 threads, and reserves 3 GB for them.)
ADDRESS_SPACE = 6 * 10 ** 9
MAX_TASKS = 500
#: This command limits the master, the robot, the check, and the node in a sandbox.
LIMIT_COMMAND = LIMIT_FILES_COMMAND + [f'--as={ADDRESS_SPACE}']
#: Root's sandboxes use these users, which own nothing. systemd uses them for the same purpose.
UNUSED_USER_IDS = range(61184, 65519)
#: The first version of Linux that counts the processes of each user namespace separately.
LINUX_WITH_COUNT = 5, 14
#: A sandbox that has not started within this time does not work [s].
SANDBOX_START = 20.0
#: The instructor reads this text if the submissions are marked without sandboxes.
UNPROTECTED = "No sandboxes: a submission's program can read and delete your files and use the " \
    'network; it can write no large file, and every process of it that can be found is killed.'


class Protection:
    """The commands that start a submission's check and a submission's programs with limits. `words`
    are the words of a command without limits. This class has the weakest limits, for
    an ordinary user who cannot make sandboxes: a program cannot write a large file, and the check
    ends with the process that starts it."""

    isolates = False

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
        """Give a folder of copies to the user who runs the program."""


class OtherUser(Protection):
    """The protection if root cannot make sandboxes, as in a container. The program's user owns
    nothing, so the program can neither write the marks nor signal the marker."""

    def __init__(self) -> None:
        self.user = random.choice(UNUSED_USER_IDS)

    def check_command(self, words: List[str]) -> List[str]:
        # the program cannot read the check's files
        return ['sh', '-c', 'umask 077; exec "$@"', 'sh'] + super().check_command(words)

    def program_command(self, words: List[str]) -> List[str]:
        become_user = ['setpriv', f'--reuid={self.user}', f'--regid={self.user}',
                       '--clear-groups', '--no-new-privs', '--pdeathsig', 'KILL']
        return become_user + LIMIT_COMMAND + [f'--nproc={MAX_TASKS}'] + words

    def program_environment(self, base: Mapping[str, str]) -> Dict[str, str]:
        home = base.get('TMPDIR', '/tmp') + '/ws'
        return dict(base, HOME=home, TMPDIR=home, ROS_HOME=home + '/.ros',
                    ROS_LOG_DIR=home + '/.ros/log')

    def hand_over(self, folder: Path) -> None:
        _change_owner(folder, self.user)
        folder.parent.chmod(0o711)


class Sandbox(Protection):
    """The protection by a sandbox. All commands of a sandbox have the same user."""

    isolates = True

    def __init__(self, readable: Iterable[Path]) -> None:
        """A program may read the `readable` folders, the system and the folders of ROS. The
        `readable` folders need not exist yet."""
        self._readable = [str(folder) for folder in readable]
        self.user = random.choice(UNUSED_USER_IDS) if os.geteuid() == 0 else None

    def check_command(self, words: List[str]) -> List[str]:
        return ['bwrap', '--die-with-parent', '--unshare-net', '--unshare-pid', '--dev-bind', '/',
                '/', '--proc', '/proc', '--'] + LIMIT_COMMAND + words

    def program_command(self, words: List[str]) -> List[str]:
        options = ['--die-with-parent', '--unshare-pid', '--unshare-ipc', '--unshare-uts']
        if self.user is None:
            options.append('--unshare-user')
        else:
            options += ['--cap-drop', 'ALL', '--cap-add', 'CAP_SETUID', '--cap-add', 'CAP_SETGID']
        options += [*mount_options(self._readable), '--chdir', HOME]
        limit_command = LIMIT_COMMAND + ['--core=0']
        if self.user is not None or version_of(platform.release()) >= LINUX_WITH_COUNT:
            limit_command.append(f'--nproc={MAX_TASKS}')
        entered = {'forget': IDENTITY, 'user': self.user, 'folders': OWN_FOLDERS, 'logs': LOGS}
        enter_command = ['/usr/bin/python3', '-ISc', ENTER, json.dumps(entered)]
        # Ctrl+C must end the program and not bubblewrap
        return ['sh', '-c', 'trap "" INT; exec "$@"', 'sh', 'bwrap', *options, '--',
                *limit_command, *enter_command, *words]

    def program_environment(self, base: Mapping[str, str]) -> Dict[str, str]:
        kept = {name: value for name, value in base.items() if name.startswith(INHERITED_PREFIXES)}
        user = os.path.basename(HOME)
        return dict(kept, HOME=HOME, USER=user, LOGNAME=user,
                    ROS_HOME=HOME + '/.ros', ROS_LOG_DIR=LOGS)

    def hand_over(self, folder: Path) -> None:
        if self.user is not None:
            _change_owner(folder, self.user)


def protection_problem(protection: Protection) -> str:
    """Try a protection. Returns '' if the protection works here, else the reason why it fails."""
    command = protection.check_command(protection.program_command(
        ['python3', '-c', f'import {OWN_PACKAGE}.msg']))
    try:
        done = subprocess.run(command, env=protection.program_environment(os.environ),
                              timeout=SANDBOX_START, stdin=subprocess.DEVNULL,
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                              universal_newlines=True)
    except FileNotFoundError:
        return 'bubblewrap is not installed (apt install bubblewrap)'
    except subprocess.TimeoutExpired:
        return 'bubblewrap hangs'
    if done.returncode == 0:
        return ''
    lines = [f'exit status {done.returncode}', *done.stderr.strip().splitlines()]
    failure = 'bubblewrap fails' if protection.isolates else 'another user cannot run them'
    return f'{failure} ({lines[-1]})'


def _change_owner(folder, user):
    for path in [folder] + list(Path(folder).rglob('*')):
        os.chown(str(path), user, user, follow_symlinks=False)


# -- inside a sandbox

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
