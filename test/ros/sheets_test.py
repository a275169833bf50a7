"""Types the commands of the pages, as a student would, and reads what they print.

The lab sheets come first. Then sheets_walk.md has the commands that stand in sentences and tables. sheets_steps.py
reads the steps of a page. In the suite the simulated robots send fewer samples, which costs less. With `all:=true` the
test types also the long commands, and each command as it is printed.
"""
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import rospkg
import rospy

from masters import free_port
from node_case import TestProgram, plain_node
from rosunit_internals import needs_setup
from sheets_steps import promised, steps_of

os.environ.pop('ROS_NAMESPACE', None)
PACKAGE = Path(rospkg.RosPack().get_path('tb3_labs'))
REPOSITORY = (PACKAGE / 'README.md').resolve().parent
PAGES = ('doc/imu_lab.md', 'doc/transformation_lab.md', 'test/ros/sheets_walk.md',
         'doc/instructor/nodes.md', 'doc/instructor/teaching.md', 'doc/setup.md')
#: A student's terminal, before the first command.
PROFILE = '''set -e
if [ -e ~/catkin_ws/devel/setup.bash ]; then source ~/catkin_ws/devel/setup.bash
else source ~/tb3_labs/scripts/setup.sh; fi
'''
#: A command that changes what PROFILE gives.
NEW_PROFILE = re.compile('catkin_make|setup')
#: A command that starts a simulated robot.
ROBOT = re.compile(r'^(roslaunch .*(?:sim:=true|(fake_robot)\.launch).*?)(\s+#.*)?$', re.MULTILINE)
#: The setting of such a robot in the suite.
FEW_SAMPLES = 'imu_rate: 30'
#: {a name in a command: what a reader types in its place}
OWN_NAMES = {'run_DATE.bag': '$(ls -t run_*.bag | head -1)', 'REPOSITORY': '~/tb3_labs'}
#: Longest wait for the end or the output of a command, and of a long command [s].
PATIENCE, LONG_PATIENCE = 120.0, 400.0
#: A command that asks a node is typed again for this time [s], since nodes are starting.
AGAIN, ASKS = 10.0, re.compile('rostopic|rosservice|rosnode')
#: `timeout` ends such a command with the status 124, which is a success here.
TIMED, SUCCEEDS = re.compile(r'^(timeout .*?)(\s+# .*)?$', re.MULTILINE), r'\1 || [ $? = 124 ]'
#: A terminal must not show this after Ctrl+C. (Python that still imports modules prints KeyboardInterrupt.)
BAD_END = re.compile(r'Traceback(?!(?s:.)*KeyboardInterrupt)|escalating|Exception in thread')
#: Python 3.13 does not end while a thread waits in input(): Enter ends it (doc/symptoms.md).
PYTHON_WAITS = sys.version_info >= (3, 13)
#: The characters that change a terminal's colour.
COLOUR = re.compile(r'\x1b\[[\d;]*m')


def with_few_samples(found):
    """Returns a command found by ROBOT, with FEW_SAMPLES."""
    command, is_robot_alone, _ = found.groups()
    given = ' set:="{' if is_robot_alone else ' robot_set:="{'
    if given in command:
        return command.replace(given, given + FEW_SAMPLES + ', ')
    return command + given + FEW_SAMPLES + '}"'


def plain(text):
    """The part of a terminal's text that a person reads."""
    return COLOUR.sub('', text)


