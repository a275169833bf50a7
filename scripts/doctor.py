#!/usr/bin/env python3
"""Finds faults of this computer, its network, or a robot. Each finding is one line.

Example: rosrun tb3_labs doctor.py robot3. A line begins with ok, warning or FAULT, and may end with
an instruction. The doctor needs up to 12 s with a robot, 3 s without a master, and longer if a name
resolves slowly. The exit status is 0 without a FAULT, 1 with a FAULT, and 2 for wrong arguments.

The doctor changes nothing, and publishes nothing. For 5 s it listens to imu, odom,
joint_states and cmd_vel in the robot's namespace.
"""
import argparse
import os
import re
import sys

try:
    from tb3_labs.command_line import Parser
    from tb3_labs.doctor import finding_text, summary_text
    from tb3_labs.doctor.checks import examine
    from tb3_labs.safe_output import run_tool
except ImportError as error:
    sys.exit(f'no package {error.name}: source scripts/setup.sh')

#: Names with slashes between them, such as robot3 or /room/robot3/. The text may also be empty.
NAMESPACE = re.compile(r'/?([A-Za-z]\w*(/[A-Za-z]\w*)*)?/?')


def checked_namespace(word):
    """Returns a typed namespace with slashes: '/robot3/' for 'robot3', and '/' for ''."""
    if not NAMESPACE.fullmatch(word):
        raise argparse.ArgumentTypeError(f'{word} is not a namespace, such as robot3')
    return f'/{word.strip("/")}/'.replace('//', '/')


def main(argv):
    """Print the findings. Returns the exit status."""
    parser = Parser(prog='doctor.py', description=__doc__)
    parser.add_argument('robot', nargs='?', type=checked_namespace,
                        default=os.environ.get('ROS_NAMESPACE', ''),
                        help="the robot's namespace; default: ROS_NAMESPACE, or none")
    robot = parser.parse_args(argv).robot
    findings = []
    try:
        for finding in examine(robot):
            findings.append(finding)
            print(finding_text(finding), flush=True)
    except KeyboardInterrupt:
        return 130
    print(summary_text(findings))
    return int(any(finding.severity == 'FAULT' for finding in findings))


if __name__ == '__main__':
    # ROS can append the words __name:=NAME and __log:=FILE, which the doctor must not read
    run_tool(lambda argv: main([word for word in argv if ':=' not in word]))
