"""A person uses the panel in a real browser by mouse, keys and gamepad. The tests judge the simulated robot's true
pose."""
import math
import unittest

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from tb3_labs.geometry.arrays import wrap_all
from tb3_labs.geometry.se2 import Pose2

from browser import MISSING, Browser, Cable
from masters import free_port
from node_case import SILENCE, STARTING, ZERO, NodeProgram
from panel_case import LOSS, PanelCase
from panel_page import PanelPage, address_of

PORT = free_port()
#: Pictures a second. The browser computes mostly to draw them.
RATE = 4
#: A page that is frozen or cut off has stopped the robot after this time [s].
LOST = 0.5
#: The cable between the browser and the panel.
CABLE = Cable(PORT)


@unittest.skipIf(MISSING, MISSING)
class PanelBrowserTest(PanelCase):
    """Methods share nodes and browser. Each begins with a robot at rest that nobody drives."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.start_panel()
        cls.address = address_of(cls.panel)
        cls.browser = None

    @classmethod
    def start_panel(cls):
        cls.panel = NodeProgram('panel.py', '_port:={}'.format(PORT), '_rate:={}'.format(RATE))
        cls.addClassCleanup(cls.panel.kill)

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()

    def setUp(self):
        self.others = []
        if self.browser is None:
            type(self).browser = Browser(CABLE.address(self.address))
        self.page = self.browser
        self.page.wait_until(lambda: self.page.picture('stops') is not None, STARTING, 'a picture')
        self.wait_for_nodes()
        self.page.click('stop')
        self.rest()
        self.page.wait_for(page='', has_control=False)

    def pages(self):
        return [page for page in (self.browser, *self.others) if page]

    def here(self):
        """Reset the local pose to 0, 0, 0. Returns the robot's true pose, which is the origin of local.

        A reset is refused if it is late, if sensors are late, or if a False of setUp's STOP comes after the click. The
        page shows the reason, and the person asks again.
        """
        origin = self.rest()
        self.page.type(reset_x='0', reset_y='0', reset_yaw='0')
        self.page.click('reset')

        def is_done():
            if self.page.shows_refusal():
                self.page.click('reset')
            return self.is_at(self.page.picture('local'), Pose2(), 0.005)
        self.page.wait_until(is_done, 20.0, 'the reset')
        return origin

    def wait_for_pose(self, name, x, y, yaw_deg):
        """Wait until the picture shows this pose, about as exactly as a pixel of the map."""
        def is_there():
            shown = self.page.picture(name)
            return self.is_at(shown, Pose2(x, y), 0.02) and abs(wrap_all(
                math.degrees(shown[2]) - yaw_deg, 360.0)) < 3.0
        self.page.wait_until(is_there, 5.0, name)

    def test_a_reset_and_a_goal_are_dragged_and_a_typed_goal_is_reached(self):
        self.page.errors()    # without the values of earlier tests
        self.here()
        self.page.click('tool-reset')
        self.page.drag_in_local((0.2, 0.1), (0.4, 0.1))
        self.wait_for_pose('local', 0.2, 0.1, 0.0)
        self.page.click('tool-goal')
        self.page.drag_in_local((-0.1, -0.1), (-0.1, -0.3))    # facing down: -90 degrees
        self.wait_for_pose('goal', -0.1, -0.1, -90.0)
        origin = self.here()
        self.page.type(goal_x='-0.15', goal_y='0.15', goal_yaw='0')
        self.page.click('goal')
        self.assert_stands()
        self.page.click('button-a')
        self.page.wait_until(lambda: self.page.text('state').strip() == 'MOVE_FORWARD', 10.0,
                             'MOVE_FORWARD')
        self.assertRegex(self.page.text('distance'), r'0\.\d')
        self.page.wait_until(lambda: self.page.text('state').strip() == 'GOAL_REACHED', 40.0,
                             'GOAL_REACHED')
        self.assertTrue(self.page.picture('has_control'))
        reached = origin.inverse() @ self.rest()
        self.assertLess(reached.distance_to(Pose2(-0.15, 0.15)), 0.012)
        self.assertLess(abs(math.degrees(reached.yaw)), 0.7)
        self.assertEqual(self.page.errors(), [])

    def test_a_stick_drives_until_the_person_lets_go(self):
        start = self.rest()
        self.page.take_hold('stick-left', up=0.9)
        self.assert_drives_forward(start)
        since = rospy.get_time()
        self.page.let_go()
        self.assert_stopped(since)
        start = self.rest()
        self.page.take_hold('stick-right', across=-0.9)
        self.assert_turns(start, 1)
        self.page.let_go()
        self.assert_stands()

    def test_a_real_gamepad_drives_hands_over_and_takes_back(self):
        start = self.here()
        self.page.type(goal_x='2')
        self.page.click('goal')
        self.page.move_pad()
        self.page.wait_until(lambda: 'test pad' in self.page.text('gamepad-hint'), 5.0, 'its name')
        self.let_pass(SILENCE)    # its sticks are seen in their middle
        self.page.move_pad(axes=(0, -1, 0, 0))
        self.assert_drives_forward(start)
        self.page.move_pad()
        self.assert_stands()
        self.page.move_pad(pressed=[0])
        self.page.wait_for(has_control=True)
        self.page.move_pad()
        self.observer.wait_for('cmd_vel', lambda command: command != ZERO)
        self.page.move_pad(pressed=[1])
        self.page.wait_for(has_control=False)
        self.page.move_pad()
        self.assert_stands()
        self.page.run('window.testPad = null')

    def test_a_person_sees_the_variables_of_a_node_as_text(self):
        publisher = rospy.Publisher('variables', DiagnosticArray, queue_size=1, latch=True)
        self.assertFalse(self.page.is_shown('inside'))
        publisher.publish(status=[DiagnosticStatus(name='/controller', values=[
            KeyValue('curr_yaw', '359.98765'), KeyValue('<b>state</b>', '<i>TURN</i>')])])
        self.page.wait_until(lambda: self.page.text('inside').split('\n') == [
            'inside /controller', 'curr_yaw', '359.988', '<b>state</b>', '<i>TURN</i>'], 5.0, 'the variables')
        publisher.unregister()
        self.page.wait_until(lambda: not self.page.is_shown('inside'), 10.0, 'a page without them')

    def test_a_button_turns_and_space_stops(self):
        start = self.rest()
        self.let_pass(SILENCE)    # until the controller has heard setUp's STOP, which ends a turn
        self.page.click('turn-right')
        self.assert_turns(start, -1)
        since = rospy.get_time()
        self.page.press_key(' ')
        self.assert_stopped(since)
        self.page.wait_until(lambda: 'the robot stands' in self.page.text('message'), 5.0,
                             'the confirmation')

    def test_b_takes_the_robot_from_another_page(self):
        """B is a key, or a button of a gamepad that a person pressed before the gamepad was plugged in."""
        other = PanelPage(self.address)
        self.others.append(other)
        self.addCleanup(other.close)
        for press in lambda: self.page.press_key('b'), lambda: self.page.move_pad(pressed=[1]):
            self.let_pass(SILENCE)    # until each False of the last stop has come: each is a stop
            other.hold(pad={})
            self.let_pass(0.5)    # the node knows the delay of a pad after this time
            other.hold(pad={'a': True})
            other.hold(pad={})
            self.page.wait_for(has_control=True, page='other')
            press()
            self.page.wait_for(5.0, has_control=False, page='')
            other.let_go()
        self.page.run('window.testPad = null')

    def test_the_mouse_pad_drives_until_the_person_lets_go(self):
        self.page.click('tab-mouse')
        self.page.take_hold('mouse-pad', across=-0.9, up=0.9)    # forward, and to the left
        self.observer.wait_for('cmd_vel', lambda command: command[0] > 0.15 and command[1] > 0.2)
        since = rospy.get_time()
        self.page.let_go()
        self.assert_stopped(since)
        self.page.click('tab-pad')

    def test_a_hidden_page_stops_and_stays_stopped(self):
        self.page.take_hold('stick-left', up=0.9)
        self.wait_until_it_moves()
        since = rospy.get_time()
        self.page.hide()
        hidden = rospy.get_time()
        self.assert_stopped(since, LOSS + hidden - since)
        self.page.show()
        self.assert_stands(2 * SILENCE)
        self.page.let_go()

    def test_a_frozen_or_disconnected_page_stops_and_stays_stopped(self):
        for stop, go_on in ((self.page.freeze, self.page.thaw), (CABLE.pull, CABLE.plug)):
            self.page.take_hold('stick-left', up=0.9)
            self.wait_until_it_moves()
            since = rospy.get_time()
            stop()
            try:
                self.assert_stopped(since, LOST + rospy.get_time() - since)
            finally:
                go_on()
            self.assert_stands(2 * SILENCE)
            self.page.let_go()
            self.page.wait_until(lambda: not self.page.is_shown('banner'), STARTING, 'its return')

    def test_a_page_without_a_panel_shows_a_banner_and_connects_again(self):
        self.panel.end()
        self.page.wait_until(lambda: self.page.is_shown('banner'), 10.0, 'the banner')
        before = self.page.picture('now')
        self.assertIn('not connected', self.page.text('banner').lower())
        self.assertTrue(self.page.picture('odom'))    # all stays to be looked at
        self.start_panel()
        self.page.wait_until(lambda: not self.page.is_shown('banner'), STARTING, 'its return')
        self.page.wait_until(lambda: self.page.picture('now') > before, STARTING, 'new pictures')
        self.wait_for_nodes()
