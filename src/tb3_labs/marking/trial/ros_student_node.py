"""Starts and ends a student's node and asks the master for the node's topics and services.

The start, the output, the topics and the end of each process are recorded. A student's node can
block this module, so each wait has a time limit.
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

from tb3_labs.geometry.angles import clamp
from tb3_labs.handout import CTRL_RELINQ_TOPIC, JOY_TOPIC, MOUSE_INFO_TOPIC
from tb3_labs.marking.labs.stimuli import START_TIME
from tb3_labs.marking.student_nodes import WRITABLE_FOLDERS, NodeStart
from tb3_labs.marking.trial.observation import NotTried
from tb3_labs.marking.trial.processes import NodeOutput, ResourceWatch, RunningProgram
from tb3_labs.marking.trial.ros_recording import ROBOT_NODE, VARIABLES
from tb3_labs.marking.trial.ros_types import KnownTypes
from tb3_labs.ros.clocks import wait_until
from tb3_labs.watch import with_probe

#: The roles of a node. The master's system state contains a list for each role, in this order.
PUBLISHER, SUBSCRIBER, SERVER = range(3)
#: These topics of a node are not recorded, because every node may have them.
IGNORED_TOPICS = {'/rosout', '/clock', '/' + VARIABLES}
#: If signal N ends a program in a sandbox, the sandbox's exit status is SIGNAL_STATUS_BASE + N.
SIGNAL_STATUS_BASE = 128


class StudentNode:
    """Starts, ends and records the processes of a node. One process runs at a time."""

    def __init__(self, node, sensors, bag):
        """`node` is package/file. `sensors` are the topics that the node usually needs."""
        self._sensors = sensors
        self._bag = bag
        self._needed_topics = []    # the full names of the topics that the process needs
        self._node_start = NodeStart.from_environment()
        program = self._node_start.program
        self._command = [program] if program else ['rosrun', *node.split('/', 1)]
        self._process = None                    # None while no process runs
        self._resource_watch = None             # only for a submission
        self._output = None                     # of the latest process
        self._first_process_was_ready = None    # None until the first start succeeds or fails
        self._got_ctrl_c = False
        self.graph = NodeGraph(KnownTypes(self._node_start.types))

    @property
    def is_alive(self):
        return self._process is not None and self._process.status is None

    @property
    def status(self):
        """The exit status of the process; None while it runs, -N if signal N ended it."""
        status = self._process.status
        if not self._node_start.is_sandboxed or status is None or status <= SIGNAL_STATUS_BASE:
            return status
        return -(status - SIGNAL_STATUS_BASE)

    def start(self, *arguments, needed_topics=None):
        """End the current process of the node and start a new process.

        The node needs the `needed_topics`, by default its `sensors`. The new process is ready when
        it subscribes to the first needed topic. Raises ``NotTried`` if the process is not ready in
        time, or if the first process of the trial was not ready.
        """
        self._needed_topics = list(map(rospy.resolve_name, needed_topics or self._sensors))
        self.stop()
        if self._first_process_was_ready is False:
            raise NotTried
        earlier_nodes = set(self.graph.roles_by_node())
        self._start_process(arguments)
        is_ready = self._wait_until_ready(earlier_nodes)
        if self._first_process_was_ready is None:
            self._first_process_was_ready = is_ready
        if not is_ready:
            self.stop()
            raise NotTried
        self._bag.add_event('ready')

    def _start_process(self, arguments):
        self._got_ctrl_c = False
        self._bag.add_event('start', needed=self._needed_topics[0].strip('/'))
        self._output = NodeOutput(self._bag)
        environment = dict(self._node_start.environment or with_probe(os.environ))
        environment['ROS_MASTER_URI'] = os.environ['ROS_MASTER_URI']    # the master of this trial
        command = [*self._node_start.prefix, *self._command, *arguments]
        self._process = RunningProgram(command, environment, self._output.add)
        if self._node_start.program:        # mark.py has prepared a submission
            own_folders = WRITABLE_FOLDERS if self._node_start.is_sandboxed else ()
            self._resource_watch = ResourceWatch(self._process.pid, own_folders, os.getppid())

    def _wait_until_ready(self, earlier_nodes):
        """Returns True as soon as the node is ready, False if the node ends or takes too long."""
        own_roles = {}
        change_time = time.monotonic()

        def has_ended_or_is_ready():
            nonlocal own_roles, change_time
            if not self.is_alive:
                return True
            current_roles = {name: roles for name, roles in self.graph.roles_by_node().items()
                             if name not in earlier_nodes}
            if current_roles != own_roles:
                own_roles = current_roles
                change_time = time.monotonic()
            is_subscribed = any((SUBSCRIBER, self._needed_topics[0]) in roles
                                for roles in own_roles.values())
            has_settled = time.monotonic() - change_time >= 0.5
            return is_subscribed and has_settled
        # a computer with a load of 2 for each processor is twice as slow
        slowness = clamp(os.getloadavg()[0] / (os.cpu_count() or 1), 1.0, 4.0)
        is_in_time = wait_until(has_ended_or_is_ready, START_TIME * slowness, 0.1)
        self.graph.node_names = set(own_roles)
        silent = self.graph.silent_topics(self._needed_topics) if self.is_alive else []
        self._bag.add_event('run', nodes=sorted(own_roles), unheard=silent)
        return is_in_time and self.is_alive

    def stop(self):
        """End the node by Ctrl+C. If the node still runs after 2 s, SIGKILL ends it."""
        if self._process is None:
            return
        self.send_ctrl_c(2.0)
        self._process.kill()
        if self._resource_watch is not None:
            self._resource_watch.stop_requested.set()
            limit = self._resource_watch.exceeded_limit
            if limit:
                self._output.add(f'\nThe marker ended it, since it used {limit}.\n')
        self._output.flush()
        self._bag.add_event('stop')
        self._process = None
        self.graph.unregister()

    def send_ctrl_c(self, seconds):
        """Send Ctrl+C. Returns True as soon as the node has ended, False after `seconds` [s]."""
        self.record_state()
        self._got_ctrl_c = True
        self._process.send(signal.SIGINT)
        return wait_until(lambda: not self.is_alive, seconds)

    def type(self, line):
        with suppress(OSError):     # the node has ended
            self._process.type(line)

    @property
    def printed(self):
        """The node's output after the start of the current stimulus."""
        return self._output.latest_text

    def flush(self):
        if self._output is not None:
            self._output.flush()

    def record_state(self):
        """Record the output so far. Then record the topics of a node that runs, or the exit status
        of a node that ended without Ctrl+C."""
        if self._process is None:
            return
        self._output.flush()
        if self.is_alive:
            with suppress(OSError, rosgraph.MasterException):   # the master does not answer
                subscribed, published = self.graph.topics()
                unconnected = self.graph.unconnected_topics(self._needed_topics)
                self._bag.add_event('run', listens=subscribed, publishes=published,
                                    unconnected=unconnected)
        elif not self._got_ctrl_c:
            self._bag.add_event('run', ended_by_itself=True, status=self.status)


