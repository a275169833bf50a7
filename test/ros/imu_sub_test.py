"""The output of imu_sub, against the simulated robot's true heading."""
import math
import re

import rospy
from std_msgs.msg import Float32

from node_case import STARTING, NodeCase

LINE = re.compile(r'Current heading is (\d+\.\d{6}) degrees\.$')


class ImuSubTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.watch_data(Float32, 'heading')
        cls.observer.wait_for('ground_truth')

    def test_prints_at_most_ten_lines_a_second_and_publishes_every_message(self):
        begun = rospy.get_time()
        node = self.start('imu_sub.py')
        self.observer.wait_until(lambda: len(self.observer.all('heading')) >= 400, STARTING,
                                 'headings of two seconds')
        self.assertEqual(node.end(), 0)
        lines, headings = node.lines, [heading for _, heading in self.observer.all('heading')]
        # one of 20 messages; the test hears a few messages less than the node, and a late machine
        # delivers several at once
        expected, late = len(headings) / 20.0, 10.0 * self.hiccups.since(begun)
        self.assertTrue(0.9 * expected - late <= len(lines) - 1 <= expected + 5.0 + late,
                        (len(lines), len(headings), late))
        truth = math.degrees(self.observer.latest('ground_truth').yaw) + 20.0    # the IMU's offset
        for heading in [float(LINE.search(line).group(1)) for line in lines[:-1]] + headings:
            self.assertLess(abs(math.remainder(heading - truth, 360.0)), 0.1)
        self.assertTrue(lines[-1].endswith('Shutting down the IMU subscriber'), lines[-1])
