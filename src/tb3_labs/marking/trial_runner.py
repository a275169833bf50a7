"""Records the trial of a submission by the check_LAB.test of the lab.

Each submission has its own master, simulated robot, home and log folder, and a time limit. At the
end all processes of the submission are killed, whatever the submission did.
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
from typing import Dict, Mapping, Set

import rospkg

from tb3_labs.command_line import write_output
from tb3_labs.marking.intake.archives import NotJudged
from tb3_labs.marking.intake.read_submission import ParsedSubmission, read
from tb3_labs.marking.intake.node_start import IDENTITY, OWN_PACKAGE
from tb3_labs.marking.intake.sandbox import MODULES, PREFIXES, NoSandbox, OtherUser, Sandbox
from tb3_labs.marking.intake.submissions import Submission
from tb3_labs.marking.intake.workspace import COPY, prepare, version_errors
from tb3_labs.marking.marks import LABS, Marks
from tb3_labs.marking.marks_folder import MarksFolder
from tb3_labs.marking.names import LAB_NODES
from tb3_labs.marking.trial.from_bag import read_trial

#: The names of the environment variables that the marking takes over from the caller's terminal.
INHERITED_VARIABLES = re.compile(
    'HOME|USER|LOGNAME|LANG|LANGUAGE|LC_[A-Z]+|TZ|TERM|ROS_(ROOT|DISTRO|VERSION|PYTHON_VERSION)|'
    'PYTHON(NOUSERSITE|DONTWRITEBYTECODE)|OPENBLAS_NUM_THREADS|SETUPTOOLS_USE_DISTUTILS')
PYTHON_FOLDER = 'lib/python3/dist-packages'
#: environment variable -> the folder of each prefix that the variable lists
PREFIX_FOLDERS = {PREFIXES: '', MODULES: PYTHON_FOLDER, 'ROS_PACKAGE_PATH': 'share',
                  'LD_LIBRARY_PATH': 'lib', 'PATH': 'bin'}
SYSTEM_PATH = '/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin'
#: rospy's configuration of logging: log lines go to the terminal as usual, but to no file.
LOGGING_CONFIG = '''version: 1
disable_existing_loggers: false
root: {handlers: []}
handlers: {stream: {class: rosgraph.roslogging.RosStreamHandler}}
loggers: {rosout: {level: INFO, handlers: [stream], propagate: false}}
'''
#: The check of a submission is ended after this time [s].
TIME_LIMIT = 300.0
#: The time between two looks at a running check [s].
POLL_PERIOD = 0.1


class MarkingInterrupted(RuntimeError):
    """A person has interrupted the marking."""


class TrialRunner:
    """Records the trials of a class. Several threads may use it at a time."""

    def __init__(self, folder: MarksFolder, interrupted: threading.Event) -> None:
        """`folder` has the lab and its options, and gets the bags and the logs. Once `interrupted`
        is set, each trial is ended, and :meth:`try_out` raises MarkingInterrupted."""
        self.folder, self.interrupted = folder, interrupted

    def read(self, submission: Submission, work: Path) -> ParsedSubmission:
        """Copy a submission into the existing folder `work`, and read the copy."""
        return read(submission, work / 'ws' / COPY, LAB_NODES[self.folder.lab],
                    self.folder.options.package, self.folder.options.name)

    def try_out(self, submission: Submission, reading: ParsedSubmission, work: Path) -> Marks:
        """Record the trial of a submission that was read in `work`. Returns the Marks without
        verdicts."""
        marks, identity = new_marks(submission), uuid.uuid4().hex
        marks.remarks, marks.findings = reading.remarks, reading.findings
        with suppress(FileNotFoundError):
            self.folder.bag(marks.student).unlink()
        try:
            self._record(marks, reading, work, identity)
        except NotJudged as problem:
            marks.unjudged = str(problem)
        finally:
            kill_processes(identity)
        return marks

    def _record(self, marks, reading, work, identity):
        """Record the trial of a submission. The Marks get the node's name and remarks."""
        workspace, record = work / 'ws', work / 'trial.bag'
        marks.path_prefixes = [f'{workspace}/{place}' for place in (
            f'{COPY}/{reading.package}/', COPY + '/', '')]
        if self.folder.options.sandbox:
            sandbox = Sandbox([workspace, work / 'etc'])
        else:
            sandbox = NoSandbox() if os.geteuid() else OtherUser()
        environment = trial_environment(work, dict(os.environ, **{IDENTITY: identity}))
        launch = prepare(reading, workspace, environment, sandbox)
        marks.node = f'{launch.package}/{os.path.basename(launch.program)}'
        option = LABS[self.folder.lab].option
        if option is not None:
            marks.remarks.append(option.as_text(self.folder.options.option))
        sandbox.hand_over(workspace)
        # the check itself must not import a module of the submission
        environment.update(launch.write(work / 'launch.json'))
        log = self.folder.logs / (marks.student + '.log')
        write_output(log, '')       # replaces a link by a new file
        with open(str(log), 'w') as file:
            command = sandbox.own_network(self._rostest(marks.node, work))
            in_time = self._check(command, environment, file)
        if not in_time:
            marks.remarks.append(f'It was stopped after {TIME_LIMIT:g} s, the limit.')
        if self.interrupted.is_set():
            raise MarkingInterrupted('interrupted')
        if not record.exists():
            raise NotJudged(f'The check left no record; see {log}.')
        write_output(self.folder.bag(marks.student), record.read_bytes())
        printed = '\n'.join(process.printed for process in read_trial(record).processes)
        marks.findings += version_errors(printed, workspace / COPY)

    def _rostest(self, node, work):
        """Returns the command that checks package/file `node` and records the bag."""
        (package, executable), lab = node.split('/'), self.folder.lab
        command = ['rostest', OWN_PACKAGE, f'check_{lab}.test', f'pkg:={package}',
                   f'type:={executable}', 'parts:=' + ','.join(self.folder.parts),
                   f"record:={work / 'trial.bag'}", f"truth:={work / 'truth'}"]
        if LABS[lab].option:
            command.append(f'{LABS[lab].option.name}:={self.folder.options.option}')
        return command

    def _check(self, command, environment, output):
        """Run a check until its end, the time limit, or an interruption. Returns False if the check
        exceeded the limit."""
        check = subprocess.Popen(
            command, env=environment, cwd=environment['ROS_HOME'], stdin=subprocess.DEVNULL,
            stdout=output, stderr=output, start_new_session=True)
        begun = time.monotonic()
        while check.poll() is None and not self.interrupted.wait(POLL_PERIOD) and (
                time.monotonic() < begun + TIME_LIMIT):
            pass
        in_time = check.poll() is not None or self.interrupted.is_set()
        kill_processes(environment[IDENTITY])
        check.wait()
        return in_time


