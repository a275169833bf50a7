"""Marks one submission by the check_LAB.test of its lab.

Each submission has its own master, simulated robot, home and log folder, and a time limit. At the
end none of its processes is left, whatever the submission did.
"""
import json
import os
import subprocess
import sys
import threading
import time
import uuid
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, MutableMapping, Set

from tb3_labs.command_line import write_output
from tb3_labs.marking.intake.packages import NotJudged
from tb3_labs.marking.intake.reading import Reading, read
from tb3_labs.marking.intake.sandbox import IDENTITY, MODULES, PREFIXES, NoSandbox, Sandbox
from tb3_labs.marking.intake.submissions import Submission
from tb3_labs.marking.intake.workspace import COPY, VARIABLE, elsewhere, prepare
from tb3_labs.marking.lab_names import GAMEPAD, NODES
from tb3_labs.marking.labs.criteria import judge
from tb3_labs.marking.labs.gamepad import HANDOUT, pad_in_words
from tb3_labs.marking.marks import LABS, Marks
from tb3_labs.marking.marks_folder import MarksFolder
from tb3_labs.marking.trial.evidence import remarks_on, untold
from tb3_labs.marking.trial.observation import Observation
from tb3_labs.marking.trial.processes import sweep

#: Variables of the caller that would change the result.
FORGOTTEN = ('ROS_MASTER_URI', 'ROS_IP', 'ROS_NAMESPACE', 'TURTLEBOT3_MODEL', 'ROSCONSOLE_FORMAT',
             'DISPLAY', 'WAYLAND_DISPLAY')
#: Variables that list folders of catkin's workspaces.
LISTS = (PREFIXES, 'LD_LIBRARY_PATH', 'PATH', 'PKG_CONFIG_PATH', MODULES, 'ROS_PACKAGE_PATH')
#: Log lines go to the terminal as usual, but to no file.
LOGGING = '''version: 1
disable_existing_loggers: false
root: {handlers: []}
handlers: {stream: {class: rosgraph.roslogging.RosStreamHandler}}
loggers: {rosout: {level: INFO, handlers: [stream], propagate: false}}
'''
#: The time for one submission, and between two looks at its check [s].
LIMIT, LOOK = 300.0, 0.1


@dataclass(frozen=True)
class Options:
    """Settings of a try."""

    package: str = ''           # of the node, if it is not a usual one of the lab
    name: str = ''              # of the node's file, if it is not a usual one
    pad: str = HANDOUT          # the gamepad that is played
    sandbox: bool = True        # do the submissions' programs run in a Sandbox?


class MarkingInterrupted(RuntimeError):
    """A person has interrupted the marking."""


