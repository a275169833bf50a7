"""The lab's demonstration with a gamepad, and nodes that die. A Thumb plays the pad."""
import math
import signal

import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool, String

from masters import free_port
from drive_case import DriveCase
from node_case import STARTING, ZERO, NodeProgram
from observer import Observer
from panel_page import PanelPage, address_of
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.conversions import to_pose2
from thumb import A, B, Y, Thumb, WithThumb

#: A goal of the lab's direction, but near.
GOAL = Pose2(-0.1, 0.1)
MOVER = 'move2goal_tf.py', '_goal_x:=-0.1', '_goal_y:=0.1'


class GamepadTest(WithThumb, DriveCase):
    """Methods share the running nodes. Each begins with a robot at rest that the pad holds."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.observer.watch('local_pose', PoseStamped, lambda message: to_pose2(message.pose))
        cls.watch_data(String, 'control_holder')
        cls.watch_data(Bool, 'ctrl_relinq')
        cls.thumb = Thumb()
        # the pad second: a node doubts the first message of a pad that was there before
        cls.mover = NodeProgram(*MOVER)
        cls.wait_for_state('waiting for control', seconds=STARTING)
        cls.pad = NodeProgram('gamepad.py')

    @classmethod
    def tearDownClass(cls):
        for node in (cls.pad, cls.mover):
            node.kill()

    def setUp(self):
        self.thumb.sticks(0.0, 0.0)
        if self.pad.status is not None:
            self.start_pad()
        if self.mover.status is not None:
            type(self).mover = NodeProgram(*MOVER)
        self.thumb.press(B)
        self.observer.wait_for('control_holder', lambda holder: holder == 'gamepad', STARTING)
        self.rest()
        self.printed = len(self.pad.text)

    def start_pad(self):
        """A new gamepad node, which holds the robot."""
        self.observer.forget('control_holder')
        type(self).pad = NodeProgram('gamepad.py')
        self.printed = 0
        self.observer.wait_for('control_holder', lambda holder: holder == 'gamepad', STARTING)

    def let_it_drive(self):
        """Press A, and wait until the robot moves fast."""
        self.observer.forget('cmd_vel')
        self.thumb.press(A)
        self.observer.wait_for('cmd_vel', lambda command: abs(command[1]) > 1.0)

    def said(self, words):
        """Returns how often the gamepad node printed `words` in this test."""
        return self.pad.text[self.printed:].count(words)

    def press_y(self):
        words = 'Pose reset successfully.'
        resets = self.said(words)
        self.thumb.press(Y)
        self.observer.wait_until(lambda: self.said(words) > resets, 5.0, words)

    def assert_at_goal(self, start):
        """The robot truly is at GOAL in a frame that stood at `start`."""
        place = start.inverse() @ self.rest()
        self.assertLess(place.distance_to(GOAL), 0.02)
        self.assertLess(abs(math.degrees(place.yaw)), 1.0)

    def test_the_whole_demonstration(self):
        # reset, A, goal; Y, goal again
        self.press_y()
        start = self.observer.latest('ground_truth')
        self.let_it_drive()
        self.assertTrue(self.observer.latest('ctrl_relinq'))
        self.thumb.sticks(1.0, 1.0)        # means nothing now
        self.wait_for_state('GOAL_REACHED')
        self.thumb.sticks(0.0, 0.0)
        self.assert_at_goal(start)
        self.assert_silence()
        start = self.observer.latest('ground_truth')
        self.observer.forget('goal_state')
        self.press_y()
        self.wait_for_state('GOAL_REACHED')
        self.assert_at_goal(start)

        # B in mid-turn
        self.observer.forget('goal_state')
        self.press_y()
        self.observer.forget('cmd_vel')
        self.observer.wait_for('cmd_vel', lambda command: abs(command[1]) > 1.0)
        pressed = self.thumb.press(B)
        self.assert_stopped(pressed, 0.1)
        self.observer.wait_for('control_holder', lambda holder: holder == 'gamepad')
        self.observer.wait_for('ctrl_relinq', lambda relinquished: not relinquished)
        self.assert_silence()
        commands = [command for _, command in self.observer.all('cmd_vel', pressed)]
        self.assertEqual(commands.count(ZERO), 1)

    def test_a_hanging_driver_stops_the_robot_until_a_new_message(self):
        """Such a driver repeats one message with its stamp."""
        self.thumb.sticks(1.0, 0.0)
        self.observer.wait_for('cmd_vel', lambda command: command[0] > 0.2)
        self.thumb.hangs_since = rospy.Time.now()
        hung = rospy.get_time()
        self.pad.wait_for('joy_node repeats one message')
        self.assert_stopped(hung, 0.35)
        self.thumb.hangs_since = None
        self.assert_silence()        # the stick was not in its middle since then
        self.thumb.sticks(0.0, 0.0)
        self.observer.wait_for('control_holder', lambda holder: holder == 'gamepad')

    def test_a_late_subscriber_gets_the_holder(self):
        self.thumb.press(A)
        self.observer.wait_for('control_holder', lambda holder: holder == 'move_to_goal')
        late = Observer()
        late.watch('control_holder', String, lambda message: message.data)
        late.watch('ctrl_relinq', Bool, lambda message: message.data)
        late.wait_for('control_holder', lambda holder: holder == 'move_to_goal', 5.0)
        self.assertTrue(late.wait_for('ctrl_relinq', seconds=5.0))
        self.thumb.press(B)

    def test_a_gamepad_node_that_dies_while_move_to_goal_drives(self):
        for number in (signal.SIGKILL, signal.SIGINT):
            self.press_y()
            self.let_it_drive()
            died = rospy.get_time()
            self.pad.end(number)
            self.wait_for_state('waiting for control')
            self.assert_stopped(died, 0.7 if number == signal.SIGKILL else 0.5)
            self.assert_silence()
            self.start_pad()

    def test_a_move_to_goal_that_is_killed_in_mid_drive_starts_again_without_control(self):
        self.press_y()
        self.let_it_drive()
        self.mover.kill()
        self.rest()
        self.observer.forget('cmd_vel')
        self.observer.forget('goal_state')
        type(self).mover = NodeProgram(*MOVER)
        # two orders are possible: the node hears first that the pad gave control before; or the pad
        # hears first that the node has no control, and takes it back
        self.observer.wait_until(
            lambda: 'Control from /gamepad does not count: it was given before' in self.mover.text
            or self.said('Control was taken from move_to_goal'), STARTING, 'what became of it')
        self.wait_for_state('waiting for control')
        self.assert_silence()
        self.thumb.press(B)
        self.let_it_drive()
        self.thumb.press(B)
        self.wait_for_state('waiting for control')

    def test_a_pad_and_a_page_reset_and_drive_a_node_as_in_the_handout(self):
        page = PanelPage(address_of(self.start('panel.py', '_port:={}'.format(free_port()))))
        self.addCleanup(page.close)
        for end in (self.mover.kill, lambda: student.end(signal.SIGINT)):
            end()    # after a kill the master still knows reset_pose
            student = self.start('plain_move2goal_tf.py')
            rospy.wait_for_service('/set_pose', STARTING)
            self.assertEqual(page.ask('reset', x=1.0, y=2.0, yaw_deg=90.0), (
                True, '/set_pose was called with x=1.000, y=2.000, yaw=90.0 deg'))
            student.wait_for('Local pose set to x=1.0, y=2.0, yaw=1.57')
            self.press_y()
            student.wait_for('Local pose set to x=0.0, y=0.0, yaw=0.0.')
            self.observer.forget('cmd_vel')
            self.thumb.press(A)
            self.observer.wait_for('cmd_vel', lambda command: command[1] > 0.5)
            self.assert_stopped(self.thumb.press(B), 0.2)

    def test_a_pad_as_in_the_handout_resets_and_hands_over(self):
        self.pad.end(signal.SIGINT)
        student = self.start('plain_gamepad.py')
        self.observer.forget('cmd_vel')
        self.observer.wait_for('cmd_vel', seconds=STARTING)    # the node repeats zeros
        rospy.wait_for_service('reset_pose', STARTING)     # an earlier test may have ended its node
        self.declare(Pose2(5.0, 5.0, 1.6))
        self.observer.wait_for('local_pose', lambda pose: pose.x > 4.9)
        self.thumb.press(Y)
        student.wait_for('Pose reset successfully.')
        self.observer.wait_for('local_pose', lambda pose: abs(pose.x) < 0.01 and abs(pose.y) < 0.01)
        self.thumb.press(B)      # otherwise its first True could be a repetition by an earlier process
        self.let_it_drive()
        self.assert_stopped(self.thumb.press(B), 0.2)
        self.assertEqual(student.end(), 0)
