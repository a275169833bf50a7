#!/usr/bin/env python3
"""Judges an answer to a mystery robot. The answer is the name of the hidden fault, and its value.

    roslaunch tb3_labs fake_robot.launch mystery:=7        the robot; measure it, then:
    rosrun tb3_labs mystery.py --answer 7 "imu offset" 130

The command needs no master and no robot. The exit status is 0 only if fault and value are right.
"""
import sys

from tb3_labs.command_line import Parser
from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.simulation.mystery_robot import FAULT_KINDS, LAST_NUMBER, draw
from tb3_labs.terminal import run_tool

#: Because of rounding, the error of a right value may exceed the tolerance by this.
ROUNDING = 1e-9


def judge(number, name, value):
    """Judges a student's answer: the name of a fault, and its value. An angle may be off by whole
    turns. Returns (is the answer right?, the text for the student). The text about a wrong fault
    does not show the right fault. Raises ``ValueError`` if the number of the robot, or the name of
    the fault, is not valid."""
    hidden, right, _ = draw(number)
    names = [kind.name for kind in FAULT_KINDS]
    if name.lower() not in names:
        raise ValueError(f'{name!r} is not a fault. Valid: {", ".join(names)}')
    if name.lower() != hidden.name:
        return False, f'Wrong: mystery {number} has another fault.'
    error = value - right
    if hidden.unit == 'deg':
        error = difference_degrees(value, right)
    if abs(error) <= hidden.tolerance + ROUNDING:
        return True, f'Right: mystery {number} is {hidden.name!r}, {hidden.text(right)}.'
    return False, ('The fault is right, its value is not: it may be off by '
                   f'{hidden.tolerance:g} {hidden.unit}. The value is {hidden.quantity}.')


def parse(argv):
    """Returns the command line's arguments."""
    parser = Parser(
        prog='mystery.py', epilog='example: mystery.py --answer 7 "imu offset" 130',
        description='Judges an answer to a mystery robot. roslaunch tb3_labs fake_robot.launch '
        'mystery:=NUMBER hides one fault. NUMBER is from 1 to {}.'.format(LAST_NUMBER))
    choice = parser.add_mutually_exclusive_group(required=True)
    choice.add_argument('--answer', nargs=3, metavar=('NUMBER', 'FAULT', 'VALUE'),
                        help='judge this fault, and its value in the unit that --list shows')
    choice.add_argument('--list', action='store_true',
                        help='list the faults, and the meaning of their values')
    return parser.parse_args(argv)


def main(argv):
    """Print the verdict or the list. Returns the exit status."""
    options = parse(argv)
    if options.list:
        for kind in FAULT_KINDS:
            print(f'{kind.name} [{kind.unit}], right within {kind.tolerance:g}: {kind.quantity}')
        return 0
    number, name, value = options.answer
    try:
        is_right, verdict = judge(int(number), name, float(value))
    except ValueError as problem:
        print(f'mystery.py: {problem}', file=sys.stderr)
        return 2
    print(verdict)
    return 0 if is_right else 1


if __name__ == '__main__':
    run_tool(main)
