"""Marks the submissions of a class, each by the check_LAB.test of its lab.

Each submission has its own master, simulated robot, home and log folder, and a time limit. At the
end none of its processes is left, whatever the submission did.
"""
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
import uuid
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Callable, Mapping, Sequence

from tb3_labs.command_line import printable, reason
from tb3_labs.marking.choice import NoNode
from tb3_labs.marking.criteria import judge
from tb3_labs.marking.intake import Copy, Submission, digest
from tb3_labs.marking.marks import GAMEPAD, LABS, NOT_JUDGED, Marks
from tb3_labs.marking.marks_folder import MarksFolder
from tb3_labs.marking.observation import Observation
from tb3_labs.marking.processes import IDENTITY, environment_in, sweep
from tb3_labs.marking.gamepad import HANDOUT, pad_in_words
from tb3_labs.marking.ros_student_node import ALWAYS, VARIABLE, Launch
from tb3_labs.marking.sandbox import NoSandbox, Sandbox
from tb3_labs.marking.workspace import prepare
from tb3_labs.ros.clocks import wait_until

#: The time for one submission [s].
LIMIT = 300.0


class Interrupted(RuntimeError):
    """A person has interrupted the marking."""


@dataclass(frozen=True)
class Options:
    """Settings of a try."""

    package: str = ''           # of the node, if it is not a usual one of the lab
    name: str = ''              # of the node's file, if it is not a usual one
    pad: str = HANDOUT          # the gamepad that is played
    sandbox: bool = True        # do the submissions' programs run in a Sandbox?


class Marker:
    """Marks submissions of one lab. Several threads may use it at a time."""

    def __init__(self, lab: str, worth: Mapping[str, float], logs: Path, parts: Sequence[str] = (),
                 options: Options = Options()) -> None:
        """`worth`: criterion -> points; `logs`: an existing folder; `parts`: only these."""
        self._lab, self._worth, self._logs = lab, worth, Path(logs)
        self._parts, self._options = parts, options
        #: Once this is set, all that runs is ended, and each :meth:`mark` raises Interrupted.
        self.interrupted = threading.Event()

    def mark(self, copy: Copy, tell: Callable[[str], None]) -> Marks:
        """The Marks of a submission.

        If the machine was too busy to judge it fairly, the submission is tried once more, and
        ``tell(words)`` is told so.
        """
        marks = self._try(copy)
        if marks.unfair:
            tell('the machine held the robot up for {:.2f} s; tried again'.format(
                marks.observation.longest_gap))
            marks = self._try(copy)
            marks.remarks += [marks.unfair] * bool(marks.unfair)
        return marks

    def _try(self, copy):
        marks = Marks(copy.folder.name, remarks=list(copy.remarks))
        unread = list(dict.fromkeys(copy.unread))
        with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
            identity = uuid.uuid4().hex
            try:
                self._observe(marks, copy.folder, Path(work), identity)
                marks.remarks += unread
            except NoNode as problem:      # the node may be in what was not read
                marks.unjudged = ' '.join(unread) or str(problem)
            finally:
                sweep(identity)
        return self.judged(marks)

    def judged(self, marks: Marks) -> Marks:
        """The Marks with their verdicts; if they are unjudged, the instructor is told why."""
        if marks.unjudged:
            marks.findings.append('Not judged: ' + marks.unjudged)
        observation = marks.observation or Observation(self._lab, marks.node)
        marks.verdicts = judge(LABS[self._lab].criteria, observation, self._worth, self._parts)
        return marks

    def _observe(self, marks, folder, work, identity):
        """Write node, remarks and Observation of a submission into its Marks."""
        log, record = self._logs / (folder.name + '.log'), work / 'observation.json'
        sandbox = Sandbox([work / 'ws', work / 'etc']) if self._options.sandbox else NoSandbox()
        prepared = prepare(folder, LABS[self._lab], work / 'ws', {IDENTITY: identity},
                           self._options.package, self._options.name, sandbox)
        marks.node = '{}/{}'.format(prepared.package, prepared.executable)
        marks.remarks += prepared.remarks
        if prepared.lacking:
            marks.unjudged = ('The node imports {}, which neither the submission nor the marking '
                              'machine has.'.format(' and '.join(prepared.lacking)))
            return
        if self._lab == GAMEPAD:
            marks.remarks.append(pad_in_words(self._options.pad))
        if not self._check(prepared, sandbox, work, log, record, identity):
            marks.remarks.append('It was stopped after {:g} s, the limit.'.format(LIMIT))
        if self.interrupted.is_set():
            raise Interrupted('interrupted')
        if not record.exists():
            marks.unjudged = 'The check left no record; see {}.'.format(log)
            return
        observed = record.read_text()       # of no use to a student: the copy's place
        for place in ('src/package/', 'src/', ''):
            observed = observed.replace('{}/ws/{}'.format(work, place), '')
        (self._logs / (folder.name + '.json')).write_text(observed)
        marks.observation = Observation.from_json(observed)
        marks.remarks += marks.observation.remarks
        marks.findings += marks.observation.findings
        if marks.observation.broken:
            marks.unjudged = 'The marker itself failed ({}); see {}.'.format(
                marks.observation.broken, log)

    def _check(self, prepared, sandbox, work, log, record, identity):
        """Run the lab's check; False if the time was up.

        Only the node gets the environment of the student's workspace: this has modules of the
        submission.
        """
        sandbox.hand_over(work / 'ws')
        own = environment_in(work, dict(os.environ, **{IDENTITY: identity}))
        launch = Launch(ALWAYS + sandbox.command([]),
                        sandbox.environment(environment_in(work, prepared.environment)),
                        prepared.types, sandbox.isolates)
        (work / 'launch.json').write_text(json.dumps(asdict(launch)))
        with open(str(log), 'w') as file:
            check = subprocess.Popen(
                sandbox.own_network([
                    'rostest', 'tb3_labs', 'check_{}.test'.format(self._lab),
                    'pkg:=' + prepared.package, 'type:=' + prepared.executable,
                    'parts:=' + ','.join(self._parts), 'record:={}'.format(record),
                    'truth:=truth_' + uuid.uuid4().hex]
                    + ['pad:=' + self._options.pad] * (self._lab == GAMEPAD)),
                env=dict(own, **{VARIABLE: str(work / 'launch.json')}), cwd=str(work),
                stdin=subprocess.DEVNULL, stdout=file, stderr=file, start_new_session=True)
            in_time = wait_until(
                lambda: check.poll() is not None or self.interrupted.is_set(), LIMIT)
            sweep(identity)
            check.wait()
        return in_time


