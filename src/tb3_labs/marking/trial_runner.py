"""Records the trial of a submission. The lab's launch file check_LAB.test runs the trial.

Each submission has its own master, simulated robot, home and log folder, and a time limit. At the
end of the trial the marking kills all processes of the submission.
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
from typing import Dict, Mapping, Sequence, Set

import rospkg

from tb3_labs.command_line import printable, write_output
from tb3_labs.marking.intake.archives import NotJudged
from tb3_labs.marking.intake.sandbox import (
    CMAKE_PREFIX_PATH, PYTHONPATH, OtherUser, Protection, Sandbox)
from tb3_labs.marking.intake.submissions import ParsedSubmission, Submission, read_submission
from tb3_labs.marking.intake.workspace import COPY_FOLDER, prepare_workspace
from tb3_labs.marking.labs.gamepad import pad_text
from tb3_labs.marking.marks import Marks
from tb3_labs.marking.marks_folder import MarksFolder
from tb3_labs.marking.student_nodes import GAMEPAD, IDENTITY_VARIABLE, LAB_NODES, OWN_PACKAGE
from tb3_labs.marking.trial.from_bag import read_trial
from tb3_labs.marking.trial.observation import NodeProcess

#: The environment variables with these names are copied from the instructor's terminal.
INHERITED_VARIABLES = re.compile(
    'HOME|USER|LOGNAME|LANG|LANGUAGE|LC_[A-Z]+|TZ|TERM|ROS_(ROOT|DISTRO|VERSION|PYTHON_VERSION)|'
    'PYTHON(NOUSERSITE|DONTWRITEBYTECODE)|OPENBLAS_NUM_THREADS|SETUPTOOLS_USE_DISTUTILS')
PYTHON_FOLDER = 'lib/python3/dist-packages'
#: {environment variable: subfolder}. Each variable lists this subfolder of every install prefix.
PREFIX_FOLDERS = {CMAKE_PREFIX_PATH: '', PYTHONPATH: PYTHON_FOLDER, 'ROS_PACKAGE_PATH': 'share',
                  'LD_LIBRARY_PATH': 'lib', 'PATH': 'bin'}
SYSTEM_PATH = '/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin'
#: With this configuration, rospy's log lines go to the terminal, but not into files.
LOGGING_CONFIG = '''version: 1
disable_existing_loggers: false
root: {handlers: []}
handlers: {stream: {class: rosgraph.roslogging.RosStreamHandler}}
loggers: {rosout: {level: INFO, handlers: [stream], propagate: false}}
'''
TRIAL_TIMEOUT = 300.0       # [s]
POLL_PERIOD = 0.1           # [s]


class MarkingInterrupted(RuntimeError):
    """A person interrupted the marking."""


class TrialRunner:
    """Records the trials of a class. Several threads may use one TrialRunner at the same time."""

    def __init__(self, folder: MarksFolder, interrupted: threading.Event) -> None:
        """The bags and the logs are written into `folder`. When the event `interrupted` is set,
        each trial ends, and :meth:`try_out` raises MarkingInterrupted."""
        self.folder = folder
        self.interrupted = interrupted

    def read(self, submission: Submission, work: Path) -> ParsedSubmission:
        """Copy a submission into the existing folder `work` and read the copy."""
        options = self.folder.options_of(submission.student)
        return read_submission(submission, work / 'ws' / COPY_FOLDER, LAB_NODES[self.folder.lab],
                               options.package, options.name)

    def try_out(self, submission: Submission, parsed: ParsedSubmission, work: Path) -> Marks:
        """Record the trial of a submission that `read` has copied into `work`. Returns the Marks
        without verdicts."""
        identity = uuid.uuid4().hex
        marks = marks_before_trial(submission)
        marks.remarks, marks.findings = parsed.remarks, parsed.findings
        self.folder.bag(marks.student).unlink(missing_ok=True)
        try:
            self._record_trial(marks, parsed, work, identity)
        except NotJudged as error:
            marks.unjudged = str(error)
        finally:
            kill_processes(identity)
        return marks

    def _record_trial(self, marks, parsed, work, identity):
        """Run the check on the node in a workspace, and keep the bag that the check records."""
        workspace = work / 'ws'
        copy = f'{workspace}/{COPY_FOLDER}/'
        marks.path_prefixes = [f'{copy}{parsed.package_folder}/', copy, f'{workspace}/']
        if self.folder.options.sandbox:
            protection = Sandbox([workspace, work / 'etc'])
        elif os.geteuid() == 0:
            protection = OtherUser()
        else:
            protection = Protection()
        environment = make_trial_environment(work, {**os.environ, IDENTITY_VARIABLE: identity})
        node_start = prepare_workspace(parsed, workspace, environment, protection)
        marks.node = node_start.name
        if self.folder.lab == GAMEPAD:
            marks.remarks.append(pad_text(self.folder.options.pad))
        protection.hand_over(workspace)
        # The node's environment is written into a file. If the check itself had this environment,
        # the check would import modules of the submission.
        environment.update(node_start.write(work / 'launch.json'))
        log = self.folder.logs / (marks.student + '.log')
        write_output(log, '')       # replaces a link by a file, so that open() follows no link
        with open(str(log), 'w') as file:
            command = protection.check_command(self._rostest_command(marks.node, work))
            is_in_time = self._run_check(command, environment, file)
        if not is_in_time:
            marks.remarks.append(f'It was stopped after {TRIAL_TIMEOUT:g} s, the limit.')
        if self.interrupted.is_set():
            raise MarkingInterrupted('interrupted')
        self._keep_bag(work / 'trial.bag', marks, log)

    def _keep_bag(self, bag, marks, log):
        """Copy the bag of a trial into the folder. Raises ``NotJudged`` if the bag is missing or
        damaged, or if the node could not import a module."""
        if not bag.exists():
            raise NotJudged(f'The check left no record; see {log}.')
        write_output(self.folder.bag(marks.student), bag.read_bytes())
        try:
            processes = read_trial(bag).processes
        except ValueError as error:
            raise NotJudged(f'Its trial cannot be judged: {error}.') from None
        failed_import = import_error(processes)
        if failed_import:
            raise NotJudged(f'{marks.node} ended at once: {failed_import}.')

    def _rostest_command(self, node, work):
        package, executable = node.split('/')
        command = ['rostest', OWN_PACKAGE, f'check_{self.folder.lab}.test', f'pkg:={package}',
                   f'type:={executable}', 'parts:=' + ','.join(self.folder.parts),
                   f"record:={work / 'trial.bag'}", f"truth:={work / 'truth'}"]
        if self.folder.lab == GAMEPAD:
            command.append(f'pad:={self.folder.options.pad}')
        return command

    def _run_check(self, command, environment, output):
        """Run a check until it ends, a person interrupts the marking, or the time limit is reached.
        Returns True if the time limit was not reached."""
        check = subprocess.Popen(
            command, cwd=environment['ROS_HOME'], env=environment, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=output, stderr=output)
        deadline = time.monotonic() + TRIAL_TIMEOUT
        while time.monotonic() < deadline:
            if check.poll() is not None or self.interrupted.wait(POLL_PERIOD):
                break
        is_in_time = check.poll() is not None or self.interrupted.is_set()
        kill_processes(environment[IDENTITY_VARIABLE])
        check.wait()
        return is_in_time


def import_error(processes: Sequence[NodeProcess]) -> str:
    """Returns the text of the ImportError that ended the node's first process, or '' if there was
    none. The student's machine may have the missing module, so the node is then not judged."""
    if not processes or processes[0].ready is not None:
        return ''
    last_line = processes[0].printed.rstrip().split('\n')[-1]
    is_import_error = last_line.startswith(('ModuleNotFoundError: ', 'ImportError: '))
    return printable(last_line) if is_import_error else ''


