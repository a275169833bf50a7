"""Each of two robots drives and is reset by itself, and they share no frame."""
import math

import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool, String
from tf2_msgs.msg import TFMessage

from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose2, to_pose_stamped
from tb3_labs.srv import ResetPose

from node_case import STARTING, NodeCase
from thumb import A, B, Thumb, WithThumb

ROBOTS = ('robot1', 'robot2')
DECLARED = {'robot1': Pose2(0.5, -0.5, 1.0), 'robot2': Pose2(-1.0, 0.0, -2.0)}
GOALS = {'robot1': Pose2(0.9, -0.2, 0.0), 'robot2': Pose2(-0.6, 0.3, 2.0)}


class TwoRobotsTest(WithThumb, NodeCase):

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.control, cls.goals, cls.reset = {}, {}, {}
        for robot in ROBOTS:
            cls.seen.watch(robot + '/ground_truth', PoseStamped,
                           lambda message: to_pose2(message.pose))
            cls.watch_data(String, robot + '/goal_state')
            cls.watch_data(Bool, robot + '/ctrl_relinq')
            cls.control[robot] = rospy.Publisher(robot + '/ctrl_relinq', Bool,
                                                 queue_size=5)    # each word counts
            cls.goals[robot] = rospy.Publisher(robot + '/move_base_simple/goal', PoseStamped,
                                               queue_size=1)
            rospy.wait_for_service(robot + '/reset_pose', STARTING)
            cls.reset[robot] = rospy.ServiceProxy(robot + '/reset_pose', ResetPose)
        cls.seen.watch('/tf', TFMessage, lambda message: [
            (transform.header.frame_id, transform.child_frame_id)
            for transform in message.transforms])
        cls.watch_data(String, 'robot2/control_holder')
        cls.thumb = Thumb('robot2/joy')
        cls.wait_until_heard(*cls.control.values(), *cls.goals.values())

    def truth(self, robot):
        return self.seen.latest(robot + '/ground_truth')

    def test_each_for_itself(self):
        starts = {}
        for robot in ROBOTS:
            self.seen.wait_for_rest(robot + '/ground_truth')
            starts[robot] = self.truth(robot)
            declared = DECLARED[robot]
            answer = self.reset[robot](declared.x, declared.y, math.degrees(declared.yaw))
            self.assertTrue(answer.success, answer.message)
        for robot, goal in GOALS.items():
            self.seen.forget(robot + '/goal_state')
            self.goals[robot].publish(to_pose_stamped(goal, '', 0.0))
        for word in (False, True):    # a True alone may be older than the node
            self.control['robot1'].publish(word)
        self.seen.wait_for('robot1/ground_truth', lambda truth: truth.distance_to(
            starts['robot1']) > 0.1, 30.0)
        # the robot without control stands
        self.assertLess(self.truth('robot2').distance_to(starts['robot2']), 1e-6)
        for word in (False, True):
            self.control['robot2'].publish(word)
        for robot, goal in GOALS.items():
            self.seen.wait_for(robot + '/goal_state', lambda state: state == 'GOAL_REACHED', 30.0)
            self.seen.wait_for_rest(robot + '/ground_truth')
            place = DECLARED[robot] @ starts[robot].inverse() @ self.truth(robot)
            self.assertLess(place.distance_to(goal), 0.01, robot)
            self.assertLess(abs(math.degrees(difference(place.yaw, goal.yaw))), 0.5, robot)

    def test_a_gamepad_hands_over_its_own_robot_only(self):
        for robot in ROBOTS:
            self.seen.forget(robot + '/ctrl_relinq')
        self.thumb.press(B)     # another test may have given robot2 away
        # a pad is obeyed after it was at rest for a while
        self.seen.wait_for('robot2/control_holder', lambda holder: holder == 'gamepad')
        self.thumb.press(A)
        self.seen.wait_for('robot2/ctrl_relinq', lambda relinquished: relinquished)
        self.assertFalse(self.seen.latest('robot1/ctrl_relinq'))
        self.thumb.press(B)
        self.seen.wait_for('robot2/ctrl_relinq', lambda relinquished: not relinquished)

    def test_frames_are_each_robots_own(self):
        self.seen.wait_until(lambda: len(self.pairs()) >= 4, 10.0, 'frames')
        self.assertEqual(self.pairs(), {(robot + '/odom', robot + '/' + child) for robot in ROBOTS
                                        for child in ('local', 'base_footprint')})

    def test_a_node_that_comes_later_knows_where_each_robots_odometry_began(self):
        self.seen.watch('/tf_static', TFMessage, lambda message: {
            transform.child_frame_id for transform in message.transforms})
        self.seen.wait_until(lambda: {
            name for _, frames in self.seen.all('/tf_static') for name in frames} == {
                robot + '/odom' for robot in ROBOTS}, 10.0, 'both origins')

    def pairs(self):
        return {pair for _, pairs in self.seen.all('/tf') for pair in pairs}
