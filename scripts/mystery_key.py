#!/usr/bin/env python3
"""Prints the answers of mystery robots, for the instructor.

Usage: mystery_key.py NUMBER|FIRST-LAST ...        mystery_key.py 1-12
"""
import sys

from tb3_labs.command_line import Parser
from tb3_labs.simulation.mystery import LAST, draw
from tb3_labs.simulation.mystery import shown


def main(words):
    """Print one line for each number; the exit status."""
    parser = Parser(
        prog='mystery_key.py', epilog='example: mystery_key.py 1-12',
        description='Prints the answers of mystery robots, for the instructor.')
    parser.add_argument('numbers', nargs='+', metavar='NUMBER',
                        help='such as 7 or 1-12; from 1 to {}'.format(LAST))
    try:
        rows = [(number,) + draw(number)[:2] for word in parser.parse_args(words).numbers
                for number in _range(word)]
    except ValueError as problem:
        print('mystery_key.py: {}'.format(problem), file=sys.stderr)
        return 2
    print('number  fault            value')
    for number, fault, value in rows:
        print('{:6}  {:15}  {} (within {:g})'.format(
            number, fault.name, shown(fault, value), fault.tolerance))
    return 0


def _range(word):
    """The numbers of '7' or '1-12'."""
    first, _, last = word.partition('-')
    if not (first.isdecimal() and (last or first).isdecimal()) or word.endswith('-'):
        raise ValueError('{!r} is not valid: a number such as 7, or a range such as 1-12'.format(
            word))
    numbers = range(int(first), int(last or first) + 1)
    if not numbers:
        raise ValueError('{!r} is not valid: the first number is larger than the last'.format(word))
    return numbers


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