def marks_before_trial(submission: Submission, unjudged: str = '', advice: str = '') -> Marks:
    """Returns the Marks of a submission before its trial. `unjudged` and `advice` are those of a
    NotJudged, or ''."""
    return Marks(submission.student, number=submission.number, late=submission.is_late,
                 unjudged=unjudged, findings=[advice] if advice else [])


def kill_processes(identity: str) -> None:
    """Kill all processes that have `identity` in their environment. A program may start processes
    faster than this function finds them. Therefore all processes are first stopped and then killed.
    A stopped process starts nothing and keeps its process id."""
    variable = f'{IDENTITY_VARIABLE}={identity}'.encode()
    empty_searches = 0
    # one search may miss a process that is starting a program and has no environment yet
    while empty_searches < 2:
        stopped_pids: Set[int] = set()
        while _stop_more_processes(variable, stopped_pids):
            pass
        empty_searches = 0 if stopped_pids else empty_searches + 1
        for pid in stopped_pids:
            with suppress(ProcessLookupError):      # the process has ended already
                if _has_in_environment(pid, variable):  # else the pid belongs to a new process now
                    os.kill(pid, signal.SIGKILL)


def _stop_more_processes(variable, stopped_pids):
    """Stop the processes that have `variable` in their environment, and their process groups. Add
    the processes to `stopped_pids`. Returns True if the search found a further process."""
    old_count = len(stopped_pids)
    pids = [int(name) for name in os.listdir('/proc') if name.isdigit()]
    for pid in sorted(pids, reverse=True):      # the newest first
        if pid not in stopped_pids and _has_in_environment(pid, variable):
            with suppress(ProcessLookupError):      # the process has ended already
                group = os.getpgid(pid)
                os.kill(pid, signal.SIGSTOP)
                if group != os.getpgrp():       # this process must not stop itself
                    os.killpg(group, signal.SIGSTOP)
            stopped_pids.add(pid)
    return len(stopped_pids) > old_count


