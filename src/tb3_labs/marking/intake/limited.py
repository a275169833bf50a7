"""Calls of functions in a process of their own, within limits: files of strangers are read there.

A text can be made so that reading it takes all memory, or hours. Then the process ends, not the
marking.
"""
import json
import subprocess
import sys
from typing import Any, Callable

#: The most that a call may use: memory [bytes], processor time [s].
MEMORY, COMPUTING = 10 ** 9, 120
PROGRAM = '''import importlib, json, sys
sys.path[:], module, name, arguments = json.load(sys.stdin)
json.dump(getattr(importlib.import_module(module), name)(*arguments), sys.stdout)
'''


class TooMuch(Exception):
    """The call failed, most likely at a limit; the text is a clause."""


def call(function: Callable[..., Any], *arguments: Any) -> Any:
    """The result of a module's function. Arguments and result pass as JSON.

    ``TooMuch`` if it has none.
    """
    done = subprocess.run(
        ['prlimit', '--as={}'.format(MEMORY), '--cpu={}'.format(COMPUTING), '--core=0',
         sys.executable, '-c', PROGRAM],
        input=json.dumps([sys.path, function.__module__, function.__name__, arguments]),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True,
        cwd='/',                    # Python looks for modules in its folder
        start_new_session=True)     # Ctrl+C is for the marker
    if done.returncode != 0:
        words = done.stderr.strip().splitlines() or ['exit status {}'.format(done.returncode)]
        raise TooMuch('reading it takes more than {:g} GB of memory or {:g} s, or failed '
                      '({})'.format(MEMORY / 1e9, COMPUTING, words[-1]))
    return json.loads(done.stdout)
