#!/usr/bin/env python3
"""Starts a node or launch file of another package, or says how to install that package.

A launch file fails as a whole if it names a node of a package that is not installed, or includes
such a package's launch file. roslaunch has no condition for that.

Usage: start_optional.py PACKAGE NODE|FILE.launch [arguments of the node, or of the launch file]
"""
import tb3_labs.ros.early_ctrl_c    # noqa: F401 (first: it is for the other imports)

import os
import sys

from tb3_labs.ros.launching.optional import how_to_install, path_of
from tb3_labs.ros.node import run


def main(package, what, *arguments):
    """Become that node, or a roslaunch of that launch file; exit status 1 if not installed."""
    path = path_of(package, what)
    if path and what.endswith('.launch'):
        os.execvp('roslaunch', ['roslaunch', package, what] + list(arguments))
    if path:
        os.execv(path, [path] + list(arguments))

    def refuse():
        raise ValueError(how_to_install(package))
    run(package, refuse)    # a node that says so by one fatal line: roslaunch shows no other output


if __name__ == '__main__':
    if len(sys.argv) < 3:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
