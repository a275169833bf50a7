"""Shared by the tests of nodes: starting a node, waiting until it is ready, rest, silence, and the
delays of this machine."""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import unittest
import xmlrpc.client
from bisect import bisect_left
from functools import lru_cache

import rosgraph
import roslib.packages
import rospy
from geometry_msgs.msg import PoseStamped, Twist

from observer import Observer
from rosunit_internals import Hiccups
from tb3_labs.geometry.angles import difference
from tb3_labs.geometry.se2 import interpolate
from tb3_labs.marking.trial import processes
from tb3_labs.ros.conversions import to_pose2

PACKAGE = 'tb3_labs'
ZERO = (0.0, 0.0)
#: Commands of a driver are never farther apart than this [s]: a robot without commands for this
#: long is not driven.
SILENCE = 0.3
#: Limit of waits that depend on the machine, not on the node: the start of processes [s].
STARTING = 60.0


@lru_cache(maxsize=None)
def path_of(executable):
    """Returns the path of a node of this package. As for roslaunch, the relay of the build comes first."""
    return roslib.packages.find_node(PACKAGE, executable)[0]


def command_of(executable):
    """Returns the command that starts a node of this package, or a program beside this file."""
    path = os.path.join(os.path.dirname(os.path.realpath(__file__)), executable)
    return [sys.executable, path] if os.path.exists(path) else [path_of(executable)]


def plain_node(file, package=PACKAGE):
    """The text of the plain node with this file's name, in a package with the mouse's message."""
    folder = pathlib.Path(__file__).resolve().parents[2] / 'scripts'
    path = folder / ('plain_' + file)
    text = (path if path.exists() else folder / file).read_text(encoding='utf-8')
    return text.replace('tb3_labs.msg', package + '.msg')


def stamped(message):
    """Returns (stamp [s], Pose2) of a PoseStamped."""
    return message.header.stamp.to_sec(), to_pose2(message.pose)


def watch_robot(observer, read_truth=lambda message: to_pose2(message.pose)):
    """Let the Observer `observer` keep `cmd_vel` as (linear [m/s], angular [rad/s]), and `ground_truth`
    as Pose2."""
    observer.watch('cmd_vel', Twist, lambda message: (message.linear.x, message.angular.z))
    observer.watch('ground_truth', PoseStamped, read_truth)


class TestProgram(processes.RunningProgram):
    """A program whose output and end a test waits for.

    `environment` is added to this process's environment, or replaces it if `clean`. Without a `terminal` the program
    reads the text `typed`, and then the end of its input.
    """

    def __init__(self, command, terminal=False, typed='', environment=None, clean=False):
        environment = dict({} if clean else os.environ, **environment or {})
        self._changed, self.text = threading.Condition(), ''
        if terminal:
            super().__init__(command, environment, self._keep)
            return
        source, printed = os.pipe()
        with tempfile.TemporaryFile() as file:
            file.write(typed.encode())
            file.seek(0)
            super().__init__(command, environment, self._keep, (source, file, printed))

    def _keep(self, text):
        with self._changed:
            self.text += text
            self._changed.notify_all()

    @property
    def lines(self):
        return self.text.splitlines()

    def wait_for(self, words, seconds=STARTING, times=1):
        """Wait until `words` were printed `times` times. RuntimeError with the output if this takes
        longer than `seconds`."""
        with self._changed:
            if not self._changed.wait_for(lambda: self.text.count(words) >= times, seconds):
                raise RuntimeError('waited {:.0f} s in vain for {!r}; printed: {}'.format(
                    seconds, words, self.text))

    def end(self, number=signal.SIGINT, seconds=10.0):
        """Send a signal, and wait for the end. Returns the exit status. Raises RuntimeError if the program still
        runs."""
        self.send(number)
        return self.wait(seconds)

    def wait(self, seconds=10.0):
        """Wait for the end of the program and its output. Returns the exit status. Raises RuntimeError if the program
        still runs."""
        try:
            status = self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            raise RuntimeError('it still runs after {:.0f} s; printed: {}'.format(
                seconds, self.text)) from None
        self._reader.join(1.0)    # a child of its own may keep the output open
        return status


class NodeProgram(TestProgram):
    """A node of this package as a separate process, with the options of TestProgram.

    The test starts the file of the node, since `rosrun` searches the whole package for this file, which costs as much
    CPU time as the node's own start. `prefix` is a command that stands before the path.
    """

    def __init__(self, executable, *arguments, prefix=(), **options):
        super().__init__(list(prefix) + command_of(executable) + list(arguments), **options)


