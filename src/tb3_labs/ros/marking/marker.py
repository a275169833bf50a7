"""Judges one submission by its lab's check_LAB.test, in a world of its own.

That world has a master, an embedded robot, a home and a log folder of its own, and a time limit. At
the end not a process is left, whatever the submission did.
"""
import os
import shutil
import subprocess
import tempfile
import time
import uuid
from dataclasses import dataclass
from pathlib import Path

from tb3_labs.marking.conduct import NODE_TEXT, laws_imported
from tb3_labs.marking.criteria import judge
from tb3_labs.marking.labs import GAMEPAD, LABS
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.observation import Observation
from tb3_labs.ros.marking.box import Box, NoBox
from tb3_labs.marking.ros_student_node import ALWAYS, VARIABLE, Launch
from tb3_labs.marking.ros_gamepad import HANDOUT, pad_in_words
from tb3_labs.marking.progress import tried_last
from tb3_labs.ros.marking.sandbox import COOKIE, environment_in, sweep
from tb3_labs.ros.marking.submission import Unusable
from tb3_labs.ros.marking.workspace import prepare

#: What is tried is told so often [s].
TOLD = 0.5
#: The network that takes no time; any other is told in the remarks.
QUIET = 'quiet'


class Interrupted(RuntimeError):
    """A person wants no more marks."""


@dataclass(frozen=True)
class Options:
    """Settings of a try."""

    package: str = ''           # of the node, if not those that the lab knows
    name: str = ''              # of the node's file, likewise
    limit: float = 300.0        # time for one submission [s]
    network: str = QUIET        # between robot and node; see tb3_labs.simulation.network.NETWORKS
    pad: str = HANDOUT          # the gamepad that is played
    boxed: bool = True          # do strangers' programs run in a Box?


