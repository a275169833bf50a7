#!/usr/bin/env python3
"""Makes a report of a recorded run: paths, errors, speeds and tables, as a page, PNG and CSV.

Usage: lab_report.py RUN.bag [-o FOLDER] [--ns ROBOT] [--model MODEL]

Record with
    rosbag record /imu /odom /cmd_vel /local_pose /goal_state /current_goal /ground_truth /tf
Any other bag with sensor_msgs/Imu and nav_msgs/Odometry gets a report without drives.
"""
import argparse
import os
import sys
import time

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
    parser = argparse.ArgumentParser(
        prog='lab_report.py', description='Makes a report of a recorded run of a TurtleBot3.')
    parser.add_argument('bag', metavar='RUN.bag')
    parser.add_argument('-o', dest='folder', help='where to write; default: RUN_report beside it')
    parser.add_argument('--ns', metavar='ROBOT', help='namespace of the robot, / for none')
    parser.add_argument('--model', choices=sorted(MODELS), default=DEFAULT_MODEL,
                        help='whose limits are drawn; default: %(default)s')
    return parser.parse_args(words)


def main(words):
    """Read, draw, write; the exit status."""
    arguments = parse(words)
    try:
        from tb3_labs.report.page import write_report
        from tb3_labs.ros.bags.reader import BagProblem, read_run
    except ImportError as problem:
        return _fail('{}; install what is missing: sudo apt install python3-matplotlib '
                     'python3-rosbag'.format(problem))
    folder = arguments.folder or os.path.splitext(arguments.bag)[0] + '_report'
    line = ProgressLine()
    try:
        run = read_run(arguments.bag, arguments.ns, line.step('reading'))
        page = write_report(run, robot_model(arguments.model), folder, line.step('drawing'))
    except BagProblem as problem:
        line.end()
        return _fail(problem)
    except OSError as problem:
        line.end()
        return _fail('cannot write the report to {}: {}; choose another folder with -o'.format(
            folder, problem.strerror or problem))
    except KeyboardInterrupt:
        line.end()
        return 130
    print('Report: {}'.format(page))
    return 0


def _fail(problem):
    print('lab_report.py: {}'.format(problem), file=sys.stderr)
    return 1


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
