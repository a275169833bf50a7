"""The embedded robot's node on the wall clock: rates, cost, its end, and a hidden fault. The lines of imu_sub."""
import math
import re
import signal
import time

import rosgraph
import rospy
from dynamic_reconfigure.msg import Config
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu
from std_msgs.msg import Float32
from tf2_msgs.msg import TFMessage

from costs import cpu_time, process_of
from node_case import STARTING, NodeCase
from tb3_labs.geometry.angles import difference
from tb3_labs.ros.conversions import yaw_of

#: The time over which rates are measured [s].
MEASURED = 3.0
LINE = re.compile(r'Current heading is (\d+\.\d{6}) degrees\.$')


def rate_of(entries):
    """Returns the messages a second by the wall clock. `entries` are (time of arrival, header) [s]. This process reads
    some messages late. So at either end only the fastest message of a sixth of them shows the pace of the robot."""
    stamps = [header.stamp.to_sec() for _, header in entries]
    under_way = [arrival - stamp for (arrival, _), stamp in zip(entries, stamps)]
    sixth = len(entries) // 6
    lost = min(under_way[-sixth:]) - min(under_way[:sixth])
    return (len(entries) - 1) / (stamps[-1] - stamps[0] + lost)


class FakeRobotRatesTest(NodeCase):

    def arrivals(self, kinds, count):
        """Watch the topics in `kinds`, {name: type}, until each topic has had at least count(name) messages."""
        for topic, kind in kinds.items():
            self.observer.watch(topic, kind)
        self.observer.wait_until(lambda: all(len(self.observer.all(topic)) >= count(topic) for topic in kinds),
                                 STARTING, 'messages on ' + ', '.join(kinds))

    def test_rates_cost_and_names(self):
        pid = process_of('turtlebot3')
        start, used = time.monotonic(), cpu_time(pid)
        rates = {'imu': 200.0, 'odom': 30.0, '/tf': 30.0}
        self.arrivals({'imu': Imu, 'odom': Odometry, '/tf': TFMessage}, lambda topic: MEASURED * rates[topic] + 1)
        for topic, rate in rates.items():
            headers = [(at, message.transforms[0].header if topic == '/tf' else message.header)
                       for at, message in self.observer.all(topic)]
            self.assertAlmostEqual(rate_of(headers), rate, delta=rate / 100.0)
        share = (cpu_time(pid) - used) / (time.monotonic() - start)
        # The robot used 0.06 of a core on a quiet machine. The share depends on the machine and its
        # load, so this limit only finds an endless loop.
        self.assertLess(share, 0.5)
        imu, odom = self.observer.latest('imu'), self.observer.latest('odom')
        self.assertEqual((imu.header.frame_id, odom.header.frame_id, odom.child_frame_id),
                         ('imu_link', 'odom', 'base_footprint'))
        self.assertLess(abs(rospy.get_time() - imu.header.stamp.to_sec()), 0.5)

    def test_it_ends_at_once_and_well(self):
        numbers = signal.SIGINT, signal.SIGTERM
        running = {number: self.start('fake_turtlebot3.py', '__ns:=robot_%d' % number, '_host:=pi', '_odom_rate:=25')
                   for number in numbers}
        for number, robot in running.items():
            name = '/robot_%d/' % number
            offered = rospy.wait_for_message(name + 'turtlebot3/parameter_updates', Config, STARTING)
            rospy.wait_for_message(name + 'imu', Imu, STARTING)
            host = {item.name: item.value for item in offered.doubles}
            self.assertEqual((host['imu_rate'], host['yaw_lag'], host['odom_rate']),
                             (115.0, 0.085, 25.0))      # a parameter goes before the value of the host
            start = time.time()
            self.assertEqual(robot.end(number), 0)
            self.assertLess(time.time() - start, 2.0 + self.hiccups.since(start))

    def test_nothing_but_the_samples_gives_a_hidden_fault_away(self):
        """Mystery 4 is an offset of the IMU of 115 deg."""
        node, logged = '/mystery/turtlebot3', []
        rospy.Subscriber('/rosout', Log, lambda log: log.name == node and logged.append(log.msg))
        robot = self.start('fake_turtlebot3.py', '__ns:=mystery', '_mystery:=4')
        imu, odom = '/mystery/imu', '/mystery/odom'
        self.arrivals({imu: Imu, odom: Odometry}, lambda topic: 1)
        offset = difference(yaw_of(self.observer.latest(imu).orientation),
                            yaw_of(self.observer.latest(odom).pose.pose.orientation))
        self.assertAlmostEqual(math.degrees(offset), 115.0, delta=0.2)

        published, _, services = rosgraph.Master('/fake_robot_rates_test').getSystemState()
        self.assertEqual({topic for topic, nodes in published if node in nodes}, {
            imu, odom, '/mystery/joint_states', '/tf', '/rosout'})
        self.assertEqual({service for service, nodes in services if node in nodes}, {
            node + '/' + name for name in ('get_loggers', 'set_logger_level')})
        self.assertEqual(rospy.get_param('/mystery'), {'turtlebot3': {'mystery': 4}})

        for line in [robot.text] + logged:
            for word in '115', 'offset', 'imu', 'silent', 'odom':
                self.assertNotIn(word, line)
        # rospy prints a line of its own about a service's caller that has ended
        said = [line for line in robot.lines if 'Inbound TCP/IP connection' not in line]
        self.assertLessEqual(len(said), 2, robot.text)
        self.assertIn('one fault is hidden', said[0])

    def test_imu_sub_prints_at_most_ten_lines_a_second_and_publishes_every_message(self):
        self.watch_data(Float32, 'heading')
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
