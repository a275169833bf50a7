"""Starts and ends a student's node, and asks the master for its topics and services.

The start, the output, the topics and the end of each process are recorded. A node may do anything.
Therefore each wait in this module has a limit.
"""
import os
import signal
import time
import xmlrpc.client
from contextlib import suppress

import rosgraph
import rosnode
import rospy
import rosservice

from tb3_labs.handout import CTRL_RELINQ_TOPIC, JOY_TOPIC, MOUSE_INFO_TOPIC
from tb3_labs.marking.labs.stimuli import START_TIME
from tb3_labs.marking.trial.observation import NotTried
from tb3_labs.marking.trial.processes import NodeOutput, Program, ResourceWatch
from tb3_labs.marking.trial.ros_recording import ROBOT_NODE, VARIABLES
from tb3_labs.marking.trial.ros_types import Types
from tb3_labs.marking.node_start import OWN_FOLDERS, NodeStart
from tb3_labs.ros.clocks import wait_until
from tb3_labs.watch import watched

#: A node's roles at a topic or a service. The master's system state has one list for each role, in
#: this order.
PUBLISHES, LISTENS, OFFERS = 0, 1, 2
#: Topics that every node may have.
IGNORED_TOPICS = {'/rosout', '/clock', '/' + VARIABLES}
#: If signal N ends a program in a sandbox, the sandbox has the exit status BY_SIGNAL + N.
BY_SIGNAL = 128


class StudentNode:
    """Starts, ends and records the processes of a node. One process runs at a time."""

    def __init__(self, node, sensors, recording):
        """`node` is package/file. `sensors` are the topics that the node needs. A node that
        subscribes to the first sensor is ready. `recording` is the Recording of the trial."""
        self._sensors, self._recording, self._needed = sensors, recording, []
        self._prepared = NodeStart.from_environment()
        self._command = [self._prepared.program] if self._prepared.program else [
            'rosrun', *node.split('/', 1)]
        self._process = self._watch = self._output = None
        #: Was any process ready? None before the first process.
        self._was_ready = None
        #: Did the present process get Ctrl+C?
        self._interrupted = False
        self.graph = Graph(Types(self._prepared.types))

    @property
    def alive(self):
        return self._process is not None and self._process.status is None

    @property
    def status(self):
        """The exit status of the process. It is None while the process runs, and -N if signal N
        ended the process."""
        status = self._process.status
        isolated = self._prepared.isolated and status is not None and status > BY_SIGNAL
        return BY_SIGNAL - status if isolated else status

    def start(self, *arguments, listens=()):
        """End the last process of the node, and start a new process.

        The node needs the topics `listens`. By default these are its `sensors`. A process that
        subscribes to the first needed topic is ready. Raises ``NotTried`` if the new process is not
        ready in time. If the first process was not ready, no other process is started.
        """
        needed = self._needed = list(map(rospy.resolve_name, listens or self._sensors))
        self.stop()
        if self._was_ready is False:
            raise NotTried
        known = set(self.graph.nodes())
        self._interrupted = False
        self._recording.event('start', needed=needed[0].strip('/'))
        self._output = NodeOutput(self._recording)
        environment = dict(self._prepared.environment or watched(os.environ))
        environment['ROS_MASTER_URI'] = os.environ['ROS_MASTER_URI']    # the master of this trial
        self._process = Program([*self._prepared.prefix, *self._command, *arguments], environment,
                                self._output.add)
        if self._prepared.program:        # mark.py has prepared a submission
            self._watch = ResourceWatch(
                self._process.pid, OWN_FOLDERS if self._prepared.isolated else (), os.getppid())
        is_ready = self._is_ready_in_time(needed, known)
        self._was_ready = self._was_ready or is_ready
        if not is_ready:
            self.stop()
            raise NotTried
        self._recording.event('ready')

    def _is_ready_in_time(self, needed, known):
        new, since = {}, time.monotonic()

        def is_ready():
            """Has the node subscribed to its first topic, and registered nothing new for 0.5 s?"""
            nonlocal new, since
            present = {name: registered for name, registered in self.graph.nodes().items()
                       if name not in known}
            if present != new:
                new, since = present, time.monotonic()
            return any((LISTENS, needed[0]) in registered for registered in new.values()) and (
                time.monotonic() - since >= 0.5)
        # a computer with a load of 2 for each processor is twice as slow
        factor = min(4.0, max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1)))
        ready = wait_until(lambda: not self.alive or is_ready(), START_TIME * factor, 0.1)
        self.graph.names = set(new)
        self._recording.event('run', nodes=sorted(new), unheard=self.graph.unheard(
            needed) if self.alive else [])
        return ready and self.alive

    def stop(self):
        """End the node by Ctrl+C. If it still runs after 2 s, end it by SIGKILL."""
        if self._process is None:
            return
        self.interrupt(2.0)
        self._process.kill()
        if self._watch is not None:
            self._watch.over.set()
            if self._watch.exceeded:
                self._output.add(f'\nThe marker ended it, since it used {self._watch.exceeded}.\n')
        self._output.flush()
        self._recording.event('stop')
        self._process = None
        self.graph.forget()

    def interrupt(self, seconds):
        """Send Ctrl+C. Returns True as soon as the node has ended, False after `seconds` [s]."""
        self.record_state()
        self._interrupted = True
        self._process.send(signal.SIGINT)
        return wait_until(lambda: not self.alive, seconds)

    def type(self, line):
        with suppress(OSError):     # the node has ended
            self._process.type(line)

    @property
    def printed(self):
        """The output since the last `flush`, which is the output of the present stimulus."""
        return self._output.last

    def flush(self):
        if self._output is not None:
            self._output.flush()

    def record_state(self):
        """Record the output so far, and the node's topics. If the node has ended by itself, record
        its end in place of its topics."""
        if self._process is None:
            return
        self._output.flush()
        if self.alive:
            with suppress(OSError, rosgraph.MasterException):   # the master does not answer
                listens, publishes = self.graph.topics()
                self._recording.event('run', listens=listens, publishes=publishes,
                                      unconnected=self.graph.unconnected(self._needed))
        elif not self._interrupted:
            self._recording.event('run', ended_by_itself=True, status=self.status)


