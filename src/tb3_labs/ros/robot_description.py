"""Prints the robot's URDF, which launch/view.launch puts on the parameter server for RViz:

    python3 -m tb3_labs.ros.robot_description MODEL [PREFIX]

It is the URDF of turtlebot3_description where that is installed, else a simple shape of its size.
PREFIX is of the frames' names, such as robot3/.
"""
import os
import subprocess
import sys

from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.robot.urdf import simple_urdf, with_prefix


def urdf_of(model):
    """The URDF of a RobotModel; ``ValueError`` of one line if it cannot be made."""
    found = _run('rospack', 'find', 'turtlebot3_description')
    if found.returncode:
        return simple_urdf(model)
    path = os.path.join(found.stdout.strip(), 'urdf',
                        'turtlebot3_{}.urdf.xacro'.format(model.name))
    try:
        xacro = _run('xacro', path)
    except FileNotFoundError:
        raise ValueError('xacro is missing: sudo apt install ros-noetic-xacro') from None
    if xacro.returncode:
        raise ValueError('xacro {}: {}'.format(path, ' '.join(xacro.stderr.split())))
    return xacro.stdout


def _run(*words):
    return subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          universal_newlines=True)


def main(model, prefix=''):
    """Print the URDF; the exit status, or the reason why there is none."""
    try:
        print(with_prefix(urdf_of(robot_model(model)), prefix))
    except ValueError as problem:
        return 'robot_description: {}'.format(problem)
    return 0


if __name__ == '__main__':
    sys.exit(main(*sys.argv[1:]))
