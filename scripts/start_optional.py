#!/usr/bin/env python3
"""Starts a node or launch file of another package, or says how to install that package.

A launch file fails as a whole if it names a node of a package that is not installed, or includes
such a package's launch file. roslaunch has no condition for that.

Usage: start_optional.py PACKAGE NODE|FILE.launch [arguments of the node, or of the launch file]
"""
import os
import sys

import roslib.packages
import rospkg
import rospy

HOW_ON_DEBIAN = {
    'joy': 'Debian has none: build joystick_drivers from source, or publish sensor_msgs/Joy '
           'yourself and start with joy:=false',
    'turtlebot3_gazebo': 'Debian has none: sim:=true is the embedded robot',
    'rviz': 'Debian: sudo apt install rviz',
}


def main(package, what, *arguments):
    """Become that node, or a roslaunch of that launch file; exit status 1 if not installed."""
    try:
        if what.endswith('.launch'):
            rospkg.RosPack().get_path(package)
            os.execvp('roslaunch', ['roslaunch', package, what] + list(arguments))
        found = roslib.packages.find_node(package, what)
    except rospkg.ResourceNotFound:
        found = []
    if found:
        os.execv(found[0], [found[0]] + list(arguments))
    rospy.init_node(package)
    rospy.logfatal('the package %s is not installed: sudo apt install ros-noetic-%s (%s)', package,
                   package.replace('_', '-'), HOW_ON_DEBIAN.get(package, 'Debian has none'))
    sys.exit(1)


if __name__ == '__main__':
    if len(sys.argv) < 3:
        sys.exit(__doc__.strip())
    main(*sys.argv[1:])
