"""The real nodes run for hours. Their memory, threads and errors do not grow."""
import math
import random
import time

import rospy
from rosgraph_msgs.msg import Log
from std_msgs.msg import Float64

from costs import memory, process_of, threads
from drive_case import DriveCase
from node_case import STARTING
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.supervision.timeouts import SENDER_PAUSE

#: Memory and threads count from here on, when every history has been filled [simulated s].
WARM = 15.0
#: A line of the controller that ends a request for a turn begins thus.
ENDS = 'Turned', 'Turn given up', 'cannot turn'
NODES = ('move_to_goal', 'controller', 'turtlebot3')


def inside(node):
    """Returns (memory [MB], number of threads) of a node."""
    pid = process_of(node)
    return memory(pid), threads(pid)


class SoakTest(DriveCase):

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.turns = rospy.Publisher('turn', Float64, queue_size=1)
        cls.observer.watch('/rosout', Log, lambda line: line.msg)
        cls.wait_for_subscriber(cls.control, cls.goals, cls.turns)
        cls.observer.wait_for('ground_truth', seconds=STARTING)

    def drive(self, chance):
        """Drive to a goal. Returns the true error there as (distance [m], angle [deg])."""
        declared, goal = (Pose2(chance.uniform(-1, 1), chance.uniform(-1, 1),
                                chance.uniform(-math.pi, math.pi)) for _ in range(2))
        local_T_world = declared @ self.rest().inverse()
        # in simulated time a short pause of the computer makes the sensors look silent
        self.declare(declared)
        self.observer.forget('goal_state')
        self.go_to(goal)
        self.give_control()
        self.wait_for_state('GOAL_REACHED', seconds=60.0)
        self.control.publish(False)
        here = local_T_world @ self.rest()
        return here.distance_to(goal), abs(math.degrees(difference(here.yaw, goal.yaw)))

    def turn(self, angle):
        """Turn. Returns the true error [deg]. A refused or aborted turn is repeated, because a pause of a busy computer
        is four times as long for the robot, and makes the sensors silent. A repetition within SENDER_PAUSE of the
        request would not count."""
        line = ''
        while not line.startswith('Turned'):
            if line:
                self.let_pass(SENDER_PAUSE + 0.1)
            start = self.rest().yaw
            self.observer.forget('/rosout')
            self.turns.publish(angle)
            line = self.observer.wait_for('/rosout', lambda line: line.startswith(ENDS), 60.0)
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
        hours = (rospy.get_time() - begun) / 3600.0
        print('{} drives and turns in {:.2f} simulated hours, {:.1f} times real time'.format(
            len(drives), hours, 3600.0 * hours / (time.monotonic() - wall)))
        for off in drives, turns:
            half = len(off) // 2
            print('worst of each half:', max(off[:half], default=0.0), max(off[half:]))
        for node in NODES:
            used, running = inside(node)
            print('{}: {:.1f} MB ({:+.1f}), {} threads ({:+d})'.format(
                node, used, used - before[node][0], running, running - before[node][1]))
            self.assertLess(used - before[node][0], 3.0, node)
            self.assertLessEqual(running, before[node][1] + 1, node)
        # on a fast clock a short pause of the computer is a long one for the robot
        self.assertLess(max(distance for distance, _ in drives), 0.020)
        self.assertLess(max(angle for _, angle in drives), 1.0)
