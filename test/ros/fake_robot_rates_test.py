"""The embedded robot's node on the wall clock: rates, cost, its end, and a hidden fault."""
import math
import signal
import subprocess
import threading
import time
import unittest

import rosgraph
import rospy
from dynamic_reconfigure.msg import Config
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu
from tf2_msgs.msg import TFMessage

from costs import cpu_time, process_of
from node_case import STARTING, TestProgram, path_of
from tb3_labs.geometry.angles import difference
from tb3_labs.ros.conversions import yaw_of

COUNT = 600       # imu messages: 3 s
DEADLINE = STARTING   # of a wait [s]


class Arrivals:
    """The times of sending and arrival of a topic's messages; `done` after the first `count`.

    `stamp_of` reads the time of sending from a message.
    """

    def __init__(self, topic, kind, count, stamp_of=lambda message: message.header.stamp):
        self.times, self.stamps, self.count = [], [], count
        self.done, self._stamp_of = threading.Event(), stamp_of
        self.last = None
        rospy.Subscriber(topic, kind, self._on_message, tcp_nodelay=True)

    def _on_message(self, message):
        self.last = message
        self.times.append(time.time())
        self.stamps.append(self._stamp_of(message).to_sec())
        if len(self.times) > self.count:
            self.done.set()

    def rate(self):
        """Messages a second, by the wall clock. Messages that this process reads late are ignored: the fastest of a
        sixth of them, at either end, show the pace of the robot's time."""
        times, stamps = self.times[:self.count + 1], self.stamps[:self.count + 1]
        under_way = [time - stamp for time, stamp in zip(times, stamps)]
        some = self.count // 6
        lost = min(under_way[-some:]) - min(under_way[:some])
        return self.count / (stamps[-1] - stamps[0] + lost)


class FakeRobotRatesTest(unittest.TestCase):
    def test_rates_cost_and_names(self):
        pid = process_of('turtlebot3')
        start, used = time.monotonic(), cpu_time(pid)
        topics = {'imu': (Imu, 200.0), 'odom': (Odometry, 30.0),
                  '/tf': (TFMessage, 30.0, lambda message: message.transforms[0].header.stamp)}
        arrivals = {topic: Arrivals(topic, kind, int(COUNT * rate / 200.0), *stamp_of)
                    for topic, (kind, rate, *stamp_of) in topics.items()}
        for topic, (_, rate, *_) in topics.items():
            self.assertTrue(arrivals[topic].done.wait(DEADLINE), 'too few on ' + topic)
            self.assertAlmostEqual(arrivals[topic].rate(), rate, delta=rate / 100.0)
        share = (cpu_time(pid) - used) / (time.monotonic() - start)
        # Measured: 0.06 of a core on a quiet machine. The cost depends on the machine and its load;
        # this only finds an endless loop.
        self.assertLess(share, 0.5)
        self.assertEqual(arrivals['imu'].last.header.frame_id, 'imu_link')
        self.assertEqual(arrivals['odom'].last.header.frame_id, 'odom')
        self.assertEqual(arrivals['odom'].last.child_frame_id, 'base_footprint')
        age = rospy.get_time() - arrivals['imu'].last.header.stamp.to_sec()
        self.assertLess(abs(age), 0.5)

    def test_it_ends_at_once_and_well(self):
        robots = [(number, 'robot_{}'.format(int(number)))
                  for number in (signal.SIGINT, signal.SIGTERM)]
        running = [(number, Arrivals(name + '/imu', Imu, 1), subprocess.Popen([
            path_of('fake_turtlebot3.py'), '__ns:=' + name, '_host:=pi', '_odom_rate:=25']))
            for number, name in robots]
        for number, imu, process in running:
            self.assertTrue(imu.done.wait(DEADLINE), 'no imu')
            offered = rospy.wait_for_message('/robot_{}/turtlebot3/parameter_updates'.format(
                int(number)), Config, DEADLINE)
            host = {item.name: item.value for item in offered.doubles}
            self.assertEqual((host['imu_rate'], host['yaw_lag'], host['odom_rate']),
                             (115.0, 0.085, 25.0))      # what is given itself goes before it
            start = time.time()
            process.send_signal(number)
            self.assertEqual(process.wait(DEADLINE), 0)
            self.assertLess(time.time() - start, 2.0 + self.hiccups.since(start))

    def test_nothing_but_the_samples_gives_a_hidden_fault_away(self):
        """Mystery 4: an offset of the IMU of 115 deg."""
        node, logged = '/mystery/turtlebot3', []
        rospy.Subscriber('/rosout', Log, lambda log: log.name == node and logged.append(log.msg))
        robot = TestProgram([path_of('fake_turtlebot3.py'), '__ns:=mystery', '_mystery:=4'])
        other = TestProgram([path_of('fake_turtlebot3.py'), '__ns:=other', '_mystery:=4',
                             '_network:=bad'])
        self.addCleanup(robot.kill)
        self.addCleanup(other.kill)
        imu, odom = (Arrivals('/mystery/' + topic, kind, 1)
                     for topic, kind in (('imu', Imu), ('odom', Odometry)))
        self.assertTrue(imu.done.wait(DEADLINE) and odom.done.wait(DEADLINE), robot.text)
        offset = difference(yaw_of(imu.last.orientation), yaw_of(odom.last.pose.pose.orientation))
        self.assertAlmostEqual(math.degrees(offset), 115.0, delta=0.2)

        published, _, services = rosgraph.Master('/fake_robot_rates_test').getSystemState()
        self.assertEqual({topic for topic, nodes in published if node in nodes}, {
            '/mystery/imu', '/mystery/odom', '/mystery/joint_states', '/tf',
            '/rosout'})
        self.assertEqual({service for service, nodes in services if node in nodes}, {
            node + '/' + name for name in ('get_loggers', 'set_logger_level')})
        self.assertEqual(rospy.get_param('/mystery'), {'turtlebot3': {'mystery': 4}})

        self.assertEqual(other.wait(STARTING), 1)
        self.assertIn("network = 'bad' is not valid together with mystery = 4", other.text)
        for line in [robot.text, other.text] + logged:
            for word in '115', 'offset', 'imu', 'silent', 'odom':
                self.assertNotIn(word, line)
        # a service's caller that is gone at once: rospy's own line on it
        said = [line for line in robot.lines if 'Inbound TCP/IP connection' not in line]
        self.assertLessEqual(len(said), 2, robot.text)
        self.assertIn('one fault is hidden', said[0])
