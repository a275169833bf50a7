#!/usr/bin/env python3
"""Marks a class's submissions by the criteria of their lab, on the simulated robot.

Usage: mark.py SUBMISSIONS --lab turn -o MARKS

SUBMISSIONS is a folder from a learning platform, with a folder or a zip file for each student.
mark.py writes marks.csv, overview.html, and each student's page and results.json into the folder
MARKS. A marked submission is tried again only after a change. The instructors' page on marking
explains the details.
"""
import os
import shlex
import signal
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path

from tb3_labs.command_line import Parser, error_text, printable
from tb3_labs.marking.intake.archives import NotJudged
from tb3_labs.marking.intake.sandbox import (
    NO_SANDBOX_WARNING, OtherUser, Sandbox, protection_problem)
from tb3_labs.marking.intake.submissions import refuse_unknown_names, submissions_in
from tb3_labs.marking.labs.gamepad import HANDOUT_PAD, pad_called
from tb3_labs.marking.marks import LABS, NOT_JUDGED, points_of, read_points
from tb3_labs.marking.marks_folder import MarksFolder, Options, error_sentence, locked
from tb3_labs.marking.trial_runner import (
    POLL_PERIOD, MarkingInterrupted, TrialRunner, make_marking_environment, marks_before_trial)
from tb3_labs.safe_output import run_tool

#: These signals come from Ctrl+C, the command kill, and a closed terminal.
END_SIGNALS = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
INTERRUPTED = threading.Event()


def parse(argv):
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
                        help='only these parts of the lab, with commas: ' + parts)
    parser.add_argument('--pad', default=HANDOUT_PAD, metavar='NAME',
                        help='for the lab gamepad: the numbers of the gamepad that is played, '
                        f'launch/params/pad_NAME.yaml; default: {HANDOUT_PAD}')
    parser.add_argument('--jobs', type=int, choices=range(1, 17), default=1, metavar='N',
                        help='submissions at a time; each needs about one processor core')
    parser.add_argument('--unprotected', action='store_true', help='if sandboxes do not work here, '
                        "mark without: the submissions' programs can read and delete your files")
    return parser.parse_args(argv)


def main(argv):
    """Mark all submissions and write the marks. Returns the exit status."""
    arguments = parse(argv)
    with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
        try:
            for number in END_SIGNALS:
                is_nohup = number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN
                if not is_nohup:
                    signal.signal(number, interrupt)
            return mark_class(arguments, Path(work))
        except (OSError, ValueError, NotJudged) as error:
            print_error(error_text(error))
            return 2
        except KeyboardInterrupt:
            print_error('interrupted')
            return 130


def mark_class(arguments, work):
    """Mark a class in the environment of a separate ROS, with temporary files in the folder `work`.
    Returns the exit status."""
    environment = make_marking_environment(work / 'ros', os.environ)
    os.environ.clear()
    os.environ.update(environment)

    parts = LABS[arguments.lab].read_parts(arguments.parts)
    criterion_points = points_of(arguments.lab, read_points(arguments.points))
    pad_called(arguments.pad)       # raises ValueError for an unknown pad
    submissions = _chosen_submissions(arguments)
    has_sandbox = _choose_protection(arguments, work)
    options = Options(arguments.package, arguments.type, arguments.pad, has_sandbox)

    with locked(arguments.folder):
        folder = MarksFolder(arguments.folder, arguments.lab, parts, criterion_points, options,
                             is_for_class=not arguments.only)
        marker = ClassMarker(TrialRunner(folder, INTERRUPTED), must_retry=bool(arguments.only))
        has_failed = marker.mark_all(submissions, arguments.jobs)
        with ThreadPoolExecutor(1) as pool:     # Ctrl+C does not interrupt a thread of a pool
            page, notes = pool.submit(folder.write_overview).result()
    for note in notes:
        print_line(note)
    if page is not None:
        print_line(f'Overview: {page}')
    return int(has_failed)


def _chosen_submissions(arguments):
    marks_folder = arguments.folder.resolve()
    folder = arguments.submissions.resolve()
    if not folder.exists():
        raise ValueError(f'{arguments.submissions} does not exist')
    if not folder.is_dir():
        raise ValueError(f'{arguments.submissions} is not a folder (a zip file of a class: unzip '
                         f'{shlex.quote(folder.name)} -d submissions)')
    if folder in (marks_folder, *marks_folder.parents):
        raise ValueError(f'-o {arguments.folder}: the marks would lie among the submissions; give '
                         'a folder beside them')
    submissions = submissions_in(arguments.submissions.absolute(), print_error)
    refuse_unknown_names(arguments.only, [submission.student for submission in submissions])
    if not arguments.only:
        return submissions
    return [submission for submission in submissions if submission.student in arguments.only]


