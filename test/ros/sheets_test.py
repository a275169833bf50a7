#!/usr/bin/env python3
"""Types the commands of the lab sheets, as a student would, and reads what they print.

A comment before each block of commands says how:

    <!-- run -->                  in a new terminal, to its end, which must be a success
    <!-- run: robot -->           in a terminal called robot, in which it goes on
    <!-- then: robot, types: l --> a line is typed into that terminal
    <!-- not run: reason -->      not here
    <!-- fill in: lab2 turtlebot_controller.py -->    the student has written this node

The block of output after any of the first three must appear, line after line, with other lines
between, before the next command is typed. A number of more than three digits may be another one,
and ... may be anything. A terminal that goes on is ended by Ctrl+C at the next heading, or when another block runs in it.
"""
import os
import re
import shutil
import signal
import socket
import tempfile
import time
import unittest
from pathlib import Path
from typing import NamedTuple

import rospkg
import rostest

from tb3_labs.ros.testing.node_process import Program

PACKAGE = Path(rospkg.RosPack().get_path('tb3_labs'))
REPOSITORY = (PACKAGE / 'README.md').resolve().parent
SHEETS = ('imu_lab.md', 'transformation_lab.md')
NODES = PACKAGE / 'test' / 'ros' / 'student_nodes'
#: A student's terminal, before the first command.
PROFILE = '''set -e
if [ -e ~/catkin_ws/devel/setup.bash ]; then source ~/catkin_ws/devel/setup.bash
else source ~/tb3_labs/scripts/setup.sh; fi
'''
#: A line that matters: heading, directive, or the fence of a block.
MARK = re.compile(r'^ *(?:(#+) (.*)|<!-- (run|then|not run|fill in)(?:: (.*?))? -->|```(\w*))$')
#: A command must have ended, and the output of a terminal must have come, by then [s].
PATIENCE = 60.0
#: A command that asks a node is typed again for so long, since nodes are starting [s].
AGAIN, ASKS = 10.0, re.compile('rostopic|rosservice')
#: A number that may be another one.
LONG_NUMBER, NUMBER = re.compile(r'-?(?:\d{4,}(?:\.\d+)?|\d+\.\d{3,})'), r'-?\d+(?:\.\d+)?(?:e-?\d+)?'
TYPES = re.compile(r'(\w+)(?:, types: (.*))?$')


class Step(NamedTuple):
    """A heading (its text), a node to fill in (package and file), or a block of commands."""

    kind: str           # heading, run, then, not run, fill in
    argument: str
    commands: str = ''
    output: str = ''
    line: int = 0


def steps_of(text):
    """The Steps of a sheet; AssertionError for commands without a directive."""
    steps, fence, directive = [], None, None
    for number, line in enumerate(text.splitlines(), 1):
        mark = MARK.match(line)
        if fence is not None:
            if mark and mark.group(5) == '':
                add_block(steps, fence, directive, number)
                fence, directive = None, None
            else:
                fence[1].append(line.strip())
        elif mark and mark.group(1):
            steps.append(Step('heading', mark.group(2), line=number))
        elif mark and mark.group(3) in ('fill in', 'then'):
            steps.append(Step(mark.group(3), mark.group(4), line=number))
        elif mark and mark.group(3):
            directive = mark.group(3), mark.group(4) or ''
        elif mark:
            fence = mark.group(5), []
    return steps


def add_block(steps, fence, directive, number):
    """Add a block's Step, or its text as the output of the step before it."""
    language, lines = fence
    if language == 'bash':
        assert directive, 'line {}: the block does not say whether it is run'.format(number)
        steps.append(Step(directive[0], directive[1], '\n'.join(lines), line=number))
    elif not language and steps and steps[-1].kind in ('run', 'then') and not steps[-1].output:
        steps[-1] = steps[-1]._replace(output='\n'.join(lines))


def promised(output):
    """A pattern of a text in which the lines of `output` appear, in their order."""
    return re.compile('.*?'.join(
        pattern_of(line) for line in output.splitlines() if line.strip(' .')), re.DOTALL)


