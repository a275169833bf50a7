"""Runs a node of the package with a method that raises during a drive.

Usage: broken_node.py NODE.py MODULE:CLASS.METHOD [ROS arguments]
"""
import functools
import importlib
import runpy
import sys

import roslib.packages

#: Calls after which the robot is in full motion.
CALLS = 60


def main(node, where, *arguments):
    module, _, name = where.partition(':')
    owner, _, method = name.partition('.')
    owner = getattr(importlib.import_module(module), owner)
    sound, calls = getattr(owner, method), []

    @functools.wraps(sound)
    def broken(self, *given):
        result = sound(self, *given)
        if method != '_next_command' or result is not None:
            calls.append(result)
        if len(calls) > CALLS:
            raise RuntimeError('broken on purpose')
        return result
    setattr(owner, method, broken)
    path, = roslib.packages.find_node('tb3_labs', node)[:1]
    sys.argv = [path] + list(arguments)
    runpy.run_path(path, run_name='__main__')


if __name__ == '__main__':
    main(*sys.argv[1:])
