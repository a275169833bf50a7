#!/usr/bin/env python3
"""What tests of nodes share: starting a node, waiting until it is ready, rest, silence, and how
late this machine is."""
import threading
import time
import unittest
import xmlrpc.client
from collections import deque
from functools import lru_cache

import rosgraph
import roslib.packages
import rospy

from tb3_labs.ros.testing.node_process import Program

PACKAGE = 'tb3_labs'
ZERO = (0.0, 0.0)
#: Nobody drives a robot by commands that are farther apart than this [s]: a robot that was sent
#: nothing for so long is driven by nobody.
SILENCE = 0.3
#: Limit of waits that say nothing of the node: how fast the machine starts processes [s].
STARTING = 60.0


@lru_cache(maxsize=None)
def path_of(executable):
    """Path of a node of this package, as roslaunch finds it: the relay of the build comes first."""
    return roslib.packages.find_node(PACKAGE, executable)[0]


class Node(Program):
    """A node of this package as a process of its own, with the options of Program.

    It is started by its path. `rosrun` first looks for it in the whole package, which takes as much
    computing as the node's own start. `prefix` is a command that starts it.
    """

    def __init__(self, executable, *arguments, prefix=(), **options):
        super().__init__(list(prefix) + [path_of(executable)] + list(arguments), **options)

    def wait_for(self, words, seconds=STARTING, times=1):
        """As Program's, with time enough for its start."""
        super().wait_for(words, seconds, times)


class NodeCase(unittest.TestCase):
    """A test case that starts nodes and watches them with `seen`, an observer.Observer."""

    seen = None

    def start(self, executable, *arguments, **options):
        """A node that is killed at the end of the test, unless it has ended."""
        node = Node(executable, *arguments, **options)
        self.addCleanup(node.kill)
        return node

    @classmethod
    def wait_until_heard(cls, *publishers, seconds=STARTING):
        """Wait until somebody listens to each publisher."""
        cls.seen.wait_until(lambda: all(p.get_num_connections() for p in publishers), seconds,
                            'subscribers of ' + ', '.join(p.name for p in publishers))

    @classmethod
    def wait_until_hears(cls, name, topic, seconds=STARTING):
        """Wait until the running node `name` has received something on `topic`."""
        node = xmlrpc.client.ServerProxy(rosgraph.Master(rospy.get_name()).lookupNode(
            rospy.resolve_name(name)))
        topic = rospy.resolve_name(topic)

        def hears():
            _, _, (_, subscribed, _) = node.getBusStats(rospy.get_name())
            return any(received for subscription, connections in subscribed
                       if subscription == topic for _, received, *_ in connections)
        cls.seen.wait_until(hears, seconds, '{} to hear {}'.format(name, topic))

    @classmethod
    def wait_until_unheard(cls, harmless, seconds=STARTING):
        """Wait until nobody listens any more. `harmless` is {publisher: a message that does
        nothing}: rospy notices that a subscriber has gone when it writes to it."""
        def is_unheard():
            for publisher, message in harmless.items():
                publisher.publish(message)
            return not any(publisher.get_num_connections() for publisher in harmless)
        cls.seen.wait_until(is_unheard, seconds, 'the end of the last nodes')

    @staticmethod
    def forget_parameters(*nodes):
        """Delete the parameters of nodes: what a node was started with outlives it."""
        for node in nodes:
            if rospy.has_param(node):
                rospy.delete_param(node)

    def let_pass(self, seconds):
        """Wait for so much ROS time."""
        until = rospy.get_time() + seconds
        self.seen.wait_until(lambda: rospy.get_time() > until, seconds + STARTING)

    def assert_silence(self, since=None, seconds=SILENCE):
        """Nothing is sent on `cmd_vel` from `since` (now) on, until `seconds` from now."""
        since = rospy.get_time() if since is None else since
        self.let_pass(seconds)
        self.assertEqual(self.seen.all('cmd_vel', since), [])

    def rest(self, topic='ground_truth'):
        """Wait until the robot rests; its true pose."""
        self.seen.wait_for_rest(topic, seconds=STARTING)
        return self.seen.latest(topic)


class Hiccups:
    """How late this machine wakes a thread that has nothing to do: a thread of its own looks.

    A limit on the reaction of a node holds on a machine that lets the node run. `since(start)` is
    how long it did not, at least, and is added to the limit: a few milliseconds on a quiet machine.
    """

    PERIOD = 0.01

    def __init__(self):
        self._late = deque(maxlen=100000)    # (time [s], late by [s])
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        while not rospy.is_shutdown():
            due = time.time() + self.PERIOD
            time.sleep(self.PERIOD)
            now = time.time()
            self._late.append((now, now - due))

    def since(self, start, end=float('inf')):
        """Seconds, of those between two times [s, wall clock], that were withheld."""
        return sum(late for at, late in list(self._late) if start <= at <= end)
