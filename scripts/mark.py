#!/usr/bin/env python3
"""Marks a class's submissions by the criteria of their lab, on the simulated robot.

Usage: mark.py SUBMISSIONS --lab turn -o MARKS

SUBMISSIONS is a folder with a folder or a zip file for each student, as a learning platform makes
it. MARKS is a folder that gets marks.csv, overview.html, and for each student a page and a
results.json. A marked submission is not tried again until it changes. The instructors' page on
marking has more.
"""
import tb3_labs.ros.early_signals    # noqa: F401 (first, so that Ctrl+C works in later imports)

import signal
import threading
from pathlib import Path

from tb3_labs.command_line import Parser, whole_number
from tb3_labs.marking.labs.gamepad import HANDOUT_PAD
from tb3_labs.marking.mark_class import mark_class, print_problem
from tb3_labs.marking.marks import LABS
from tb3_labs.terminal import run_tool

#: The signals of Ctrl+C, of the command kill, and of a closed terminal.
END_SIGNALS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
INTERRUPTED = threading.Event()


def parse(argv):
    """Returns the command line's arguments."""
    parser = Parser(
        prog='mark.py', description="Marks a class's submissions. What has been marked and has not "
        'changed is not tried again: after an interruption, the same command goes on.')
    parser.add_argument('submissions', metavar='SUBMISSIONS', type=Path,
                        help='a folder with a folder or a zip file for each student')
    parser.add_argument('--lab', required=True, choices=sorted(LABS))
    parser.add_argument('-o', dest='folder', metavar='MARKS', type=Path, required=True,
                        help='folder for the marks and pages; marks in it are kept')
    parser.add_argument('--only', metavar='NAME', action='append', default=[],
                        help='try this student again, and no other; more than once for several')
    parser.add_argument('--points', type=Path, help='YAML file with the points of each criterion; '
                        'default: launch/checks/points.yaml of this package')
    parser.add_argument('--package', default='', metavar='NAME',
                        help="the node's package, if it has an unusual name")
    parser.add_argument('--type', default='', metavar='NAME',
                        help="the node's file, or its path as a line names it, if it is not found")
    parts = '; '.join(f"{name}: {', '.join(lab.parts)}" for name, lab in sorted(LABS.items()))
    parser.add_argument('--parts', default='',
                        help='these parts of the lab alone, with commas: ' + parts)
    parser.add_argument('--pad', default=HANDOUT_PAD, metavar='NAME',
                        help='for the lab gamepad: the numbers of the gamepad that is played, '
                        f'launch/params/pad_NAME.yaml; default: {HANDOUT_PAD}')
    parser.add_argument('--jobs', type=whole_number(16), default=1, metavar='N',
                        help='submissions at a time; each needs about one processor core')
    parser.add_argument('--unprotected', action='store_true', help='if sandboxes do not work here, '
                        "mark without: the submissions' programs can read and delete your files")
    return parser.parse_args(argv)


def main(argv):
    """Mark all submissions, and write the marks. Returns the exit status."""
    arguments = parse(argv)
    try:
        for number in END_SIGNALS:
            is_nohup = number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN
            if not is_nohup:
                signal.signal(number, interrupt)
        return mark_class(arguments, INTERRUPTED)
    except KeyboardInterrupt:
        print_problem('interrupted')
        return 130


def interrupt(*_):
    """Interrupt the marking. Further signals are ignored, since the marking must end its trials."""
    for number in END_SIGNALS:      # a signal during set() would block this process for ever
        signal.signal(number, lambda *_: None)
    INTERRUPTED.set()       # for the places where Python ignores KeyboardInterrupt
    raise KeyboardInterrupt


if __name__ == '__main__':
    run_tool(main)
