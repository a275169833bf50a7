#!/usr/bin/env python3
"""The local pose of the real node on recorded and on contrived sensor streams."""
import bisect
import math
import os
import sys
import time
import unittest
from concurrent.futures import ThreadPoolExecutor

import rospy
import rostest
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu

from tb3_labs.ros.conversions import to_pose2, to_quaternion
from tb3_labs.ros.testing.observer import Observer
from tb3_labs.srv import ResetPose

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), '..', 'unit'))
from real_recordings import arrays_of    # noqa: E402 (a relay's folder is another one)

#: Pace at which a recording is played, times real time.
SPEED = 8.0
#: Samples of a TurtleBot3 are at least this much older than their stamps say [s].
SAMPLE_AGE = 0.0135
#: A heading is off by more than this [deg] only if IMU samples were dropped for later ones, so that
#: it was interpolated between others. Limits for these: their share, and their error [deg].
HEADING_OFF, OVERTAKEN, AT_MOST = 0.2, 0.02, 1.0


def degrees_apart(a, b):
    return abs(math.degrees(math.remainder(a - b, 2.0 * math.pi)))


class SensorStreamsTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.seen = Observer()
        cls.seen.watch('local_pose', PoseStamped,
                       lambda message: (message.header.stamp, to_pose2(message.pose)))
        cls.clock = rospy.Publisher('/clock', Clock, queue_size=100)
        cls.imu = rospy.Publisher('imu', Imu, queue_size=100)
        cls.odom = rospy.Publisher('odom', Odometry, queue_size=100)
        rospy.wait_for_service('reset_pose', 20.0)
        cls.reset_pose = rospy.ServiceProxy('reset_pose', ResetPose)
        cls.seen.wait_until(lambda: all(p.get_num_connections() for p in (
            cls.clock, cls.imu, cls.odom)), 20.0, 'connections')
        cls.caller = ThreadPoolExecutor(2)
        cls.now = 1000.0

    def send(self, *messages):
        """One tick of the clock, then messages, each delivered before the next is sent."""
        type(self).now += 0.005
        self.clock.publish(rospy.Time.from_sec(self.now))
        for message in messages:
            (self.imu if isinstance(message, Imu) else self.odom).publish(message)
            time.sleep(0.001)

    def imu_at(self, stamp, heading):
        message = Imu()
        message.header.stamp = rospy.Time.from_sec(stamp)
        message.orientation = to_quaternion(heading)
        return message

    def odom_at(self, stamp, x, y, heading):
        message = Odometry()
        message.header.stamp = rospy.Time.from_sec(stamp)
        message.header.frame_id = 'odom'
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        message.pose.pose.orientation = to_quaternion(heading)
        return message

    def let_the_node_follow(self, stamp):
        """Wait for the pose of this stamp, a moment at most: the node keeps the newest sample alone, so
        on a busy machine it would miss some of a stream that is sent this fast."""
        deadline = time.monotonic() + 0.2
        while time.monotonic() < deadline:
            sample = self.seen.latest('local_pose')
            if sample is not None and sample[0].to_sec() > stamp - 1e-3:
                break
            time.sleep(0.001)

    def declare(self, *pose):
        """Reset, once more if the machine paused: at this pace a tenth of a second is a lost sensor."""
        for _ in range(10):
            reply = self.reset_pose(*pose)
            if reply.success:
                break
            time.sleep(0.1)
        return reply

    def check_order(self, order):
        """A robot that turns at 2.6 rad/s while its odometry moves along a line, in closed form."""
        start, offset = self.now + 100.0, 1.2     # a sender's clock that is 100 s ahead
        begun = None
        for k in range(150):
            t = 0.025 * k
            stamp = start + t
            imu = self.imu_at(stamp, 2.6 * t + offset)
            odom = self.odom_at(stamp, 0.2 * t, 0.0, 2.6 * t)
            if order == 'imu first':
                self.send(imu, odom)
            elif order == 'odom first':
                self.send(odom, imu)
            elif order == 'imu between':
                # never at the odometry's stamp: the middle of two is only right if interpolated
                self.send(odom, self.imu_at(stamp + 0.0125, 2.6 * (t + 0.0125) + offset))
            self.let_the_node_follow(stamp)
            type(self).now += 0.020
            if k == 5:    # to the node it is the robot of the test before: its pose may be lost
                declared = self.caller.submit(self.declare, 0.0, 0.0, 0.0)
            elif k > 5 and begun is None and declared.done():
                begun = stamp

        def of_this_stream():
            return [sample for _, sample in self.seen.all('local_pose')
                    if begun < sample[0].to_sec() <= stamp]
        self.seen.wait_until(lambda: len(of_this_stream()) > 100, 10.0, 'poses')
        poses = of_this_stream()
        stamps = [pose[0].to_sec() for pose in poses]
        self.assertEqual(stamps, sorted(stamps))
        # relative to the first pose of the stream, in the local frame in force
        first = poses[0][1]
        for stamp, (_, pose) in zip(stamps, poses):
            moved, elapsed = first.inverse() @ pose, stamp - stamps[0]
            self.assertLess(degrees_apart(moved.yaw, 2.6 * elapsed), 0.05)
            self.assertLess(abs(math.hypot(moved.x, moved.y) - 0.2 * elapsed), 1e-4)

    def test_imu_first(self):
        self.check_order('imu first')

    def test_odometry_first(self):
        self.check_order('odom first')

    def test_imu_never_at_the_odometrys_stamp(self):
        self.check_order('imu between')

    def play(self, name, resets=()):
        """Play a recording, calling reset_pose at the given seconds.

        Returns the odometry {stamp: (x, y, yaw)}, the raw IMU {stamp: yaw}, and the replies. The
        odometry is the recorded one, except for the firmware's fault at +/-180 deg: one
        displacement is exactly backwards, and is reversed.
        """
        samples = sorted((arrival, stamp, values) for table in arrays_of(name)
                         for arrival, stamp, *values in table.tolist())
        self.seen.forget('local_pose')
        odometry, imu, calls, resets = {}, {}, [], list(resets)
        last, lost = None, complex(0.0, 0.0)
        wall, base = time.monotonic(), self.now + 200.0
        for arrival, stamp, values in samples:
            played = arrival - samples[0][0]
            time.sleep(max(0.0, wall + played / SPEED - time.monotonic()))
            type(self).now = base + played
            self.clock.publish(rospy.Time.from_sec(self.now))
            stamp = rospy.Time.from_sec(stamp).to_sec()
            if len(values) == 2:
                imu[stamp], rate = values
                message = self.imu_at(stamp, imu[stamp])
                message.angular_velocity.z = rate
                self.imu.publish(message)
            else:
                x, y, heading, linear, angular = values
                place = complex(x, y)
                if abs(angular) > 100.0:
                    lost -= 2.0 * (place - last)
                last = place
                odometry[stamp] = ((place + lost).real, (place + lost).imag, heading)
                message = self.odom_at(stamp, x, y, heading)
                message.twist.twist.linear.x, message.twist.twist.angular.z = linear, angular
                self.odom.publish(message)
            if resets and played > resets[0][0]:
                # in a thread: it is answered when later messages have come
                _, declared = resets.pop(0)
                calls.append(self.caller.submit(self.declare, *declared))
        return odometry, imu, [call.result(10.0) for call in calls]

    def check_against(self, odometry, imu, reply, declared, until=math.inf):
        """Every pose after the reset against the transform of the raw recording itself."""
        start = reply.stamp + SAMPLE_AGE
        x0, y0, yaw0 = self.interpolated(odometry, start)
        imu0, = self.interpolated({stamp: (value,) for stamp, value in imu.items()}, start)
        turn = math.radians(declared[2]) - yaw0
        checked, off = 0, []
        for _, (stamp, pose) in self.seen.all('local_pose'):
            stamp = stamp.to_sec()
            if not start < stamp < until:
                continue
            x, y, _ = odometry[stamp]
            expected_x = declared[0] + math.cos(turn) * (x - x0) - math.sin(turn) * (y - y0)
            expected_y = declared[1] + math.sin(turn) * (x - x0) + math.cos(turn) * (y - y0)
            self.assertLess(math.hypot(pose.x - expected_x, pose.y - expected_y), 0.001)
            heading = math.radians(declared[2]) + imu[stamp] - imu0
            off.append(degrees_apart(pose.yaw, heading))
            checked += 1
        self.assertLess(max(off), AT_MOST)
        self.assertLess(sum(angle > HEADING_OFF for angle in off), OVERTAKEN * checked)
        return checked

    @staticmethod
    def interpolated(table, stamp):
        """The row of {stamp: row} at a stamp between two; the last number of a row is an angle."""
        stamps = sorted(table)
        after = bisect.bisect_left(stamps, stamp)
        low, high = stamps[after - 1], stamps[after]
        share = (stamp - low) / (high - low)
        row = [a + share * (b - a) for a, b in zip(table[low], table[high])]
        row[-1] = table[low][-1] + share * math.remainder(
            table[high][-1] - table[low][-1], 2.0 * math.pi)
        return row

    def test_a_real_drive_with_resets_on_the_way(self):
        first, second = (0.0, 0.0, 0.0), (1.5, -2.0, 120.0)
        odometry, imu, replies = self.play('burger_drive', [(5.0, first), (30.0, second)])
        self.assertEqual([reply.success for reply in replies], [True, True])
        again = replies[1].stamp
        self.assertGreater(self.check_against(odometry, imu, replies[0], first, again), 300)
        self.assertGreater(self.check_against(odometry, imu, replies[1], second), 400)

    def test_a_real_robot_at_rest(self):
        declared = (0.2, 0.1, -45.0)
        odometry, imu, replies = self.play('burger_static', [(2.0, declared)])
        self.assertTrue(replies[0].success, replies[0].message)
        self.assertGreater(self.check_against(odometry, imu, replies[0], declared), 400)


if __name__ == '__main__':
    rospy.init_node('sensor_streams_test')
    rostest.rosrun('tb3_labs', 'sensor_streams', SensorStreamsTest)