def tell(line):
    """Print a line of progress; several threads may do so."""
    sys.stdout.write(printable(line) + '\n')
    sys.stdout.flush()


class MarkedClass:
    """A class whose submissions are marked, and its folder of marks."""

    def __init__(self, marker: Marker, folder: MarksFolder, anew: bool,
                 tell_problem: Callable[[str], None]) -> None:
        """`anew`: try all submissions again, also those that were marked and have not changed."""
        self._marker, self._folder, self._anew = marker, folder, anew
        self._tell_problem = tell_problem
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
                wait(tasks)
            except KeyboardInterrupt:
                self._failed = True
                self._marker.interrupted.set()
                for task in tasks:
                    task.cancel()
                self._tell_problem('interrupted; the marks so far are written, and the same '
                                   'command goes on from here')
        for task in tasks:
            problem = None if task.cancelled() else task.exception()
            if problem is not None:
                self._tell_problem(reason(problem))      # its marks cannot be written
                self._failed = True
        if self._unchanged:
            tell('{} of {} had been marked and have not changed (--only NAME tries one again)'
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

    def _try(self, submission, name):
        """Mark one submission, unless it was marked before and has not changed."""
        begun = time.monotonic()
        with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
            copy = submission.lay_out(work)
            tried = digest(copy.folder)
            kept = None if self._anew else self._folder.kept(submission.student, tried)
            if kept is not None:
                tell('{}: {:g} of {:g} points, marked before'.format(
                    name, kept.points, kept.worth))
                with self._writing:
                    self._unchanged += 1
                return
            tell(name + ' ...')
            marks = self._marker.mark(copy, lambda words: tell('{}: {}'.format(name, words)))
        marks.seconds = time.monotonic() - begun
        tell('{}: {}, {:.0f} s'.format(
            name, '{:g} of {:g} points'.format(marks.points, marks.worth) if marks.judged
            else NOT_JUDGED, marks.seconds))
        self._write(marks, tried)

    def _write(self, marks, tried):
        """Write Marks; `tried`: the digest of the submission."""
        with self._writing:
            self._folder.write(marks, '' if marks.unfair or marks.unjudged else tried)
            self._failed = self._failed or not marks.judged
