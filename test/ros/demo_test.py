#!/usr/bin/env python3
"""The demonstration ends with success by its own account, and by the true pose."""
import os
import time
import unittest

import rospy
import rostest


class DemoTest(unittest.TestCase):

    def test_both_drives_are_good(self):
        path = rospy.get_param('demo/status_file')
        self.addCleanup(lambda: os.path.exists(path) and os.remove(path))
        deadline = time.monotonic() + 45.0
        while not os.path.exists(path) or not os.path.getsize(path):
            self.assertLess(time.monotonic(), deadline, 'no status was written')
            time.sleep(0.1)
        with open(path) as status:
            self.assertEqual(status.read(), '0\n')


if __name__ == '__main__':
    rospy.init_node('demo_test')
    rostest.rosrun('tb3_labs', 'demo_test', DemoTest)