def pattern_of(line):
    """A pattern of a line, with any space between its words, and any long numbers; ``...`` stands
    for anything."""
    return NUMBER.join(
        '.*?'.join(r'\s+'.join(re.escape(word) for word in re.split(r'\s+', words))
                   for words in part.split('...'))
        for part in LONG_NUMBER.split(line.strip()))


class Student:
    """A home with a workspace, and terminals."""

    def __init__(self, home):
        self.home, self._terminals = home, {}
        (home / 'tb3_labs').symlink_to(REPOSITORY)
        with socket.socket() as probe:
            probe.bind(('localhost', 0))
            port = probe.getsockname()[1]
        self._environment = {
            'HOME': str(home), 'PATH': '/usr/bin:/bin', 'ROSCONSOLE_FORMAT': '${message}',
            'TERM': 'dumb', 'ROS_MASTER_URI': 'http://localhost:{}'.format(port)}

    def do(self, step):
        """Do one step; AssertionError if it is not as the sheet says."""
        if step.kind == 'heading':
            self.end_all()
        elif step.kind == 'fill in':
            package, node = step.argument.split()
            target = self.home / 'catkin_ws' / 'src' / package / 'src' / node
            assert target.exists(), target
            target.write_text((NODES / node).read_text().replace('@PACKAGE@', package))
        elif step.kind == 'run' and step.argument:
            self._end(step.argument)
            self._terminals[step.argument] = self._start(step)
            self._wait_for_output(self._terminals[step.argument], step)
        elif step.kind == 'then':
            name, typed = TYPES.match(step.argument).groups()
            if typed:
                self._terminals[name].type(typed)
            self._wait_for_output(self._terminals[name], step)
        elif step.kind == 'run':
            self._run(step)

    def _run(self, step):
        """Run a command to its end; again if it asks a node that does not answer yet."""
        pattern, give_up = promised(step.output), time.monotonic() + AGAIN
        while True:
            program = self._start(step)
            try:
                status = program.wait(PATIENCE)
            finally:
                program.kill()
            if status == 0 and pattern.search(program.text):
                return
            assert ASKS.match(step.commands) and time.monotonic() < give_up, 'status {}, printed:\n{}'.format(
                status, program.text)

    def _start(self, step):
        return Program(['bash', '-c', PROFILE + 'cd\n' + step.commands], terminal=True,
                       environment=self._environment, clean=True)

    @staticmethod
    def _wait_for_output(program, step):
        program.wait_for_match(promised(step.output), PATIENCE)

    def end_all(self):
        """Press Ctrl+C in each terminal."""
        for name in list(self._terminals):
            self._end(name)

    def close_all(self):
        """End what still runs, after a failure; roslaunch alone can end its nodes."""
        for program in self._terminals.values():
            try:
                program.end(signal.SIGTERM, 20.0)
            except RuntimeError:
                program.kill()

    def _end(self, name):
        program = self._terminals.get(name)
        if program is not None:
            program.end(signal.SIGINT, 20.0)
            del self._terminals[name]


class SheetsTest(unittest.TestCase):
    """One student's term."""

    def setUp(self):
        self.home = Path(tempfile.mkdtemp(prefix='sheets_', dir='/tmp'))    # not within this package

    def tearDown(self):
        shutil.rmtree(str(self.home))

    def test_the_sheets_say_what_happens(self):
        student = Student(self.home)
        try:
            for sheet in SHEETS:
                for step in steps_of((REPOSITORY / 'doc' / sheet).read_text(encoding='utf-8')):
                    try:
                        student.do(step)
                    except (AssertionError, RuntimeError) as problem:
                        self.fail('doc/{}, line {}: {}\n{}'.format(
                            sheet, step.line, step.commands, problem))
                student.end_all()
        finally:
            student.close_all()


if __name__ == '__main__':
    os.environ.pop('ROS_NAMESPACE', None)
    rostest.rosrun('tb3_labs', 'sheets', SheetsTest)
