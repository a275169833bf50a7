"""What the master knows of a robot, and what the robot's nodes answer."""
from tb3_labs.doctor.network import is_loopback
from tb3_labs.doctor.robot import Driver, MasterName
from tb3_labs.ros.doctor.addresses import is_own
from tb3_labs.ros.doctor.deadline import together
from tb3_labs.ros.doctor.questions import ANSWERING, RESOLVING, Peer

#: The longest that a few questions to one peer take [s].
QUESTIONS = RESOLVING + ANSWERING
#: A master's usual port.
PORT = 11311


class Graph:
    """The nodes around one robot in `namespace` ('/' or '/robot3/'), as a master's state has it."""

    def __init__(self, namespace, state):
        self._publishers, self._subscribers, _ = (
            {topic: list(nodes) for topic, nodes in part} for part in state)
        self.namespace = namespace
        self.imu = self._publishers.get(namespace + 'imu', [])
        self.odom = self._publishers.get(namespace + 'odom', [])
        self.joints = self._publishers.get(namespace + 'joint_states', [])
        self.drivers = self._publishers.get(namespace + 'cmd_vel', [])
        self.hearers = self._robots_own(self._subscribers.get(namespace + 'cmd_vel', []))

    def _robots_own(self, hearers):
        """Nodes that listen to cmd_vel without being a robot (a recorder, the panel, a driver that
        looks for others) are left out if a robot's node hears it as well."""
        own = [node for node in hearers if node in self.imu + self.odom]
        return own or [node for node in hearers if node not in self.drivers]

    @property
    def robot_nodes(self):
        """The names of the nodes that are the robot."""
        return sorted(set(self.imu + self.odom + self.hearers))

    @property
    def others(self):
        """The namespaces that have a robot, other than this one."""
        return sorted(topic[:-len('odom')] for topic in self._publishers
                      if topic.endswith('/odom') and topic[:-len('odom')] != self.namespace)


def peers_of(master, nodes):
    """{node: Peer} of those that the master knows."""
    outcomes = together(QUESTIONS, [(Peer(master.uri).ask, 'lookupNode', node) for node in nodes])
    return {node: Peer(str(outcome.or_none() or '')) for node, outcome in zip(nodes, outcomes)}


def ask_all(peers, method):
    """{node: what it answers, or None}; each Peer's `answer` tells why."""
    outcomes = together(QUESTIONS, [(peer.ask, method) for peer in peers.values()])
    return {node: outcome.or_none() for node, outcome in zip(peers, outcomes)}


def master_names(uris, master):
    """A MasterName for each node; `uris`: {node: (Peer, URI of its master as the node has it)}."""
    names = []
    peers = {node: Peer(uri) for node, (_, uri) in uris.items()}
    ask_all(peers, 'getPid')
    for node, (peer, uri) in uris.items():
        theirs = peers[node]
        # what the robot calls localhost is the robot
        address = peer.address if is_loopback(theirs.address) else theirs.address
        names.append(MasterName(node, uri.rstrip('/'), theirs.address,
                                _is_ours(master, address, theirs.port)))
    return names


def second_masters(master, addresses):
    """Addresses, with port, of masters other than ours: on this computer, and on those given."""
    places = {(address, PORT) for address in addresses} | {('127.0.0.1', PORT)}
    places = [place for place in sorted(places) if not _is_ours(master, *place)]
    peers = [Peer('http://{}:{}'.format(*place)) for place in places]
    outcomes = together(QUESTIONS, [(peer.ask, 'getUri') for peer in peers])
    return ['{}:{}'.format(*place) for place, outcome in zip(places, outcomes) if outcome.or_none()]


def _is_ours(master, address, port):
    """Is that our master, by any of the addresses of its computer?"""
    same = address == master.address or is_own(address) and is_own(master.address)
    return same and port == master.port


def local_drivers(drivers, bus):
    """A Driver for each node of this computer: `drivers` {node: Peer}, `bus` the getBusInfo of the
    robot's node."""
    heard = {str(row[1]).rstrip('/') for row in bus if row[2] == 'i'}
    return [Driver(node, peer.uri, peer.uri.rstrip('/') in heard)
            for node, peer in sorted(drivers.items())]
