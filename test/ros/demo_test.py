#!/usr/bin/env python3
"""The demonstration succeeds by its own result and by the true pose. The report of its recording
has the same errors for each drive."""
import glob
import math
import os
import time
import unittest
import xmlrpc.client

import rosgraph
import rospkg
import rospy
import rostest

from tb3_labs.report.analysis import drives
from tb3_labs.report.epochs import epochs
from tb3_labs.robot.turtlebot3 import robot_model
from tb3_labs.ros.bags.reader import read_run
from tb3_labs.ros.testing.node_process import Program
from tb3_labs.ros.testing.ports import free_port

#: Both measure the robot at rest, so their poses differ only by a step or two of the encoders [m]
#: and ten times the noise of the IMU [deg].
OFF_BY = 0.0002, 0.05
#: The report's only origin is the first local_pose after a reset, whose heading is as noisy as the
#: reset's own: together 0.007 deg, 0.1 mm across after 0.86 m. The limits are five times that.
TRULY_OFF = 0.0005, 0.05


class DemoTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.path = rospy.get_param('demo/status_file')
        cls.addClassCleanup(lambda: [os.remove(file) for file in glob.glob(cls.path + '*')])

    def wait_for(self, what, is_there, seconds):
        deadline = time.monotonic() + seconds
        while not is_there():
            self.assertLess(time.monotonic(), deadline, what)
            time.sleep(0.1)

    def wait_for_the_end(self):
        self.wait_for('no status was written', lambda: os.path.exists(self.path)
                      and os.path.getsize(self.path), 120.0)

    def test_both_drives_are_good(self):
        self.wait_for_the_end()
        with open(self.path) as status:
            self.assertEqual(status.read(), '0\n')

    def test_the_report_says_what_the_demonstration_said(self):
        self.wait_for_the_end()
        said = rospy.get_param('demo/result')
        run = read_run(self.bag())
        reported = drives(run, robot_model('burger'))
        self.assertEqual(len(epochs(run)) - 1, len(said) - 1, 'resets')
        self.assertEqual([drive.outcome for drive in reported], ['reached'] * len(said))
        for number, (drive, told) in enumerate(zip(reported, said), 1):
            self.compare('drive {}: off by'.format(number), drive.measured, told['off_by'], OFF_BY)
            self.compare('drive {}: truly off'.format(number), drive.true, told['truly_off'],
                         TRULY_OFF)

    def compare(self, what, reported, told, tolerance):
        reported = reported[0], abs(math.degrees(reported[1]))
        for value, expected, most, unit in zip(reported, told, tolerance, ('m', 'deg')):
            self.assertLess(abs(value - expected), most, '{} {:.5f} {}, and the demonstration said '
                            '{:.5f}'.format(what, value, unit, expected))    # NaN is not less

    def bag(self):
        """The complete recording."""
        recorder = rosgraph.Master(rospy.get_name()).lookupNode('/record')
        xmlrpc.client.ServerProxy(recorder).shutdown(rospy.get_name(), 'the demonstration is over')
        self.wait_for('no bag was written', lambda: glob.glob(self.path + '_*.bag'), 60.0)
        path, = glob.glob(self.path + '_*.bag')
        return path

    def test_ctrl_c_ends_the_script_at_once_without_a_word(self):
        """Also while its programs start, which print tracebacks then."""
        script = os.path.join(rospkg.RosPack().get_path('tb3_labs'), 'scripts', 'demo.sh')
        runs = []
        for _ in range(3):
            uri = 'http://localhost:{}'.format(free_port())
            run = Program([script, 'web:=false', 'stay:=true'], terminal=True,
                          environment={'ROS_MASTER_URI': uri})
            self.addCleanup(run.kill)
            runs.append((run, uri))
        for (run, uri), after in zip(runs, (0.3, 0.7, 1.0)):    # at 0.3 s, 1 s and 2 s
            time.sleep(after)
            self.assertEqual(run.end(), 130)
            self.assertEqual(run.text, '')
            self.assertFalse(rosgraph.is_master_online(uri), uri)


if __name__ == '__main__':
    rospy.init_node('demo_test')
    rostest.rosrun('tb3_labs', 'demo_test', DemoTest)
