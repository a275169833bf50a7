#!/usr/bin/env python3
"""The skeletons in an empty workspace: written, built, started by their launch files, ended.

The marks that they earn are in mark_test.py.
"""
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import rosgraph
import rostest

from tb3_labs.marking.labs import LABS
from tb3_labs.ros.program import Program

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from node_case import STARTING, path_of    # noqa: E402 (a relay's folder)

#: What each skeleton says by itself: its open TODOs that are met without a person. The robot of
#: move2goal is the robot of all four.
SAID = {
    'imu': [1, 2],
    'turn': [1, 2, 3, 4, 7],
    'move2goal': [1, 2, 3, 4],
    'gamepad': [1],
}
ARGUMENTS = {'turn': {'mouse': 'false'}, 'move2goal': {'sim': 'true'}, 'gamepad': {'joy': 'false'}}
SENTENCE = re.compile(r'TODO (\d+) is open: [^\'\r\n]+')


class SkeletonTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix='skeleton_')
        cls.workspace = Path(cls.folder.name)
        (cls.workspace / 'src').mkdir()
        cls.written = [cls.write(lab) for lab in LABS]
        cls.built = subprocess.run(
            ['catkin_make', '--directory', str(cls.workspace)], stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, universal_newlines=True, timeout=STARTING)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def write(cls, *words):
        """Run skeleton.py in the workspace; a CompletedProcess."""
        return subprocess.run([path_of('skeleton.py'), *words, 'src'], cwd=str(cls.workspace),
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              universal_newlines=True, timeout=STARTING)

    def test_it_says_what_comes_next_in_one_line(self):
        for lab, done in zip(LABS, self.written):
            self.assertEqual((done.returncode, done.stderr), (0, ''))
            self.assertRegex(done.stdout, r'^/\S*/{} is written.*catkin_make.*roslaunch {} {}\.launch '
                             r'sim:=true\n$'.format(*[LABS[lab].packages[0]] * 2, lab))

    def test_it_overwrites_nothing(self):
        done = self.write('turn')
        self.assertEqual((done.returncode, done.stdout), (2, ''))
        self.assertRegex(done.stderr, r'^skeleton\.py: /\S*/lab2 is already there[^\n]*\n$')

    @staticmethod
    def wait_until_all_runs(program):
        """Wait until no topic or service is added any more. A node that is interrupted while it adds
        one hangs: rospy's handler of the signal waits for a lock that the interrupted thread holds.
        """
        address = re.search(r'ROS_MASTER_URI=(http://[\w.]+:\d+)', program.text).group(1)
        master = rosgraph.Master('/skeleton_test', address)
        before, now, deadline = None, master.getSystemState(), time.monotonic() + STARTING
        while now != before and time.monotonic() < deadline:
            time.sleep(1.0)
            before, now = now, master.getSystemState()

    def test_they_start_say_what_is_open_and_end(self):
        self.assertEqual(self.built.returncode, 0, self.built.stdout)
        program = self.start()
        expected = {said.group() for lab in LABS for said in SENTENCE.finditer(self.node(lab))
                    if int(said.group(1)) in SAID[lab]}
        self.assertEqual(len(expected), sum(map(len, SAID.values())))
        for sentence in expected:
            program.wait_for(sentence, STARTING)
        self.wait_until_all_runs(program)
        # roslaunch waits for 15 s before it ends a node by force
        self.assertEqual(program.end(seconds=14.0), 0, program.text)
        for goodbye in ('Shutting down the IMU subscriber', 'Controller exiting. Halting robot.'):
            self.assertIn(goodbye, program.text)
        self.assertNotRegex(program.text, 'Traceback|escalating|has died|[Ee]rror')
        said = [said.group() for said in SENTENCE.finditer(program.text)]
        self.assertEqual(sorted(said), sorted(expected), program.text)

    def node(self, lab):
        return (self.workspace / 'src' / LABS[lab].packages[0] / 'src' / LABS[lab].files[0]).read_text()

    def start(self):
        """Start the launch files of all labs in a terminal whose workspace is the student's."""
        everything = self.workspace / 'everything.launch'
        everything.write_text('<launch>{}</launch>'.format(''.join(
            '<include file="$(find {})/launch/{}.launch">{}</include>'.format(
                LABS[lab].packages[0], lab, ''.join(
                    '<arg name="{}" value="{}"/>'.format(*item) for item in sorted(
                        ARGUMENTS.get(lab, {}).items()))) for lab in LABS)))
        program = Program(['bash', '-c', 'source "$0"; exec roslaunch "$1"',
                           str(self.workspace / 'devel' / 'setup.bash'), str(everything)],
                          terminal=True)
        self.addCleanup(program.kill)
        return program


if __name__ == '__main__':
    rostest.rosrun('tb3_labs', 'skeleton', SkeletonTest)
