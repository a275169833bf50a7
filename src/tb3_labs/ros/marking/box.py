"""The boxes in which a stranger's programs run; bubblewrap makes them.

World      one submission's rostest, master, robot, check and node: a network of their own, which is
           a loopback and nothing else.
Box        the stranger's program, the node, within the world: its own processes, its own /tmp and home, an empty system but for what it needs, which is
           read-only; limits on processes, memory and disk.

As an ordinary user, a box is a user namespace. As root, it is none: the program in it becomes a
user that owns nothing, since Linux counts no processes of root.
"""
import functools
import json
import os
import platform
import random
import re
import subprocess
import sys
from pathlib import Path

import rospkg

from tb3_labs.ros.marking import in_box
from tb3_labs.ros.marking.sandbox import COOKIE

OWN_PACKAGE = 'tb3_labs'
#: What a student's program may have of this package: messages, services, and how they are found.
SHARED = ('package.xml', 'cmake', 'msg', 'srv')
NAME = 'stranger'
HOME = '/home/' + NAME
#: Folders that are a program's own, each with room for this much [bytes].
OWN_FOLDERS = ('/tmp', HOME, '/dev/shm')
ROOM = 100 * 10 ** 6
#: The largest file [bytes], the address space of one process [bytes], the number of threads and
#: processes together. (A numpy on 64 cores starts 64 threads, and reserves 3 GB for them.)
LARGEST_FILE, ADDRESS_SPACE, TASKS = 50 * 10 ** 6, 6 * 10 ** 9, 500
#: Users that own nothing, for root's boxes; systemd has these for the same purpose.
USERS = range(61184, 65519)
#: From /etc, as far as it is there: names, time zone, libraries, fonts, ROS.
ETC = ('alternatives', 'fonts', 'host.conf', 'hosts', 'ld.so.cache', 'ld.so.conf', 'ld.so.conf.d',
       'localtime', 'matplotlibrc', 'mime.types', 'nsswitch.conf', 'python3', 'ros', 'timezone')
#: Variables that a program in a box gets from the instructor's environment, if they begin so.
KEPT = ('ROS', 'PYTHON', 'CMAKE_PREFIX_PATH', 'PKG_CONFIG_PATH', 'LD_LIBRARY_PATH', 'PATH', 'LANG',
        'LC_', 'TZ', 'TERM', COOKIE)
#: Those of them that list folders.
LISTS = ('PYTHONPATH', 'CMAKE_PREFIX_PATH', 'LD_LIBRARY_PATH')
#: `--size` of a tmpfs came with this version of bubblewrap; processes of a user namespace are
#: counted for themselves since this Linux.
SIZED, COUNTED = (0, 8), (5, 14)
#: A box that works is there within this time [s].
START_TIME = 20.0


@functools.lru_cache(maxsize=1)
def problem():
    """Why boxes do not work here, a clause; '' if they do. It is tried, a box within a world."""
    box = Box([])
    command = box.world(box.command(['python3', '-c', 'import {}.msg'.format(OWN_PACKAGE)]))
    try:
        done = subprocess.run(command, env=box.environment(os.environ), timeout=START_TIME,
                              stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, universal_newlines=True)
    except FileNotFoundError:
        return 'bubblewrap is not installed (apt install bubblewrap)'
    except subprocess.TimeoutExpired:
        return 'bubblewrap hangs'
    words = done.stderr.strip().splitlines()
    return '' if done.returncode == 0 else 'bubblewrap fails ({})'.format(
        words[-1] if words else 'exit status {}'.format(done.returncode))


class NoBox:
    """What remains where boxes do not work: a program writes no large file."""

    boxed = False

    @staticmethod
    def world(command):
        """The command that starts the world of a submission."""
        return command

    @staticmethod
    def command(command):
        """The command of a stranger's program."""
        return ['prlimit', '--fsize={}'.format(LARGEST_FILE)] + command

    @staticmethod
    def environment(environment):
        """The environment of a stranger's program."""
        return environment

    @staticmethod
    def hand_over(folder):
        """A folder of copies is the program's."""


