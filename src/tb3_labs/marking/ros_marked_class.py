"""Marks the submissions of a class, several at a time, and keeps their marks in a folder."""
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor, wait
from datetime import datetime
from typing import Callable, Optional, Sequence

from tb3_labs.command_line import reason
from tb3_labs.marking.intake import Submission, digest
from tb3_labs.marking.marks import NOT_JUDGED, Marks
from tb3_labs.marking.marks_folder import MarksFolder, late_by
from tb3_labs.marking.names import printable
from tb3_labs.marking.processes import Progress
from tb3_labs.marking.ros_marker import Interrupted, Marker


class MarkedClass:
    """A class whose submissions are marked, and its folder of marks."""

    def __init__(self, marker: Marker, folder: MarksFolder, due: Optional[datetime], anew: bool,
                 progress: Progress, tell_problem: Callable[[str], None]) -> None:
        """`anew`: try all submissions again, also those that were marked and have not changed."""
        self._marker, self._folder, self._due, self._anew = marker, folder, due, anew
        self._progress, self._tell_problem = progress, tell_problem
        self._failed, self._unchanged = False, 0
        self._writing = threading.Lock()

    def mark_all(self, submissions: Sequence[Submission], jobs: int) -> bool:
        """Mark the submissions, `jobs` at a time; write the marks of each as soon as it is marked.

        Returns True if one of them was not judged.
        """
        with ThreadPoolExecutor(jobs) as pool:
            tasks = [pool.submit(self._mark, submission, '[{}/{}] {}'.format(
                number, len(submissions), submission.student)) for number, submission
                in enumerate(submissions, 1)]
            try:
                wait(tasks)
            except KeyboardInterrupt:
                self._tell_problem('interrupted; the marks so far are written, and the same '
                                   'command goes on from here')
                self._failed = True
                for task in tasks:
                    task.cancel()
                self._marker.interrupted.set()
        for task in tasks:
            problem = None if task.cancelled() else task.exception()
            if problem is not None:
                self._tell_problem(reason(problem))      # its marks cannot be written
                self._failed = True
        if self._unchanged:
            self._tell('{} of {} had been marked and have not changed (--anew tries them again)'
                       .format(self._unchanged, len(submissions)))
        return self._failed

    def _mark(self, submission, name):
        try:
            self._try(submission, name)
        except Interrupted:
            pass
        except Exception as problem:    # any error: the other submissions are still marked
            said = '{} ({})'.format(reason(problem), type(problem).__name__)
            self._tell_problem('{}: {}: {}'.format(name, NOT_JUDGED, said))
            self._write(self._marker.judged(Marks(
                submission.student, unjudged='The marking of it failed: {}.'.format(said))), '')
        finally:
            self._progress.done(name)

    def _try(self, submission, name):
        """Mark one submission, unless it was marked before and has not changed."""
        begun, late = time.monotonic(), self._late(submission)
        with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
            copy = submission.lay_out(work)
            tried = digest(copy.folder)
            kept = None if self._anew else self._folder.kept(submission.student, tried)
            if kept is not None:
                self._folder.set_late(submission.student, late)
                self._tell('{}: {:g} of {:g} points, marked before'.format(
                    name, kept.points, kept.worth))
                with self._writing:
                    self._unchanged += 1
                return
            self._tell_trying(name)
            marks = self._marker.mark(
                copy, lambda words: self._tell('{}: {}'.format(name, words)),
                lambda words: self._tell_trying(name, words, time.monotonic() - begun))
        marks.late, marks.seconds = late, time.monotonic() - begun
        self._tell('{}: {}, {:.0f} s{}'.format(
            name, '{:g} of {:g} points'.format(marks.points, marks.worth) if marks.judged
            else NOT_JUDGED, marks.seconds, ', late' * bool(late)))
        self._write(marks, tried)

    def _late(self, submission):
        if submission.late:
            return 'Late, as the learning platform says.'
        return late_by(self._due, *submission.handed_in_at()) if self._due else ''

    def _write(self, marks, tried):
        """Write Marks; `tried`: the digest of the submission."""
        with self._writing:
            self._folder.write(marks, '' if marks.unfair or marks.unjudged else tried)
            self._failed = self._failed or not marks.judged

    def _tell(self, line):
        self._progress.line(printable(line))

    def _tell_trying(self, name, words='', seconds=0.0):
        """Show the part that is tried now; on a terminal show its step and the time too."""
        part, _, step = words.partition(': ')
        self._progress.now(name, '{}: {}'.format(name, part) if part else name + ' ...',
                           (', {},'.format(step) if part else '') + ' {:.0f} s'.format(seconds))