class Student:
    """The home of a student with a workspace, and the student's terminals."""

    def __init__(self, home, types_all):
        """`types_all` says whether the student types each command as it is printed."""
        self.home, self._types_all, self._terminals, self._seen = home, types_all, {}, {}
        (home / 'tb3_labs').symlink_to(REPOSITORY)
        self._environment = {
            'HOME': str(home), 'PATH': '/usr/bin:/bin', 'ROSCONSOLE_FORMAT': '${message}',
            # make must not wait for a quiet machine, as it does by catkin_make's -l2
            'TERM': 'dumb', 'ROS_PARALLEL_JOBS': '-j2',
            'ROS_LANG_DISABLE': 'gencpp:geneus:genlisp:gennodejs',
            'ROS_MASTER_URI': 'http://localhost:{}'.format(free_port()),
            'SETUPTOOLS_USE_DISTUTILS': os.environ.get('SETUPTOOLS_USE_DISTUTILS', 'local'),    # see test.sh
            'OPENBLAS_NUM_THREADS': '1'}
        self._sourced = None    # the environment after PROFILE, if that has not changed since

    def do(self, step):
        """Do one step. Raises AssertionError if its outcome is not what the page says."""
        patience = LONG_PATIENCE if step.kind == 'long' else PATIENCE
        self._prepare(step.before)
        if step.kind == 'heading':
            self.end_all()
        elif step.kind == 'types':
            self._look()
            for line in step.text.splitlines():
                self._terminals[step.argument].type(line)
        elif step.kind == 'then':
            self._wait_for_output(step.argument, step.output, patience)
        elif step.argument:
            self._end(step.argument)
            self._look()
            self._terminals[step.argument] = self._start(step)
            self._wait_for_output(step.argument, step.output, patience)
        else:
            self._look()
            self._run(step, patience)

    def _prepare(self, before):
        """Do what stands in front of a step. Write a node, let time pass, or end a terminal."""
        if 'fill' in before:
            package, node = before['fill'].split('/')
            target = self.home / 'catkin_ws' / 'src' / package / 'src' / node
            assert target.exists(), target
            target.write_text(plain_node(node, package))
        if 'wait' in before:
            time.sleep(float(before['wait']))
        if 'ends' in before:
            self._end(before['ends'])

    def _look(self):
        """A `then` sees only the text that the terminals print from now on."""
        self._seen = {name: len(program.text) for name, program in self._terminals.items()}

    def _run(self, step, patience):
        """Run a command to its end. Run it again if it asks a node that does not answer yet."""
        pattern, give_up = promised(step.output), time.monotonic() + AGAIN
        while True:
            program = self._start(step)
            try:
                status = program.wait(patience)
            finally:
                program.kill()
            if status == 0 and pattern.search(plain(program.text)):
                break
            assert ASKS.match(step.text) and time.monotonic() < give_up, 'status {}, printed:\n{}'.format(
                status, program.text)
        if NEW_PROFILE.search(step.text):
            self._sourced = None

    def _start(self, step):
        commands = TIMED.sub(SUCCEEDS, step.text)
        for name, own in OWN_NAMES.items():
            commands = commands.replace(name, own)
        if not self._types_all:
            commands = ROBOT.sub(with_few_samples, commands)
        folder = 'cd ~/tb3_labs\n' if re.match(r'(source |\./)scripts/', commands) else 'cd\n'
        self._sourced = self._sourced or self._source()
        return TestProgram(['bash', '-c', 'set -e\n' + folder + commands], terminal=True,
                           environment=self._sourced, clean=True)

    def _source(self):
        """Returns the environment of a new terminal. A sourcing takes as long as a command."""
        printed = subprocess.run(['bash', '-c', PROFILE + 'env -0'], env=self._environment, check=True,
                                 stdout=subprocess.PIPE, timeout=PATIENCE).stdout.decode()
        return dict(line.split('=', 1) for line in printed.split('\0') if '=' in line)

    def _wait_for_output(self, name, output, seconds):
        """Wait until the terminal has printed `output` since the last _look."""
        pattern, program, give_up = promised(output), self._terminals[name], time.monotonic() + seconds
        while not pattern.search(plain(program.text[self._seen.get(name, 0):])):
            assert time.monotonic() < give_up, 'not within {} s: {}; printed:\n{}'.format(
                seconds, output, program.text[self._seen.get(name, 0):])
            assert program.status is None, 'ended; printed:\n' + program.text
            time.sleep(0.05)

    def end_all(self):
        """Press Ctrl+C in each terminal."""
        for name in list(self._terminals):
            self._end(name)

    def close_all(self):
        """End the programs that still run after a failure. roslaunch must end its nodes itself."""
        for program in self._terminals.values():
            try:
                program.end(signal.SIGTERM, 20.0)
            except RuntimeError:
                program.kill()

    def _end(self, name):
        program = self._terminals.get(name)
        if program is not None:
            program.send(signal.SIGINT)
            give_up = time.monotonic() + 10.0
            while PYTHON_WAITS and program.status is None and time.monotonic() < give_up:
                time.sleep(0.5)
                program.type('')
            program.wait(20.0)
            del self._terminals[name]
            assert not BAD_END.search(program.text), 'after Ctrl+C:\n' + program.text


@needs_setup
class SheetsTest(unittest.TestCase):
    """One student's term."""
    IS_NODE = False

    def test_the_pages_say_what_happens(self):
        home = Path(tempfile.mkdtemp(prefix='sheets_', dir='/tmp'))    # not within this package
        self.addCleanup(shutil.rmtree, str(home))
        types_all = rospy.get_param('/sheets_all')
        student = Student(home, types_all)
        self.addCleanup(student.close_all)
        for page in PAGES:
            left_out = False
            for step in steps_of((REPOSITORY / page).read_text(encoding='utf-8')):
                if step.kind in ('run', 'long', 'heading'):
                    left_out = step.kind == 'long' and not types_all
                if step.kind == 'never' or left_out:
                    continue
                began = time.monotonic()
                try:
                    student.do(step)
                except (AssertionError, RuntimeError) as error:
                    self.fail('{}, line {}: {}\n{}'.format(page, step.line, step.text, error))
                print('{:6.1f} s  {}:{}  {}'.format(time.monotonic() - began, page, step.line, step.text.split(
                    '\n')[0] or step.argument), flush=True)
            student.end_all()
