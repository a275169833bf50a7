"""Judges a submission by the check_LAB.test of its lab.

Each submission has its own master, simulated robot, home and log folder, and a time limit. At the
end none of its processes is left, whatever the submission did.
"""
import json
import os
import shutil
import subprocess
import tempfile
import threading
import time
import uuid
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Callable, Mapping, Sequence

from tb3_labs.marking.choice import NoNode, files_in
from tb3_labs.marking.conduct import NODE_TEXT
from tb3_labs.marking.criteria import judge
from tb3_labs.marking.imports import laws_named
from tb3_labs.marking.intake import Copy
from tb3_labs.marking.marks import GAMEPAD, LABS, Marks
from tb3_labs.marking.observation import Observation
from tb3_labs.marking.own_numbers import own_numbers
from tb3_labs.marking.processes import IDENTITY, environment_in, sweep, tried_last
from tb3_labs.marking.ros_gamepad import HANDOUT, pad_in_words
from tb3_labs.marking.ros_student_node import ALWAYS, VARIABLE, Launch
from tb3_labs.marking.sandbox import NoSandbox, Sandbox
from tb3_labs.marking.workspace import prepare

#: The period of reading from the check's log which part is tried [s].
TOLD = 0.5
#: The network without delays; a remark names any other network.
QUIET = 'quiet'


class Interrupted(RuntimeError):
    """A person has interrupted the marking."""


@dataclass(frozen=True)
class Options:
    """Settings of a try."""

    package: str = ''           # of the node, if it is not a usual one of the lab
    name: str = ''              # of the node's file, if it is not a usual one
    limit: float = 300.0        # time for one submission [s]
    network: str = QUIET        # between robot and node; see tb3_labs.simulation.network.NETWORKS
    pad: str = HANDOUT          # the gamepad that is played
    own: bool = False           # does each student have own numbers?
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

    def mark(self, copy: Copy, tell: Callable[[str], None],
             trying: Callable[[str], None]) -> Marks:
        """The Marks of a submission.

        If the machine was too busy to judge it fairly, the submission is tried once more, and
        ``tell(words)`` is told so. ``trying(words)`` is told the present part twice a second.
        """
        marks = self._try(copy, trying)
        if marks.unfair:
            tell('the machine held the robot up for {:.2f} s; tried again'.format(
                marks.observation.longest_gap))
            marks = self._try(copy, trying)
            marks.remarks += [marks.unfair] * bool(marks.unfair)
        return marks

    def _try(self, copy, trying):
        marks = Marks(copy.folder.name, remarks=list(copy.remarks))
        unread = list(dict.fromkeys(copy.unread))
        with tempfile.TemporaryDirectory(prefix='tb3_labs_') as work:
            identity = uuid.uuid4().hex
            try:
                self._observe(marks, copy.folder, Path(work), identity, trying)
                marks.remarks += unread
            except NoNode as reason:
                if unread:      # the node may be in there
                    marks.unjudged = ' '.join(unread)
                else:
                    marks.remarks.append(str(reason))
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

    def _observe(self, marks, folder, work, identity, trying):
        """Write node, remarks and Observation of a submission into its Marks."""
        log, record = self._logs / (folder.name + '.log'), work / 'observation.json'
        sandbox = Sandbox([work / 'ws', work / 'etc']) if self._options.sandbox else NoSandbox()
        prepared = prepare(folder, LABS[self._lab], work / 'ws', {IDENTITY: identity},
                           self._options.package, self._options.name, sandbox)
        marks.node = '{}/{}'.format(prepared.package, prepared.executable)
        marks.remarks += prepared.remarks
        self._read(marks, work / 'ws' / 'src', prepared.executable)
        if prepared.lacking:
            marks.unjudged = ('The node imports {}, which neither the submission nor the marking '
                              'machine has.'.format(' and '.join(prepared.lacking)))
            return
        if self._options.network != QUIET:
            marks.remarks.append('Judged over the network "{}".'.format(self._options.network))
        if self._lab == GAMEPAD:
            marks.remarks.append(pad_in_words(self._options.pad))
        settings = ['pad:=' + self._options.pad] * (self._lab == GAMEPAD)
        if self._options.own:
            numbers = own_numbers(marks.student)
            marks.remarks.append(numbers.remark)
            settings = ['goal:={!r},{!r},{!r}'.format(*numbers.goal_pose)]
        if not self._check(prepared, sandbox, work, log, record, identity, trying, settings):
            marks.remarks.append('It was stopped after {:g} s, the limit.'.format(
                self._options.limit))
        if self.interrupted.is_set():
            raise Interrupted('interrupted')
        if not record.exists():
            marks.unjudged = 'The check left no record; see {}.'.format(log)
            return
        marks.observation = Observation.from_json(record.read_text())
        marks.remarks += marks.observation.remarks
        marks.findings += marks.observation.findings
        if marks.observation.broken:
            marks.unjudged = 'The marker itself failed ({}); see {}.'.format(
                marks.observation.broken, log)
        shutil.copy(str(record), str(self._logs / (folder.name + '.json')))

    def _read(self, marks, sources, executable):
        for path in files_in(sources):
            if path.suffix == '.py':
                marks.findings += laws_named(path.name, path.read_text(errors='replace'))
        node = min(sources.rglob(executable))
        (self._logs / (marks.student + NODE_TEXT)).write_bytes(node.read_bytes())

    def _check(self, prepared, sandbox, work, log, record, identity, trying, settings):
        """Run the lab's check with these further arguments; False if the time was up.

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
                    'network:=' + self._options.network, 'truth:=truth_' + uuid.uuid4().hex]
                    + settings),
                env=dict(own, **{VARIABLE: str(work / 'launch.json')}), cwd=str(work),
                stdin=subprocess.DEVNULL, stdout=file, stderr=file, start_new_session=True)
            in_time = self._wait_for(check, log, trying)
            sweep(identity)
            check.wait()
        return in_time

    def _wait_for(self, check, log, trying):
        """Wait for the check's end or an interruption. Returns False if the time was up."""
        end = time.monotonic() + self._options.limit
        while not self.interrupted.is_set():
            try:
                check.wait(TOLD)
                break
            except subprocess.TimeoutExpired:
                trying(tried_last(log.read_text(errors='replace')))
            if time.monotonic() > end:
                return False
        return True