class Marker:
    """Marks submissions of one lab; several at a time, by threads, if wanted."""

    def __init__(self, lab, worth, logs, parts=(), options=Options()):
        """`worth`: criterion -> points; `logs`: an existing folder; `parts`: these alone."""
        self._lab, self._worth, self._logs = lab, worth, Path(logs)
        self._parts, self._options = parts, options
        self._interrupted = False
        self._cookies = set()

    def interrupt(self):
        """Kill what is under way: each :meth:`mark` raises Interrupted from now on."""
        self._interrupted = True
        for cookie in list(self._cookies):
            sweep(cookie)

    def mark(self, folder, tell=lambda words: None, trying=lambda words: None):
        """The Marks of the submission in `folder`.

        If the machine was too busy to judge it fairly, it is tried once more, and ``tell(words)``
        hears that. ``trying(words)`` hears what is tried now, at least once a second.
        """
        marks = self._try(Path(folder), trying)
        if self.held_up(marks):
            tell('the machine held the robot up for {:.2f} s; tried again'.format(
                marks.observation.longest_gap))
            marks = self._try(Path(folder), trying)
            if self.held_up(marks):
                marks.remarks.append(marks.observation.unfair)
        return marks

    @staticmethod
    def held_up(marks):
        """Was the machine too busy to judge it fairly?"""
        return marks.observation is not None and bool(marks.observation.unfair)

    def _try(self, folder, trying):
        marks = Marks(folder.name)
        with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
            cookie = uuid.uuid4().hex
            self._cookies.add(cookie)
            try:
                self._observe(marks, folder, Path(work), cookie, trying)
            except Unusable as reason:
                marks.remarks.append(str(reason))
            finally:
                sweep(cookie)
                self._cookies.remove(cookie)
        return self._judged(marks)

    def not_judged(self, student, reason):
        """The Marks of a submission that cannot be judged, for this reason, a sentence."""
        return self._judged(Marks(student, remarks=[reason], failed=True))

    def _judged(self, marks):
        observation = marks.observation or Observation(self._lab, marks.node)
        marks.verdicts = judge(LABS[self._lab].criteria, observation, self._worth, self._parts)
        return marks

    def _observe(self, marks, folder, work, cookie, trying):
        """Write node, remarks and Observation of a submission into its Marks."""
        log, record = self._logs / (folder.name + '.log'), work / 'observation.json'
        box = Box([work / 'ws', work / 'etc']) if self._options.boxed else NoBox()
        prepared = prepare(folder, LABS[self._lab], work / 'ws', {COOKIE: cookie},
                           self._options.package, self._options.name, box)
        marks.node = '{}/{}'.format(prepared.package, prepared.executable)
        marks.remarks += prepared.remarks
        self._read(marks, work / 'ws' / 'src', prepared.executable)
        if prepared.lacking:
            marks.lacking, marks.failed = prepared.lacking, True
            marks.remarks.append(
                'The marking machine lacks {}, which the node imports: it was not judged.'.format(
                    ' and '.join(prepared.lacking)))
            return
        if self._options.network != QUIET:
            marks.remarks.append('Judged over the network "{}".'.format(self._options.network))
        if self._lab == GAMEPAD:
            marks.remarks.append(pad_in_words(self._options.pad))
        self._go_on()
        if not self._check(prepared, box, work, log, record, cookie, trying):
            marks.remarks.append('It was stopped after {:g} s, the limit.'.format(
                self._options.limit))
        self._go_on()
        if not record.exists():
            marks.failed = True
            marks.remarks.append('It could not be judged; see {}.'.format(log))
            return
        marks.observation = Observation.from_json(record.read_text())
        marks.remarks += marks.observation.remarks
        marks.findings += marks.observation.findings
        if marks.observation.broken:
            marks.failed = True
            marks.remarks.append('The marker itself failed ({}), so this was not judged; see {}.'
                                 .format(marks.observation.broken, log))
        shutil.copy(str(record), str(self._logs / (folder.name + '.json')))

    def _read(self, marks, sources, executable):
        """Note which of this package's laws a submission uses; keep the node's text, by which it is
        compared with others."""
        files = [path for path in sorted(sources.rglob('*.py')) if path.is_file()
                 and not path.is_symlink()]
        for path in files:
            marks.findings += laws_imported(path.name, path.read_text(errors='replace'))
        for path in sorted(sources.rglob(executable))[:1]:
            (self._logs / (marks.student + NODE_TEXT)).write_bytes(path.read_bytes())

    def _check(self, prepared, box, work, log, record, cookie, trying):
        """Run the lab's check; False if the time was up.

        The environment of the student's workspace is the node's alone: the modules in it are a
        stranger's.
        """
        box.hand_over(work / 'ws')
        world = environment_in(work, dict(os.environ, **{COOKIE: cookie}))
        Launch(ALWAYS + box.command([]),
               box.environment(environment_in(work, prepared.environment)),
               prepared.types, box.boxed).write(work / 'launch.json')
        with open(str(log), 'w') as file:
            check = subprocess.Popen(
                box.world(['rostest', 'tb3_labs', 'check_{}.test'.format(self._lab),
                 'pkg:=' + prepared.package, 'type:=' + prepared.executable,
                 'parts:=' + ','.join(self._parts), 'record:={}'.format(record),
                 'network:=' + self._options.network, 'truth:=truth_' + uuid.uuid4().hex]
                + (['pad:=' + self._options.pad] if self._lab == GAMEPAD else [])),
                env=dict(world, **{VARIABLE: str(work / 'launch.json')}), cwd=str(work),
                stdin=subprocess.DEVNULL, stdout=file, stderr=file, start_new_session=True)
            in_time = self._wait_for(check, log, trying)
            sweep(cookie)
            check.wait()
        return in_time

    def _wait_for(self, check, log, trying):
        """Wait for its end, for the limit, or for an interruption; False if the time was up."""
        begun = told = time.monotonic()
        while check.poll() is None and not self._interrupted:
            time.sleep(0.1)
            now = time.monotonic()
            if now > begun + self._options.limit:
                return False
            if now > told + TOLD:
                told = now
                trying(tried_last(log.read_text(errors='replace')))
        return True

    def _go_on(self):
        if self._interrupted:
            raise Interrupted('interrupted')
