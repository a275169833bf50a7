"""A node that a person has started; it takes the place of a StudentNode.

The node is found on the ROS graph and watched; the person types its input, and ends it by Ctrl+C.
Its log is read from /rosout. The person is asked for its other output.
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

from tb3_labs.marking.criteria import AT_ONCE, CTRL_C, SIGNAL, TOOK, TRACEBACK
from tb3_labs.marking.observation import CMD_VEL, IMU, ODOM, WAS_MOVING, Run, Stimulus
from tb3_labs.marking.ros_interface import LISTENS, PUBLISHES, Graph
from tb3_labs.marking.ros_robot import UNDER_WAY
from tb3_labs.marking.ros_stage import PATIENCE
from tb3_labs.marking.ros_types import Types
from tb3_labs.ros.clocks import wait_until
from tb3_labs.ros.program import BoundedText

#: The answers of a person.
YES, NO = 'y', 'n'
#: A question is asked at most this many times, until an answer is valid.
TIMES = 3
#: A person starts the node within START_TIME; the master is asked for it every LOOK [s].
START_TIME, LOOK = 300.0, 0.3
#: The period of asking the node whether it still runs [s].
WATCH = 0.05
#: A node ended in motion if it commanded a movement within this time before its end [s].
IN_MOTION = 0.5
#: Tools that listen to everything have names that begin so.
LISTENERS = ('/record', '/rosbag', '/rviz', '/rqt', '/rostopic', '/play')


class Person:
    """The person at the bench: reads standard output, and answers by standard input."""

    _task = ''

    @staticmethod
    def tell(words):
        print(words, flush=True)

    def have(self, task):
        """Ask the person to do this task with the node."""
        self._task = task
        self.tell('> ' + task)

    def missed(self, question):
        """Returns True if the person says no; the latest task is then asked for again."""
        if self.asks(question) != NO:
            return False
        self.have(self._task)
        return True

    def asks(self, question):
        """Ask a question. Returns YES, NO, or '' if there is no answer."""
        return self._answer(question + ' [y/n] ', r'y|yes|n|no')[:1]

    def number(self, question):
        """Ask for a number that the person sees. Returns it as text; '' if there is no answer."""
        return self._answer(question + ' [a number, or Enter] ', r'(-?\d+(\.\d+)?)?')

    def _answer(self, question, form):
        for _ in range(TIMES):
            try:
                if sys.stdin.isatty():
                    termios.tcflush(sys.stdin, termios.TCIFLUSH)    # drop earlier input
                answer = input('? ' + question).strip().lower()
            except EOFError:
                print('(no answer)', flush=True)
                return ''
            if re.fullmatch(form, answer):
                return answer
        return ''


class Impossible(Exception):
    """A checkoff is impossible now; the text is the reason and the remedy."""


def is_there(name):
    """Does the node of this name answer? One that was killed stays on the graph, but does not."""
    try:
        address = rosgraph.Master(rospy.get_name()).lookupNode(name)
        xmlrpc.client.ServerProxy(address).getPid(rospy.get_name())
    except (OSError, rosgraph.MasterException, xmlrpc.client.Error):
        return False
    return True


class RunningNode:
    """The node that runs; `runs` is a list of Run, the latest last."""

    def __init__(self, person, listens, drives, name, now):
        """`listens`: the topic that the node listens to; `drives`: does it publish cmd_vel?

        `name`: the name of the node, '' if any will do; `now()`: the observation's time [s].
        """
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
        """The name of the node; '' if no node was found yet."""
        return next(iter(self.graph.names), '')

    def find(self):
        """Is there such a node? It is watched from now on. ``Impossible`` if there are several."""
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
        """Does a node run? If none does, the person is asked to start it."""
        if self.alive or self.find():
            return True
        self.person.have('Start your node in its own terminal ({}).'.format(self._told))
        while not wait_until(self.find, START_TIME, LOOK):
            if not self.person.missed('No such node runs. Did you start it?'):
                return False
        return True

    def stop(self):
        """Does nothing: the node is the person's, and goes on."""

    def type(self, line):
        """Have the person type a line, and Enter. Returns the Person."""
        self.person.have('In the terminal of your node: type {}, then Enter.'.format(line))
        return self.person

    @property
    def printed(self):
        """The length of the node's known output: (characters, lines)."""
        with self._lock:
            return self._text.length, self._text.lines

    def text_since(self, characters):
        """The node's known output after its first `characters`."""
        with self._lock:
            return self._text.since(characters)

    def attest(self, text):
        """Add a text to the node's known output, because a person or the log says so."""
        with self._lock:
            self._text.append(text + '\n')

    def note(self):
        """Write the node's known output into the latest run."""
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


# ----- Ctrl+C by the person -----

def person_ends(stage, task, goodbye='', set_in_motion=None):
    """Have the person end the node by Ctrl+C.

    `task`: the words to the person; `goodbye`: the last line of the node; ``set_in_motion()`` is
    called before Ctrl+C, and the node ended again if the robot did not move; None: it need not.
    """
    for name in CTRL_C:
        if not _ended(stage, name, task, goodbye, set_in_motion):
            return
        if set_in_motion is None or stage.observation.stimuli[-1].facts[WAS_MOVING]:
            return
        stage.node.person.tell('  The robot was not moving when the node ended.')


def _ended(stage, name, task, goodbye, set_in_motion):
    """Record the stimulus of a Ctrl+C; False if the person does not press it.

    Its moment is that of the node's last command, or of the node's end.
    """
    node, recorder = stage.node, stage.recorder
    answer = NO
    while answer == NO:
        if not node.start():    # it may have ended while the person answered
            return False
        if set_in_motion is not None:
            set_in_motion()
        asked, (characters, lines) = recorder.now, node.printed
        node.person.have(task)
        answer = YES if wait_until(lambda: not node.alive, PATIENCE) else node.person.asks(
            'The node still runs. Did you press Ctrl+C?')
    if answer != YES:
        return False
    ended = not node.alive
    time.sleep(UNDER_WAY)
    gone = node.runs[-1].end if ended else recorder.now
    moving = [at for at, linear, angular in recorder.commands_since(asked) if linear or angular]
    in_motion = bool(moving) and gone - moving[-1] < IN_MOTION
    begin = moving[-1] if in_motion else max(asked, gone - AT_ONCE)
    _ask_for_the_end(node, characters, goodbye if name == CTRL_C[0] else '', ended)
    stage.observation.stimuli.append(Stimulus(
        name, begin, recorder.now, node.text_since(characters), node.printed[1] - lines, ended,
        {WAS_MOVING: in_motion, TOOK: gone - begin if ended else None, SIGNAL: 0}))
    node.runs[-1].ended_by_itself = False
    stage.keep()
    return True


def _ask_for_the_end(node, characters, goodbye, ended):
    if goodbye and goodbye not in node.text_since(characters) and node.person.asks(
            'Did it print "{}"?'.format(goodbye)) == YES:
        node.attest(goodbye)
    if ended and node.person.asks('Did it end without a traceback in its terminal?') == NO:
        node.attest(TRACEBACK)
