"""Can this machine make sandboxes at all? If it can, this package's sandboxes must work on it. And the
environment in which mark.py reads a submission, whatever is sourced."""
import os
import subprocess
import sys
from unittest import mock

import pytest

#: Any sandbox needs this of a machine: a namespace in a namespace.
BARE = ['bwrap', '--unshare-net', '--dev-bind', '/', '/', 'bwrap', '--unshare-pid',
        '--dev-bind', '/', '/', '--proc', '/proc', 'true']


def _missing():
    try:
        subprocess.run(BARE, check=True, timeout=600.0)
    except (OSError, subprocess.SubprocessError) as problem:
        return 'no sandboxes on this machine: {}'.format(problem)
    return ''


#: '' or the reason why there can be none.
MISSING = _missing()


def skip_if_closed(place):
    """Skip a test in which another account reads this path, if a folder above it is closed, such as /root."""
    for parent in place.parents:
        if not parent.stat().st_mode & 0o001:
            pytest.skip('{} is closed to other accounts'.format(parent))


@pytest.fixture(scope='module')
def ros_alone(tmp_path_factory):
    """Meanwhile this process has ROS and this package, and no other workspace."""
    from tb3_labs.marking import trial_runner
    made = trial_runner.marking_environment(tmp_path_factory.mktemp('ros'), os.environ)
    sourced = {os.getcwd(), *os.environ.get('PYTHONPATH', '').split(':')}
    modules = made['PYTHONPATH'].split(':') + [path for path in sys.path if path not in sourced]
    with mock.patch.dict(os.environ, made, clear=True), mock.patch.object(sys, 'path', modules):
        yield made
