"""Checks of the robot's motion in the tests of the panel.

A page that is silent for 0.25 s is lost, and the robot must stop. On a busy machine the page of a test
may be late, or its messages reach the panel late. Then :meth:`PanelCase.excuse` makes the test void.
"""
import xmlrpc.client

import rosgraph
import rospy

from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import Pose2

from node_case import SILENCE, STARTING, ZERO, NodeCase

#: A lost page has stopped the robot after this time [s].
LOSS = 0.3
#: Words of the panel about a page that was late.
VOID = 'stopped meanwhile', 'came late', 'is silent for'
#: Topics of the panel, to which move_to_goal, the gamepad and the controller listen.
HEARD = {'/ctrl_relinq', '/joy', '/mouse_info', '/turn', '/move_base_simple/goal'}


class PanelCase(NodeCase):
    """A case with an Observer `observer` of cmd_vel and ground_truth."""

    def wait_for_nodes(self):
        """Wait until the nodes of the labs listen to the panel."""
        def all_listen():
            address = rosgraph.Master(rospy.get_name()).lookupNode('/panel')
            _, _, links = xmlrpc.client.ServerProxy(address).getBusInfo(rospy.get_name())
            return HEARD <= {topic for _, node, direction, _, topic, *_ in links
                             if direction == 'o' and node != '/panel'}
        self.observer.wait_until(all_listen, STARTING, 'all nodes')

    @staticmethod
    def is_at(shown, place, within):
        """Is the pose `shown` of a picture, which may be None, `within` [m] of the Pose2 `place`?"""
        return shown is not None and Pose2(*shown).distance_to(place) < within

    def assert_drives_forward(self, start):
        there = self.observer.wait_for('ground_truth', lambda pose: start.distance_to(pose) > 0.1)
        self.assertGreater((start.inverse() @ there).x, 0.09)

    def assert_turns(self, start, sign):
        """The robot turns from the true pose `start`, to the left if `sign` is 1, to the right if it is -1."""
        self.observer.wait_for('ground_truth', lambda pose: 0.2 < sign * difference(
            pose.yaw, start.yaw) < 2.0)

    def assert_stopped(self, since, within=LOSS):
        """Check as NodeCase does. Then the robot must stand."""
        super().assert_stopped(since, within)
        self.assert_stands()

    def assert_stands(self, seconds=SILENCE):
        """The robot comes to rest, and no movement is commanded for a time."""
        self.rest()
        since = rospy.get_time()
        self.let_pass(seconds)
        commands = {command for _, command in self.observer.all('cmd_vel', since)}
        self.assertEqual(commands - {ZERO}, set())

    def excuse(self, _begun):
        """Returns the reason why the test was void, or ''. The method `pages()` of the case returns the pages of the
        test. Each page has its `notes`."""
        notes = [note for page in self.pages() for note in page.notes]
        print('the panel refused:', notes)
        return next((note for note in notes if any(words in note for words in VOID)), '')
