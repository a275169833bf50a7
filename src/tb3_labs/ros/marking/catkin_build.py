"""Builds a workspace by catkin_make, for packages with messages or modules of their own."""
import os
import re
import subprocess
import sys
from pathlib import Path

#: A build takes no longer than this [s].
BUILD_TIME = 180.0
#: A package with one of these needs a build.
BUILT = ('msg', 'srv', 'action', 'setup.py')
ERROR = re.compile(r'CMake Error|[Ee]rror:|Could not find')
#: An error is told up to this length [characters].
LENGTH = 150


def needs_build(package):
    """Does this package folder have messages, services, actions or a setup.py to build?"""
    return (package / 'CMakeLists.txt').is_file() and any(
        (package / name).exists() for name in BUILT)


def build(workspace, log, environment, remarks):
    """The environment of the built workspace; None, and a remark, if the build failed.

    `log` is the file into which catkin_make prints. The build leaves the processor to the robots
    that run beside it.
    """
    command = ['nice', '-n', '5', 'catkin_make', '--directory', str(workspace),
               '-DPYTHON_EXECUTABLE=' + sys.executable, '-DCATKIN_ENABLE_TESTING=0']
    with open(str(log), 'w') as file:
        try:
            status = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=file, stderr=file,
                                    env=environment, timeout=BUILD_TIME).returncode
        except subprocess.TimeoutExpired:
            status = None
    if status != 0:
        remarks.append('catkin_make failed, so the node was run without it: {}'.format(
            'it took longer than {:g} s'.format(BUILD_TIME) if status is None
            else _first_error(Path(log).read_text(errors='replace'))))
        return None
    text = subprocess.run(['bash', '-c', 'source "$0" && env -0',
                           str(workspace / 'devel' / 'setup.bash')],
                          env=environment, stdout=subprocess.PIPE, check=True).stdout
    return dict(item.split('=', 1) for item in os.fsdecode(text).split('\0') if '=' in item)


def _first_error(printed):
    lines = [line.strip() for line in printed.splitlines() if line.strip()]
    errors = [line for line in lines if ERROR.search(line)]
    return (errors + lines[-1:] + ['without a word'])[0][:LENGTH]
