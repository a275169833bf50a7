#!/usr/bin/env python3
"""Makes a report of recorded runs: paths, errors, speeds and tables, as a page, PNG and CSV.

Usage: lab_report.py RUN.bag [RUN2.bag ...] [-o FOLDER] [--goal X Y YAW_DEG] [--ns ROBOT]
                     [--model MODEL]

Record with
    roslaunch tb3_labs record.launch
Any bag with sensor_msgs/Imu and nav_msgs/Odometry will do. Drives and turns are found in goal_state
or, for a node of your own, in cmd_vel; resets in the line `Local pose set to x=..., y=..., yaw=...`
on /rosout. Several runs make one page that compares them, and a page for each.
"""
import sys
import time

from tb3_labs.command_line import Parser, number_or_text
from tb3_labs.geometry.se2 import TypedPose
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS, robot_model

#: Time between two lines of progress where the output is no terminal [s].
LINE_PERIOD = 2.0


class ProgressLine:
    """Progress on stderr: on a terminal one line that is overwritten, else a new line at times."""

    def __init__(self):
        self._terminal = sys.stderr.isatty()
        self._said_at, self._open = time.monotonic(), False

    def step(self, what):
        """A function that takes the share of `what` that is done, 0 to 1."""
        def hear(fraction):
            text = '{}: {:3.0f} %'.format(what, 100.0 * fraction)
            if self._terminal:
                print('\r' + text, end='', file=sys.stderr, flush=True)
                self._open = True
            elif time.monotonic() - self._said_at >= LINE_PERIOD:
                self._said_at = time.monotonic()
                print(text, file=sys.stderr, flush=True)
            if fraction >= 1.0:
                self.end()
        return hear

    def end(self):
        """End the line, if one is begun."""
        if self._open:
            print(file=sys.stderr)
            self._open = False


def parse(words):
    """The command line's arguments."""
    parser = Parser(
        prog='lab_report.py', description='Makes a report of a recorded run of a TurtleBot3; of '
        'several runs one page that compares them, and a page for each.',
        epilog='Example: lab_report.py lab.bag precise.bag -o compared')
    parser.add_argument('bags', metavar='RUN.bag', nargs='+')
    parser.add_argument('-o', dest='folder', help='where to write; default: RUN_report beside it; '
                        'for several runs: runs_report beside the first')
    parser.add_argument('--goal', nargs=3, type=number_or_text, metavar=('X', 'Y', 'YAW_DEG'),
                        help='goal in the local frame [m, m, deg] of drives whose goal was not '
                        "recorded; default: the lab's, -0.61 0.61 0")
    parser.add_argument('--ns', metavar='ROBOT', help='namespace of the robot, / for none')
    parser.add_argument('--model', choices=sorted(MODELS), default=DEFAULT_MODEL,
                        help='whose limits are drawn; default: %(default)s')
    given = parser.parse_args(words)
    if given.goal is not None:
        try:
            TypedPose(*given.goal)
        except ValueError as problem:
            parser.error('--goal: {}'.format(problem))
    return given


def main(words):
    """Read, draw, write; the exit status."""
    arguments = parse(words)
    try:
        from tb3_labs.ros.bags import reports
    except ImportError as problem:
        return _fail('{}; install it: sudo apt install --no-install-recommends python3-{}'.format(
            problem, (problem.name or 'matplotlib').split('.')[0]))
    line = ProgressLine()
    try:
        page, problems = reports.write(
            arguments.bags, arguments.folder, robot_model(arguments.model), arguments.ns,
            arguments.goal, line.step)
    except OSError as problem:
        line.end()
        return _fail('cannot write the report to {}: {}; choose another folder with -o'.format(
            problem.filename or arguments.folder, problem.strerror or problem))
    except KeyboardInterrupt:
        line.end()
        return 130
    line.end()
    for problem in problems:
        _fail(problem)
    if page is not None:
        print('Report: {}'.format(page))
    return 1 if problems else 0


def _fail(problem):
    print('lab_report.py: {}'.format(problem), file=sys.stderr)
    return 1


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
