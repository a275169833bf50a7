#!/usr/bin/env python3
"""The real nodes, hour after hour: flat memory, no thread left behind, no growing error."""
import math
import random
import time

import rospy
import rostest
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool, Float64, String

from costs import memory, process_of, threads
from node_case import NodeCase, watch_robot
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose_stamped
from tb3_labs.ros.program import Observer
from tb3_labs.srv import ResetPose

#: Memory and threads count from here on, when every history has been filled [simulated s].
WARM = 30.0
NODES = ('move_to_goal', 'controller', 'turtlebot3')


def inside(node):
    """(memory [MB], threads) of a node."""
    pid = process_of(node)
    return memory(pid), threads(pid)


class SoakTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        cls.seen = Observer()
        watch_robot(cls.seen)
        cls.seen.watch('goal_state', String, lambda message: message.data)
        cls.seen.watch('local_pose', PoseStamped)
        cls.control = rospy.Publisher('ctrl_relinq', Bool, queue_size=1)
        cls.goals = rospy.Publisher('move_base_simple/goal', PoseStamped, queue_size=1)
        cls.turns = rospy.Publisher('turn', Float64, queue_size=1)
        rospy.wait_for_service('reset_pose', 30.0)
        cls.reset = rospy.ServiceProxy('reset_pose', ResetPose)
        cls.wait_until_heard(cls.control, cls.goals, cls.turns)
        cls.seen.wait_for('ground_truth')
        cls.seen.wait_for('local_pose', seconds=20.0)    # a reset needs both sensors

    def drive(self, chance):
        """The true error at a goal: (distance [m], angle [deg])."""
        declared, goal = (Pose2(chance.uniform(-1, 1), chance.uniform(-1, 1),
                                chance.uniform(-math.pi, math.pi)) for _ in range(2))
        local_T_world = declared @ self.rest().inverse()
        # in simulated time a short pause of the computer makes the sensors look silent
        self.seen.wait_until(lambda: self.reset(
            declared.x, declared.y, math.degrees(declared.yaw)).success, 10.0, 'a reset')
        self.seen.forget('goal_state')
        self.goals.publish(to_pose_stamped(goal, 'local', 0.0))
        self.control.publish(True)
        self.seen.wait_for('goal_state', lambda state: state == 'GOAL_REACHED', 60.0)
        self.control.publish(False)
        here = local_T_world @ self.rest()
        return here.distance_to(goal), abs(math.degrees(difference(here.yaw, goal.yaw)))

    def turn(self, angle):
        """The true error of a turn [deg]."""
        start = self.rest().yaw
        self.turns.publish(angle)
        self.seen.wait_for('cmd_vel', lambda command: command != (0.0, 0.0), 20.0)
        self.seen.wait_for('cmd_vel', lambda command: command == (0.0, 0.0), 60.0)
        turned = math.degrees(self.rest().yaw - start)
        return abs(math.remainder(turned - angle, 360.0))

    def test_nothing_grows(self):
        chance, begun, wall = random.Random(1), rospy.get_time(), time.monotonic()
        end = begun + 60.0 * rospy.get_param('~minutes')
        drives, turns, before = [], [], None
        while rospy.get_time() < end or before is None:
            drives.append(self.drive(chance))
            turns.append(self.turn(chance.choice((90.0, -90.0, 180.0))))
            if before is None and rospy.get_time() > begun + WARM:
                before = {node: inside(node) for node in NODES}
                warm_at = rospy.get_time()
        hours = (rospy.get_time() - begun) / 3600.0
        print('{} drives and turns in {:.2f} simulated hours, {:.1f} times real time'.format(
            len(drives), hours, 3600.0 * hours / (time.monotonic() - wall)))
        quarter = max(1, len(drives) // 4)
        for part in range(0, len(drives) - quarter + 1, quarter):
            print('worst: drive {:.1f} mm {:.2f} deg, turn {:.2f} deg'.format(
                1000.0 * max(d for d, _ in drives[part:part + quarter]),
                max(a for _, a in drives[part:part + quarter]), max(turns[part:part + quarter])))
        for node in NODES:
            used, running = inside(node)
            print('{}: {:.1f} MB ({:+.1f}), {} threads ({:+d}) in {:.2f} h'.format(
                node, used, used - before[node][0], running, running - before[node][1],
                (rospy.get_time() - warm_at) / 3600.0))
            self.assertLess(used - before[node][0], 3.0, node)
            self.assertLessEqual(running, before[node][1] + 1, node)
        # on a fast clock a short pause of the computer is a long one for the robot
        self.assertLess(max(distance for distance, _ in drives), 0.020)
        self.assertLess(max(angle for _, angle in drives), 1.0)


if __name__ == '__main__':
    rospy.init_node('soak_test')
    rostest.rosrun('tb3_labs', 'soak', SoakTest)
