#!/usr/bin/env python3
"""Judges an answer to a mystery robot. The answer is the name of the hidden fault, and its value.

    roslaunch tb3_labs fake_robot.launch mystery:=7        the robot; measure it, then:
    rosrun tb3_labs mystery.py --answer 7 "imu offset" 130

The command needs no master and no robot. The exit status is 0 only if fault and value are right.
"""
import importlib
import sys
import textwrap
from importlib.util import find_spec

from tb3_labs.command_line import Parser, number_or_text
from tb3_labs.simulation.mystery_answer import MEANINGS, judge
from tb3_labs.simulation.mystery_robot import LAST_NUMBER
from tb3_labs.terminal import run_tool

#: The module for `mystery.py key 1-12`. The students' archive does not have this module.
KEY_MODULE = 'tb3_labs.simulation.mystery_key'


def parse(argv):
    """Returns the command line's arguments."""
    parser = Parser(
        prog='mystery.py', epilog='example: mystery.py --answer 7 "imu offset" 130',
        description='Judges an answer to a mystery robot. roslaunch tb3_labs fake_robot.launch '
        'mystery:=NUMBER hides one fault. NUMBER is from 1 to {}.'.format(LAST_NUMBER))
    choice = parser.add_mutually_exclusive_group(required=True)
    choice.add_argument('--answer', nargs='+', metavar=('NUMBER', 'FAULT [VALUE]'),
                        help='judge this fault, and its value in the unit that --list shows')
    choice.add_argument('--list', action='store_true',
                        help='list the faults, their units, and their symptoms')
    return parser.parse_args(argv)


def main(argv):
    """Print the verdict, the list or the key. Returns the exit status."""
    try:
        if argv[:1] == ['key'] and find_spec(KEY_MODULE):
            print('\n'.join(importlib.import_module(KEY_MODULE).key(argv[1:])))
            return 0
        options = parse(argv)
        if options.list:
            print('\n\n'.join(_description(*item) for item in MEANINGS.items()))
            return 0
        is_right, verdict = judge(*_answer(options.answer))
    except ValueError as problem:
        print(f'mystery.py: {problem}', file=sys.stderr)
        return 2
    print(verdict)
    return 0 if is_right else 1


def _answer(values):
    """Returns (number, name of the fault, value or None) of the words after --answer. The name may
    be several words, without quotation marks."""
    number, *name = values
    if not number.isdecimal() or len(number) > 9:
        raise ValueError(f'number = {number!r:.40} is not valid: a whole number from 1 to '
                         f'{LAST_NUMBER}')
    value = number_or_text(name[-1]) if name else None
    if isinstance(value, float):
        return int(number), ' '.join(name[:-1]), value
    return int(number), ' '.join(name), None      # judge() reports a missing value or name


def _description(name, fault):
    value = f'  Value [{fault.unit}], right within {fault.tolerance:g}: {fault.quantity}.'
    lines = [name]
    for text in (value, '  ' + fault.symptom):
        lines += textwrap.wrap(text, 100, subsequent_indent='  ')
    return '\n'.join(lines)


if __name__ == '__main__':
    run_tool(main)
