"""Can this machine make sandboxes at all? If it can, those of this package must work on it."""
import subprocess

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
