#!/usr/bin/env python3
"""Measures a robot in a guided test drive of ten minutes: what is wrong, and which numbers it has.

Usage: commission.py robot3

The robot needs 2 m x 2 m of empty floor, and a person beside it. Each step is announced and begins
by Enter; any other key, Ctrl+C, a silent sensor, and a box of 0.8 m around the start stop it.
It writes robot3.html, a line for each number, and robot3.yaml, by which the simulated robot becomes
this one: roslaunch tb3_labs fake_robot.launch params:=robot3.yaml

Subscribes    (in the robot's namespace)
    imu           sensor_msgs/Imu
    odom          nav_msgs/Odometry
    joint_states  sensor_msgs/JointState: the wheels' distance
    battery_state sensor_msgs/BatteryState
    sensor_state  turtlebot3_msgs/SensorState: the torque, if that package is there
Publishes
    cmd_vel       geometry_msgs/Twist
    reset         std_msgs/Empty, in the last step
"""
import argparse
import os
import re
import sys
from pathlib import Path

from tb3_labs.command_line import Parser
from tb3_labs.commissioning.steps import BY_NAME


def namespace(word):
    """Returns 'robot3' for '/robot3/'; refuses anything else than a name, or none."""
    if not re.fullmatch(r'/?([A-Za-z]\w*(/[A-Za-z]\w*)*)?/?', word):
        raise argparse.ArgumentTypeError('{} is not a namespace, such as robot3'.format(word))
    return word.strip('/')


def chosen_steps(words):
    """The steps with these names, which commas separate, in the order of the test drive."""
    names = [name.strip() for name in words.split(',')]
    for name in names:
        if name not in BY_NAME:
            raise argparse.ArgumentTypeError('{!r} is not a step: {}'.format(
                name, ', '.join(BY_NAME)))
    return [step for name, step in BY_NAME.items() if name in names]


def parse(words):
    """The command line's arguments."""
    parser = Parser(prog='commission.py', description='Measures a robot in a guided test drive, '
                    'and writes ROBOT.html and ROBOT.yaml.')
    parser.add_argument('robot', nargs='?', type=namespace,
                        default=os.environ.get('ROS_NAMESPACE', ''),
                        help="the robot's namespace; default: ROS_NAMESPACE, or none")
    parser.add_argument('--steps', type=chosen_steps, default=list(BY_NAME.values()),
                        help='these steps alone, with commas: ' + ', '.join(BY_NAME))
    parser.add_argument('-o', dest='folder', metavar='FOLDER', type=Path, default=Path('.'),
                        help='folder for the two files; default: the current one')
    given = parser.parse_args(words)
    if not (given.folder.is_dir() and os.access(str(given.folder), os.W_OK)):
        parser.error('{} is not a folder that can be written'.format(given.folder))
    return given


def main(words):
    """Drive; the node ends this process."""
    given = parse(words)
    os.environ['ROS_NAMESPACE'] = '/' + given.robot.strip('/')
    # rospy reads the namespace when it is imported
    from tb3_labs.commissioning.ros_commission import Commission
    from tb3_labs.ros.node import run
    name = given.robot.strip('/').replace('/', '_') or 'robot'
    run('commission', lambda: Commission(name, given.steps, given.folder))


if __name__ == '__main__':
    main([word for word in sys.argv[1:] if ':=' not in word])
