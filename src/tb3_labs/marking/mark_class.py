"""Marks the submissions of a class by the arguments of mark.py."""
import os
import shlex
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path
from typing import Sequence

from tb3_labs.command_line import failure_text, printable
from tb3_labs.marking.intake.archives import NotJudged
from tb3_labs.marking.intake.sandbox import (
    UNPROTECTED, OtherUser, Sandbox, protection_problem)
from tb3_labs.marking.intake.submissions import Submission, check_names, submissions_in
from tb3_labs.marking.labs.gamepad import pad_called
from tb3_labs.marking.marks import LABS, NOT_JUDGED, points_of, read_points
from tb3_labs.marking.marks_folder import MarksFolder, Options, failure, locked
from tb3_labs.marking.trial_runner import (
    POLL_PERIOD, MarkingInterrupted, TrialRunner, marking_environment, new_marks)


def print_line(line: str) -> None:
    """Print a line of progress. Several threads may call this function."""
    sys.stdout.write(printable(line) + '\n')
    sys.stdout.flush()


def print_problem(text: str) -> None:
    sys.stderr.write(f'mark.py: {printable(text)}\n')


class MarkedClass:
    """Marks the submissions of a class."""

    def __init__(self, runner: TrialRunner, retry: bool) -> None:
        """If `retry`, unchanged submissions are tried again, too."""
        self._runner = runner
        self._retry = retry
        #: Is there a submission without points?
        self._failed = False
        self._writing = threading.Lock()

    def mark_all(self, submissions: Sequence[Submission], jobs: int) -> bool:
        """Mark the submissions, `jobs` at a time. The marks of a submission are written as soon as
        its trial has ended. Returns True if a submission has no points."""
        tasks = []
        with ThreadPoolExecutor(jobs) as pool:
            try:
                for number, submission in enumerate(submissions, 1):
                    name = f'[{number}/{len(submissions)}] {submission.student}'
                    tasks.append(pool.submit(self._mark, submission, name))
                while wait(tasks, POLL_PERIOD).not_done:
                    if self._runner.interrupted.is_set():     # Python ignored the KeyboardInterrupt
                        raise KeyboardInterrupt
            except KeyboardInterrupt:
                self._failed = True
                self._runner.interrupted.set()
                for task in tasks:
                    task.cancel()
                print_problem('interrupted; the marks so far are written, and the same command '
                              'goes on from here')
        for task in tasks:
            problem = None if task.cancelled() else task.exception()
            if problem is not None:
                print_problem(failure_text(problem))      # the marks cannot be written
                self._failed = True
        return self._failed

    def _mark(self, submission, name):
        try:
            self._try_out(submission, name)
        except MarkingInterrupted:
            pass
        except NotJudged as problem:
            print_line(f'{name}: {NOT_JUDGED}')
            self._write(new_marks(submission, unjudged=str(problem)), '')
        except Exception as problem:    # an error with one submission must not end the marking
            print_problem(f'{name}: {NOT_JUDGED}: {failure(problem)}')
            self._write(new_marks(submission, unjudged=failure(problem)), '')

    def _try_out(self, submission, name):
        """Try a submission, unless it was tried before and has not changed. If the machine delayed
        the robot, the submission is tried a second time."""
        begun = time.monotonic()
        for is_first in (True, False):
            with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
                reading = self._runner.read(submission, Path(work))
                if is_first:
                    if not self._retry and self._is_kept(submission, reading.digest, name):
                        return
                    print_line(name + ' ...')
                tried = self._runner.try_out(submission, reading, Path(work))
            tried.seconds = time.monotonic() - begun
            marks = self._write(tried, reading.digest)
            if not marks.delay_sentence:
                break
            if is_first:
                print_line(f'{name}: the machine held the robot up for '
                           f'{marks.observation.longest_gap:.2f} s; tried again')
        print_line(f'{name}: {marks.points_text}, {tried.seconds:.0f} s')

    def _is_kept(self, submission, digest, name):
        """If the marks of an earlier trial can be kept, print the points and return True."""
        with self._writing:
            marks = self._runner.folder.marks_if_unchanged(submission.student, digest)
            if marks is None:
                return False
            self._failed = self._failed or not marks.is_known
        print_line(f'{name}: {marks.points_text}, tried before, and not changed')
        return True

    def _write(self, tried, digest):
        """Record a tried submission, and write its page. Returns the Marks with points."""
        with self._writing:
            marks = self._runner.folder.write(tried, digest)
            self._failed = self._failed or not marks.is_known
        return marks


# -- the command

def mark_class(arguments, interrupted: threading.Event) -> int:
    """Mark a class by the arguments of mark.py. Returns the exit status. If the event `interrupted`
    is set, all trials end. This function replaces the environment of the process by the environment
    of a separate ROS."""
    with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
        environment = marking_environment(Path(work) / 'ros', os.environ)
        os.environ.clear()
        os.environ.update(environment)
        try:
            parts = LABS[arguments.lab].read_parts(arguments.parts)
            worth = points_of(arguments.lab, read_points(arguments.points))
            pad_called(arguments.pad)       # ValueError for a pad that is not known
            submissions = _submissions(arguments)
            is_sandbox = _choose_protection(arguments, Path(work))
            with locked(arguments.folder):
                folder = MarksFolder(
                    arguments.folder, arguments.lab, parts, worth,
                    Options(arguments.package, arguments.type, arguments.pad, is_sandbox))
                folder.judge_kept_trials()
                failed = MarkedClass(TrialRunner(folder, interrupted),
                                     bool(arguments.only)).mark_all(submissions, arguments.jobs)
                with ThreadPoolExecutor(1) as pool:     # an interruption does not end this thread
                    page, notes = pool.submit(
                        folder.write_overview, unprotected=not is_sandbox).result()
        except (OSError, ValueError, NotJudged) as problem:
            print_problem(failure_text(problem))
            return 2
    if not is_sandbox:
        notes = notes[1:]       # the first note was printed before the trials
    for note in notes:
        print_line(note)
    if page is not None:
        print_line(f'Overview: {page}')
    return 1 if failed else 0


def _submissions(arguments):
    """Returns the Submissions to mark."""
    marks, source = arguments.folder.resolve(), arguments.submissions.resolve()
    if source.is_dir() and source in (marks, *marks.parents):
        raise ValueError(f'-o {arguments.folder}: the marks would lie among the submissions; give '
                         'a folder beside them')
    if not source.is_dir():
        raise ValueError(f'{arguments.submissions} is not a folder (a zip file of a class: unzip '
                         f'{shlex.quote(source.name)} -d submissions)')
    submissions = submissions_in(arguments.submissions.absolute(), print_problem)
    check_names(arguments.only, [submission.student for submission in submissions])
    return [submission for submission in submissions
            if not arguments.only or submission.student in arguments.only]


def _choose_protection(arguments, work):
    """Returns True if the programs of the submissions run in sandboxes. ``ValueError`` if sandboxes
    do not work on this computer, and no argument allows the marking without them."""
    problem = protection_problem(Sandbox([]))
    if not problem:
        return True
    if not arguments.unprotected:
        raise ValueError("nothing was started, since the submissions' programs cannot be kept in "
                         f'sandboxes here ({problem}); --unprotected marks without them: '
                         f'{UNPROTECTED}')
    print_line(f'{problem}. {UNPROTECTED}')
    work.chmod(0o711)       # OtherUser must read the prefix of ROS in this folder
    if os.geteuid() == 0:
        problem = protection_problem(OtherUser())
        if problem:
            raise ValueError(f'nothing was started: {problem}; this package must lie where every '
                             'user can read it, not in /root')
    return False
