#!/usr/bin/env python3
"""The panel as its pages use it, without a browser. The actions and pictures of pages are compared
with the simulated robot's true pose."""
import http.client
import math
import re
import signal
import sys

import rosgraph
import rospy
import rostest
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped, TransformStamped, Twist, Vector3
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool, Float32
from tf2_msgs.msg import TFMessage

from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.ros.clocks import steady_time
from tb3_labs.ros.observer import Observer

from node_case import SILENCE, STARTING, Hiccups, Node, watch_robot
from panel_case import LOSS, PanelCase, with_punctual_pages
from panel_page import Page, address_of

PORT = 8090


@with_punctual_pages
class PanelTest(PanelCase):
    """Methods share the nodes; each begins with a robot at rest that nobody drives."""

    @classmethod
    def setUpClass(cls):
        cls.seen, cls.hiccups = Observer(), Hiccups()
        watch_robot(cls.seen)
        cls.seen.watch('ctrl_relinq', Bool, lambda message: message.data)
        cls.seen.watch('has_control', Bool, lambda message: message.data)
        cls.seen.watch('/rosout', Log, lambda line: (line.name, line.msg))
        cls.panel = cls.start_panel()
        cls.addClassCleanup(cls.panel.kill)
        cls.address = address_of(cls.panel)

    @staticmethod
    def start_panel(*arguments):
        return Node('panel.py', '_port:={}'.format(PORT), *arguments)

    def setUp(self):
        self.opened = []
        self.open_with_all_nodes()
        self.page.send('stop')
        self.rest()
        self.page.wait_for(page='', has_control=False)

    def open(self, address=None, **options):
        page = Page(address or self.address, **options)
        self.addCleanup(page.close)
        self.opened.append(page)
        return page

    def open_with_all_nodes(self):
        """The page of the test, when the panel has found all nodes."""
        self.page = page = self.open()
        page.wait_until(lambda: all(page.latest.get('picture', {}).get(
            'can', {'': False}).values()), STARTING, 'all nodes')

    def pages(self):
        return self.opened

    def here(self):
        """Declare the robot to be at the origin; its true pose, which is that of local."""
        origin = self.rest()
        self.assertEqual(self.page.ask('reset', x=0, y=0, yaw_deg=0), (
            True, 'Local pose set to x=0.000, y=0.000, yaw=0.0 deg'))
        self.page.wait_until(lambda: self.is_at(self.page.picture['local'], Pose2(), 0.005), 5.0,
                             'the new frame')
        return origin

    def drive_by_stick(self):
        """Grip the pad, as a person does: the sticks begin in their middle."""
        self.assertEqual(self.page.ask('begin'), (True, ''))
        self.page.hold(pad={})
        self.page.wait_for(pad='ready')
        self.page.hold(pad={'forward': 1.0})
        self.wait_until_it_moves()

    def drive_to_goal(self):
        """Give control for a goal that is far away."""
        self.here()
        self.page.ask('goal', x=2.0, y=0.0, yaw_deg=0)
        self.assertEqual(self.page.ask('give'), (True, 'control given'))
        self.page.hold()
        self.page.wait_for(phase='driving')
        self.wait_until_it_moves()

    # -- what a page shows

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
        self.assertLess(abs(difference_degrees(
            seen['heading_deg'], math.degrees(pose.yaw) + 140.6)), 1.5)
        self.assertEqual((seen['state'], seen['phase']), ('waiting for control', 'waiting'))

    def test_nothing_is_listened_to_while_nobody_looks(self):
        self.page.close()
        master = rosgraph.Master('/panel_test')

        def heard():
            return {topic for topic, nodes in master.getSystemState()[1] if '/panel' in nodes}
        self.seen.wait_until(lambda: heard() <= {'/rosout'}, 10.0,
                             'the end of its subscriptions, not {}'.format(heard()))
        again = self.open()
        again.wait_until(lambda: again.latest.get('picture', {}).get('odom'), 5.0, 'a picture')

    def test_a_page_that_takes_nothing_is_dropped_and_no_other(self):
        frozen = self.open()
        frozen.freeze(6.0)
        self.assertTrue(frozen.closed.wait(10.0))
        self.assertLess(frozen.pictures, 120)
        self.assertFalse(self.page.closed.is_set())

    def test_invalid_messages_of_other_nodes_are_dropped(self):
        topics = {'/tf': TFMessage([TransformStamped()]), 'local_pose': PoseStamped(),
                  'ground_truth': PoseStamped(), 'imu': Imu(), 'odom': Odometry(),
                  'distance_error': Float32(math.nan),
                  'cmd_vel': Twist(linear=Vector3(x=math.nan))}
        topics['/tf'].transforms[0].header.frame_id = 'odom'
        topics['/tf'].transforms[0].child_frame_id = 'local'    # a quaternion of four zeros
        publishers = {rospy.Publisher(topic, type(message), queue_size=5): message
                      for topic, message in topics.items()}
        self.wait_until_heard(*publishers)
        for publisher, message in publishers.items():
            publisher.publish(message)
        before = self.page.pictures
        self.page.wait_until(lambda: self.page.pictures > before + 20, 5.0, 'more pictures')
        for publisher in publishers:
            publisher.unregister()
        self.assertIsNone(self.panel.status)

    # -- driving

    def test_control_is_over_with_the_page_that_gave_it(self):
        for how in 'closed', 'silent':
            self.drive_to_goal()
            since = rospy.get_time()
            (self.page.close if how == 'closed' else self.page.fall_silent)()
            self.assert_stopped(since)
            # a page that comes, or comes back, gives nothing by itself
            page = self.page = self.open() if how == 'closed' else self.page
            page.hold()
            page.wait_for(has_control=False)
            self.assert_stands()
            page.fall_silent()

    def test_a_page_that_falls_silent_or_is_closed_while_its_stick_drives_stops(self):
        self.drive_by_stick()
        since = rospy.get_time()
        self.page.fall_silent()
        self.assert_stopped(since)
        self.page.hold(pad={'forward': 1.0})    # the same joy again, but nobody gripped it anew
        self.assert_stands(2 * SILENCE)
        self.page.fall_silent()
        self.drive_by_stick()
        since = rospy.get_time()
        self.page.close()
        self.assert_stopped(since)

    def test_y_resets_and_control_by_a_is_over_with_its_page(self):
        self.assertEqual(self.page.ask('begin')[0], True)
        self.page.hold(pad={})
        self.page.wait_for(pad='ready')
        self.assertTrue(self.page.ask('reset', x=5, y=5, yaw_deg=5)[0])
        self.page.wait_until(lambda: self.page.picture['local'][0] > 4.9, 5.0, 'the reset')
        self.page.hold(pad={'y': True})
        self.page.wait_until(lambda: abs(self.page.picture['local'][0]) < 0.01, 5.0, 'reset by Y')
        self.page.hold(pad={'a': True})
        self.page.wait_for(pad='held back', has_control=True)
        self.page.fall_silent()
        self.page.wait_for(has_control=False, seconds=5.0)
        self.rest()

    def test_a_stop_ends_a_turn_and_names_the_nodes_to_which_it_was_sent(self):
        start = self.rest()
        self.page.ask('turn', degrees=180)
        self.assert_turns(start, 1)
        since = rospy.get_time()
        confirmed, text = self.page.ask('stop')
        self.assert_stopped(since, within=0.1)
        self.assertTrue(confirmed, text)
        self.assertRegex(text, '^STOP was sent to /move_to_goal, .*/turtlebot3$')

    def test_a_stop_ends_everything_and_nothing_comes_back(self):
        other = self.open()
        for kind, drive in (('stop', self.drive_to_goal), ('take', self.drive_by_stick)):
            drive()
            since = rospy.get_time()
            other.send(kind)    # of a page that does not drive
            self.assert_stopped(since, within=0.1)
            self.assert_stands(2 * SILENCE)    # the joys of the page that drove go on

    def test_what_was_pressed_before_a_stop_does_not_count_after_it(self):
        other, goal = self.open(), {'x': 1.0, 'y': 0.0, 'yaw_deg': 0.0}
        publishers = {    # latched: the panel hears them when it is connected
            rospy.Publisher('ctrl_relinq', Bool, queue_size=1, latch=True): Bool(False),
            rospy.Publisher('move2goal/cancel', GoalID, queue_size=1, latch=True): GoalID()}
        stops = [lambda: other.ask('stop'), lambda: other.ask('take'),
                 lambda: other.hold(pad={'b': True})]
        stops += [lambda publisher=publisher: publisher.publish(publishers[publisher])
                  for publisher in publishers]
        for stop in stops:
            pressed = steady_time()    # this computer's clock is the panel's
            self.assertEqual(self.page.ask('begin', pressed=pressed), (True, ''))
            stop()
            # the panel hears it soon
            self.seen.wait_until(lambda at=pressed: not self.page.ask('begin', pressed=at)[0], 5.0)
            for request, values in (('begin', {}), ('give', {}), ('turn', {'degrees': 90}),
                                    ('goal', goal)):
                self.assertEqual(self.page.ask(request, pressed=pressed, **values), (
                    False, 'this was pressed before the robot was stopped: press it again'))
        for publisher in publishers:
            publisher.unregister()

    def test_control_that_was_lost_by_itself_is_given_anew(self):
        self.page.ask('give')
        self.page.hold()
        self.page.wait_for(has_control=True)
        lost = rospy.Publisher('has_control', Bool, queue_size=1, latch=True)
        lost.publish(False)    # as move_to_goal does
        self.page.wait_for(has_control=False)
        since = rospy.get_time()
        self.assertEqual(self.page.ask('give'), (True, 'control given'))
        self.seen.wait_until(lambda: False in [
            word for _, word in self.seen.all('ctrl_relinq', since)], 2.0, 'a new giving')
        self.page.wait_for(has_control=True)
        lost.unregister()

    def test_turns_and_mouse_are_refused_while_move_to_goal_drives(self):
        self.drive_to_goal()
        self.assertEqual(self.page.ask('turn', degrees=90), (
            False, 'move_to_goal drives: take control first'))
        self.page.hold(mouse=[1.0, 1.0])
        self.let_pass(SILENCE)
        self.page.wait_for(phase='driving')
        since = rospy.get_time()
        self.assertEqual(self.page.ask('take'), (True, 'control taken'))
        self.assert_stopped(since)    # the mouse that is still held must be gripped anew
        self.page.hold()
        self.page.hold(mouse=[0.0, 1.0])
        self.seen.wait_for('cmd_vel', lambda command: command[0] > 0.15)

    def test_a_panel_that_ends_while_it_is_used_stops_the_robot(self):
        for drive in self.drive_by_stick, self.drive_to_goal:
            drive()
            since = rospy.get_time()
            self.assertEqual(self.panel.end(), 0)    # Ctrl+C
            self.assert_stopped(since)
            type(self).panel = self.start_panel()
            self.addClassCleanup(self.panel.kill)
            address_of(self.panel)
            self.open_with_all_nodes()

    def test_a_panel_that_slept_drives_nothing_when_it_wakes(self):
        self.drive_by_stick()
        since = rospy.get_time()
        self.panel.send(signal.SIGSTOP)
        try:
            self.assert_stopped(since, within=LOSS + 0.05)
        finally:
            self.panel.send(signal.SIGCONT)
        self.assert_stands(2 * SILENCE)    # the messages of that time arrive all at once

    # -- what is refused

    def test_bad_requests_are_refused_with_the_reason(self):
        self.page.send_text('{"type": "fly"}')
        self.page.wait_until(lambda: any('type = "fly"' in note for note in self.page.notes), 5.0,
                             'the reason')
        self.page.send_text('x' * 100000)    # the connection ends, and nothing else
        self.seen.wait_until(self.page.closed.is_set, 5.0, 'the end of that page')
        self.assertIsNone(self.panel.status)
        self.rest()

    @staticmethod
    def status_of(path, port=PORT, **headers):
        """(status, body) of a request as a program sends it."""
        connection = http.client.HTTPConnection('localhost', port, timeout=5.0)
        connection.putrequest('GET', path, skip_host='Host' in headers)
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
        for headers in {'Origin': 'http://evil.example'}, {'Host': 'evil.example'}:
            with self.assertRaises(ConnectionRefusedError):
                Page(self.address, headers=headers)
        self.open(headers={'Origin': self.address.rstrip('/')})

    def test_another_address_needs_the_token_and_a_panel_may_only_show(self):
        shows = self.start_panel('__name:=shows', '_address:=0.0.0.0', '_control:=false',
                                 '_robots:=2')
        self.addCleanup(shows.kill)
        address = address_of(shows)    # the next port is taken: this one is in use
        self.seen.wait_for('/rosout', lambda line: line[0] == '/shows')
        # The name that this computer's nodes bear: in a container the host's browser finds it, too.
        place, token = re.match(r'(http://localhost:{}/)\?token=(\S{{10,}})$'.format(PORT + 1),
                                address).groups()
        for wrong in '', '?token=' + token[:-1], '?token=%C3%A9':
            with self.assertRaises(ConnectionRefusedError, msg=wrong):
                Page(place + wrong)
            status, body = self.status_of('/' + wrong, PORT + 1)    # as a browser shows it
            self.assertEqual(status, 403)
            self.assertIn('the token is missing or wrong: use the whole address', body)
        page = self.open(address)
        page.wait_until(lambda: 'robots' in page.latest, 10.0, 'the list')
        self.assertEqual([robot['name'] for robot in page.latest['robots']['robots']],
                         ['robot1', 'robot2'])
        self.assertEqual(page.ask('look', robot='robot3'), (
            False, "robot 'robot3' is unknown; known: robot1, robot2"))
        page.send('look', robot='robot2')
        page.wait_for(robot='robot2')
        self.seen.wait_for('/rosout', lambda line: line[0] == '/shows' and 'refused' in line[1])
        self.assertEqual([line for _, line in self.seen.all('/rosout') if token in line[1]], [])
        self.assertEqual(page.ask('stop'), (
            False, 'this panel only shows: it was started with control:=false'))

    def test_a_reset_without_a_node_that_offers_it_is_refused(self):
        alone = self.start_panel('__name:=alone', '__ns:=nowhere')
        self.addCleanup(alone.kill)
        page = self.open(address_of(alone))
        fulfilled, text = page.ask('reset', x=0, y=0, yaw_deg=0)    # within a second, or soon after
        self.assertFalse(fulfilled)
        self.assertIn('/nowhere/reset_pose', text)
        self.assertEqual(page.ask('give'), (
            False, 'no node listens on ctrl_relinq: is move_to_goal running?'))
        self.assertEqual(page.ask('stop'), (False, 'no node hears it'))


if __name__ == '__main__':
    rospy.init_node('panel_test')
    rostest.rosrun('tb3_labs', 'panel_test', PanelTest, sys.argv)
