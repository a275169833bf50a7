"""The first program in a box: gives up what a stranger's program shall not have, and becomes it.

Its text is what ``python3 -c`` runs in the box, so it imports the standard library alone.
Arguments: a JSON object, then the command. The object has "limits" (name in :mod:`resource` ->
number), "forget" (a variable), "user" (a number; null: stay who you are) and "folders" (made
writable for that user).
"""
import json
import os
import resource
import signal
import sys


def give_up(limits, forget, user, folders):
    """Become `user`, and keep within these limits."""
    if user is not None:
        for folder in folders:
            os.chmod(folder, 0o1777)
        os.setgroups([])
        os.setresgid(user, user, user)
        os.setresuid(user, user, user)
    for name, number in limits.items():
        resource.setrlimit(getattr(resource, name), (number, number))
    os.environ.pop(forget, None)
    # bubblewrap itself must survive the Ctrl+C that the node gets, and ignores it; so do its
    # children otherwise
    signal.signal(signal.SIGINT, signal.SIG_DFL)


if __name__ == '__main__':
    give_up(**json.loads(sys.argv[1]))
    os.execvp(sys.argv[2], sys.argv[2:])