class Marker:
    """Marks the submissions of a class. Several threads may use it at a time."""

    def __init__(self, folder: MarksFolder, options: Options = Options()) -> None:
        """`folder`: says what is marked, and gets the logs."""
        self.folder, self._lab, self._options = folder, folder.lab, options
        #: Once this is set, all that runs is ended; each :meth:`mark` raises MarkingInterrupted.
        self.interrupted = threading.Event()

    def read(self, submission: Submission, work: Path) -> Reading:
        """Copy a submission into `work`, an existing folder, and read it."""
        return read(submission, work / 'ws' / COPY, NODES[self._lab], self._options.package,
                    self._options.name)

    def mark(self, student: str, reading: Reading, work: Path) -> Marks:
        """The Marks of the submission that was read in `work`."""
        marks, identity = Marks(student), uuid.uuid4().hex
        try:
            self._observe(marks, reading, work, identity)
        except NotJudged as problem:
            marks.unjudged = str(problem)
        finally:
            sweep(identity)
        return self.judged(marks)

    def judged(self, marks: Marks) -> Marks:
        """The Marks with their verdicts; if they are unjudged, the instructor is told why."""
        if marks.unjudged:
            marks.findings.append('Not judged: ' + marks.unjudged)
        observation = marks.observation or Observation(self._lab, marks.node)
        marks.verdicts = judge(LABS[self._lab].criteria, observation, self.folder.worth,
                               self.folder.parts)
        marks.remarks = untold(marks.remarks, ' '.join(each.seen for each in marks.verdicts))
        return marks

    def _observe(self, marks, reading, work, identity):
        """Write node, remarks and Observation of a submission into its Marks."""
        log, record = self.folder.logs / (marks.student + '.log'), work / 'observation.json'
        sandbox = Sandbox([work / 'ws', work / 'etc']) if self._options.sandbox else NoSandbox()
        own = environment_in(work, dict(os.environ, **{IDENTITY: identity}))
        launch = prepare(reading, work / 'ws', own, sandbox)
        marks.node = '{}/{}'.format(launch.package, os.path.basename(launch.program))
        marks.remarks += reading.remarks
        marks.findings += reading.look_at
        if self._lab == GAMEPAD:
            marks.remarks.append(pad_in_words(self._options.pad))
        sandbox.hand_over(work / 'ws')
        # the node alone gets the environment of the student's workspace: modules of the submission
        (work / 'launch.json').write_text(json.dumps(launch))
        own[VARIABLE] = str(work / 'launch.json')
        write_output(log, '')       # a new file, never through a link
        with open(str(log), 'w') as file:
            in_time = self._check(marks.node, sandbox, record, own, file)
        if not in_time:
            marks.remarks.append('It was stopped after {:g} s, the limit.'.format(LIMIT))
        if self.interrupted.is_set():
            raise MarkingInterrupted('interrupted')
        if not record.exists():
            raise NotJudged('The check left no record; see {}.'.format(log))
        observed = record.read_text()       # of no use to a student: the copy's place
        for place in (reading.package + '/', ''):
            observed = observed.replace('{}/ws/{}/{}'.format(work, COPY, place), '')
        write_output(self.folder.logs / (marks.student + '.json'), observed)
        marks.observation = Observation.from_json(observed)
        marks.remarks += remarks_on(marks.observation)
        marks.findings += marks.observation.findings + elsewhere(
            '\n'.join(run.printed for run in marks.observation.runs), work / 'ws' / COPY)
        if marks.observation.broken:
            raise NotJudged('The marker itself failed ({}); see {}.'.format(
                marks.observation.broken, log))
        marks.findings += ['Its page has no timeline; see {}.'.format(log)] * (
            not marks.observation.shown)

    def _check(self, node, sandbox, record, environment, output):
        """Run the lab's check on package/file `node`; False if the time was up."""
        package, executable = node.split('/')
        work = record.parent
        check = subprocess.Popen(
            sandbox.own_network([
                'rostest', 'tb3_labs', 'check_{}.test'.format(self._lab), 'pkg:=' + package,
                'type:=' + executable, 'parts:=' + ','.join(self.folder.parts),
                'record:={}'.format(record), 'truth:={}'.format(work / 'truth')]
                + ['pad:=' + self._options.pad] * (self._lab == GAMEPAD)),
            env=environment, cwd=str(work), stdin=subprocess.DEVNULL, stdout=output, stderr=output,
            start_new_session=True)
        begun = time.monotonic()
        while check.poll() is None and not self.interrupted.wait(LOOK) and (
                time.monotonic() < begun + LIMIT):
            pass
        in_time = check.poll() is not None or self.interrupted.is_set()
        sweep(environment[IDENTITY])
        check.wait()
        return in_time


# -- the environment

def environment_in(work: Path, environment: Dict[str, str]) -> Dict[str, str]:
    """The environment of a separate ROS that writes only below `work`, an existing folder."""
    settings = work / 'etc'
    settings.mkdir(exist_ok=True)
    (settings / 'logging.yaml').write_text(LOGGING)
    # without rosout, which would write all log lines into a file
    (settings / 'roscore.xml').write_text('<launch/>')
    given = {name: value for name, value in environment.items() if name not in FORGOTTEN}
    return dict(given, TMPDIR=str(work), ROS_HOSTNAME='localhost', ROS_HOME=str(work / 'ros'),
                ROS_LOG_DIR=str(work / 'log'), ROS_ETC_DIR=str(settings),
                ROS_PYTHON_LOG_CONFIG_FILE=str(settings / 'logging.yaml'),
                ROS_TEST_RESULTS_DIR=str(work / 'results'))


def forget_overlays(environment: MutableMapping[str, str] = os.environ,
                    modules: List[str] = sys.path) -> None:
    """Remove the catkin workspaces that come before this package's from `environment` and from
    Python's search path `modules`.

    An instructor's own nodes and messages must not replace those of a submission, nor be read.
    """
    prefixes = [path for path in environment.get(PREFIXES, '').split(':') if path]
    holders = [number for number, prefix in enumerate(prefixes)
               if os.path.isdir(os.path.join(prefix, 'share', 'tb3_labs'))]
    overlays = prefixes[:holders[0]] if holders else []
    sources: Set[str] = set()
    for prefix in overlays:
        with suppress(OSError):
            sources.update(Path(prefix, '.catkin').read_text().split(';'))

    def stays(path: str) -> bool:
        return path not in sources and not any(
            (path + '/').startswith(prefix.rstrip('/') + '/') for prefix in overlays)
    for name in LISTS:
        if name in environment:
            environment[name] = ':'.join(filter(stays, environment[name].split(':')))
    modules[:] = filter(stays, modules)
