#!/usr/bin/env python3
"""Becomes another package's node where that package is installed; says what to install where not.

roslaunch cannot start a node only if its package is there: a launch file that names such a node
fails as a whole.

Usage: start_optional.py PACKAGE NODE [arguments of the node]
"""
import os
import sys

import roslib.packages
import rospkg
import rospy

HOW_ON_DEBIAN = {
    'joy': 'Debian has none: build joystick_drivers from source, or publish sensor_msgs/Joy '
           'yourself and start with joy:=false',
    'rviz': 'Debian: sudo apt install rviz',
}


def main(package, node, *arguments):
    """Become that node."""
    try:
        found = roslib.packages.find_node(package, node)
    except rospkg.ResourceNotFound:
        found = []
    if found:
        os.execv(found[0], [found[0]] + list(arguments))
    rospy.init_node(node)
    rospy.logfatal('the package %s is not installed: sudo apt install ros-noetic-%s (%s)', package,
                   package, HOW_ON_DEBIAN.get(package, 'Debian has none'))
    sys.exit(1)


if __name__ == '__main__':
    main(*sys.argv[1:])
