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

#: Variables of the caller's terminal that the marking gets.
INHERITED_VARIABLES = re.compile(
    'HOME|USER|LOGNAME|LANG|LANGUAGE|LC_[A-Z]+|TZ|TERM|ROS_(ROOT|DISTRO|VERSION|PYTHON_VERSION)|'
    'PYTHON(NOUSERSITE|DONTWRITEBYTECODE)|OPENBLAS_NUM_THREADS|SETUPTOOLS_USE_DISTUTILS')
#: Variables that list these folders of each prefix.
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
    """Records the trials of a class. Several threads may use it at a time."""

    def __init__(self, folder: MarksFolder, interrupted: threading.Event) -> None:
        """`folder` says what is marked, and gets the bags and logs. Once `interrupted` is set, each
        trial is ended, and :meth:`try_out` raises MarkingInterrupted."""
        self.folder, self.interrupted = folder, interrupted

    def read(self, submission: Submission, work: Path) -> ParsedSubmission:
        """Copy a submission into `work`, an existing folder, and read it."""
        return read(submission, work / 'ws' / COPY, LAB_NODES[self.folder.lab],
                    self.folder.options.package, self.folder.options.name)

    def try_out(self, submission: Submission, reading: ParsedSubmission, work: Path) -> Marks:
        """Record the trial of a submission that was read in `work`. Returns its Marks, which are
        not judged yet."""
        marks, identity = new_marks(submission), uuid.uuid4().hex
        marks.remarks, marks.findings = reading.remarks, reading.findings   # they grow
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
        """Record the trial of a submission. Its Marks get the node's name and remarks."""
        workspace, record = work / 'ws', work / 'trial.bag'
        marks.places = [f'{workspace}/{place}' for place in (
            f'{COPY}/{reading.package}/', COPY + '/', '')]     # of no use to a student
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
        # the check has no module of the submission; only the node's own environment has them
        environment.update(launch.write(work / 'launch.json'))
        log = self.folder.logs / (marks.student + '.log')
        write_output(log, '')       # a new file, never through a link
        with open(str(log), 'w') as file:
            command = sandbox.own_network(self._rostest(marks.node, work))
            in_time = self._check(command, environment, file)
        if not in_time:
            marks.remarks.append(f'It was stopped after {LIMIT:g} s, the limit.')
        if self.interrupted.is_set():
            raise MarkingInterrupted('interrupted')
        if not record.exists():
            raise NotJudged(f'The check left no record; see {log}.')
        write_output(self.folder.bag(marks.student), record.read_bytes())
        printed = '\n'.join(run.printed for run in read_trial(record).runs)
        marks.findings += version_errors(printed, workspace / COPY)

    def _rostest(self, node, work):
        """Returns the command of the lab's check of package/file `node`, which records a bag."""
        (package, executable), lab = node.split('/'), self.folder.lab
        command = ['rostest', OWN_PACKAGE, f'check_{lab}.test', f'pkg:={package}',
                   f'type:={executable}', 'parts:=' + ','.join(self.folder.parts),
                   f"record:={work / 'trial.bag'}", f"truth:={work / 'truth'}"]
        if LABS[lab].option:
            command.append(f'{LABS[lab].option.name}:={self.folder.options.option}')
        return command

    def _check(self, command, environment, output):
        """Run a check until its end, the time limit, or an interruption. Returns False if it
        exceeded the limit."""
        check = subprocess.Popen(
            command, env=environment, cwd=environment['ROS_HOME'], stdin=subprocess.DEVNULL,
            stdout=output, stderr=output, start_new_session=True)
        begun = time.monotonic()
        while check.poll() is None and not self.interrupted.wait(POLL_PERIOD) and (
                time.monotonic() < begun + LIMIT):
            pass
        in_time = check.poll() is not None or self.interrupted.is_set()
        kill_processes(environment[IDENTITY])
        check.wait()
        return in_time


def new_marks(submission: Submission, unjudged: str = '') -> Marks:
    """Returns the Marks of a submission before its trial."""
    return Marks(submission.student, number=submission.number, late=submission.late,
                 unjudged=unjudged)


# -- the end

def kill_processes(identity: str) -> None:
    """Kill every process that has this identity in its environment, until there is none. Processes
    that left their group are killed too.

    A program may start processes faster than they are found. Therefore all of them are stopped
    before one is killed: a stopped process starts nothing, and its number stays in use.
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
                if _has(pid, mark):     # else another process may have its number by now
                    os.kill(pid, signal.SIGKILL)


def _stop_more(mark, stopped):
    """Stop the processes that have this mark and are not in `stopped`, the newest first, and their
    groups. Add them to `stopped`. Returns False if there were none."""
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
    """Returns the environment of a separate ROS that writes only below `work`, an existing
    folder."""
    settings, home = work / 'etc', work / 'ros'
    settings.mkdir(exist_ok=True)
    home.mkdir(exist_ok=True)
    logging = settings / 'logging.yaml'
    logging.write_text(LOGGING)
    # roscore starts no rosout, which would write all log lines into a file
    (settings / 'roscore.xml').write_text('<launch/>')
    return dict(environment, TMPDIR=str(work), ROS_HOSTNAME='localhost', ROS_HOME=str(home),
                ROS_LOG_DIR=str(work / 'log'), ROS_ETC_DIR=str(settings),
                ROS_PYTHON_LOG_CONFIG_FILE=str(logging),
                ROS_TEST_RESULTS_DIR='results')     # in ROS_HOME: rostest cuts a path at a blank


def marking_environment(prefix: Path, caller: Mapping[str, str]) -> Dict[str, str]:
    """Returns an environment that has two prefixes: ROS's own, and `prefix`, a new folder with
    links to the files of this package.

    A workspace of the `caller` may hold this package together with an instructor's nodes and
    messages. They must not replace a submission's, so such a workspace is not a prefix here.
    """
    prefixes, modules = (caller.get(name, '').split(':') for name in (PREFIXES, MODULES))
    for place, folders in (('share', [rospkg.RosPack().get_path(OWN_PACKAGE)]),
                           ('lib', [folder + '/lib/' + OWN_PACKAGE for folder in prefixes]),
                           (PYTHON, [folder + '/' + OWN_PACKAGE for folder in modules])):
        own = prefix / place / OWN_PACKAGE
        own.mkdir(parents=True)
        first, *_ = list(filter(os.path.isdir, folders)) or ['']
        for name in os.listdir(first) if first else []:
            (own / name).symlink_to(os.path.join(os.path.abspath(first), name))
    (prefix / '.catkin').touch()
    site = Path(sys.prefix).parent / 'devel' / PYTHON / 'sitecustomize.py'
    if site.is_file():      # setup.sh repairs rospy of Debian 11 by it
        shutil.copy(str(site), str(prefix / PYTHON))
    ros = [folder for folder in prefixes if os.path.isdir(folder + '/share/rospy')][-1:]
    made = {name: value for name, value in caller.items() if INHERITED_VARIABLES.fullmatch(name)}
    for name, folder in FOLDERS.items():        # each program knows /usr
        made[name] = ':'.join(f'{each}/{folder}'.rstrip('/') for each in [str(prefix), *ros])
    made['PATH'] = ':'.join([os.path.dirname(sys.executable), made['PATH'], SYSTEM])
    return made
