#!/usr/bin/env python3
"""Judges a student's answer about a mystery robot. The answer has the name and the value of the
robot's hidden fault.

    roslaunch tb3_labs fake_robot.launch mystery:=7        the robot; measure it, then:
    rosrun tb3_labs mystery.py 7 "imu offset" 130

The command needs no master and no robot. The exit status is 0 only if fault and value are right.
"""
import sys
from argparse import RawDescriptionHelpFormatter

from tb3_labs.command_line import Parser
from tb3_labs.geometry.arrays import wrap_all
from tb3_labs.simulation.mystery_robot import FAULT_KINDS, LAST_NUMBER, fault_of
from tb3_labs.safe_output import run_tool

ROUNDING_ERROR = 1e-9


def judge(number, name, value):
    """Returns (True if the answer is right, text for the student). The answer is the `name` and the
    `value` of a fault. An angle is right if whole turns are its only error. If the name is wrong,
    the text does not tell the right name. Raises ``ValueError`` for an invalid `number`."""
    fault, right_value, _ = fault_of(number)
    if name != fault.name:
        return False, f'Wrong: mystery {number} has another fault.'
    error = value - right_value
    if fault.unit == 'deg':
        error = wrap_all(error, 360.0)
    if abs(error) <= fault.tolerance + ROUNDING_ERROR:
        return True, f'Right: mystery {number} is {fault.name!r}, {fault.text(right_value)}.'
    return False, ('The fault is right, its value is not: it may be off by '
                   f'{fault.tolerance:g} {fault.unit}. The value is {fault.quantity}.')


def parse(argv):
    faults = [f'{kind.name} [{kind.unit}], right within {kind.tolerance:g}: {kind.quantity}'
              for kind in FAULT_KINDS]
    parser = Parser(prog='mystery.py', description=__doc__, epilog='\n'.join(['faults:', *faults]),
                    formatter_class=RawDescriptionHelpFormatter)
    parser.add_argument('number', metavar='NUMBER', type=int,
                        help=f'number of the mystery robot, 1 to {LAST_NUMBER}')
    parser.add_argument('fault', metavar='FAULT', type=str.lower,
                        choices=[kind.name for kind in FAULT_KINDS], help='one of the faults below')
    parser.add_argument('value', metavar='VALUE', type=float, help='value in the unit of the fault')
    return parser.parse_args(argv)


def main(argv):
    """Print the verdict. Returns the exit status."""
    answer = parse(argv)
    try:
        is_right, verdict = judge(answer.number, answer.fault, answer.value)
    except ValueError as error:
        print(f'mystery.py: {error}', file=sys.stderr)
        return 2
    print(verdict)
    return int(not is_right)


if __name__ == '__main__':
    run_tool(main)
