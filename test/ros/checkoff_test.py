#!/usr/bin/env python3
"""checkoff.py beside a student's node: the test is the person who types into both terminals."""
import re
import sys
import tempfile
import time
import unittest
from pathlib import Path

import rosbag
import rosgraph
import rospkg
import rostest
import rospy

from tb3_labs.ros.program import Observer

from node_case import Program, path_of, watch_robot

NODES = Path(rospkg.RosPack().get_path('tb3_labs')) / 'test' / 'ros' / 'student_nodes'
#: The person is asked to type a word, or to answer.
TASK = re.compile(r'^> .* type (\w+), then Enter\.$|^(\?) .*\[y/n\] ', re.MULTILINE)
#: A checkoff of the turns takes no longer [s].
LONGEST = 150.0


class CheckoffTest(unittest.TestCase):

    def test_a_student_is_checked_off(self):
        seen = Observer()
        watch_robot(seen)
        # without a true pose, as with a real robot
        checkoff, student, folder = self.start('turtlebot_controller.py', [
            'turn', '--parts', 'turns', '--name', 'Ann Miller', 'ground_truth:=nowhere'])
        self.work(checkoff, student)
        printed = checkoff.text
        self.assertEqual(checkoff.wait(), 0, printed)
        self.assertIn('Judged by odometry and IMU', printed)
        self.assertRegex(printed, r'Ann Miller: 14 of 14 points, 20\d\d-\d\d-\d\d \d\d:\d\d, '
                                  r'IMU lab \(turns\), node /controller')
        self.assertEqual(len(re.findall('^  met ', printed, re.MULTILINE)), 7, printed)
        for criterion in ('l turns 90 degrees left', 'where it jumps', 'names the valid'):
            self.assertRegex(printed, '  met +[123] of [123] .*' + criterion)
        self.assert_nothing_was_done(student, seen)
        bag, = folder.glob('checkoff_turn_Ann_Miller_*.bag')
        self.assertIn(str(bag), printed)
        with rosbag.Bag(str(bag)) as recorded:
            self.assertGreater(recorded.get_message_count('/cmd_vel'), 10)

    def test_a_gamepad_is_played_and_let_go(self):
        checkoff, student, _ = self.start('gamepad.py', ['gamepad', '--parts', 'sticks'])
        checkoff.wait_for('Watch it again: ', 30.0)
        self.assertEqual(checkoff.wait(), 0, checkoff.text)
        self.assertRegex(checkoff.text, r"simulated robot's true pose[\s\S]*: 7 of 7 points")
        student.end()

    def start(self, node, words):
        """Start a student's node and a checkoff of it: (checkoff, node, folder of the bag)."""
        folder = tempfile.TemporaryDirectory(prefix='checkoff_')
        self.addCleanup(folder.cleanup)
        place = Path(folder.name) / node
        place.write_text((NODES / node).read_text().replace('from lab2.', 'from tb3_labs.'))
        student = Program([sys.executable, str(place)], terminal=True)
        self.addCleanup(student.kill)
        checkoff = Program([path_of('checkoff.py'), '-o', folder.name] + words, terminal=True)
        self.addCleanup(checkoff.kill)
        return checkoff, student, Path(folder.name)

    def work(self, checkoff, student):
        """Do what the checkoff asks for, until it has ended."""
        done, deadline = 0, time.monotonic() + LONGEST
        while checkoff.status is None:
            self.assertLess(time.monotonic(), deadline, checkoff.text)
            self.assertIsNone(student.status, student.text)
            tasks = list(TASK.finditer(checkoff.text))
            for task in tasks[done:]:
                if task.group(1):
                    student.type(task.group(1))
                else:
                    time.sleep(0.2)     # what is typed before the question counts as no answer
                    checkoff.type('y')
            done = len(tasks)
            time.sleep(0.1)

    def assert_nothing_was_done(self, student, seen):
        """The student's node runs as before, the robot rests, and there is no other one."""
        self.assertIsNone(student.status, student.text)
        self.assertIn('Error: valid inputs are l and r', student.text)
        seen.wait_for_rest('ground_truth', seconds=10.0)
        publishers, _, _ = rosgraph.Master(rospy.get_name()).getSystemState()
        self.assertEqual({topic: nodes for topic, nodes in publishers
                          if topic in ('/imu', '/cmd_vel', '/mouse_info')},
                         {'/imu': ['/turtlebot3'], '/cmd_vel': ['/controller']})


if __name__ == '__main__':
    rospy.init_node('checkoff_test')
    rostest.rosrun('tb3_labs', 'checkoff', CheckoffTest)