class NodeGraph:
    """Asks the ROS master for the student's node, its topics and its services."""

    def __init__(self, types):
        self.types = types
        self._master = rosgraph.Master(rospy.get_name())
        self.node_names = set()     # of the student's process, which may run several nodes

    def roles_by_node(self):
        """Returns {name of a node: {(role, topic or service)}} for all nodes except the marker.
        Returns {} if the master does not answer."""
        roles_by_node = {}
        with suppress(OSError, rosgraph.MasterException):
            for role, nodes_of_topics in enumerate(self._master.getSystemState()):
                for topic, names in nodes_of_topics:
                    for name in names:
                        roles_by_node.setdefault(name, set()).add((role, topic))
        roles_by_node.pop(rospy.get_name(), None)
        return roles_by_node

    def names_by_role(self):
        """Returns three sets of names: the topics that the student's node publishes, its subscribed
        topics, and its services. If the master does not answer, an exception ends the trial,
        because the student must not lose points for an error of the master."""
        return [{topic for topic, names in nodes_of_topics if self.node_names.intersection(names)}
                for nodes_of_topics in self._master.getSystemState()]

    def silent_topics(self, needed_topics):
        """Returns the topics that the student's node subscribes to although nobody publishes them.
        Returns [] if the node subscribes to all `needed_topics`."""
        subscribed = self.names_by_role()[SUBSCRIBER]
        if subscribed.issuperset(needed_topics):
            return []
        published = {topic for roles in self.roles_by_node().values()
                     for role, topic in roles if role == PUBLISHER}
        marker_topics = {
            rospy.resolve_name(name) for name in (MOUSE_INFO_TOPIC, JOY_TOPIC, CTRL_RELINQ_TOPIC)}
        return sorted(subscribed - published - marker_topics)

    def topics(self):
        """Returns the subscribed topics of the student's node, and {published topic: type}.
        IGNORED_TOPICS are left out."""
        types = dict(self._master.getTopicTypes())
        published, subscribed, _ = (names - IGNORED_TOPICS for names in self.names_by_role())
        return sorted(subscribed), {topic: types.get(topic, '') for topic in sorted(published)}

    def unconnected_topics(self, needed_topics):
        """Returns the `needed_topics` to which the student's node subscribes without a connection
        to the robot. The connection fails if the node and the robot use different types."""
        connections = []    # [connection's number, name of a node, direction, protocol, topic, ...]
        with suppress(OSError, rosgraph.MasterException, xmlrpc.client.Error):
            robot = xmlrpc.client.ServerProxy(self._master.lookupNode('/' + ROBOT_NODE))
            _, _, connections = robot.getBusInfo(rospy.get_name())
        subscribed = self.names_by_role()[SUBSCRIBER]
        if not connections:
            return []
        connected = {topic for _, name, _, _, topic, *_ in connections if name in self.node_names}
        return [topic.strip('/') for topic in needed_topics
                if topic in subscribed and topic not in connected]

    def message_class(self, topic):
        """Returns the class of a topic's messages; None for an unknown class."""
        type_name = dict(self._master.getTopicTypes()).get(rospy.resolve_name(topic))
        return self.types.message_class(type_name) if type_name else None

    def service_class(self, name):
        """Returns the class of an offered service; None for an unknown class."""
        try:
            type_name = rosservice.get_service_type(name)
        except (rosservice.ROSServiceException, OSError):
            return None
        return self.types.service_class(type_name) if type_name else None

    def unregister(self):
        """Remove the node from the master. A killed node does not remove itself."""
        registered = self.node_names.intersection(self.roles_by_node())
        if registered:
            rosnode.cleanup_master_blacklist(self._master, list(registered))
