"""The drives, resets and goals of the real node, judged by the robot's true pose. check_move2goal.test has the drives
of the lab."""
import math
import random
import time
from concurrent.futures import ThreadPoolExecutor

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseActionResult, MoveBaseGoal
from nav_msgs.msg import Path
from tf2_msgs.msg import TFMessage

from drive_case import DriveCase
from node_case import STARTING, ZERO, stamped, watch_robot
from tb3_labs.control.goal_state import is_over
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose2, to_pose_stamped, to_twist, transform_to_pose2
from tb3_labs.srv import ResetPose, SetInitialPose


class Move2GoalTest(DriveCase):
    """Methods share the running nodes. Each begins with a robot at rest and control taken."""

    @classmethod
    def watch(cls):
        watch_robot(cls.observer, stamped)
        cls.observer.watch('current_goal', PoseStamped, lambda message: to_pose2(message.pose))
        cls.observer.watch('local_pose', PoseStamped, stamped)
        cls.observer.watch('local_path', Path)
        cls.observer.watch('move2goal/result', MoveBaseActionResult, lambda message: message.status)
        cls.observer.watch('/tf', TFMessage)

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.initialpose = rospy.Publisher('initialpose', PoseWithCovarianceStamped, queue_size=1)
        cls.wheels = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        cls.action = actionlib.SimpleActionClient('move2goal', MoveBaseAction)
        for service in ('reset_pose', 'set_pose'):
            rospy.wait_for_service(service, STARTING)
        cls.set_pose = rospy.ServiceProxy('set_pose', SetInitialPose)
        cls.observer.wait_for('local_pose', seconds=STARTING)
        cls.observer.wait_for('ground_truth', seconds=STARTING)
        cls.wait_for_subscriber(cls.control, cls.goals, cls.initialpose, cls.wheels)
        assert cls.action.wait_for_server(rospy.Duration(4.0 * STARTING))    # simulated time

    def setUp(self):
        self.control.publish(False)
        # a drive that begins again shows that the message has arrived
        self.observer.forget('goal_state')
        self.declare()
        self.wait_for_state('waiting for control')
        self.wait_for_rest()

    def wait_for_rest(self):
        self.observer.wait_for_rest('ground_truth', lambda sample: sample[1])

    def declared(self, x=0.0, y=0.0, yaw_deg=0.0):
        """Declare a pose. Returns the true local_T_world at the instant of the reply."""
        self.observer.forget('goal_state')
        pose = Pose2(x, y, math.radians(yaw_deg))
        instant = self.declare(pose).stamp
        self.observer.wait_until(lambda: all(self.observer.latest(topic)[0] > instant for topic in (
            'ground_truth', 'local_pose')), 5.0, 'poses after the reset')
        return pose @ self.truth_at(instant).inverse()

    def truth(self):
        return self.observer.latest('ground_truth')[1]

    def set_goal(self, pose, frame='local'):
        """Send a goal, and wait until it is the current goal."""
        self.observer.forget('current_goal')
        self.observer.forget('goal_state')
        self.go_to(pose, frame)
        self.observer.wait_for('current_goal')

    def drive(self):
        """Give control. Returns the state in which the drive ends."""
        self.give_control()
        state = self.observer.wait_for('goal_state', is_over, 60.0)
        self.wait_for_rest()
        return state

    def assert_pose(self, pose, expected, metres=0.010, degrees=0.5):
        self.assertLess(pose.distance_to(expected), metres)
        self.assertLess(abs(math.degrees(difference(pose.yaw, expected.yaw))), degrees)

    def test_declared_pose_is_honoured(self):
        goal = Pose2(1.6, 2.4, math.radians(90.0))
        local_T_world = self.declared(1.0, 2.0, -120.0)
        here = self.observer.latest('local_pose')[1]
        self.assert_pose(here, local_T_world @ self.truth(), 0.002, 0.1)
        self.set_goal(goal)
        self.assertEqual(self.drive(), 'GOAL_REACHED')
        self.assert_pose(local_T_world @ self.truth(), goal)
        path = self.observer.wait_for('local_path', lambda path: to_pose2(
            path.poses[-1].pose).distance_to(goal) < 0.03)    # its last step is 20 mm
        self.assertEqual(path.header.frame_id, 'local')
        self.assertTrue(10 <= len(path.poses) <= 120, len(path.poses))    # it is thinned
        answer = self.reset(-2.0, 0.5, -10.0)
        x, y, yaw_deg = answer.before
        self.assert_pose(Pose2(x, y, math.radians(yaw_deg)), goal, 0.02, 1.0)
        self.assertEqual(list(answer.after), [-2.0, 0.5, -10.0])

    def test_the_last_of_many_resets_at_once_holds_at_rest_and_while_turning(self):
        def call(caller, begun):
            """Make the resets of one of ten callers, who make 100 a second together. Returns [(declared, answer)]."""
            chance, made = random.Random(caller), []
            reset = rospy.ServiceProxy('reset_pose', ResetPose)     # a proxy is for one thread
            for number in range(caller, 50, 10):
                time.sleep(max(0.0, begun + 0.01 * number - time.time()))
                declared = [chance.uniform(-most, most) for most in (5.0, 5.0, 180.0)]
                for _ in range(100):
                    answer = reset(*declared)
                    if answer.success:      # a late machine delays the sensors
                        break
                made.append((declared, answer))
            return made

        for rate in 0.0, 1.0:
            turning = rospy.Timer(rospy.Duration(0.1), lambda _: self.wheels.publish(
                to_twist(0.0, rate)))
            begun = time.time()
            with ThreadPoolExecutor(10) as pool:
                answers = sum(pool.map(lambda caller: call(caller, begun), range(10)), [])
            turning.shutdown()
            refused = [answer.message for _, answer in answers if not answer.success]
            self.assertEqual(refused, [])
            stamp = max(answer.stamp for _, answer in answers)
            last = [Pose2(x, y, math.radians(yaw_deg)) for (x, y, yaw_deg), answer in answers
                    if answer.stamp == stamp]      # several may be carried out by one sample
            self.wait_for_rest()
            now = rospy.get_time()
            self.observer.wait_until(lambda: self.observer.latest('local_pose')[0] > now, what='a pose')
            moved = self.truth_at(stamp).inverse() @ self.truth()
            here = self.observer.latest('local_pose')[1]
            self.assert_pose(here, min((pose @ moved for pose in last), key=here.distance_to),
                             0.001, 0.1)

    def test_bad_resets_are_refused_and_the_old_frame_stays(self):
        self.declared(0.4, 0.3, 20.0)
        for x in (math.nan, 1e9):
            answer = self.reset(x, 0.0, 0.0)
            self.assertFalse(answer.success)
            self.assertEqual(
                answer.message, 'x = {} is not valid: a number from -100 to 100 m'.format(x))
            self.assertEqual((list(answer.before), list(answer.after), answer.stamp), ([], [], 0.0))
        for frame, w, reason in (('local', 0.0, 'norm'), ('local', math.nan, 'norm'),
                                 ('mars', 1.0, "'mars' is not valid: local, odom, or map")):
            pose = PoseWithCovarianceStamped()
            pose.header.frame_id = frame
            pose.pose.pose.orientation.w = w
            with self.assertRaisesRegex(rospy.ServiceException, reason):
                self.set_pose(pose)
        self.assert_pose(self.observer.latest('local_pose')[1],
                         Pose2(0.4, 0.3, math.radians(20.0)), 1e-3, 0.1)

    def test_set_pose_and_initialpose_are_resets_too(self):
        target = Pose2(0.7, -0.1, 0.5)
        for declare, frame in ((self.set_pose, 'map'), (self.set_pose, ''),
                               (self.set_pose, 'local'), (self.set_pose, 'odom'),
                               (self.initialpose.publish, 'local')):
            self.declared()
            place = self.odom_T_local() @ target if frame == 'odom' else target
            message = PoseWithCovarianceStamped()
            message.header.frame_id = frame
            message.pose.pose = to_pose_stamped(place, frame, 0.0).pose
            declare(message)
            self.observer.wait_for('local_pose', lambda s: s[1].distance_to(target) < 1e-3, 5.0)

    def test_requests_in_odom_are_converted_in_the_order_of_their_arrival(self):
        """A pose in odom comes 5 to 30 ms after a reset that waits for its samples. The pose is the place of the robot,
        so in local it is the pose that the reset declared. A goal at this pose comes later."""
        message = PoseWithCovarianceStamped()
        message.header.frame_id = 'odom'
        self.declared()
        message.pose.pose = to_pose_stamped(
            self.odom_T_local() @ self.observer.latest('local_pose')[1], 'odom', 0.0).pose
        there, goal = Pose2(5.0, 5.0, math.radians(90.0)), PoseStamped(message.header,
                                                                       message.pose.pose)
        for k in range(6):
            self.declare()
            self.observer.forget('current_goal')
            with ThreadPoolExecutor(1) as pool:
                first = pool.submit(self.reset, 5.0, 5.0, 90.0)
                rospy.rostime.wallsleep((0.005, 0.015, 0.03)[k % 3])
                self.set_pose(message)
                self.assertTrue(first.result().success)
            now = rospy.get_time()
            _, here = self.observer.wait_for('local_pose', lambda sample: sample[0] > now)
            self.assert_pose(here, there, 0.001, 0.3)
            self.goals.publish(goal)
            self.observer.wait_for('current_goal', lambda pose: pose.distance_to(there) < 0.001)

    def odom_T_local(self):
        now = rospy.get_time()

        def transforms():
            return [t.transform for _, message in self.observer.all('/tf', now)
                    for t in message.transforms
                    if t.child_frame_id == 'local' and t.header.stamp.to_sec() > now]
        self.observer.wait_until(transforms, 5.0, 'tf of local')
        return transform_to_pose2(transforms()[-1])

    # -- goals of the action, and goals that end otherwise

    def goal(self, pose, frame='local'):
        return MoveBaseGoal(target_pose=to_pose_stamped(pose, frame, 0.0))

    def test_action_reports_feedback_and_success(self):
        self.declared()
        feedback = []
        self.give_control()
        self.action.send_goal(self.goal(Pose2(0.3, 0.0, 0.0)), feedback_cb=feedback.append)
        self.assertTrue(self.action.wait_for_result(rospy.Duration(40.0)))
        self.assertEqual(self.action.get_state(), GoalStatus.SUCCEEDED)
        self.assertEqual(feedback[-1].base_position.header.frame_id, 'local')
        # a late machine delivers the last ones after the result
        self.observer.wait_until(lambda: to_pose2(feedback[-1].base_position.pose).distance_to(
            Pose2(0.3, 0.0, 0.0)) < 0.1, what='the last feedback')

    def drive_by_action(self, goal):
        """Send an action goal, and wait until the robot moves."""
        self.observer.forget('goal_state')
        self.action.send_goal(self.goal(goal))
        self.observer.wait_until(lambda: self.action.get_state() == GoalStatus.ACTIVE, 10.0, 'active')
        self.observer.wait_for('cmd_vel', lambda command: command[0] > 0.1)

    def test_cancel_stops_and_a_newer_goal_replaces(self):
        self.declared()
        self.give_control()
        self.drive_by_action(Pose2(2.0, 0.0, 0.0))
        self.action.cancel_goal()
        self.assertTrue(self.action.wait_for_result(rospy.Duration(20.0)))
        self.assertEqual(self.action.get_state(), GoalStatus.PREEMPTED)
        self.observer.wait_for('cmd_vel', lambda command: command == ZERO)
        self.wait_for_rest()
        self.assertTrue(self.declare().message.endswith('; no goal: send one'))
        self.drive_by_action(Pose2(2.0, 0.0, 0.0))
        self.go_to(self.observer.latest('local_pose')[1])
        self.assertTrue(self.action.wait_for_result(rospy.Duration(20.0)))
        self.assertEqual(self.action.get_state(), GoalStatus.PREEMPTED)
        self.assertIn('newer', self.action.get_goal_status_text())

    def test_bad_goals_are_refused_with_the_reason(self):
        for pose, frame, reason in ((Pose2(math.nan, 0.0, 0.0), 'local', 'finite'),
                                    (Pose2(0.0, 1e9, 0.0), 'local', 'a number from -100 to 100 m'),
                                    (Pose2(), 'mars', 'mars')):
            # SimpleActionClient loses an answer that comes before it has noted its goal, so a topic is read
            self.observer.forget('move2goal/result')
            self.action.send_goal(self.goal(pose, frame))
            status = self.observer.wait_for('move2goal/result')
            self.assertEqual(status.status, GoalStatus.REJECTED)
            self.assertIn(reason, status.text)
