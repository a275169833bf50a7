#!/usr/bin/env python3
"""replay.py: the node that was recorded commands the same again; one with a mistake parts from it
at the moment that geometry says."""
import math
import os
import re
import tempfile
import unittest
from pathlib import Path

import numpy as np
import rosbag
import rosgraph
import rospkg
import rospy
import rostest
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool

from tb3_labs.ros.conversions import to_quaternion, to_twist

from node_case import Program, path_of

NODES = Path(rospkg.RosPack().get_path('tb3_labs')) / 'test' / 'ros' / 'student_nodes'
BEGIN = 1.7e9
#: Zeros of the odometry and of the IMU.
ODOM_YAW, IMU_YAW = math.radians(100.0), math.radians(-34.0)
#: The drive to (-0.61, 0.61): a turn by 135 degrees, a line, a turn back, and a reset at rest.
FACE, WAY, SPIN, SPEED = math.radians(135.0), 0.75, 1.5, 0.15
MOVE, BACK = 1.0 + FACE / SPIN, 1.0 + FACE / SPIN + WAY / SPEED
REST, RESET, END = BACK + FACE / SPIN, 10.0, 11.0
#: The robot is 0.15 m from the goal then.
NEAR = MOVE + (math.hypot(0.61, 0.61) - 0.15) / SPEED
#: R in place of its inverse.
MISTAKE = (('cos * dx + sin * dy', 'cos * dx - sin * dy'),
           ('-sin * dx + cos * dy', 'sin * dx + cos * dy'))


def driven(time):
    """(way along the line [m], yaw [rad]) in local."""
    return (float(np.interp(time, [MOVE, BACK], [0.0, WAY])),
            float(np.interp(time, [1.0, MOVE, BACK, REST], [0.0, FACE, FACE, 0.0])))


def commanded(time):
    """(m/s, rad/s) by the lab's law, for that robot."""
    way, yaw = driven(time)
    if time >= RESET:
        return 0.0, 0.3 * FACE
    if FACE - yaw > 0.05 and time < MOVE:
        return 0.0, 0.3 * (FACE - yaw)
    if time < NEAR:
        return 0.15, 0.0
    return 0.0, -0.5 * yaw if yaw > 0.05 else 0.0


class Recording:
    """A bag that is written; times in seconds from its begin."""

    def __init__(self, path):
        self.path, self._bag = path, rosbag.Bag(str(path), 'w')

    def write(self, topic, message, at):
        stamp = rospy.Time.from_sec(BEGIN + at)
        if hasattr(message, 'header'):
            message.header.stamp = stamp
        self._bag.write(topic, message, stamp)

    def sensors(self, place_and_yaw, end):
        """imu at 100 Hz, odom at 25 Hz; `place_and_yaw(time)`: the way along a line that faces
        FACE, and the yaw."""
        for k in range(int(end * 100)):
            way, yaw = place_and_yaw(k / 100.0)
            imu = Imu()
            imu.orientation = to_quaternion(yaw + IMU_YAW)
            self.write('/imu', imu, k / 100.0)
            if k % 4 == 0:
                odom = Odometry()
                facing = FACE + ODOM_YAW
                odom.pose.pose.position.x = 2.0 + way * math.cos(facing)
                odom.pose.pose.position.y = -1.0 + way * math.sin(facing)
                odom.pose.pose.orientation = to_quaternion(yaw + ODOM_YAW)
                self.write('/odom', odom, k / 100.0)

    def close(self):
        self._bag.close()


class ReplayTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix='replay_')
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        package = cls.folder / 'mylab'
        (package / 'src').mkdir(parents=True)
        (package / 'package.xml').write_text(
            '<package><name>mylab</name><version>1.0.0</version><description>d</description>'
            '<maintainer email="a@b.c">m</maintainer><license>MIT</license></package>')
        cls.environment = {'ROS_PACKAGE_PATH': '{}:{}'.format(
            cls.folder, os.environ['ROS_PACKAGE_PATH'])}

    def node(self, name, *changes):
        """Save a node of a student, with these changes."""
        text = (NODES / name).read_text().replace('from lab2.', 'from tb3_labs.')
        for old, new in changes:
            self.assertIn(old, text)
            text = text.replace(old, new)
        path = self.folder / 'mylab' / 'src' / name
        path.write_text(text)
        path.chmod(0o755)
        return path

    def replay(self, bag, node, *options):
        replay = Program([path_of('replay.py'), str(bag), 'mylab', node, '--speed', '4', *options],
                         environment=self.environment)
        self.addCleanup(replay.kill)
        return replay

    @staticmethod
    def page(replay):
        """The latest page."""
        return Path(re.findall(r'^Watch it: (.*)$', replay.text, re.MULTILINE)[-1]).read_text()

    def drive(self):
        """The bag of a drive with a reset."""
        bag = Recording(self.folder / 'drive.bag')
        bag.sensors(driven, END)
        bag.write('/ctrl_relinq', Bool(True), 0.5)
        for k in range(int(END * 10)):
            if k >= 5 and (k < REST * 10 + 3 or k / 10.0 >= RESET):
                bag.write('/cmd_vel', to_twist(*commanded(k / 10.0)), k / 10.0)
        bag.write('/rosout', Log(name='/move_to_goal', level=Log.INFO, msg='Local pose set to '
                                 'x=0.00, y=0.00, yaw=0.00'), RESET)
        bag.close()
        return bag.path

    def test_a_drive_is_tried_again_until_its_mistake_is_mended(self):
        """Each time the file is saved; and nothing of it comes to this test's master."""
        bag, name = self.drive(), 'move2goal_tf.py'
        path = self.node(name, *MISTAKE)
        replay = self.replay(bag, name, '--watch')
        replay.wait_for('it runs again', 60.0)
        parts = re.search(r'From ([\d.]+) s on .*: 0.15 m/s, 0.00 rad/s; recorded: 0.00 m/s',
                          replay.text)
        self.assertAlmostEqual(float(parts.group(1)), NEAR, delta=0.45, msg=replay.text)
        self.assertIn('the commands part', self.page(replay))
        self.node(name)
        os.utime(str(path))
        replay.wait_for('it runs again', 60.0, times=2)
        self.assertIn('This node commands what the recorded one did.', replay.text)
        page = self.page(replay)
        self.assertIn('Open loop', page)
        self.assertIn('now, move_to_goal: Local pose set to', page)
        self.assertNotIn('the commands part', page)
        names = rosgraph.Master(rospy.get_name()).getSystemState()[0]
        self.assertFalse({topic for topic, _ in names} & {'/imu', '/odom', '/cmd_vel', '/clock'})
        replay.end()

    def test_a_turn_is_typed_again(self):
        """From 350 degrees by 90 to the left, by the lab's law at 10 Hz."""
        bag, name = Recording(self.folder / 'turn.bag'), 'turtlebot_controller.py'
        yaws, speeds, left = [0.0] * 20, [], 90.0
        while left >= 10.0:
            speeds.append(min(max(0.1 * left, 0.5), 1.5))
            yaws.append(yaws[-1] + 0.1 * speeds[-1])
            left = 90.0 - math.degrees(yaws[-1])
        yaws += [yaws[-1]] * 20
        bag.sensors(lambda at: (0.0, float(np.interp(at, np.arange(len(yaws)) / 10.0, yaws))),
                    len(yaws) / 10.0)
        for k, speed in enumerate(speeds + [0.0]):
            bag.write('/cmd_vel', to_twist(0.0, speed), 1.95 + k / 10.0)
        bag.close()
        self.node(name)
        replay = self.replay(bag.path, name)
        self.assertEqual(replay.wait(60.0), 0, replay.text)
        self.assertIn('This node commands what the recorded one did.', replay.text)

    def test_what_cannot_be_replayed_is_said_in_one_line(self):
        for words, line in ((['none.bag', 'mylab', 'none.py'], 'rosrun finds no none.py'),
                            (['none.bag', 'tb3_labs', 'imu_sub.py'], 'none.bag: there is no such'),
                            (['none.bag', 'a', 'b', '--speed', '0'], '--speed: 0 is not within')):
            replay = Program([path_of('replay.py'), *words], environment=self.environment)
            self.assertNotEqual(replay.wait(30.0), 0)
            self.assertEqual(len(replay.lines), 1, replay.text)
            self.assertIn(line, replay.text)


if __name__ == '__main__':
    rospy.init_node('replay_test')
    rostest.rosrun('tb3_labs', 'replay', ReplayTest)
