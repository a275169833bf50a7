#!/usr/bin/env python3
"""Gamepad, mouse, keyboard and move_to_goal together: each input drives in its turn, never two at
once, and a stop reaches the one that drives."""
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import String

from drive_case import DriveCase
from node_case import STARTING, ZERO, run_as_node
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.rospy_internals import connection_of
from thumb import A, B, Mouse, Thumb, punctual

#: Time from a stop, or from another driver's first command, to a driver's last that moves [s].
PROMPT = 0.25
PAD, MOVER, CONTROLLER = '/gamepad', '/move_to_goal', '/controller'
#: The mouse: active, x, y.
RELEASED, CENTRED, PUSHED = (False, 0.0, 0.0), (True, 0.0, 0.0), (True, 0.0, 0.8)


@punctual
class InputsTest(DriveCase):

    @classmethod
    def watch(cls):
        cls.seen.watch('cmd_vel', Twist, lambda message: (
            connection_of(message)['callerid'], (message.linear.x, message.angular.z)))
        cls.watch_data(String, 'control_holder')

    def setUp(self):
        self.begun = rospy.get_time()
        self.seen.forget('control_holder')
        self.thumb, self.mouse = Thumb(), Mouse()
        self.start('move2goal_tf.py')
        self.start('gamepad.py')
        self.keyboard = self.start('turtlebot_controller.py', terminal=True)
        self.keyboard.wait_for('and Enter')
        self.wait_for_state('waiting for control', seconds=STARTING)
        self.seen.wait_for('control_holder', lambda holder: holder == 'gamepad', STARTING)
        self.wait_until_heard(self.goals, self.control, self.mouse.publisher)
        self.wait_until_hears('controller', 'imu')

    def drives(self, sender, condition=lambda command: command != ZERO):
        """Wait for a new command of `sender` that moves the robot."""
        asked = rospy.get_time()
        self.seen.wait_until(lambda: any(
            who == sender and condition(command)
            for _, (who, command) in self.seen.all('cmd_vel', asked)), what=sender)

    def is_stopped(self, sender, since):
        """A zero of `sender` ends its commands within PROMPT of a stop."""
        self.seen.wait_until(lambda: self.sent_by(sender)[-1][1] == ZERO, what='a zero')
        last = max(at for at, command in self.sent_by(sender) if command != ZERO)
        self.assertLess(last - since, PROMPT + self.hiccups.since(since, last), sender)

    def sent_by(self, sender):
        return [(at, command) for at, (who, command) in self.seen.all('cmd_vel', self.begun)
                if who == sender]

    def test_each_input_drives_in_its_turn_and_never_two_at_once(self):
        self.thumb.sticks(0.5, 0.0)
        self.drives(PAD)
        self.declare()
        self.go_to(Pose2(90.0))
        self.thumb.press(A)
        self.drives(MOVER)                     # the stick is still pushed
        self.is_stopped(PAD, rospy.get_time())
        self.is_stopped(MOVER, self.thumb.press(B))
        self.thumb.sticks(0.0, 0.0)
        self.keyboard.type('900')
        self.drives(CONTROLLER, lambda command: command[1] > 1.0)
        self.mouse.state, self.mouse.plugged = CENTRED, True
        self.keyboard.wait_for('The mouse is active')
        self.drives(CONTROLLER, lambda command: command[1] > 1.0)
        self.mouse.state = PUSHED
        self.drives(CONTROLLER, lambda command: command[0] > 0.1)
        self.keyboard.wait_for('the mouse took over')
        released, self.mouse.state = rospy.get_time(), RELEASED
        self.is_stopped(CONTROLLER, released)
        self.thumb.press(A)
        self.drives(MOVER)
        self.seen.forget('control_holder')
        stopped = rospy.get_time()
        self.control.publish(False)            # although the pad renews
        self.is_stopped(MOVER, stopped)
        self.seen.wait_for('control_holder', lambda holder: holder == 'gamepad')
        self.thumb.sticks(0.0, 0.5)
        self.drives(PAD)
        self.thumb.sticks(0.0, 0.0)
        self.is_stopped(PAD, rospy.get_time())
        self.check_one_at_a_time()

    def check_one_at_a_time(self):
        """A driver that another one follows had sent its zero, apart from delays of the machine."""
        driver, heard = '', []
        for at, (sender, command) in self.seen.all('cmd_vel', self.begun):
            if command == ZERO:
                continue
            if sender != driver:
                heard.append((at, sender))
                driver = sender
        self.assertEqual([sender for _, sender in heard], [PAD, MOVER, CONTROLLER, MOVER, PAD])
        for (_, before), (at, _) in zip(heard, heard[1:]):
            self.assertEqual([c for t, c in self.sent_by(before) if t < at][-1], ZERO)


if __name__ == '__main__':
    run_as_node('inputs', InputsTest)
