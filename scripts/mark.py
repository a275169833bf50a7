#!/usr/bin/env python3
"""Marks a class's submissions by the criteria of their lab, on the simulated robot.

Usage: mark.py SUBMISSIONS --lab turn -o MARKS

SUBMISSIONS is a folder with a folder or a zip file for each student, or the zip file of a learning
platform. MARKS gets marks.csv, overview.html, and a
page of feedback and a results.json for each student. A submission that has been marked there, and
has not changed, is not tried again. doc/instructor/marking.md tells more.
"""
import os
import signal
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

from tb3_labs.command_line import Parser, printable, reason
from tb3_labs.marking import sandbox
from tb3_labs.marking.intake import Refused, submissions_from
from tb3_labs.marking.marks import GAMEPAD, LABS, points_of, read_points
from tb3_labs.marking.marks_folder import MarksFolder
from tb3_labs.marking.names import chosen
from tb3_labs.marking.processes import forget_overlays
from tb3_labs.marking.gamepad import HANDOUT, pad_called
from tb3_labs.marking.ros_marker import MarkedClass, Marker, Options, tell

#: Signals that end the marking: Ctrl+C, the command kill, a terminal that is closed.
ENDS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


def parse(words):
    """The command line's arguments."""
    parser = Parser(
        prog='mark.py', description="Marks a class's submissions. What has been marked and has not "
        'changed is not tried again: after an interruption, the same command goes on.')
    parser.add_argument('submissions', metavar='SUBMISSIONS', type=Path,
                        help="a folder, or a learning platform's zip file")
    parser.add_argument('--lab', required=True, choices=sorted(LABS))
    parser.add_argument('-o', dest='folder', metavar='MARKS', type=Path, required=True,
                        help='folder for the marks and pages; marks in it are kept')
    parser.add_argument('--only', metavar='NAME', action='append', default=[],
                        help='try this student again, and no other; more than once for several')
    parser.add_argument('--points', type=Path, help='YAML file with the points of each criterion; '
                        'default: launch/checks/points.yaml of this package, if MARKS has no others')
    parser.add_argument('--package', default='', metavar='NAME',
                        help="the node's package, if it has an unusual name")
    parser.add_argument('--type', default='', metavar='NAME',
                        help="the node's file, if it has an unusual name")
    parser.add_argument('--parts', default='', help='these parts of the lab alone, with commas: '
                        + '; '.join('{}: {}'.format(name, ', '.join(lab.parts))
                        for name, lab in sorted(LABS.items())))
    parser.add_argument('--pad', metavar='NAME', default=HANDOUT,
                        help='for the lab {}: numbers of the gamepad that is played, '
                        'launch/params/pad_NAME.yaml; default: %(default)s'.format(GAMEPAD))
    parser.add_argument('--jobs', type=int, default=1, choices=range(1, 17), metavar='N',
                        help='submissions at a time; each needs about one processor core')
    parser.add_argument('--unprotected', action='store_true', help='mark without sandboxes: the '
                        "submissions' programs can read and delete your files")
    return parser.parse_args(words)


def main(words):
    """Mark all submissions, and write the marks. Returns the exit status."""
    given = parse(words)
    for each in ENDS:
        if signal.getsignal(each) != signal.SIG_IGN:        # nohup ignores SIGHUP
            signal.signal(each, interrupt)
    try:
        return mark(given)
    except KeyboardInterrupt:
        tell_problem('interrupted')
        return 130


def interrupt(number, _):
    """Interrupt the marking, once: the tidying up must not be interrupted."""
    for each in ENDS:
        signal.signal(each, signal.SIG_IGN)
    if number == signal.SIGHUP:     # else each word to the closed terminal would be an error
        for stream in (1, 2):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    raise KeyboardInterrupt


def mark(given):
    """Mark as the command line's arguments say. Returns the exit status."""
    sys.stdout.reconfigure(errors='backslashreplace')    # not every terminal has every letter
    forget_overlays()
    with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
        try:
            lab = LABS[given.lab]
            parts = lab.checked_parts(given.parts)
            worth = points_of(given.lab, read_points(given.points))
            check_place(given.submissions, given.folder)
            found = submissions_from(given.submissions, work, tell_problem)
            if given.only:
                names = chosen([submission.student for submission in found], given.only)
                found = [submission for submission in found if submission.student in names]
            check_lab(given)
            options = Options(given.package, given.type, given.pad, not given.unprotected)
            check_sandboxes(given.unprotected)
            folder = MarksFolder(given.folder, given.lab, parts, worth, asdict(options),
                                 given.points is not None)
        except (OSError, ValueError, Refused) as problem:
            tell_problem(reason(problem))
            return 2
        marked = MarkedClass(Marker(given.lab, worth, folder.logs, parts, options), folder,
                             bool(given.only), tell_problem)
        failed = marked.mark_all(found, given.jobs)
    try:
        page, notes = folder.write_overview(given.unprotected)
    except (OSError, ValueError) as problem:
        tell_problem(reason(problem))
        return 2
    for note in notes[given.unprotected:]:      # the note on --unprotected was printed before
        tell(note)
    if page is not None:
        tell('Overview: {}'.format(page))
    return 1 if failed else 0


def check_lab(given):
    """Raises ``ValueError`` for an unknown pad, and for an option of another lab."""
    if given.pad != HANDOUT and given.lab != GAMEPAD:
        raise ValueError('--pad is for --lab {} alone'.format(GAMEPAD))
    pad_called(given.pad)


def check_place(submissions, marks):
    """Raises ``ValueError`` if the marks would lie among the submissions, and be marked, too."""
    inside, outside = marks.resolve(), submissions.resolve()
    if outside.is_dir() and outside in (inside, *inside.parents):
        raise ValueError('-o {}: the marks would lie among the submissions; give a folder beside '
                         'them'.format(marks))


def check_sandboxes(unprotected):
    """If `unprotected`, print that there is no protection. Otherwise raise ``ValueError`` if
    sandboxes do not work here."""
    if unprotected:
        tell(sandbox.UNPROTECTED)
    elif sandbox.problem():
        raise ValueError("{}: the submissions' programs cannot be kept in sandboxes here; nothing "
                         'was started. --unprotected marks without: {}'.format(
                             sandbox.problem(), sandbox.UNPROTECTED))


def tell_problem(words):
    """Print why something was not done."""
    print('mark.py: {}'.format(printable(words)), file=sys.stderr)


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
