"""Pages without a browser use the panel. The tests compare their actions and pictures with the simulated robot's true
pose."""
import http.client
import math
import os
import re
import signal

import rosgraph
import rospy
from actionlib_msgs.msg import GoalID
from rosgraph_msgs.msg import Log
from std_msgs.msg import Bool

from tb3_labs.geometry.arrays import wrap_all
from tb3_labs.geometry.se2 import Pose2

from masters import free_port, process_of
from node_case import SILENCE, ZERO, NodeProgram
from panel_case import LOSS, PanelCase
from panel_page import PanelPage, address_of

PORT = free_port()
#: Pictures a second.
RATE = 10
#: The node gamepad knows the delay of a pad after this time [s].
HEARD = 0.45


class PanelTest(PanelCase):
    """Methods share the nodes. Each begins with a robot at rest that nobody drives."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.observer.watch('/rosout', Log, lambda line: (line.name, line.msg))
        cls.panel = cls.start_panel()
        cls.addClassCleanup(cls.panel.kill)
        cls.address = address_of(cls.panel)

    @staticmethod
    def start_panel(*arguments):
        return NodeProgram('panel.py', '_port:={}'.format(PORT), '_rate:={}'.format(RATE), *arguments)

    def setUp(self):
        self.opened = []
        self.open_with_all_nodes()
        stops = self.page.picture['stops']
        self.page.ask('stop')
        self.rest()
        self.page.wait_for(page='', has_control=False)
        self.page.wait_until(lambda: self.page.picture['stops'] > stops, 5.0, 'the stop')

    def open(self, address=None, **options):
        page = PanelPage(address or self.address, **options)
        self.addCleanup(page.close)
        self.opened.append(page)
        return page

    def open_with_all_nodes(self):
        """The page of the test, when the panel has found all nodes."""
        self.page = self.open()
        self.wait_for_nodes()

    def pages(self):
        return self.opened

    def here(self):
        """Reset the local pose to the origin. Returns the robot's true pose, which is the origin of local."""
        origin = self.rest()
        done, text = self.page.ask('reset', x=0, y=0, yaw_deg=0)
        self.assertTrue(done, text)
        self.assertIn('Local pose set to x=0.000, y=0.000, yaw=0.0 deg', text)
        self.page.wait_until(lambda: self.is_at(self.page.picture['local'], Pose2(), 0.005), 5.0,
                             'the new frame')
        return origin

    def drive_by_stick(self):
        """Take hold of the pad as a person does. So the sticks begin in their middle."""
        self.page.hold(pad={})
        self.page.wait_for(pad='ready', page='this')
        self.page.hold(pad={'forward': 1.0})
        self.wait_until_it_moves()

    def press(self, button):
        """Press a button in one message, after the node has heard the pad for HEARD."""
        self.page.hold(pad={})
        self.let_pass(HEARD)
        self.page.hold(pad={button: True})
        self.page.hold(pad={})

    def drive_to_goal(self):
        """Let move_to_goal drive to a goal that is far away."""
        self.here()
        self.page.ask('goal', x=2.0, y=0.0, yaw_deg=0)
        self.press('a')
        self.page.wait_for(phase='driving', pad='move_to_goal has control: B takes it')
        self.wait_until_it_moves()

    def test_a_frozen_page_disturbs_no_other_page_and_is_closed(self):
        frozen = self.open()
        frozen.freeze(4.5)
        for page in (self.page, self.open()):
            before = page.pictures
            page.wait_until(lambda now=page, had=before: now.pictures > had + 3, 5.0, 'pictures')
        self.assertTrue(frozen.closed.wait(10.0))
        self.assertFalse(self.page.closed.is_set())

    def test_a_picture_shows_the_robot_as_it_is(self):
        self.here()
        self.page.ask('goal', x=0.3, y=0.2, yaw_deg=40)
        self.page.wait_until(lambda: None not in (
            self.page.picture[name] for name in ('truth', 'odom', 'local', 'frame')), 5.0, 'poses')
        self.let_pass(SILENCE)    # the frame is read five times a second
        pose, seen = self.rest(), self.page.picture
        truth, odom, local, frame = (
            Pose2(*seen[name]) for name in ('truth', 'odom', 'local', 'frame'))
        # the odometry begins where the robot truly stands, so odom and world are one frame here
        self.assertLess(truth.distance_to(pose), 0.002)
        self.assertLess(odom.distance_to(truth), 0.01)
        self.assertLess(abs((frame @ local).distance_to(odom)), 0.01)
        self.page.wait_until(lambda: self.page.picture['goal'] == [0.3, 0.2, round(
            math.radians(40), 5)], 5.0, 'the goal')
        self.page.wait_until(lambda: abs(self.page.picture['distance'] - math.hypot(0.3, 0.2))
                             < 0.005, 5.0, 'the distance')
        # the yaw of this robot's IMU is 140.6 degrees ahead of its odometry
        self.assertLess(abs(wrap_all(
            seen['heading_deg'] - math.degrees(pose.yaw) - 140.6, 360.0)), 1.5)
        self.assertEqual((seen['state'], seen['phase']), ('waiting for control', 'waiting'))

    def test_a_silent_or_closed_page_stops_its_robot(self):
        for drive in self.drive_to_goal, self.drive_by_stick:
            for lose in PanelPage.fall_silent, PanelPage.close:
                drive()
                since, stops = rospy.get_time(), self.page.picture['stops']
                lose(self.page)
                self.assert_stopped(since)
                # a page that comes, or comes back, gives nothing by itself; nor does a joy that nobody holds anew
                if lose is PanelPage.close:
                    self.page = self.open()
                self.page.wait_until(lambda known=stops: self.page.picture['stops'] > known, 5.0, 'the loss')
                for _ in range(8):
                    self.page.send('joy', stops=stops, pad={'forward': 1.0, 'left': 0}, mouse=None)
                    self.let_pass(0.1)
                self.page.wait_for(has_control=False)
                self.assertLessEqual(
                    {command for _, command in self.observer.all('cmd_vel', since + LOSS)}, {ZERO})
                self.page.let_go()

    def test_a_stop_of_any_page_ends_everything_and_nothing_comes_back(self):
        other = self.open()
        for drive in (self.drive_to_goal, self.drive_by_stick):
            drive()
            since = rospy.get_time()
            other.send('stop')    # of a page that does not drive
            self.assert_stopped(since, within=0.1)
            self.assert_stands(2 * SILENCE)    # the joys of the page that drove go on
            self.assertIn('the robot was stopped meanwhile: let go, and ask again', self.page.notes)
            self.page.let_go()

    def test_a_stop_without_an_answer_of_move_to_goal_is_not_confirmed(self):
        self.drive_to_goal()
        number = process_of('move_to_goal')
        os.kill(number, signal.SIGSTOP)
        try:
            done, text = self.page.ask('stop')
        finally:
            os.kill(number, signal.SIGCONT)
        self.assertEqual((done, text), (False, 'move_to_goal does not answer'))
        self.page.let_go()
        self.page.wait_for(has_control=False)

    def test_a_stop_of_another_node_ends_the_hold_of_a_page(self):
        publishers = {    # latched, so that the panel gets them as soon as it is connected
            rospy.Publisher('ctrl_relinq', Bool, queue_size=1, latch=True): Bool(False),
            rospy.Publisher('move2goal/cancel', GoalID, queue_size=1, latch=True): GoalID()}
        for publisher, message in publishers.items():
            stops = self.page.picture['stops']
            publisher.publish(message)
            self.page.wait_until(lambda known=stops: self.page.picture['stops'] > known, 5.0,
                                 'the stop')
            for request, values in (('turn', {'degrees': 90}),
                                    ('goal', {'x': 1.0, 'y': 0.0, 'yaw_deg': 0.0})):
                self.assertEqual(self.page.ask(request, stops=stops, **values), (
                    False, 'the robot was stopped meanwhile: let go, and ask again'))
            publisher.unregister()

    def test_turns_and_mouse_are_refused_while_move_to_goal_drives(self):
        self.drive_to_goal()
        refusal = 'move_to_goal drives: take control first'
        self.assertEqual(self.page.ask('turn', degrees=90), (False, refusal))
        other = self.open()
        other.hold(mouse=[1.0, 1.0])
        other.wait_until(lambda: refusal in other.notes, 5.0, 'the reason')
        other.let_go()
        self.assertEqual(self.page.picture['phase'], 'driving')
        self.page.let_go()
        self.page.ask('stop')
        self.page.hold(mouse=[0.0, 1.0])
        self.observer.wait_for('cmd_vel', lambda command: command[0] > 0.15)
        since = rospy.get_time()
        self.page.let_go()
        self.assert_stopped(since)

    def test_the_end_of_a_panel_in_use_stops_the_robot(self):
        for drive in self.drive_by_stick, self.drive_to_goal:
            drive()
            since = rospy.get_time()
            self.assertEqual(self.panel.end(), 0)    # Ctrl+C
            self.assert_stopped(since)
            type(self).panel = self.start_panel()
            self.addClassCleanup(self.panel.kill)
            address_of(self.panel)
            self.open_with_all_nodes()

    def test_a_panel_that_slept_does_not_drive_when_it_wakes(self):
        self.drive_by_stick()
        since = rospy.get_time()
        self.panel.send(signal.SIGSTOP)
        try:
            self.assert_stopped(since, within=LOSS + 0.05)
        finally:
            self.panel.send(signal.SIGCONT)
        self.assert_stands(2 * SILENCE)    # the messages of that time arrive all at once

    def test_an_invalid_message_ends_neither_the_node_nor_the_stop_of_other_pages(self):
        """test_panel_requests.py has the messages that are refused."""
        other = self.open()
        self.page.send('turn', id=1, degrees=1e308)
        self.page.send_text('[[1, 2], {}')
        self.page.wait_until(lambda: self.page.notes and 1 in self.page.answers, 5.0, 'both refusals')
        self.page.send_text('x' * 100000)    # the connection ends, and nothing else
        self.observer.wait_until(self.page.closed.is_set, 5.0, 'the end of that page')
        self.assertEqual(other.ask('stop', seconds=20.0)[1].split(',')[0], 'control taken')
        self.assertIsNone(self.panel.status)

    @staticmethod
    def status_of(path, port=PORT, method='GET', **headers):
        """Sends a request without a browser. Returns (status, body)."""
        connection = http.client.HTTPConnection('localhost', port, timeout=5.0)
        connection.putrequest(method, path, skip_host='Host' in headers)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, answer.read().decode()

    def test_other_sites_and_files_elsewhere_are_refused(self):
        self.assertEqual(self.status_of('/')[0], 200)
        self.assertEqual(self.status_of('/', Host='evil.example:8080')[0], 403)
        for path in '/../ros_server.py', '/%2e%2e/ros_server.py', '//etc/passwd':
            status, body = self.status_of(path)
            self.assertIn(status, (403, 404), path)
            self.assertNotIn('import', body)
        # the answer does not wait for the body, which nobody reads
        self.assertEqual(self.status_of('/', method='POST', **{'Content-Length': 10 ** 8})[0], 400)
        for headers in {'Origin': 'http://evil.example'}, {'Host': 'evil.example'}:
            with self.assertRaises(ConnectionRefusedError):
                PanelPage(self.address, headers=headers)
        self.open(headers={'Origin': self.address.rstrip('/')})

    def test_another_address_needs_the_token_and_a_panel_may_only_show(self):
        shows = self.start_panel('__name:=shows', '_address:=0.0.0.0', '_control:=false')
        self.addCleanup(shows.kill)
        address = address_of(shows)    # PORT is in use, so the panel takes the next one
        self.observer.wait_for('/rosout', lambda line: line[0] == '/shows')
        # The name that this computer's nodes bear: in a container the host's browser finds it, too.
        place, port, token = re.match(r'(http://{}:(\d+)/)\?token=(\S{{10,}})$'.format(
            re.escape(rosgraph.network.get_local_address())), address).groups()
        self.assertGreater(int(port), PORT)
        for wrong in '', '?token=' + token[:-1], '?token=%C3%A9':
            with self.assertRaises(ConnectionRefusedError, msg=wrong):
                PanelPage(place + wrong)
            status, body = self.status_of('/' + wrong, int(port))    # a browser shows the body
            self.assertEqual(status, 403)
            self.assertIn('the token is missing or wrong: use the whole address', body)
        page = self.open(address)
        self.observer.wait_for('/rosout', lambda line: line[0] == '/shows' and 'refused' in line[1])
        self.assertEqual([line for _, line in self.observer.all('/rosout') if token in line[1]], [])
        self.assertEqual(page.ask('stop'), (
            False, 'this panel only shows: it was started with control:=false'))

    def test_requests_without_a_listening_node_are_refused(self):
        alone = self.start_panel('__name:=alone', '__ns:=nowhere')
        self.addCleanup(alone.kill)
        page = self.open(address_of(alone))
        fulfilled, text = page.ask('reset', x=0, y=0, yaw_deg=0)    # within a second, or soon after
        self.assertFalse(fulfilled)
        self.assertIn('/nowhere/set_pose', text)
        self.assertEqual(page.ask('goal', x=0, y=0, yaw_deg=0), (
            False, 'no node listens on move_base_simple/goal: is move_to_goal running?'))
        self.assertEqual(page.ask('stop'), (False, 'no node hears it'))
