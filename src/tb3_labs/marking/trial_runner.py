"""Records the trial of one submission by the check_LAB.test of its lab.

Each submission has its own master, simulated robot, home and log folder, and a time limit. At the
end none of its processes is left, whatever the submission did.
"""
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import uuid
from contextlib import suppress
from pathlib import Path
from typing import Any, Dict, Mapping, Set

import rospkg

from tb3_labs.command_line import write_output
from tb3_labs.marking.intake.archives import NotJudged
from tb3_labs.marking.intake.read_submission import ParsedSubmission, read
from tb3_labs.marking.intake.sandbox import (
    IDENTITY, MODULES, OWN_PACKAGE, PREFIXES, NoSandbox, OtherUser, Sandbox)
from tb3_labs.marking.intake.submissions import Submission
from tb3_labs.marking.intake.workspace import COPY, elsewhere, prepare
from tb3_labs.marking.marks import LABS, Marks
from tb3_labs.marking.marks_folder import MarksFolder
from tb3_labs.marking.names import LAB_NODES
from tb3_labs.marking.trial.from_bag import read_trial

#: Variables of the caller's terminal that stay for the marking.
KEPT = re.compile(
    'HOME|USER|LOGNAME|LANG|LANGUAGE|LC_[A-Z]+|TZ|TERM|ROS_(ROOT|DISTRO|VERSION|PYTHON_VERSION)|'
    'PYTHON(NOUSERSITE|DONTWRITEBYTECODE)|OPENBLAS_NUM_THREADS|SETUPTOOLS_USE_DISTUTILS')
#: Others are lists of these folders of prefixes.
PYTHON = 'lib/python3/dist-packages'
FOLDERS = {PREFIXES: '', MODULES: PYTHON, 'ROS_PACKAGE_PATH': 'share', 'LD_LIBRARY_PATH': 'lib',
           'PATH': 'bin'}
SYSTEM = '/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin'
#: Log lines go to the terminal as usual, but to no file.
LOGGING = '''version: 1
disable_existing_loggers: false
root: {handlers: []}
handlers: {stream: {class: rosgraph.roslogging.RosStreamHandler}}
loggers: {rosout: {level: INFO, handlers: [stream], propagate: false}}
'''
#: The time for one submission, and between two looks at its check [s].
LIMIT, POLL_PERIOD = 300.0, 0.1


class MarkingInterrupted(RuntimeError):
    """A person has interrupted the marking."""


class TrialRunner:
    """Marks the submissions of a class. Several threads may use it at a time."""

    def __init__(self, folder: MarksFolder, interrupted: threading.Event) -> None:
        """`folder`: says what is marked, and gets the logs. Once `interrupted` is set, all that
        runs is ended; each :meth:`try_out` raises MarkingInterrupted."""
        self.folder, self.interrupted = folder, interrupted

    def read(self, submission: Submission, work: Path) -> ParsedSubmission:
        """Copy a submission into `work`, an existing folder, and read it."""
        return read(submission, work / 'ws' / COPY, LAB_NODES[self.folder.lab],
                    self.folder.options.package, self.folder.options.name)

    def try_out(self, submission: Submission, reading: ParsedSubmission, work: Path) -> Marks:
        """Record the trial of the submission that was read in `work`, into the folder of marks.
        Returns the Marks of what was handed in."""
        marks, identity = new_marks(submission), uuid.uuid4().hex
        marks.remarks, marks.findings = reading.remarks, list(reading.look_at)
        with suppress(FileNotFoundError):
            self.folder.bag(marks.student).unlink()
        try:
            self._record(marks, reading, work, identity)
        except NotJudged as problem:
            marks.unjudged = str(problem)
        finally:
            sweep(identity)
        return marks

    def _record(self, marks, reading, work, identity):
        """Record the trial of a submission; node and remarks go into its Marks."""
        marks.places = [f'{work}/ws/{place}' for place in (
            f'{COPY}/{reading.package}/', COPY + '/', '')]     # of no use to a student
        log, record = self.folder.logs / (marks.student + '.log'), work / 'trial.bag'
        sandbox = Sandbox([work / 'ws', work / 'etc']) if self.folder.options.sandbox else (
            NoSandbox() if os.geteuid() else OtherUser())
        own = environment_in(work, dict(os.environ, **{IDENTITY: identity}))
        launch = prepare(reading, work / 'ws', own, sandbox)
        marks.node = f'{launch.package}/{os.path.basename(launch.program)}'
        option = LABS[self.folder.lab].option
        if option is not None:
            marks.remarks.append(option.as_text(self.folder.options.option))
        sandbox.hand_over(work / 'ws')
        # the node alone gets the environment of the student's workspace: modules of the submission
        own.update(launch.write(work / 'launch.json'))
        write_output(log, '')       # a new file, never through a link
        with open(str(log), 'w') as file:
            in_time = self._check(sandbox.own_network(self._rostest(marks.node, work)), own, file)
        if not in_time:
            marks.remarks.append(f'It was stopped after {LIMIT:g} s, the limit.')
        if self.interrupted.is_set():
            raise MarkingInterrupted('interrupted')
        if not record.exists():
            raise NotJudged(f'The check left no record; see {log}.')
        write_output(self.folder.bag(marks.student), record.read_bytes())
        observation = read_trial(record)
        marks.findings += elsewhere('\n'.join(run.printed for run in observation.runs),
                                    work / 'ws' / COPY)

    def _rostest(self, node, work):
        """The command of the lab's check of package/file `node`, which records a bag in `work`."""
        (package, executable), lab = node.split('/'), self.folder.lab
        option = LABS[lab].option
        return ['rostest', 'tb3_labs', f'check_{lab}.test', 'pkg:=' + package,
                'type:=' + executable, 'parts:=' + ','.join(self.folder.parts),
                f"record:={work / 'trial.bag'}", f"truth:={work / 'truth'}"] + (
                    [f'{option.name}:={self.folder.options.option}'] if option else [])

    def _check(self, command, environment, output):
        """Run a check; False if the time was up."""
        check = subprocess.Popen(
            command, env=environment, cwd=environment['ROS_HOME'], stdin=subprocess.DEVNULL,
            stdout=output, stderr=output, start_new_session=True)
        begun = time.monotonic()
        while check.poll() is None and not self.interrupted.wait(POLL_PERIOD) and (
                time.monotonic() < begun + LIMIT):
            pass
        in_time = check.poll() is not None or self.interrupted.is_set()
        sweep(environment[IDENTITY])
        check.wait()
        return in_time


