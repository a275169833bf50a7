"""The files and folders that a program in a sandbox sees, as mounts of bubblewrap.

A mount is the words of an option of bubblewrap. The last word is the path in the sandbox.
"""
import functools
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Iterable, List, Tuple

import rospkg

from tb3_labs.marking.node_start import OWN_FOLDERS, OWN_PACKAGE

#: The environment variable that lists the folders of workspaces.
CMAKE_PREFIX_PATH = 'CMAKE_PREFIX_PATH'
#: The environment variable that lists the folders of Python's modules.
PYTHONPATH = 'PYTHONPATH'
#: Each of OWN_FOLDERS has at most this size [bytes].
OWN_FOLDER_BYTES = 100 * 10 ** 6
#: A sandbox has these parts of /etc: host names, time zone, libraries, fonts and ROS need them.
ETC_PARTS = ('alternatives fonts host.conf hosts ld.so.cache ld.so.conf ld.so.conf.d localtime '
             'matplotlibrc mime.types nsswitch.conf python3 ros timezone').split()
#: A student's program sees only these parts of this package.
SHARED_PARTS = ('package.xml', 'cmake', 'msg', 'srv')
#: The first version of bubblewrap that limits the size of a folder.
BUBBLEWRAP_WITH_SIZE = 0, 8
READ_ONLY, READ_ONLY_TRY, EMPTY = '--ro-bind', '--ro-bind-try', '--tmpfs'


def mount_options(readable: Iterable[str]) -> List[str]:
    """Returns bubblewrap's options for a sandbox whose program may read the `readable` folders."""
    hidden, shared = _own_package()
    mounts = _system() + _ros() + [(EMPTY, folder) for folder in hidden] + shared
    mounts += [(READ_ONLY_TRY, folder, folder) for folder in readable]
    options = _with_parents(mounts)
    for folder in hidden + ['/dev', '/']:
        options += ['--remount-ro', folder]
    return options


def _system():
    """Returns the read-only mounts of the system, and the mounts of the program's own folders."""
    mounts = [(READ_ONLY, '/usr', '/usr'), ('--proc', '/proc'), ('--dev', '/dev'),
              (READ_ONLY_TRY, '/sys/devices/system/cpu', '/sys/devices/system/cpu')]
    for name in ('bin', 'sbin', 'lib', 'lib32', 'lib64', 'libx32'):
        if os.path.islink('/' + name):
            mounts.append(('--symlink', os.readlink('/' + name), '/' + name))
        elif os.path.isdir('/' + name):
            mounts.append((READ_ONLY, '/' + name, '/' + name))
    mounts += [(READ_ONLY_TRY, '/etc/' + name, '/etc/' + name) for name in ETC_PARTS]
    size = []
    if can_limit_folder_size():
        size = ['--size', str(OWN_FOLDER_BYTES)]
    return mounts + [(*size, EMPTY, folder) for folder in OWN_FOLDERS]


def _folders_in(*variables):
    return [folder for name in variables
            for folder in os.environ.get(name, '').split(':') if folder]


def _ros():
    """Returns the mounts of the folders of Python and ROS that are not in /usr."""
    folders = [sys.prefix, sys.base_prefix, '/opt/ros'] + _folders_in(
        PYTHONPATH, CMAKE_PREFIX_PATH, 'LD_LIBRARY_PATH')
    return [(READ_ONLY, folder, folder) for folder in dict.fromkeys(map(os.path.abspath, folders))
            if os.path.isdir(folder) and not (folder + '/').startswith('/usr/')]


def _own_package():
    """Returns (the hidden folders of this package, the mounts of their SHARED_PARTS)."""
    folders = [rospkg.RosPack().get_path(OWN_PACKAGE)]
    folders += [os.path.join(folder, OWN_PACKAGE) for folder in _folders_in(PYTHONPATH)]
    folders += [os.path.join(prefix, 'lib', OWN_PACKAGE)
                for prefix in _folders_in(CMAKE_PREFIX_PATH)]
    hidden = list(filter(os.path.isdir, dict.fromkeys(map(os.path.abspath, folders))))
    paths = [os.path.join(folder, name) for folder in hidden for name in SHARED_PARTS]
    shared = [(READ_ONLY, os.path.realpath(path), path) for path in paths if os.path.exists(path)]
    return hidden, shared


def _with_parents(mounts):
    """Returns bubblewrap's options for these mounts.

    A mount comes after the mounts above it, since Python may be in a hidden folder, and a hidden
    folder may be in a folder of ROS. The options also make the folders above a mount. If bubblewrap
    made these folders by itself, only root could enter some of them.
    """
    options = []
    made = {Path('/')}
    for mount in sorted(mounts, key=lambda mount: len(Path(mount[-1]).parts)):
        for folder in reversed(Path(mount[-1]).parents):
            if folder not in made:
                made.add(folder)
                options += ['--dir', str(folder)]
        options += mount
    return options


@functools.lru_cache(maxsize=1)
def can_limit_folder_size() -> bool:
    """Can this bubblewrap limit the size of a folder?"""
    try:
        return version_of(subprocess.check_output(
            ['bwrap', '--version'], universal_newlines=True)) >= BUBBLEWRAP_WITH_SIZE
    except (OSError, subprocess.CalledProcessError):
        return False


def version_of(text: str) -> Tuple[int, ...]:
    """Returns the first two numbers of a version."""
    return tuple(int(number) for number in re.findall(r'\d+', text)[:2])
