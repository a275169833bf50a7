"""A class whose submissions are marked: the way in for mark.py."""
import os
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Callable, Sequence

from tb3_labs.command_line import printable, reason
from tb3_labs.marking.intake.archives import is_zip
from tb3_labs.marking.intake.find_node import NotJudged
from tb3_labs.marking.intake.read_submission import unpack_class
from tb3_labs.marking.intake.sandbox import UNPROTECTED
from tb3_labs.marking.intake.sandbox import problem as sandbox_problem
from tb3_labs.marking.intake.submissions import (
    Submission, students_named, submissions_in, without_wrapping)
from tb3_labs.marking.marks import LABS, NOT_JUDGED, Marks, points_of, read_points
from tb3_labs.marking.marks_folder import MarksFolder, alone_in
from tb3_labs.marking.trial_runner import (
    POLL_PERIOD, MarkingInterrupted, Options, TrialRunner, handed_in, ros_alone)


def print_line(line: str) -> None:
    """Print a line of progress; several threads may do so."""
    sys.stdout.write(printable(line) + '\n')
    sys.stdout.flush()


class MarkedClass:
    """A class whose submissions are marked."""

    def __init__(self, runner: TrialRunner, retry: bool,
                 print_problem: Callable[[str], None]) -> None:
        """`retry`: repeat all trials, also of submissions that were marked and have not changed."""
        self._runner, self._folder, self._retry = runner, runner.folder, retry
        self._print_problem = print_problem
        self._failed, self._unchanged = False, 0
        self._writing = threading.Lock()

    def mark_all(self, submissions: Sequence[Submission], jobs: int) -> bool:
        """Mark the submissions, `jobs` at a time; write the marks of each as soon as it is marked.

        Returns True if one of them was not judged.
        """
        tasks = []
        with ThreadPoolExecutor(jobs) as pool:
            try:
                for number, submission in enumerate(submissions, 1):
                    tasks.append(pool.submit(self._mark, submission, '[{}/{}] {}'.format(
                        number, len(submissions), submission.student)))
                while wait(tasks, POLL_PERIOD).not_done:
                    if self._runner.interrupted.is_set():     # where a signal's exception was lost
                        raise KeyboardInterrupt
            except KeyboardInterrupt:
                self._failed = True
                self._runner.interrupted.set()
                for task in tasks:
                    task.cancel()
                self._print_problem('interrupted; the marks so far are written, and the same '
                                    'command goes on from here')
        for task in tasks:
            problem = None if task.cancelled() else task.exception()
            if problem is not None:
                self._print_problem(reason(problem))     # its marks cannot be written
                self._failed = True
        if self._unchanged:
            print_line('{} of {} had been tried and have not changed (--only NAME tries one again)'
                       .format(self._unchanged, len(submissions)))
        return self._failed

    def _mark(self, submission, name):
        try:
            self._try(submission, name)
        except MarkingInterrupted:
            pass
        except NotJudged as problem:
            print_line(f'{name}: {NOT_JUDGED}')
            self._write(handed_in(submission, unjudged=str(problem)), '')
        except Exception as problem:    # any error: the other submissions are still marked
            why = f'{reason(problem)} ({type(problem).__name__})'
            self._print_problem(f'{name}: {NOT_JUDGED}: {why}')
            self._write(handed_in(submission, unjudged=f'The marking of it failed: {why}.'), '')

    def _try(self, submission, name):
        """Mark one submission; try it unless it was tried before and has not changed."""
        begun = time.monotonic()
        for is_last in (False, True):       # once more if the machine held up the robot
            with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
                reading = self._runner.read(submission, Path(work))
                if not (self._retry or is_last):
                    with self._writing:
                        kept = self._folder.kept(submission.student, reading.digest)
                        self._unchanged += kept is not None
                        self._failed = self._failed or kept is not None and not kept.is_known
                    if kept is not None:
                        print_line(f'{name}: {as_text(kept)}, tried before')
                        return
                if not is_last:
                    print_line(name + ' ...')
                found = self._runner.try_out(submission, reading, Path(work))
            marks = self._folder.judged(found)
            if not marks.delayed:
                break
            if not is_last:
                print_line('{}: the machine held the robot up for {:.2f} s; tried again'.format(
                    name, marks.observation.longest_gap))
        found.seconds = time.monotonic() - begun
        self._write(found, '' if marks.delayed or marks.unjudged else reading.digest)
        print_line(f'{name}: {as_text(marks)}, {found.seconds:.0f} s')

    def _write(self, found, digest):
        """Keep what was found of a submission; `digest`: '' if it is to be tried again."""
        with self._writing:
            marks = self._folder.write(found, digest)
            self._failed = self._failed or not marks.is_known