def new_marks(submission: Submission, **more: Any) -> Marks:
    """The Marks of a submission of which nothing is known yet."""
    return Marks(submission.student, number=submission.number, late=submission.late, **more)


# -- the end

def sweep(identity: str) -> None:
    """Kill every process that has this identity in its environment, until none is left: also a
    process that left its group.

    Programs that start others faster than they are found are stopped first, by whole groups: what
    is stopped starts nothing, and its places among the processes stay taken.
    """
    mark = f'{IDENTITY}={identity}'.encode()
    looks = 0
    while looks < 2:        # a process that starts a program has no environment for a moment
        stopped: Set[int] = set()
        while _stop_others(mark, stopped):
            pass
        looks = 0 if stopped else looks + 1
        for pid in stopped:
            with suppress(ProcessLookupError):      # it has ended already
                if _has(pid, mark):     # else its number may be another process's by now
                    os.kill(pid, signal.SIGKILL)


def _stop_others(mark, stopped):
    """Stop the processes with this mark that are not among `stopped`, the newest first, and add
    them. Were there any?"""
    before = len(stopped)
    for pid in sorted((int(name) for name in os.listdir('/proc') if name.isdigit()), reverse=True):
        if pid not in stopped and _has(pid, mark):
            with suppress(ProcessLookupError):      # it has ended already
                group = os.getpgid(pid)
                os.kill(pid, signal.SIGSTOP)
                if group != os.getpgrp():
                    os.killpg(group, signal.SIGSTOP)
            stopped.add(pid)
    return len(stopped) > before


def _has(pid, mark):
    try:
        return mark in Path(f'/proc/{pid}/environ').read_bytes().split(b'\0')
    except OSError:
        return False


# -- the environment

def environment_in(work: Path, environment: Mapping[str, str]) -> Dict[str, str]:
    """The environment of a separate ROS that writes only below `work`, an existing folder."""
    settings = work / 'etc'
    settings.mkdir(exist_ok=True)
    (work / 'ros').mkdir(exist_ok=True)
    (settings / 'logging.yaml').write_text(LOGGING)
    # without rosout, which would write all log lines into a file
    (settings / 'roscore.xml').write_text('<launch/>')
    return dict(environment, TMPDIR=str(work), ROS_HOSTNAME='localhost', ROS_HOME=str(work / 'ros'),
                ROS_LOG_DIR=str(work / 'log'), ROS_ETC_DIR=str(settings),
                ROS_PYTHON_LOG_CONFIG_FILE=str(settings / 'logging.yaml'),
                ROS_TEST_RESULTS_DIR='results')     # in ROS_HOME: rostest cuts a path at a blank


def ros_alone(own: Path, caller: Mapping[str, str]) -> Dict[str, str]:
    """An environment with ROS's own prefix, and `own`, a new prefix that has this package alone.

    It is made, not filtered: a workspace of the `caller` may hold this package together with an
    instructor's nodes and messages, which must not replace a submission's.
    """
    prefixes, modules = (caller.get(name, '').split(':') for name in (PREFIXES, MODULES))
    for place, folders in (('share', [rospkg.RosPack().get_path(OWN_PACKAGE)]),
                           ('lib', [prefix + '/lib/' + OWN_PACKAGE for prefix in prefixes]),
                           (PYTHON, [folder + '/' + OWN_PACKAGE for folder in modules])):
        (own / place / OWN_PACKAGE).mkdir(parents=True)
        for first in list(filter(os.path.isdir, folders))[:1]:
            for name in os.listdir(first):
                (own / place / OWN_PACKAGE / name).symlink_to(
                    os.path.join(os.path.abspath(first), name))
    (own / '.catkin').touch()
    site = Path(sys.prefix).parent / 'devel' / PYTHON / 'sitecustomize.py'
    if site.is_file():      # setup.sh repairs rospy of Debian 11 by it
        shutil.copy(str(site), str(own / PYTHON))
    ros = [prefix for prefix in prefixes if os.path.isdir(prefix + '/share/rospy')][-1:]
    made = {name: ':'.join(f'{prefix}/{folder}'.rstrip('/') for prefix in [
        str(own), *ros]) for name, folder in FOLDERS.items()}       # each program knows /usr
    made['PATH'] = ':'.join([os.path.dirname(sys.executable), made['PATH'], SYSTEM])
    return dict({name: value for name, value in caller.items() if KEPT.fullmatch(name)}, **made)
