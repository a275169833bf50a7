#!/usr/bin/env python3
"""Tells what is wrong with this computer, its network, or a robot: one line for each thing.

Usage: doctor.py [robot3]

Every line begins with ok, warning or FAULT, and says what to do. It takes up to 12 s with a robot,
3 s without a master. It does not register at the master, publish or change anything. The exit
status is 1 if there is a FAULT, else 0.

Listens to    (in the robot's namespace, by a connection of its own)
    imu       sensor_msgs/Imu
    odom      nav_msgs/Odometry
    joint_states   sensor_msgs/JointState: do the wheels agree with the gyro?
    cmd_vel   geometry_msgs/Twist: who drives
    battery_state, sensor_state, firmware_version, /rosout   the state of the robot's board
"""
import argparse
import os
import re
import sys

try:
    import tb3_labs.doctor    # noqa: F401 (found only in a terminal that was set up)
except ImportError:
    # A terminal that was not set up is among the faults: the doctor must start there, too.
    sys.path.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), os.pardir, 'src'))

from tb3_labs.command_line import Parser    # noqa: E402
from tb3_labs.doctor.examination import examine    # noqa: E402
from tb3_labs.doctor.line import exit_status, fault, printed, summary    # noqa: E402


def namespace(word):
    """Returns '/robot3/' for 'robot3', and '/' for ''."""
    if not re.fullmatch(r'/?([A-Za-z]\w*(/[A-Za-z]\w*)*)?/?', word):
        raise argparse.ArgumentTypeError(
            '{} is not a namespace, such as robot3'.format(word))
    return '/{}/'.format(word.strip('/')).replace('//', '/')


def parse(words):
    """The command line's arguments."""
    parser = Parser(
        prog='doctor.py', description='Tells what is wrong with this computer, its network, or a '
        'robot: one line for each thing, and what to do. It changes nothing.',
        epilog='Example: rosrun tb3_labs doctor.py robot3. Exit status: 0 without a fault, 1 with '
        'one, 2 if these arguments are wrong.')
    parser.add_argument('robot', nargs='?', type=namespace,
                        default=os.environ.get('ROS_NAMESPACE', ''),
                        help="the robot's namespace; default: ROS_NAMESPACE, or none")
    parser.add_argument('--seconds', type=float, default=5.0,
                        help='time for which imu and odom are listened to (5)')
    given = parser.parse_args(words)
    if not 0.5 <= given.seconds <= 600.0:
        parser.error('--seconds must be from 0.5 to 600')
    return given


def examination(robot, seconds):
    """Yields the lines. After an unexpected answer the last line is a fault, not a traceback."""
    try:
        yield from examine(robot, seconds)
    except Exception as trouble:    # an answer of a kind that nobody thought of
        yield fault('Doctor', 'the doctor itself failed ({}: {})'.format(
            type(trouble).__name__, trouble), 'mend what stands above, and report this line')


def main(words):
    """Print the lines. Returns the exit status."""
    given, lines = parse(words), []
    sys.stdout.reconfigure(errors='replace')    # others' names may not fit this terminal
    try:
        for line in examination(given.robot, given.seconds):
            lines.append(line)
            print(printed(line, sys.stdout.isatty()), flush=True)
        print(summary(lines), flush=True)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:    # as in: doctor.py | head
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return exit_status(lines)


if __name__ == '__main__':
    # rosrun may append the remappings __name:= and __log:=
    sys.exit(main([word for word in sys.argv[1:] if ':=' not in word]))
