#!/usr/bin/env python3
"""Marks a class's submissions by the criteria of their lab, on the embedded robot.

Usage: mark.py SUBMISSIONS --lab turn -o MARKS

SUBMISSIONS is a folder with a folder or a zip file for each student, the zip file of a learning
platform, or a text file with a list of repositories. MARKS gets marks.csv, overview.html, and a
page of feedback and a results.json for each student. What has been marked there and has not changed
is not tried again. doc/instructor/marking.md tells more.
"""
import importlib.util
import os
import signal
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import asdict
from pathlib import Path

if importlib.util.find_spec('matplotlib') is None:    # the pages need it, and the set-up leaves it out
    sys.exit('mark.py: matplotlib is missing; install it: sudo apt install --no-install-recommends '
             'python3-matplotlib')

from tb3_labs.command_line import Parser, reason, seconds
from tb3_labs.marking.archives import Refused
from tb3_labs.marking.conduct import UNPROTECTED
from tb3_labs.marking.course import course_of
from tb3_labs.marking.foreign import printable
from tb3_labs.marking.handed_in import chosen
from tb3_labs.marking.labs import GAMEPAD, LABS
from tb3_labs.marking.marks import NOT_JUDGED
from tb3_labs.marking.points import points_of
from tb3_labs.ros.marking import box
from tb3_labs.ros.marking.intake import digest, submissions_from
from tb3_labs.ros.marking.marker import QUIET, Interrupted, Marker, Options
from tb3_labs.ros.marking.marks_folder import MarksFolder, due_time, late_by
from tb3_labs.ros.marking.pads import HANDOUT, pad_called
from tb3_labs.ros.marking.points_file import read_points
from tb3_labs.ros.marking.progress import Progress
from tb3_labs.ros.marking.sandbox import forget_overlays
from tb3_labs.simulation.network import NETWORKS


def parse(words):
    """The command line's arguments."""
    parser = Parser(
        prog='mark.py', description="Marks a class's submissions. What has been marked and has not "
        'changed is not tried again: after an interruption, the same command goes on.')
    parser.add_argument('submissions', metavar='SUBMISSIONS', type=Path,
                        help="a folder, a learning platform's zip file, or a list of repositories")
    parser.add_argument('--lab', required=True, choices=sorted(LABS))
    parser.add_argument('-o', dest='folder', metavar='MARKS', type=Path, required=True,
                        help='folder for the marks and pages; those in it are kept')
    parser.add_argument('--only', metavar='NAME', action='append', default=[],
                        help='try this student again, and no other; more than once for several')
    parser.add_argument('--anew', action='store_true', help='try everything again')
    parser.add_argument('--due', metavar='TIME', help='"2026-11-20 23:59"; what is newer is late')
    parser.add_argument('--points', type=Path, help='YAML file with the points of each criterion; '
                        'default: test/marking/points.yaml of this package')
    parser.add_argument('--package', default='', metavar='NAME', help="the node's package, if it is "
                        'not called as usual')
    parser.add_argument('--type', default='', metavar='NAME', help="the node's file, if it is not "
                        'called as usual')
    parser.add_argument('--parts', default='', help='these parts of the lab alone, with commas: '
                        + '; '.join('{}: {}'.format(name, ', '.join(lab.parts))
                        for name, lab in sorted(LABS.items())))
    parser.add_argument('--limit', type=seconds, default=300.0, metavar='SECONDS',
                        help='for one submission; default: %(default)g')
    parser.add_argument('--network', choices=list(NETWORKS), default=QUIET,
                        help='between robot and node; default: %(default)s')
    parser.add_argument('--pad', metavar='NAME', help='for the lab {}: numbers of the gamepad that is '
                        'played, launch/params/pad_NAME.yaml; default: {}'.format(GAMEPAD, HANDOUT))
    parser.add_argument('--jobs', type=int, default=1, choices=range(1, 17), metavar='N',
                        help='submissions at a time; each needs about one processor core')
    parser.add_argument('--unprotected', action='store_true', help='mark without boxes: the '
                        "submissions' programs can read and delete your files")
    return parser.parse_args(words)


def main(words):
    """Mark all submissions, write the marks; the exit status."""
    given = parse(words)
    sys.stdout.reconfigure(errors='backslashreplace')    # not every terminal has every letter
    forget_overlays()
    lab = LABS[given.lab]
    with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
        try:
            parts = lab.checked_parts(given.parts)
            due = due_time(given.due) if given.due else None
            table = read_points(given.points)
            worth, rows = points_of(given.lab, lab.criteria, table), course_of(given.lab, table)
            check_place(given.submissions, given.folder)
            found = submissions_from(given.submissions, work, tell_problem)
            if given.only:
                names = chosen([submission.student for submission in found], given.only)
                found = [submission for submission in found if submission.student in names]
            options = Options(given.package, given.type, given.limit, given.network,
                              checked_pad(given.lab, given.pad), not given.unprotected)
            check_boxes(given.unprotected)
            folder = MarksFolder(given.folder, given.lab, parts, worth, rows, asdict(options))
        except (OSError, ValueError, Refused) as problem:
            tell_problem(problem)
            return 2
        marker = Marker(given.lab, worth, folder.logs, parts, options)
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        marking = Marking(marker, folder, due, given.anew or bool(given.only))
        failed = marking.mark_all(found, given.jobs)
    try:
        page, notes = folder.write_overview(given.unprotected)
    except (OSError, ValueError) as problem:
        tell_problem(problem)
        return 2
    for note in notes[given.unprotected:]:      # the first was told at the beginning
        tell(note)
    if page is not None:
        tell('Overview: {}'.format(page))
    for student, modules in marking.lacking:
        tell('Not judged: {} (this machine lacks {})'.format(student, ' and '.join(modules)))
    return 1 if failed else 0


