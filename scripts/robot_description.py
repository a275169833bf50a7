#!/usr/bin/env python3
"""Prints the robot's URDF, which launch/view.launch puts on the parameter server for RViz.

It is the URDF of turtlebot3_description where that is installed, else a simple shape of its size.

Usage: robot_description.py [MODEL [PREFIX]]
"""
import os
import subprocess
import sys

import rospkg

from tb3_labs.command_line import Parser
from tb3_labs.config import NOT_GIVEN
from tb3_labs.robot.turtlebot3 import model_called
from tb3_labs.robot.urdf import simple_urdf, with_prefix


def urdf_of(model):
    """The URDF of a RobotModel; ``ValueError`` of one line where it cannot be made."""
    try:
        package = rospkg.RosPack().get_path('turtlebot3_description')
    except rospkg.ResourceNotFound:
        return simple_urdf(model)
    path = os.path.join(package, 'urdf', 'turtlebot3_{}.urdf.xacro'.format(model.name))
    try:
        xacro = subprocess.run(['xacro', path], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               universal_newlines=True)
    except FileNotFoundError:
        raise ValueError('xacro is missing: sudo apt install ros-noetic-xacro') from None
    if xacro.returncode:
        raise ValueError('xacro {}: {}'.format(path, ' '.join(xacro.stderr.split())))
    return xacro.stdout


def main(words):
    """Print the URDF; the exit status."""
    parser = Parser(prog='robot_description.py', description="The robot's URDF.")
    parser.add_argument('model', metavar='MODEL', nargs='?', default=NOT_GIVEN,
                        help='default: TURTLEBOT3_MODEL in the environment, else burger')
    parser.add_argument('prefix', metavar='PREFIX', nargs='?', default='',
                        help="of the frames' names, such as robot3/")
    arguments = parser.parse_args(words)
    try:
        print(with_prefix(urdf_of(model_called(arguments.model, os.environ)), arguments.prefix))
    except ValueError as problem:
        print('robot_description.py: {}'.format(problem), file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
