#!/usr/bin/env python3
"""The lab's demonstration by thumb, and all that may happen to a pad; a script is the thumb."""
import math
import os
import signal
import sys
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Twist
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool, String

from tb3_labs.ros.conversions import to_pose2, to_twist
from tb3_labs.ros.testing.node_process import NodeProcess
from tb3_labs.ros.testing.observer import Observer

sys.path.insert(0, os.path.dirname(os.path.realpath(__file__)))
from thumb import A, B, Y, Thumb    # noqa: E402 (a relay's folder is another one)

ZERO = (0.0, 0.0)


class GamepadTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.seen = Observer()
        cls.seen.watch_robot()
        cls.seen.watch('local_pose', PoseStamped, lambda message: to_pose2(message.pose))
        cls.seen.watch('goal_state', String, lambda message: message.data)
        cls.seen.watch('control_holder', String, lambda message: message.data)
        cls.seen.watch('ctrl_relinq', Bool, lambda message: message.data)
        cls.seen.watch('/diagnostics', DiagnosticArray)
        cls.rival = rospy.Publisher('cmd_vel', Twist, queue_size=1)
        cls.thumb = Thumb()
        cls.mover = NodeProcess('tb3_labs', 'move2goal_tf.py')
        cls.seen.wait_for('goal_state', lambda state: state == 'waiting for control')

    @classmethod
    def tearDownClass(cls):
        cls.mover.end()

    def setUp(self):
        self.thumb.plugged = True
        self.thumb.sticks(0.0, 0.0)
        self.pad = self.start()
        self.seen.forget('control_holder')
        self.seen.wait_for('control_holder', lambda holder: holder == 'gamepad')

    def tearDown(self):
        self.thumb.plugged = True
        self.thumb.sticks(0.0, 0.0)
        self.pad.end()
        self.seen.wait_for_rest('ground_truth')

    def start(self, *arguments):
        node = NodeProcess('tb3_labs', 'gamepad.py', *arguments)
        self.addCleanup(node.kill)
        return node

    def wait_for_state(self, state, seconds=30.0):
        self.seen.wait_for('goal_state', lambda now: now.startswith(state), seconds)

    def let_it_drive(self):
        """Press A; returns when the robot moves fast."""
        self.seen.forget('cmd_vel')
        self.thumb.press(A)
        self.seen.wait_for('cmd_vel', lambda command: abs(command[1]) > 1.0, 5.0)

    def stopped_after(self, since):
        """How long after `since` the last movement was commanded [s]; waits for the zero."""
        self.seen.wait_for('cmd_vel', lambda command: command == ZERO, 2.0)
        moving = [time for time, command in self.seen.all('cmd_vel') if command != ZERO]
        return moving[-1] - since

    def silence(self):
        sent = len(self.seen.all('cmd_vel'))
        until = rospy.get_time() + 0.5
        self.seen.wait_until(lambda: rospy.get_time() > until)
        self.assertEqual(len(self.seen.all('cmd_vel')), sent)

    def reset(self):
        resets = self.pad.text.count('Pose reset successfully.')
        self.thumb.press(Y)
        self.pad.wait_for('Pose reset successfully.', 5.0, resets + 1)

    def assert_at_goal(self, start):
        """The robot truly is at (-0.61, 0.61, 0 deg) of a frame that stood at `start`."""
        self.seen.wait_for_rest('ground_truth')
        place = start.inverse() @ self.seen.latest('ground_truth')
        self.assertLess(math.hypot(place.x + 0.61, place.y - 0.61), 0.02)
        self.assertLess(abs(math.degrees(place.yaw)), 1.0)

    def test_the_whole_demonstration(self):
        # by stick
        start = self.seen.latest('ground_truth')
        self.seen.forget('cmd_vel')
        self.thumb.sticks(1.0, 0.0)
        self.seen.wait_for('ground_truth', lambda pose: (start.inverse() @ pose).x > 0.1)
        self.assertAlmostEqual(self.seen.latest('cmd_vel')[0], 0.2108, places=4)
        self.thumb.sticks(0.0, 1.0)
        self.seen.wait_for('cmd_vel', lambda command: command == (0.0, 2.635))
        self.thumb.sticks(0.0, 0.0)
        self.seen.wait_for('cmd_vel', lambda command: command == ZERO)
        self.seen.wait_for_rest('ground_truth')
        self.silence()

        # reset, A, goal; Y, goal again
        self.reset()
        start = self.seen.latest('ground_truth')
        self.let_it_drive()
        self.assertTrue(self.seen.latest('ctrl_relinq'))
        self.thumb.sticks(1.0, 1.0)        # means nothing now
        self.wait_for_state('GOAL_REACHED')
        self.thumb.sticks(0.0, 0.0)
        self.assert_at_goal(start)
        self.silence()
        start = self.seen.latest('ground_truth')
        self.seen.forget('goal_state')
        self.reset()
        self.wait_for_state('GOAL_REACHED')
        self.assert_at_goal(start)

        # B in mid-turn
        self.seen.forget('goal_state')
        self.reset()
        self.seen.forget('cmd_vel')
        self.seen.wait_for('cmd_vel', lambda command: abs(command[1]) > 1.0, 5.0)
        pressed = self.thumb.press(B)
        self.assertLess(self.stopped_after(pressed), 0.1)
        self.seen.wait_for('control_holder', lambda holder: holder == 'gamepad', 2.0)
        self.seen.wait_for('ctrl_relinq', lambda relinquished: not relinquished, 2.0)
        self.silence()
        commands = [command for _, command in self.seen.all('cmd_vel', pressed)]
        self.assertEqual(commands.count(ZERO), 1)

    def test_a_late_joiner_learns_who_holds_the_robot(self):
        self.thumb.press(A)
        self.seen.wait_for('control_holder', lambda holder: holder == 'move_to_goal')
        late = Observer()
        late.watch('control_holder', String, lambda message: message.data)
        late.watch('ctrl_relinq', Bool, lambda message: message.data)
        late.wait_for('control_holder', lambda holder: holder == 'move_to_goal', 5.0)
        self.assertTrue(late.wait_for('ctrl_relinq', seconds=5.0))
        self.thumb.press(B)

    def test_a_pad_lost_while_it_drives(self):
        self.seen.forget('cmd_vel')
        self.thumb.sticks(0.5, 0.0)
        self.seen.wait_for('cmd_vel')
        lost = rospy.get_time()
        self.thumb.plugged = False
        self.pad.wait_for('No joy for', 2.0)
        self.assertLess(self.stopped_after(lost), 0.35)
        self.seen.wait_for('control_holder', lambda holder: holder == 'nobody', 2.0)
        self.silence()
        self.thumb.plugged = True          # its stick still held
        self.silence()
        self.thumb.sticks(0.0, 0.0)
        self.seen.wait_for('control_holder', lambda holder: holder == 'gamepad')
        self.thumb.sticks(0.5, 0.0)
        self.seen.wait_for('cmd_vel', lambda command: command[0] > 0.05)

    def test_a_pad_lost_while_move_to_goal_drives(self):
        self.reset()
        self.let_it_drive()
        lost = rospy.get_time()
        self.thumb.plugged = False
        self.wait_for_state('waiting for control', 2.0)
        self.assertLess(self.stopped_after(lost), 0.4)
        self.silence()

    def test_a_gamepad_node_that_dies_while_move_to_goal_drives(self):
        for number in (signal.SIGKILL, signal.SIGINT):
            self.reset()
            self.let_it_drive()
            died = rospy.get_time()
            self.pad.end(number)
            self.wait_for_state('waiting for control', 2.0)
            self.assertLess(self.stopped_after(died), 0.7 if number == signal.SIGKILL else 0.4)
            self.silence()
            self.seen.forget('control_holder')
            self.pad = self.start()
            self.seen.wait_for('control_holder', lambda holder: holder == 'gamepad')

    def test_a_move_to_goal_that_is_killed_in_mid_drive_starts_again_without_control(self):
        self.reset()
        self.let_it_drive()
        self.mover.kill()
        self.seen.wait_for_rest('ground_truth')
        self.seen.forget('cmd_vel')
        self.seen.forget('goal_state')
        type(self).mover = NodeProcess('tb3_labs', 'move2goal_tf.py')
        self.mover.wait_for('Control was given by /gamepad before this node could hear it')
        self.wait_for_state('waiting for control')
        self.silence()
        self.thumb.press(B)
        self.let_it_drive()
        self.thumb.press(B)
        self.wait_for_state('waiting for control')

    def test_messages_of_another_pad_are_a_warning(self):
        self.thumb.plugged = False
        short = rospy.Publisher('joy', Joy, queue_size=1)
        self.seen.wait_until(short.get_num_connections)
        for _ in range(5):
            short.publish(Joy(axes=[1.0], buttons=[1]))
        self.pad.wait_for('1 axes and 1 buttons, where the parameters need 4 and 3')
        self.assertNotIn('Traceback', self.pad.text)
        self.assertEqual(self.pad.text.count('bad message on joy'), 1)

    def test_ten_presses_without_a_service_are_one_answer(self):
        alone = self.start('__ns:=alone', 'joy:=/joy')
        self.seen.wait_until(lambda: 'The gamepad drives' in alone.text)
        for _ in range(7):                 # in 0.84 s
            self.thumb.press(Y)
        alone.wait_for('Pose not reset: timeout', 3.0)
        self.assertEqual(alone.text.count('Pose not reset'), 1)
        self.assertEqual(alone.end(), 0)

    def test_a_second_driver_is_named(self):
        self.reset()
        self.let_it_drive()
        begun = rospy.get_time()
        while '/gamepad_test sends commands' not in self.mover.text:
            self.rival.publish(to_twist(0.0, 0.1))
            rospy.rostime.wallsleep(0.1)
            self.assertLess(rospy.get_time() - begun, 2.0)
        self.thumb.press(B)
        self.seen.wait_until(lambda: any(
            'also driven by /gamepad_test' in status.message
            for _, message in self.seen.all('/diagnostics', begun) for status in message.status),
            5.0, 'a diagnosis')


if __name__ == '__main__':
    rospy.init_node('gamepad_test')
    rostest.rosrun('tb3_labs', 'gamepad_test', GamepadTest)
