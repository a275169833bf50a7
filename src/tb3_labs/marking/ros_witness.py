"""Watches for things that a node must not do, and notes them for the instructor.

Before the node starts, only the robot, the marker and the master run. Every other name and every
other address is the student's.
"""
import os
import threading
from contextlib import suppress

import rosgraph
import rospy
from dynamic_reconfigure.encoding import decode_config, encode_config
from dynamic_reconfigure.msg import Config as Values
from dynamic_reconfigure.srv import Reconfigure
from std_msgs.msg import Empty

from tb3_labs.marking import conduct
from tb3_labs.marking.observation import RESET, TRUTH
from tb3_labs.marking.ros_interface import name_of_sender, sender_of
from tb3_labs.marking.ros_robot import ROBOT
from tb3_labs.ros.topics import subscribe

ENDED = 'The {} was ended while the node ran.'
#: Every node publishes its log lines on this topic.
LOG = '/rosout'
#: The period of asking the master [s].
PERIOD = 1.0
#: The robot's settings are set back at most this many times.
MOST_REPAIRS = 20


class Witness:
    """Notes findings in an Observation, until :meth:`end`."""

    def __init__(self, observation, robot, keep):
        """`robot`: the address of the robot; ``keep()`` saves the present Observation."""
        self._observation, self._keep = observation, keep
        self._master = rosgraph.Master(rospy.get_name())
        #: The connection to the master allows only one question at a time.
        self._asking = threading.Lock()
        self._owners = {'/' + ROBOT: ('robot', robot),
                        rospy.get_name(): ('marker', rospy.get_node_uri())}
        self._parameters = self._robots_parameters()
        self._settings, self._repairs = None, 0
        self._over = threading.Event()
        self._resets = None
        self._resets = subscribe(RESET, Empty, self._on_reset, queue_size=None)
        subscribe('/{}/parameter_updates'.format(ROBOT), Values, self._on_settings,
                  queue_size=None)
        rospy.on_shutdown(self._on_shutdown)
        threading.Thread(target=self._repeat, daemon=True).start()

    def end(self):
        """Look once more, then end."""
        if not self._over.is_set():
            self.look()
            self._over.set()

    def look(self):
        """Ask the master once; if it does not answer, nothing is noted."""
        with self._asking, suppress(OSError, rosgraph.MasterException):
            self._look_at_graph()
            for finding in conduct.changed(self._parameters, self._robots_parameters(),
                                           'parameter'):
                self._observation.note(finding)

    def _repeat(self):
        while not self._over.wait(PERIOD):
            self.look()

    def _look_at_graph(self):
        published, heard, _ = self._master.getSystemState()
        own, note = set(self._owners), self._observation.note
        inputs = {topic for topic, nodes in published if rospy.get_name() in nodes} - {LOG}
        truth = (rospy.resolve_name(TRUTH), '/' + TRUTH)
        for topic, nodes in published:
            for node in set(nodes) - own:
                note(conduct.published(node, topic, inputs, truth))
        for topic, nodes in heard:
            for node in set(nodes) - own:
                note(conduct.listened(node, topic, truth, own))
        for name, (owner, address) in self._owners.items():
            try:
                now = self._master.lookupNode(name)
            except rosgraph.MasterError:
                note(ENDED.format(owner))
                continue
            if now != address:
                note('A program called itself {}, which is the name of the {}, and so ended it.'
                     .format(name, owner))

    def _robots_parameters(self):
        try:
            found = self._master.getParam('/' + ROBOT)
        except (OSError, rosgraph.MasterException):     # a node may have deleted them
            return {}
        return found if isinstance(found, dict) else {}

    def _on_reset(self, message):
        if self._resets is None or sender_of(self._resets, message) != rospy.get_node_uri():
            self._observation.note("{} called the robot's own reset.".format(
                name_of_sender(message)))

    def _on_settings(self, message):
        """Set back the settings that the marker did not change."""
        now = decode_config(message)
        if self._settings is None:
            self._settings = now
        findings = conduct.changed(self._settings, now, 'setting')
        for finding in findings:
            self._observation.note(finding)
        if findings and self._repairs < MOST_REPAIRS:
            self._repairs += 1
            before = {name: value for name, value in self._settings.items()
                      if name not in conduct.SWITCHES}
            with suppress(rospy.ServiceException):      # the robot is gone: noted elsewhere
                rospy.ServiceProxy('/{}/set_parameters'.format(ROBOT), Reconfigure)(
                    encode_config(before))

    def _on_shutdown(self):
        """End at once: a marker that was shut down hears nothing, and would observe wrongly."""
        if not self._over.is_set():
            self._observation.note(ENDED.format('marker'))
            self._keep()
            os._exit(1)