class NodeCase(unittest.TestCase):
    """A test case that starts nodes, and watches the robot with `observer`, an Observer."""

    observer = hiccups = None

    @classmethod
    def setUpClass(cls):
        cls.observer, cls.hiccups = Observer(), cls.hiccups or Hiccups()
        cls.watch()

    @classmethod
    def watch(cls):
        watch_robot(cls.observer)

    @classmethod
    def watch_data(cls, kind, *topics):
        """Watch the field `data` of these topics."""
        for topic in topics:
            cls.observer.watch(topic, kind, lambda message: message.data)

    def start(self, executable, *arguments, **options):
        """Start a node. At the end of the test the node is killed, unless it has ended."""
        node = NodeProgram(executable, *arguments, **options)
        self.addCleanup(node.kill)
        return node

    @classmethod
    def wait_for_subscriber(cls, *publishers, seconds=STARTING):
        """Wait until each publisher has a subscriber."""
        cls.observer.wait_until(lambda: all(p.get_num_connections() for p in publishers), seconds,
                                'subscribers of ' + ', '.join(p.name for p in publishers))

    @classmethod
    def wait_until_hears(cls, name, topic, seconds=STARTING):
        """Wait until a callback of the node `name` has ended for a message on `topic`.

        rospy counts the received bytes, which include the handshake. The first growth of this count is a message. At
        the second growth the callback of the first message has ended.
        """
        master, topic, totals = rosgraph.Master(rospy.get_name()), rospy.resolve_name(topic), set()

        def hears():
            try:
                node = xmlrpc.client.ServerProxy(master.lookupNode(rospy.resolve_name(name)))
                _, _, (_, subscribed, _) = node.getBusStats(rospy.get_name())
            except (rosgraph.MasterException, OSError):
                return False    # the node has not started, or the master knows an earlier node of this name
            totals.update(received for subscription, connections in subscribed
                          if subscription == topic for _, received, *_ in connections)
            return len(totals - {0}) >= 3
        cls.observer.wait_until(hears, seconds, '{} to hear {}'.format(name, topic))

    @classmethod
    def wait_until_unheard(cls, harmless, seconds=STARTING):
        """Wait until no publisher in `harmless` has a subscriber. `harmless` is {publisher: a message without effect},
        since rospy notices the end of a subscriber only when it writes a message."""
        def is_unheard():
            for publisher, message in harmless.items():
                publisher.publish(message)
            return not any(publisher.get_num_connections() for publisher in harmless)
        cls.observer.wait_until(is_unheard, seconds, 'the end of the last nodes')

    @staticmethod
    def forget_parameters(*nodes):
        """Delete the parameters of nodes that have ended."""
        for node in nodes:
            if rospy.has_param(node):
                rospy.delete_param(node)

    def let_pass(self, seconds):
        """Wait for `seconds` of ROS time."""
        until = rospy.get_time() + seconds
        self.observer.wait_until(lambda: rospy.get_time() > until, seconds + STARTING)

    def assert_silence(self, since=None, seconds=SILENCE):
        """No message comes on `cmd_vel` from `since` (default: now) until `seconds` from now."""
        since = rospy.get_time() if since is None else since
        self.let_pass(seconds)
        self.assertEqual(self.observer.all('cmd_vel', since), [])

    def zero_since(self, last, within):
        """The time of the zero, at most `within` after `last` [s], apart from delays of the
        machine."""
        self.observer.wait_for('cmd_vel', lambda command: command == ZERO, within + 5.0)
        zero, _ = self.observer.all('cmd_vel')[-1]
        self.assertLess(zero - last, within + self.hiccups.since(last, zero))
        return zero

    def assert_stopped(self, since, within):
        """The last command that moves the robot came at most `within` after `since` [s], apart from delays of the
        machine. A zero followed."""
        self.observer.wait_for('cmd_vel', lambda command: command == ZERO)
        moving = [at for at, command in self.observer.all('cmd_vel') if command != ZERO]
        self.assertLess(moving[-1] - since, within + self.hiccups.since(since, moving[-1]))

    def truth_at(self, instant):
        """The robot's true pose at `instant`, by a `ground_truth` that is kept as stamped()."""
        samples = [sample for _, sample in self.observer.all('ground_truth')]
        after = bisect_left([stamp for stamp, _ in samples], instant)
        (before, start), (then, end) = samples[after - 1], samples[after]
        return interpolate(start, end, (instant - before) / (then - before))

    def wait_until_it_moves(self, start=None):
        """Wait until the robot has truly moved a little since it was at `start`, or since now."""
        start = start or self.observer.latest('ground_truth') or self.observer.wait_for('ground_truth')
        self.observer.wait_for('ground_truth', lambda pose: start.distance_to(pose) > 0.01 or abs(
            difference(pose.yaw, start.yaw)) > 0.05)

    def rest(self, topic='ground_truth'):
        """Wait until the robot rests. Returns its true pose."""
        self.observer.wait_for_rest(topic, seconds=STARTING)
        return self.observer.latest(topic)
