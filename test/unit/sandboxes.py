"""The files of a submission, the environment in which mark.py reads it, and the machine's sandboxes. If a
machine can make sandboxes at all, those of this package must work on it."""
import os
import subprocess
import sys
from unittest import mock

import pytest


def hand_in(folder, files):
    """Write files, {path: text or bytes}. Returns the folder."""
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder


#: This command makes a namespace in a namespace, which any sandbox needs.
BARE = ['bwrap', '--unshare-net', '--dev-bind', '/', '/', 'bwrap', '--unshare-pid',
        '--dev-bind', '/', '/', '--proc', '/proc', 'true']


def _missing():
    """Returns the reason why this machine can make no sandboxes, or ''."""
    try:
        subprocess.run(BARE, check=True, timeout=600.0)
    except (OSError, subprocess.SubprocessError) as error:
        return 'no sandboxes on this machine: {}'.format(error)
    return ''


MISSING = _missing()


def skip_if_closed(place):
    """Skip a test if another account cannot read this path, since a folder above it, such as /root, is closed."""
    for parent in place.parents:
        if not parent.stat().st_mode & 0o001:
            pytest.skip('{} is closed to other accounts'.format(parent))


@pytest.fixture(scope='module')
def ros_alone(tmp_path_factory):
    """Until the end of the module this process has ROS and this package, and no other workspace."""
    from tb3_labs.marking import trial_runner
    made = trial_runner.make_marking_environment(tmp_path_factory.mktemp('ros'), os.environ)
    sourced = {os.getcwd(), *os.environ.get('PYTHONPATH', '').split(':')}
    modules = made['PYTHONPATH'].split(':') + [path for path in sys.path if path not in sourced]
    with mock.patch.dict(os.environ, made, clear=True), mock.patch.object(sys, 'path', modules):
        yield made
