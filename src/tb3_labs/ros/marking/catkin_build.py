"""Builds a workspace by catkin_make, for packages with messages or modules of their own."""
import os
import re
import subprocess
import sys
from pathlib import Path

from tb3_labs.ros.marking.box import run

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


def build(workspace, log, environment, remarks, box):
    """The environment of the built workspace; None, and a remark, if the build failed.

    A CMakeLists.txt is a stranger's program too: it runs in the `box`, and so does what it makes.
    `log` is the file into which catkin_make prints. The build leaves the processor to the robots
    that run beside it.
    """
    command = ['nice', '-n', '5', 'catkin_make', '--directory', str(workspace),
               '-DPYTHON_EXECUTABLE=' + sys.executable, '-DCATKIN_ENABLE_TESTING=0']
    with open(str(log), 'w') as file:
        _, problem = run(box, command, workspace, environment, BUILD_TIME, stdout=file,
                         stderr=file)
    if problem:
        remarks.append('catkin_make failed, so the node was run without it: {}'.format(
            _first_error(Path(log).read_text(errors='replace'))
            if problem.startswith('exit') else problem))
        return None
    text, problem = run(box, ['bash', '-c', 'source "$0" && env -0',
                              str(workspace / 'devel' / 'setup.bash')],
                        workspace, environment, BUILD_TIME, stdout=subprocess.PIPE)
    if problem:
        remarks.append('What catkin_make built cannot be used: {}.'.format(problem))
        return None
    return dict(item.split('=', 1) for item in os.fsdecode(text).split('\0') if '=' in item)


def _first_error(printed):
    lines = [line.strip() for line in printed.splitlines() if line.strip()]
    errors = [line for line in lines if ERROR.search(line)]
    return (errors + lines[-1:] + ['without a word'])[0][:LENGTH]