def new_marks(submission: Submission, unjudged: str = '') -> Marks:
    """Returns the Marks of a submission before its trial."""
    return Marks(submission.student, number=submission.number, late=submission.late,
                 unjudged=unjudged)


# -- the end of all processes

def kill_processes(identity: str) -> None:
    """Kill all processes that have `identity` in their environment, also processes that left their
    process group.

    A program may start processes faster than this function finds them. Therefore all processes are
    stopped before the first one is killed. A stopped process starts nothing, and its number stays
    in use.
    """
    mark = f'{IDENTITY}={identity}'.encode()
    empty_searches = 0
    while empty_searches < 2:   # a process that starts a program has no environment for a moment
        stopped: Set[int] = set()
        while _stop_more(mark, stopped):
            pass
        empty_searches = 0 if stopped else empty_searches + 1
        for pid in stopped:
            with suppress(ProcessLookupError):      # it has ended already
                if _has(pid, mark):     # not a new process with the same number
                    os.kill(pid, signal.SIGKILL)


def _stop_more(mark, stopped):
    """Stop the processes that have `mark` and are not in `stopped`, the newest first, and their
    process groups. Add them to `stopped`. Returns False if no process was found."""
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

def trial_environment(work: Path, environment: Mapping[str, str]) -> Dict[str, str]:
    """Returns the environment of a separate ROS that writes only below the existing folder `work`.
    """
    settings, home = work / 'etc', work / 'ros'
    settings.mkdir(exist_ok=True)
    home.mkdir(exist_ok=True)
    logging = settings / 'logging.yaml'
    logging.write_text(LOGGING_CONFIG)
    # an empty file: roscore starts no rosout, which would write all log lines into a file
    (settings / 'roscore.xml').write_text('<launch/>')
    return dict(environment, TMPDIR=str(work), ROS_HOSTNAME='localhost', ROS_HOME=str(home),
                ROS_LOG_DIR=str(work / 'log'), ROS_ETC_DIR=str(settings),
                ROS_PYTHON_LOG_CONFIG_FILE=str(logging),
                ROS_TEST_RESULTS_DIR='results')     # in ROS_HOME: rostest cuts a path at a blank


def marking_environment(prefix: Path, caller: Mapping[str, str]) -> Dict[str, str]:
    """Returns an environment with two prefixes: the prefix of ROS, and the new folder `prefix` with
    links to the files of this package.

    A workspace of the `caller` may have this package beside an instructor's nodes and messages.
    These must not replace a submission's nodes and messages. Therefore such a workspace is no
    prefix of the environment.
    """
    prefixes, modules = (caller.get(name, '').split(':') for name in (PREFIXES, MODULES))
    for place, folders in (('share', [rospkg.RosPack().get_path(OWN_PACKAGE)]),
                           ('lib', [folder + '/lib/' + OWN_PACKAGE for folder in prefixes]),
                           (PYTHON_FOLDER, [folder + '/' + OWN_PACKAGE for folder in modules])):
        own = prefix / place / OWN_PACKAGE
        own.mkdir(parents=True)
        first, *_ = list(filter(os.path.isdir, folders)) or ['']
        for name in os.listdir(first) if first else []:
            (own / name).symlink_to(os.path.join(os.path.abspath(first), name))
    (prefix / '.catkin').touch()
    site = Path(sys.prefix).parent / 'devel' / PYTHON_FOLDER / 'sitecustomize.py'
    if site.is_file():      # setup.sh repairs rospy of Debian 11 by it
        shutil.copy(str(site), str(prefix / PYTHON_FOLDER))
    ros = [folder for folder in prefixes if os.path.isdir(folder + '/share/rospy')][-1:]
    made = {name: value for name, value in caller.items() if INHERITED_VARIABLES.fullmatch(name)}
    for name, folder in PREFIX_FOLDERS.items():        # each program knows /usr
        made[name] = ':'.join(f'{each}/{folder}'.rstrip('/') for each in [str(prefix), *ros])
    made['PATH'] = ':'.join([os.path.dirname(sys.executable), made['PATH'], SYSTEM_PATH])
    return made
