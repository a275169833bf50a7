#!/usr/bin/env python3
"""Becomes joy_node of the package `joy` where that is installed; says what to install where not.

roslaunch cannot start a node only if its package is there, so that a launch file that names
joy_node itself would fail as a whole.
"""
import os
import sys

import roslib.packages
import rospkg
import rospy


def main():
    """Become joy_node, with the same arguments."""
    try:
        found = roslib.packages.find_node('joy', 'joy_node')
    except rospkg.ResourceNotFound:
        found = []
    if found:
        os.execv(found[0], [found[0]] + sys.argv[1:])
    rospy.init_node('joy')
    rospy.logfatal('the package joy is not installed, so no pad can be read: sudo apt install '
                   'ros-noetic-joy (Debian has none: build joystick_drivers from source, or '
                   'publish sensor_msgs/Joy yourself and start with joy:=false)')
    sys.exit(1)


if __name__ == '__main__':
    main()