def as_text(marks: Marks) -> str:
    """The points, or that there are none."""
    return f'{marks.points:g} of {marks.worth:g} points' if marks.is_known else NOT_JUDGED


# -- the command

def mark_class(given, print_problem, interrupted):
    """Mark a class as the arguments of mark.py say. Returns the exit status.

    ``print_problem(words)`` gets the reason why something was not done. `interrupted`: an Event;
    once it is set, all that runs is ended.
    """
    with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work, ExitStack() as stack:
        stack.enter_context(_environment(ros_alone(Path(work) / 'ros', os.environ)))
        try:
            runner, found = _prepare(given, Path(work), print_problem, stack)
            runner.interrupted = interrupted
            marked_class = MarkedClass(runner, bool(given.only), print_problem)
            failed = marked_class.mark_all(found, given.jobs)
            with ThreadPoolExecutor(1) as pool:     # an interruption comes after its end
                page, notes = pool.submit(
                    runner.folder.write_overview, given.unprotected).result()
        except (OSError, ValueError, NotJudged) as problem:
            print_problem(reason(problem))
            return 2
    for note in notes[given.unprotected:]:      # the note on --unprotected was printed before
        print_line(note)
    if page is not None:
        print_line(f'Overview: {page}')
    return 1 if failed else 0


@contextmanager
def _environment(made):
    """Only this environment in a ``with`` block."""
    before = dict(os.environ)
    os.environ.clear()
    os.environ.update(made)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _prepare(given, work, print_problem, stack):
    """Returns (TrialRunner, Submissions) of these arguments, which are checked before anything is
    started. A class's zip file is unpacked below `work`. Until the end of the ExitStack `stack`
    nobody else writes into the folder of marks."""
    parts = LABS[given.lab].checked_parts(given.parts)
    worth = points_of(given.lab, read_points(given.points))
    option = _checked_option(given)
    marks, source = given.folder.resolve(), given.submissions.resolve()
    if source.is_dir() and source in (marks, *marks.parents):   # they would be marked, too
        raise ValueError('-o {}: the marks would lie among the submissions; give a folder beside '
                         'them'.format(given.folder))
    source = given.submissions.absolute()
    if not source.is_dir():
        if not (source.is_file() and is_zip(source.name)):
            raise ValueError(f'{given.submissions} is neither a folder nor a zip file')
        for remark in unpack_class(source, work / 'all'):
            print_problem(remark)
        source = without_wrapping(work / 'all')
    found = submissions_in(source, print_problem)
    if given.only:
        names = students_named([submission.student for submission in found], given.only)
        found = [submission for submission in found if submission.student in names]
    if given.container and sandbox_problem():
        print_line(f'{sandbox_problem()}: this container, which is thrown away, is the sandbox.')
        given.unprotected = True
    elif given.unprotected:
        print_line(UNPROTECTED)
    elif sandbox_problem():
        raise ValueError("nothing was started, since the submissions' programs cannot be kept in "
                         'sandboxes here ({}); --unprotected marks without them: {}'.format(
                             sandbox_problem(), UNPROTECTED))
    if given.unprotected:
        work.chmod(0o711)       # an OtherUser reads ROS's prefix in it
        if os.geteuid() == 0 and sandbox_problem(False):
            raise ValueError('nothing was started: {}; this package must lie where every user can '
                             'read it, not in /root'.format(sandbox_problem(False)))
    options = Options(given.package, given.type, option, not given.unprotected)
    stack.enter_context(alone_in(given.folder))
    folder = MarksFolder(given.folder, given.lab, parts, worth, asdict(options),
                         given.points is not None)
    return TrialRunner(folder, options), found


def _checked_option(given):
    """The value of the lab's option; ``ValueError`` if it is invalid, or another lab's."""
    for name, lab in LABS.items():
        value = lab.option and getattr(given, lab.option.name)
        if value is not None and name != given.lab:
            raise ValueError(f'--{lab.option.name} is for --lab {name} alone')
    option = LABS[given.lab].option
    if option is None:
        return ''
    value = getattr(given, option.name)
    value = option.default if value is None else value
    option.read(value)
    return value