def _has_in_environment(pid, variable):
    try:
        return variable in Path(f'/proc/{pid}/environ').read_bytes().split(b'\0')
    except OSError:
        return False


def make_trial_environment(work: Path, environment: Mapping[str, str]) -> Dict[str, str]:
    """Returns the environment of a separate ROS, which writes only into the folder `work`."""
    settings = work / 'etc'
    home = work / 'ros'
    settings.mkdir(exist_ok=True)
    home.mkdir(exist_ok=True)
    logging_file = settings / 'logging.yaml'
    logging_file.write_text(LOGGING_CONFIG)
    # with this empty file, roscore does not start rosout, which would write a file of log lines
    (settings / 'roscore.xml').write_text('<launch/>')
    return dict(environment, TMPDIR=str(work), ROS_HOSTNAME='localhost', ROS_HOME=str(home),
                ROS_LOG_DIR=str(work / 'log'), ROS_ETC_DIR=str(settings),
                ROS_PYTHON_LOG_CONFIG_FILE=str(logging_file),
                ROS_TEST_RESULTS_DIR='results')     # rostest cuts an absolute path at a blank


def make_marking_environment(prefix: Path, caller: Mapping[str, str]) -> Dict[str, str]:
    """Make the folder `prefix` with links to the files of this package. Returns an environment with
    two install prefixes, which are `prefix` and the prefix of ROS. `caller` is the environment of
    the instructor's terminal. The instructor's workspaces are left out, so that their nodes and
    messages do not replace those of a submission."""
    prefixes = caller.get(CMAKE_PREFIX_PATH, '').split(':')
    python_paths = caller.get(PYTHONPATH, '').split(':')
    _link_files(prefix / 'share', [rospkg.RosPack().get_path(OWN_PACKAGE)])
    _link_files(prefix / 'lib', [f'{folder}/lib/{OWN_PACKAGE}' for folder in prefixes])
    _link_files(prefix / PYTHON_FOLDER, [f'{folder}/{OWN_PACKAGE}' for folder in python_paths])
    (prefix / '.catkin').touch()
    site = Path(sys.prefix).parent / 'devel' / PYTHON_FOLDER / 'sitecustomize.py'
    if site.is_file():      # setup.sh writes this file to repair the rospy of Debian 11
        shutil.copy(str(site), str(prefix / PYTHON_FOLDER))
    prefixes_with_rospy = [folder for folder in prefixes if os.path.isdir(folder + '/share/rospy')]
    ros_prefix_if_any = prefixes_with_rospy[-1:]    # ROS comes after the workspaces
    roots = [str(prefix), *ros_prefix_if_any]
    variables = {name: value for name, value in caller.items()
                 if INHERITED_VARIABLES.fullmatch(name)}
    for name, folder in PREFIX_FOLDERS.items():
        variables[name] = ':'.join(f'{root}/{folder}'.rstrip('/') for root in roots)
    variables['PATH'] = ':'.join([os.path.dirname(sys.executable), variables['PATH'], SYSTEM_PATH])
    return variables


def _link_files(parent, folders):
    """Make `parent`/tb3_labs with links to the files of the first existing folder in `folders`."""
    own_folder = parent / OWN_PACKAGE
    own_folder.mkdir(parents=True)
    existing_folders = [folder for folder in folders if os.path.isdir(folder)]
    if existing_folders:
        first_folder = os.path.abspath(existing_folders[0])
        for name in os.listdir(first_folder):
            (own_folder / name).symlink_to(os.path.join(first_folder, name))