class Box:
    """Makes commands that run in a box; all of them as the same user."""

    boxed = True

    def __init__(self, readable):
        """`readable`: folders that a program may read as soon as they exist, besides the system and
        what ROS needs."""
        self._readable = [str(folder) for folder in readable]
        self.user = random.choice(USERS) if os.geteuid() == 0 else None

    @staticmethod
    def world(command):
        """The command, in a network of its own; it ends with the process that starts it."""
        return ['bwrap', '--die-with-parent', '--unshare-net', '--dev-bind', '/', '/',
                '--'] + command

    def command(self, command):
        """The command in a box."""
        options = ['--die-with-parent', '--unshare-pid', '--unshare-ipc', '--unshare-uts']
        options += ['--unshare-user'] if self.user is None else [
            '--cap-drop', 'ALL', '--cap-add', 'CAP_SETUID', '--cap-add', 'CAP_SETGID']
        places = _system() + self._ros() + _own_package()
        places += [('--ro-bind-try', folder, folder) for folder in self._readable]
        options += _with_parents(places)
        options += ['--remount-ro', '/dev', '--remount-ro', '/', '--chdir', HOME]
        # bubblewrap must not end at the Ctrl+C that is meant for the program
        return ['sh', '-c', 'trap "" INT; exec "$@"', 'sh', 'bwrap'] + options + [
            '--', '/usr/bin/python3', '-ISc', Path(in_box.__file__).read_text(),
            json.dumps(self._limits())] + command

    def _limits(self):
        limits = {'RLIMIT_FSIZE': LARGEST_FILE, 'RLIMIT_AS': ADDRESS_SPACE, 'RLIMIT_CORE': 0}
        if self.user is not None or _version(platform.release()) >= COUNTED:
            limits['RLIMIT_NPROC'] = TASKS
        return {'limits': limits, 'forget': COOKIE, 'user': self.user, 'folders': OWN_FOLDERS}

    @staticmethod
    def environment(environment):
        """What a program in a box gets of this environment: nothing that is the instructor's."""
        kept = {name: value for name, value in environment.items() if name.startswith(KEPT)}
        return dict(kept, HOME=HOME, USER=NAME, LOGNAME=NAME,
                    ROS_HOME=HOME + '/.ros', ROS_LOG_DIR=HOME + '/.ros/log')

    @staticmethod
    def _ros():
        """What Python and ROS need beside the system."""
        folders = [sys.prefix, sys.base_prefix, '/opt/ros'] + [
            folder for name in LISTS for folder in os.environ.get(name, '').split(':')]
        return [('--ro-bind', folder, folder)
                for folder in dict.fromkeys(os.path.abspath(folder) for folder in folders if folder)
                if os.path.isdir(folder) and not (folder + '/').startswith('/usr/')]

    def hand_over(self, folder):
        """Make a folder of copies the program's own, and readable."""
        if self.user is not None:
            for path in [folder] + list(Path(folder).rglob('*')):
                os.chown(str(path), self.user, self.user, follow_symlinks=False)


def _system():
    """The system, read-only, and the program's own folders."""
    places = [('--ro-bind', '/usr', '/usr'), ('--proc', '/proc'), ('--dev', '/dev'),
              ('--ro-bind-try', '/sys/devices/system/cpu', '/sys/devices/system/cpu')]
    for name in ('bin', 'sbin', 'lib', 'lib32', 'lib64', 'libx32'):
        if os.path.islink('/' + name):
            places.append(('--symlink', os.readlink('/' + name), '/' + name))
        elif os.path.isdir('/' + name):
            places.append(('--ro-bind', '/' + name, '/' + name))
    places += [('--ro-bind-try', '/etc/' + name, '/etc/' + name) for name in ETC]
    size = ('--size', str(ROOM)) if sized() else ()
    return places + [size + ('--tmpfs', folder) for folder in OWN_FOLDERS]


def _own_package():
    """Of this package, what a student's program may have, at the usual places; else it is empty
    there."""
    folders = [rospkg.RosPack().get_path(OWN_PACKAGE)] + [
        os.path.join(folder, below, OWN_PACKAGE)
        for name, below in (('PYTHONPATH', ''), ('CMAKE_PREFIX_PATH', 'lib'))
        for folder in os.environ.get(name, '').split(':') if folder]
    places = []
    for folder in dict.fromkeys(os.path.abspath(path) for path in folders):
        if os.path.isdir(folder):
            places.append(('--tmpfs', folder))
            places += [('--ro-bind', os.path.realpath(path), path) for path in (
                os.path.join(folder, name) for name in SHARED) if os.path.exists(path)]
            places.append(('--remount-ro', folder))
    return places


def _with_parents(places):
    """The words of these places, each after the folders above it: bubblewrap would make some of
    those so that only root may enter."""
    words, made = [], {Path('/')}
    for place in places:
        for folder in reversed(Path(place[-1]).parents):
            if folder not in made:
                made.add(folder)
                words += ['--dir', str(folder)]
        if '--tmpfs' in place:
            made = {folder for folder in made if Path(place[-1]) not in folder.parents}
        words += place
    return words


def sized():
    """Can this bubblewrap limit the size of a folder?"""
    return _bwrap_version() >= SIZED


@functools.lru_cache(maxsize=1)
def _bwrap_version():
    try:
        return _version(subprocess.check_output(['bwrap', '--version'], universal_newlines=True))
    except (OSError, subprocess.CalledProcessError):
        return ()


def _version(text):
    """The first two numbers in a text."""
    return tuple(int(number) for number in re.findall(r'\d+', text)[:2])
