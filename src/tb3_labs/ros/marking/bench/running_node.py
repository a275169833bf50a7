"""A node that a person has started, in the place of a StudentNode: found on the graph, watched, and
typed to by the person.

What it prints is known as far as it goes to /rosout. The rest is asked of the person.
"""
import os
import threading
import xmlrpc.client

import rosgraph
import rospkg
import rospy
from rosgraph_msgs.msg import Log

from tb3_labs.marking.observation import Run
from tb3_labs.marking.topics import CMD_VEL, IMU, ODOM
from tb3_labs.ros.marking.graph import LISTENS, PUBLISHES, Graph
from tb3_labs.ros.marking.types import Types
from tb3_labs.ros.marking.waiting import wait, wait_until
from tb3_labs.ros.program import BoundedText

#: A person starts the node within this time [s]; the master is asked every LOOK.
START_TIME = 300.0
LOOK = 0.3
#: How often the node is asked whether it is there [s].
WATCH = 0.05
#: Nodes that listen to everything.
LISTENERS = ('/record', '/rosbag', '/rviz', '/rqt', '/rostopic', '/play')


class NotFound(Exception):
    """There is no node to judge, or there are several; the text is one sentence."""


def process_of(name):
    """The number of a node's process; None if it is off the graph, as a node is first of all when
    it ends, or does not answer: one that was killed stays on the graph."""
    try:
        address = rosgraph.Master(rospy.get_name()).lookupNode(name)
        return xmlrpc.client.ServerProxy(address).getPid(rospy.get_name())[2]
    except (OSError, rosgraph.MasterException, xmlrpc.client.Error):
        return None


def package_of(name):
    """The package of a node, by the path of its file; '' if that is not known: it may run on
    another computer."""
    try:
        with open('/proc/{}/cmdline'.format(process_of(name)), 'rb') as file:
            words = [os.fsdecode(word) for word in file.read().split(b'\0')]
    except OSError:
        return ''
    files = [word for word in words[:3] if word.startswith('/') and word.endswith('.py')]
    return rospkg.get_package_name(os.path.realpath(files[0])) or '' if files else ''


class RunningNode:
    """The node that runs, and a list of Run, the latest last."""

    def __init__(self, person, listens, drives, name, now):
        """`listens`: the topic that it listens to; `drives`: does it publish cmd_vel? `name`: its
        name, '' if any will do; `now()`: the observation's time [s]."""
        self._person, self._now = person, now
        self._wanted = {(LISTENS, rospy.resolve_name(listens))}
        if drives:
            self._wanted.add((PUBLISHES, rospy.resolve_name(CMD_VEL)))
        self._told = 'listens to ' + listens + (' and publishes ' + CMD_VEL) * drives
        self._name = name and rospy.resolve_name(name)
        self._text, self._lock = BoundedText(), threading.Lock()
        self.runs = []
        self.alive = False
        #: When it had ended, in the observation's time [s]; None while it runs.
        self.gone_at = None
        self.graph = Graph(Types())
        rospy.Subscriber('/rosout', Log, self._on_log, queue_size=100)
        threading.Thread(target=self._watch, daemon=True).start()

    @property
    def name(self):
        """Its name; '' if there was none yet."""
        return next(iter(self.graph.names), '')

    def is_it(self, sender):
        """Is this the name of the node?"""
        return sender in self.graph.names

    def find(self):
        """Is there a node such as this? Then it is the one that is watched from now on.

        ``NotFound`` if there are several.
        """
        nodes = self.graph.nodes()
        robot = {(PUBLISHES, rospy.resolve_name(topic)) for topic in (IMU, ODOM)}
        found = [name for name, registered in nodes.items() if self._wanted <= registered
                 and not registered & robot and not name.startswith(LISTENERS)
                 and self._name in ('', name) and process_of(name) is not None]
        if len(found) > 1:
            raise NotFound('several nodes could be yours: {}; say which by --node NAME'.format(
                ', '.join(sorted(found))))
        if not found:
            return False
        self.graph.names = set(found)
        self.gone_at = None
        self.runs.append(Run(self._now(), ready=self._now()))
        self.alive = True
        return True

    def start(self, *arguments, listens=None):
        """Is there a node that runs? The person is asked to start it if not.

        Never if it should have arguments, since it is the person's own command that starts it.
        """
        if arguments or listens:
            return False
        if self.alive:
            return True
        if self.find():
            return True
        self._person.have('Start your node in its own terminal ({}).'.format(self._told))
        return wait_until(self.find, START_TIME, LOOK)

    def stop(self):
        """It is the person's: it goes on."""

    def type(self, line):
        """Have the person type a line, and Enter."""
        self._person.have('In the terminal of your node: type {}, then Enter.'.format(line))

    @property
    def printed(self):
        """How much is known that it printed: (characters, lines)."""
        with self._lock:
            return self._text.length, self._text.lines

    def text_since(self, characters):
        """What it printed after so many characters, as far as that is known."""
        with self._lock:
            return self._text.since(characters)

    def attest(self, text):
        """A person says that it printed this."""
        with self._lock:
            self._text.append(text + '\n')

    def note(self):
        """Note in the latest run what it printed."""
        if self.runs:
            self.runs[-1].printed = str(self._text)

    def _on_log(self, message):
        if self.is_it(message.name):
            self.attest(message.msg)

    def _watch(self):
        """Notice the node's end."""
        while not rospy.is_shutdown():
            wait(WATCH)
            if self.alive and process_of(self.name) is None:
                self.gone_at = self.runs[-1].end = self._now()
                self.runs[-1].ended_by_itself = True
                self.alive = False
