"""The order of starts decides nothing: a table of all orders of robot, move_to_goal, gamepad and panel, with and
without a pause between them.

With ~has_control:=true the robot drives in each order, without it the robot stands.

Usage: starts.py [number of orders that are tried side by side, default 2]
"""
import itertools
import os
import sys
from concurrent.futures import ThreadPoolExecutor

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), '..', 'ros'))
from costs import benchmark
from starts import Stage

FOUR = 'turtlebot3', 'move_to_goal', 'gamepad', 'panel'
#: Time from one start to the next [s].
APART = 0.0, 0.4, 1.2
EXPECTED = {True: 'drives', False: 'stands'}
ROW = '{:45}' + 6 * ' {:>11}'


def outcome(order, has_control, apart):
    """The outcome of one start, in words."""
    with Stage() as stage:
        stage.start_all(order, apart, has_control)
        return stage.outcome(EXPECTED[has_control])


def main(side_by_side):
    """Print the table; returns the number of outcomes that were not as expected."""
    cases = list(itertools.product((True, False), APART))
    wrong = 0
    with benchmark(), ThreadPoolExecutor(side_by_side) as pool:
        print(ROW.format('has_control', *('true' if given else 'false' for given, _ in cases)))
        print(ROW.format('order, by so many seconds apart', *(apart for _, apart in cases)))
        orders = list(itertools.permutations(FOUR))
        asked = [[pool.submit(outcome, order, *case) for case in cases] for order in orders]
        for order, row in zip(orders, asked):
            words = [each.result() for each in row]
            wrong += sum(word != EXPECTED[given] for word, (given, _) in zip(words, cases))
            print(ROW.format(' '.join(order), *words), flush=True)
        print('{} starts, {} otherwise than expected'.format(len(orders) * len(cases), wrong))
    return wrong


if __name__ == '__main__':
    sys.exit(bool(main(int(sys.argv[1]) if len(sys.argv) > 1 else 2)))