def checked_pad(lab, pad):
    """The name of the pad to be played; ``ValueError`` for an unknown one, or for another lab."""
    if pad and lab != GAMEPAD:
        raise ValueError('--pad is for --lab {} alone'.format(GAMEPAD))
    pad_called(pad or HANDOUT)
    return pad or HANDOUT


def check_place(submissions, marks):
    """``ValueError`` if the marks would lie among the submissions: they would be marked next."""
    inside = Path(os.path.realpath(str(marks)))
    outside = Path(os.path.realpath(str(submissions)))
    if outside.is_dir() and outside in (inside, *inside.parents):
        raise ValueError('-o {}: the marks would lie among the submissions; give a folder beside '
                         'them'.format(marks))


def check_boxes(unprotected):
    """Say that there is no protection; ``ValueError`` if that is not wanted, and boxes do not work
    here."""
    if unprotected:
        tell(UNPROTECTED)
    elif box.problem():
        raise ValueError('{}: programs of strangers cannot be kept in boxes here; nothing was '
                         'started. --unprotected marks without: {}'.format(
                             box.problem(), UNPROTECTED))


#: Of all submissions that are marked now.
PROGRESS = Progress(sys.stdout)


class Marking:
    """Marks submissions, several at a time, and tells of each."""

    def __init__(self, marker, folder, due, anew):
        """`due`: a datetime, or None; `anew`: try also what has been marked and has not changed."""
        self._marker, self._folder, self._due, self._anew = marker, folder, due, anew
        #: (student, modules) of those that were not judged, since this machine lacks modules.
        self.lacking = []
        self._failed, self._unchanged = False, 0
        self._writing = threading.Lock()

    def mark_all(self, submissions, jobs):
        """Mark them, `jobs` at a time, and write each one's marks as soon as it has them; whether
        anything failed."""
        with ThreadPoolExecutor(jobs) as pool:
            tasks = [pool.submit(self._mark, submission, '[{}/{}] {}'.format(
                number, len(submissions), submission.student)) for number, submission
                in enumerate(submissions, 1)]
            try:
                wait(tasks)
            except KeyboardInterrupt:
                tell_problem('interrupted; the marks so far are written, and the same command '
                             'goes on from here')
                self._failed = True
                for task in tasks:
                    task.cancel()
                self._marker.interrupt()
        for task in tasks:
            if not task.cancelled() and task.exception() is not None:
                tell_problem(task.exception())      # its marks cannot be written
                self._failed = True
        if self._unchanged:
            tell('{} of {} had been marked and have not changed (--anew tries them again)'.format(
                self._unchanged, len(submissions)))
        return self._failed

    def _mark(self, submission, name):
        try:
            self._write(*self._marked(submission, name))
        except Interrupted:
            pass
        except Exception as problem:    # whatever a submission brings about: the others are marked
            said = '{} ({})'.format(reason(problem), type(problem).__name__)
            tell_problem('{}: not judged: {}'.format(name, said))
            self._write(self._marker.not_judged(
                submission.student, 'The marking of it failed: {}.'.format(said)), '')
        finally:
            PROGRESS.done(name)

    def _write(self, marks, what):
        """Write Marks; `what`: the digest of what was tried, None if it was not tried again."""
        with self._writing:
            if what is None:
                self._unchanged += 1
            else:
                self._folder.write(marks, what, self._marker.held_up(marks) or marks.failed)
            if marks.lacking:
                self.lacking.append((marks.student, marks.lacking))
            self._failed = self._failed or marks.failed

    def _marked(self, submission, name):
        """(Marks, digest of what was tried), or (Marks, None) if it was not tried again."""
        begun = time.monotonic()
        with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
            folder, remarks = submission.lay_out(work)
            what, late = digest(folder), self._late(submission)
            marks = None if self._anew else self._folder.kept(submission.student, what)
            if marks is not None:
                self._folder.set_late(submission.student, late)
                tell('{}: {:g} of {:g} points, marked before'.format(
                    name, marks.points, marks.worth))
                return marks, None
            tell_trying(name)
            marks = self._marker.mark(
                folder, lambda words: tell('{}: {}'.format(name, words)),
                lambda words: tell_trying(name, words, time.monotonic() - begun))
        marks.remarks[:0] = remarks
        marks.late, marks.seconds = late, time.monotonic() - begun
        tell('{}: {}, {:.0f} s{}'.format(
            name, '{:g} of {:g} points'.format(marks.points, marks.worth) if marks.judged
            else NOT_JUDGED, marks.seconds, ', late' * bool(late)))
        return marks, what

    def _late(self, submission):
        if submission.late:
            return 'Late, as the learning platform says.'
        return late_by(self._due, *submission.handed_in_at()) if self._due else ''


def tell(line):
    """Print a line that stays."""
    PROGRESS.line(printable(line))


def tell_trying(name, words='', seconds=0.0):
    """Print what is tried of a submission: each part, and on a terminal each step and the time."""
    part, _, step = words.partition(': ')
    if part:
        PROGRESS.now(name, '{}: {}'.format(name, part), ', {}, {:.0f} s'.format(step, seconds))
    else:
        PROGRESS.now(name, name + ' ...', ' {:.0f} s'.format(seconds))


def tell_problem(problem):
    """Print why something was not done."""
    print('mark.py: {}'.format(printable(reason(problem))), file=sys.stderr)


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