class Graph:
    """Asks the ROS master for nodes, topics and services."""

    def __init__(self, types):
        """`types` are the Types of the node's messages and services."""
        self.types = types
        self._master = rosgraph.Master(rospy.get_name())
        #: The names of the student's node. A process may have several nodes.
        self.names = set()

    def nodes(self):
        """Returns name of a node -> {(role, topic or service)} for all nodes but the marker.
        Returns {} if the master does not answer."""
        nodes = {}
        with suppress(OSError, rosgraph.MasterException):
            for role, groups in enumerate(self._master.getSystemState()):
                for topic, names in groups:
                    for name in names:
                        nodes.setdefault(name, set()).add((role, topic))
        nodes.pop(rospy.get_name(), None)
        return nodes

    def at_role(self, role):
        """Returns the topics or services at which the student's node has the `role`.

        Raises an error if the master does not answer. The error ends the trial, so that the node
        loses no points.
        """
        groups = self._master.getSystemState()[role]
        return {topic for topic, names in groups if self.names.intersection(names)}

    def unheard(self, needed):
        """Returns the topics that the student's node subscribes to and nobody publishes. Returns []
        if the node subscribes to all topics in `needed`."""
        listens = self.at_role(LISTENS)
        published = {topic for registered in self.nodes().values()
                     for role, topic in registered if role == PUBLISHES}
        offered = set(map(rospy.resolve_name, (MOUSE_INFO_TOPIC, JOY_TOPIC, CTRL_RELINQ_TOPIC)))
        return [] if listens.issuperset(needed) else sorted(listens - published - offered)

    def topics(self):
        """Returns the topics that the student's node subscribes to, and {topic: type} for the
        topics that it publishes. IGNORED_TOPICS are left out."""
        kinds = dict(self._master.getTopicTypes())
        listens, publishes = (sorted(self.at_role(role) - IGNORED_TOPICS)
                              for role in (LISTENS, PUBLISHES))
        return listens, {topic: kinds.get(topic, '') for topic in publishes}

    def unconnected(self, needed):
        """Returns the topics in `needed` that the student's node subscribes to without a connection
        to the robot. The node and the robot give such a topic different types."""
        connected = set()
        with suppress(OSError, rosgraph.MasterException, xmlrpc.client.Error):
            robot = xmlrpc.client.ServerProxy(self._master.lookupNode('/' + ROBOT_NODE))
            connected = {(name, topic) for _, name, _, _, topic, *_ in robot.getBusInfo(
                rospy.get_name())[2]}
        listens = self.at_role(LISTENS)
        return [topic.strip('/') for topic in needed if topic in listens and connected and not any(
            (name, topic) in connected for name in self.names)]

    def kind_of(self, topic):
        """Returns the message class of a topic; None for an unknown class."""
        kind = dict(self._master.getTopicTypes()).get(rospy.resolve_name(topic))
        return self.types.message(kind) if kind else None

    def service(self, name):
        """Returns the class of an offered service; None for an unknown class."""
        try:
            kind = rosservice.get_service_type(name)
        except (rosservice.ROSServiceException, OSError):
            return None
        return self.types.service(kind) if kind else None

    def forget(self):
        """Remove the node from the master, since a killed node does not unregister itself."""
        left = [name for name in self.names if name in self.nodes()]
        if left:
            rosnode.cleanup_master_blacklist(self._master, left)