def _choose_protection(arguments, work):
    """Returns True if sandboxes work on this computer. If sandboxes do not work, returns False if
    the user typed --unprotected, and raises ``ValueError`` if the user did not."""
    problem = protection_problem(Sandbox([]))
    if not problem:
        return True
    if not arguments.unprotected:
        raise ValueError("nothing was started, since the submissions' programs cannot be kept in "
                         f'sandboxes here ({problem}); --unprotected marks without them: '
                         f'{NO_SANDBOX_WARNING}')
    print_line(f'{problem}: the marking goes on without sandboxes.')
    work.chmod(0o711)       # so that OtherUser can enter this folder
    if os.geteuid() == 0:
        problem = protection_problem(OtherUser())
        if problem:
            raise ValueError(f'nothing was started: {problem}; this package must lie where every '
                             'user can read it, not in /root')
    return False


def interrupt(*_):
    """Interrupt the marking. Later signals are ignored, so that the marking can end its trials."""
    # the signals are ignored first, because a signal during set() would block this process for ever
    for number in END_SIGNALS:
        signal.signal(number, lambda *_: None)
    # the event also tells of the interruption where Python ignores the KeyboardInterrupt
    INTERRUPTED.set()
    raise KeyboardInterrupt


def print_line(line):
    sys.stdout.write(printable(line) + '\n')      # in one call, since several threads print
    sys.stdout.flush()


def print_error(text):
    sys.stderr.write(f'mark.py: {printable(text)}\n')


class ClassMarker:
    """Marks the submissions of a class."""

    def __init__(self, runner, must_retry):
        """If `must_retry` is true, the marker also tries unchanged submissions again."""
        self._runner = runner
        self._must_retry = must_retry
        self._has_failed = False        # True if a submission has no points
        self._lock = threading.Lock()

    def mark_all(self, submissions, jobs):
        """Mark at most `jobs` submissions at the same time. Returns True if a submission has no
        points."""
        tasks = []
        with ThreadPoolExecutor(jobs) as pool:
            try:
                for number, submission in enumerate(submissions, 1):
                    label = f'[{number}/{len(submissions)}] {submission.student}'
                    tasks.append(pool.submit(self._mark_submission, submission, label))
                self._wait_for(tasks)
            except KeyboardInterrupt:
                self._has_failed = True
                self._runner.interrupted.set()
                for task in tasks:
                    task.cancel()
                print_error('interrupted; the marks so far are written, and the same command '
                            'goes on from here')
        for task in tasks:
            if not task.cancelled() and task.exception() is not None:
                print_error(error_text(task.exception()))      # the marks cannot be written
                self._has_failed = True
        return self._has_failed

    def _wait_for(self, tasks):
        while wait(tasks, POLL_PERIOD).not_done:
            if self._runner.interrupted.is_set():     # Python ignored the KeyboardInterrupt
                raise KeyboardInterrupt

    def _mark_submission(self, submission, label):
        try:
            self._mark_if_changed(submission, label)
        except MarkingInterrupted:
            pass
        except NotJudged as error:
            print_line(f'{label}: {NOT_JUDGED}')
            self._write_marks(marks_before_trial(submission, str(error), error.advice), '')
        except Exception as error:    # an error with one submission must not end the marking
            reason = error_sentence(error)
            print_error(f'{label}: {NOT_JUDGED}: {reason}')
            self._write_marks(marks_before_trial(submission, reason), digest='')

    def _mark_if_changed(self, submission, label, is_second=False):
        """Mark a submission if the submission is new, has changed, or must be tried again. If the
        computer was too slow for the simulated robot, try the submission a second time."""
        begin = time.monotonic()
        with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
            parsed = self._runner.read(submission, Path(work))
            if not (self._must_retry or is_second):
                with self._lock:
                    old_marks = self._runner.folder.write_if_unchanged(
                        submission.student, parsed.digest)
                if old_marks is not None:
                    print_line(f'{label}: {old_marks.points_text}, tried before, and not changed')
                    return
                print_line(label + ' ...')
            trial_marks = self._runner.try_out(submission, parsed, Path(work))
        trial_marks.seconds = time.monotonic() - begin
        marks = self._write_marks(trial_marks, parsed.digest)
        if marks.delay_sentence and not is_second:
            print_line(f'{label}: {marks.delay_sentence} Tried again.')
            self._mark_if_changed(submission, label, is_second=True)
        else:
            print_line(f'{label}: {marks.points_text}, {marks.seconds:.0f} s')

    def _write_marks(self, trial_marks, digest):
        with self._lock:
            marks = self._runner.folder.write_student(trial_marks, digest)
            if not marks.has_known_points:
                self._has_failed = True
        return marks


if __name__ == '__main__':
    run_tool(main)
