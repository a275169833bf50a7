#!/usr/bin/env python3
"""Starts a node or launch file of another package, or says how to install that package.

A launch file fails as a whole if it names a node of a package that is not installed, or includes
such a package's launch file. roslaunch has no condition for that.

Usage: start_optional.py PACKAGE NODE|FILE.launch [arguments of the node, or of the launch file]
"""
import os
import sys

import rospy

from tb3_labs.ros.launching.optional import how_to_install, path_of


def main(package, what, *arguments):
    """Become that node, or a roslaunch of that launch file; exit status 1 if not installed."""
    path = path_of(package, what)
    if path and what.endswith('.launch'):
        os.execvp('roslaunch', ['roslaunch', package, what] + list(arguments))
    if path:
        os.execv(path, [path] + list(arguments))
    rospy.init_node(package)
    rospy.logfatal('%s', how_to_install(package))
    sys.exit(1)


if __name__ == '__main__':
    if len(sys.argv) < 3:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
