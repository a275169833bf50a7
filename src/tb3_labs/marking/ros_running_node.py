"""A node that a person has started, in the place of a StudentNode: found on the graph, watched, and
typed to by the person.

Its print is known as far as it goes to /rosout. The person is asked for the rest.
"""
import re
import sys
import termios
import threading
import time
import xmlrpc.client

import rosgraph
import rospy
from rosgraph_msgs.msg import Log

from tb3_labs.marking.observation import CMD_VEL, IMU, ODOM, Run
from tb3_labs.marking.ros_interface import LISTENS, PUBLISHES, Graph
from tb3_labs.marking.ros_types import Types
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.program import BoundedText

#: The answers of a person.
YES, NO = 'y', 'n'
#: A question is asked so often until the answer is valid.
TIMES = 3
#: A person starts the node within this time [s]; the master is asked every LOOK.
START_TIME, LOOK = 300.0, 0.3
#: The node is asked whether it is there so often [s].
WATCH = 0.05
#: Nodes that listen to everything.
LISTENERS = ('/record', '/rosbag', '/rviz', '/rqt', '/rostopic', '/play')


class Person:
    """The person at the bench: reads standard output, and answers by standard input."""

    _task = ''

    @staticmethod
    def tell(words):
        """Say something."""
        print(words, flush=True)

    def have(self, task):
        """Ask for something to be done with the node."""
        self._task = task
        self.tell('> ' + task)

    def missed(self, question):
        """Does the person deny it? Then the latest task is asked for again."""
        if self.asks(question) != NO:
            return False
        self.have(self._task)
        return True

    def asks(self, question):
        """YES, NO, or '' if there is no answer."""
        return self._answer(question + ' [y/n] ', r'y|yes|n|no')[:1]

    def number(self, question):
        """A number that the person reads, as text; '' if there is none."""
        return self._answer(question + ' [a number, or Enter] ', r'(-?\d+(\.\d+)?)?')

    def _answer(self, question, form):
        for _ in range(TIMES):
            try:
                if sys.stdin.isatty():
                    termios.tcflush(sys.stdin, termios.TCIFLUSH)    # what was typed before
                answer = input('? ' + question).strip().lower()
            except EOFError:
                print('(no answer)', flush=True)
                return ''
            if re.fullmatch(form, answer):
                return answer
        return ''


class Impossible(Exception):
    """There can be no checkoff now; the text is the reason, and the remedy."""


def is_there(name):
    """Does a node answer? At its end it leaves the graph first of all; one that was killed stays on
    the graph."""
    try:
        address = rosgraph.Master(rospy.get_name()).lookupNode(name)
        xmlrpc.client.ServerProxy(address).getPid(rospy.get_name())
    except (OSError, rosgraph.MasterException, xmlrpc.client.Error):
        return False
    return True


class RunningNode:
    """The node that runs, and a list of Run, the latest last."""

    def __init__(self, person, listens, drives, name, now):
        """`listens`: the topic that it listens to; `drives`: does it publish cmd_vel? `name`: its
        name, '' if any will do; `now()`: the observation's time [s]."""
        self.person, self._now = person, now
        self._wanted = {(LISTENS, rospy.resolve_name(listens))}
        if drives:
            self._wanted.add((PUBLISHES, rospy.resolve_name(CMD_VEL)))
        self._told = 'listens to ' + listens + (' and publishes ' + CMD_VEL) * drives
        self._name = name and rospy.resolve_name(name)
        self._text, self._lock = BoundedText(), threading.Lock()
        self.runs = []
        self.alive = False
        self.graph = Graph(Types())
        rospy.Subscriber('/rosout', Log, self._on_log, queue_size=100)
        threading.Thread(target=self._watch, daemon=True).start()

    @property
    def name(self):
        """Its name; '' if there was none yet."""
        return next(iter(self.graph.names), '')

    def find(self):
        """Is there such a node? It is watched then. ``Impossible`` if there are several."""
        nodes = self.graph.nodes()
        robot = {(PUBLISHES, rospy.resolve_name(topic)) for topic in (IMU, ODOM)}
        found = [name for name, registered in nodes.items() if self._wanted <= registered
                 and not registered & robot and not name.startswith(LISTENERS)
                 and self._name in ('', name) and is_there(name)]
        if len(found) > 1:
            raise Impossible('several nodes could be yours: {}; say which by --node NAME'.format(
                ', '.join(sorted(found))))
        if not found:
            return False
        self.graph.names = set(found)
        self.runs.append(Run(self._now(), ready=self._now()))
        self.alive = True
        return True

    def start(self):
        """Is there a node that runs? The person is asked to start it if not."""
        if self.alive or self.find():
            return True
        self.person.have('Start your node in its own terminal ({}).'.format(self._told))
        while not wait_until(self.find, START_TIME, LOOK):
            if not self.person.missed('No such node runs. Did you start it?'):
                return False
        return True

    def stop(self):
        """It is the person's: it goes on."""

    def type(self, line):
        """Have the person type a line, and Enter; the Person."""
        self.person.have('In the terminal of your node: type {}, then Enter.'.format(line))
        return self.person

    @property
    def printed(self):
        """The amount that it is known to have printed: (characters, lines)."""
        with self._lock:
            return self._text.length, self._text.lines

    def text_since(self, characters):
        """The text after the first `characters` that it printed, as far as it is known."""
        with self._lock:
            return self._text.since(characters)

    def attest(self, text):
        """A person says that it printed this."""
        with self._lock:
            self._text.append(text + '\n')

    def note(self):
        """Note its print in the latest run."""
        if self.runs:
            self.runs[-1].printed = str(self._text)

    def _on_log(self, message):
        if message.name in self.graph.names:
            self.attest(message.msg)

    def _watch(self):
        while not rospy.is_shutdown():
            time.sleep(WATCH)
            if self.alive and not is_there(self.name):
                self.runs[-1].end, self.runs[-1].ended_by_itself = self._now(), True
                self.alive = False
