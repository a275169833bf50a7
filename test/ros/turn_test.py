"""Turns by keyboard beside a real mouse, with a terminal, an X server and a pointer. The tests judge the simulated
robot's true heading. check_turn.test has the keys of the lab, and Ctrl+C in a turn."""
import math
import os
import re
import shutil
import subprocess
from importlib.util import find_spec

import rospy
from std_msgs.msg import Float64

from node_case import STARTING, ZERO, NodeCase
from tb3_labs.msg import MouseController
from tb3_labs.nodes.controller.mouse import to_mouse
from tb3_labs.ros.clocks import wait_until
from virtual_screen import VirtualScreen

WIDTH, HEIGHT = 800, 600
#: pynput is optional. Without a display its import fails, so the tests only look for it.
HAS_PYNPUT = find_spec('pynput') is not None


class TurnTest(NodeCase):

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.observer.watch('mouse_info', MouseController, to_mouse)
        cls.observer.watch('bad/mouse_info', MouseController)
        cls.observer.wait_for('ground_truth')

    def controller(self, **options):
        """Start the controller, and wait until it is ready."""
        node = self.start('turtlebot_controller.py', **options)
        node.wait_for('and Enter')
        # the controller accepts the first turn of a sender that comes later
        self.turn = rospy.Publisher('turn', Float64, queue_size=5)
        self.addCleanup(self.turn.unregister)
        self.wait_for_subscriber(self.turn)
        self.wait_until_hears('controller', 'imu')
        self.observer.forget('cmd_vel')
        return node

    def mouse(self):
        """Start mouse_client on the screen, and wait until it is ready."""
        client = self.start('mouse_client.py', environment={'DISPLAY': self.display,
                                                            'WAYLAND_DISPLAY': ''})
        client.wait_for('Scroll down')
        return client

    def xdotool(self, *arguments):
        subprocess.check_call(['xdotool'] + [str(argument) for argument in arguments],
                              env=dict(os.environ, DISPLAY=self.display))

    def point(self, x, y):
        """Move the pointer to a position from -1 to 1."""
        self.xdotool('mousemove', round((x + 1.0) / 2.0 * (WIDTH - 1)),
                     round((1.0 - y) / 2.0 * (HEIGHT - 1)))

    def scroll(self, down):
        self.xdotool('click', 5 if down else 4)

    def activate_mouse(self, node):
        """Scroll down while the pointer is in the middle, since a lost mouse does not drive elsewhere. pynput may
        miss the first scroll, so the test scrolls again."""
        times = node.text.count('The mouse is active')
        self.point(0.0, 0.0)

        def is_activated():
            self.scroll(down=True)
            return wait_until(lambda: node.text.count('The mouse is active') > times, 2.0)
        self.assertTrue(wait_until(is_activated, STARTING), node.text)

    def wait_for_command(self, *command):
        self.observer.wait_for('cmd_vel', lambda sent: sent == command)

    def stopped(self):
        """One zero stopped the robot. Two zeros never followed each other."""
        self.wait_for_command(*ZERO)
        commands = [command for _, command in self.observer.all('cmd_vel')]
        self.assertNotIn((ZERO, ZERO), list(zip(commands, commands[1:])))

    def stands(self):
        """The robot was stopped, rests, and no command follows."""
        self.stopped()
        self.rest()
        self.assert_silence()

    def heading(self):
        return math.degrees(self.observer.latest('ground_truth').yaw)

    def turned_since(self, heading):
        return math.remainder(self.heading() - heading, 360.0)

    def turn_half_round(self, node):
        """Returns in the middle of a half turn."""
        node.type('b')
        self.observer.wait_for('cmd_vel', lambda command: command[1] > 1.0)

    def test_a_pipe_then_the_topic(self):
        before = math.degrees(self.rest().yaw)    # the node turns as soon as it runs
        # one line is empty, and the last line has no end
        node = self.controller(typed='b\n\n-33.5')
        node.wait_for('No keyboard')
        node.wait_for('l (90 degrees left)')
        node.wait_for('Turned')
        self.rest()
        turned = self.turned_since(before)
        self.assertLess(abs(math.remainder(turned - 146.5, 360.0)), 0.5)
        printed = float(re.findall(r'Turned (-?[\d.]+) degrees', node.text)[-1])
        self.assertLess(abs(math.remainder(printed - turned, 360.0)), 0.2)
        # turns that arrive together add up
        for _ in range(3):
            self.turn.publish(-30.0)
        node.wait_for('Turned', times=2)
        self.rest()
        self.assertLess(abs(self.turned_since(before) - 56.5), 0.5)
        self.turn.publish(math.nan)
        node.wait_for('nan degrees: a number from')
        self.assertEqual(node.text.count('No keyboard'), 1)
        self.assertEqual(node.end(), 0)

    def test_keyboard_and_mouse_together(self):
        if not (HAS_PYNPUT and shutil.which('Xvfb') and shutil.which('xdotool')):
            self.skipTest('pynput, Xvfb or xdotool is not installed')
        screen = VirtualScreen(WIDTH, HEIGHT)
        self.addCleanup(screen.close)
        self.display = screen.display
        node, client = self.controller(terminal=True), self.mouse()
        # active: up is forward, left is left, the middle stops, by one zero each
        self.activate_mouse(node)
        start = self.observer.latest('ground_truth')
        self.observer.forget('cmd_vel')
        self.point(0.0, 1.0)
        self.observer.wait_for('ground_truth', lambda pose: (start.inverse() @ pose).x > 0.02)
        self.assertEqual(self.observer.latest('cmd_vel'), (0.5, 0.0))
        self.point(0.1, -0.1)
        self.stands()
        before = self.heading()
        self.point(-1.0, 0.0)
        self.observer.wait_for('ground_truth', lambda pose: self.turned_since(before) > 5.0)
        self.point(0.0, 0.0)
        self.stopped()

        # beside a mouse in the middle the robot turns; scrolling up stops that, too
        self.rest()
        self.turn_half_round(node)
        self.scroll(down=False)
        node.wait_for('given up')
        self.stands()

        # a mouse that dies stops the robot
        self.activate_mouse(node)
        self.point(0.0, 1.0)
        self.wait_for_command(0.5, 0.0)
        client.kill()
        node.wait_for('No mouse for')
        self.stopped()
        last_heard, zero = self.observer.all('mouse_info')[-1][0], self.observer.all('cmd_vel')[-1][0]
        # required are 0.3 s, which the core's tests check; the time of the nodes is added
        self.assertLess(zero - last_heard, 0.4 + self.hiccups.since(last_heard, zero))
        self.stands()

        # a display that dies stops the robot, too
        client, deactivated = self.mouse(), node.text.count('The mouse was deactivated')
        self.activate_mouse(node)
        self.point(1.0, 0.0)
        self.wait_for_command(0.0, -0.5)
        screen.close()
        self.assertEqual(client.wait(10.0), 1)
        node.wait_for('The mouse was deactivated', times=deactivated + 1)
        self.stopped()
        self.assertIn('lost the display of the mouse', client.text)

        # q ends the node in the middle of a turn
        self.rest()
        self.observer.forget('cmd_vel')
        self.turn_half_round(node)
        node.type('q')
        self.assertEqual(node.wait(), 0)
        self.assertIn('Controller exiting. Halting robot.', node.text)
        self.stopped()

    def test_a_mouse_that_cannot_be_read_is_one_line(self):
        cases = [({'DISPLAY': ''}, 'DISPLAY is not set'),
                 ({'DISPLAY': ':987', 'WAYLAND_DISPLAY': ''},
                  'cannot open' if HAS_PYNPUT else 'needs the Python package pynput'),
                 ({'WAYLAND_DISPLAY': 'wayland-0'}, 'Xorg')]
        clients = [self.start('mouse_client.py', '__name:=blind%d' % number,
                              'mouse_info:=bad/mouse_info', environment=environment)
                   for number, (environment, _) in enumerate(cases)]
        for client, (_, words) in zip(clients, cases):
            self.assertEqual(client.wait(STARTING), 0)    # so that the other nodes of its launch go on
            # rospy prints a line of its own if rosout was connecting to a node that ends
            said = [line for line in client.lines if 'Inbound TCP/IP connection' not in line]
            self.assertTrue(len(said) == 1 and words in said[0], client.text)
