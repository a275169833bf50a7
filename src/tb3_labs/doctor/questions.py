"""Questions to a master and to nodes by XML-RPC, each with a deadline. All of them only read.

The calls are those of ROS's Master API and Slave API (wiki.ros.org).
"""
import email.utils
import http.client
import os
import socket
import threading
import time
import urllib.parse
import xmlrpc.client
from concurrent import futures

from tb3_labs.doctor.body import BODY_TOPICS, SERIAL_NODES
from tb3_labs.doctor.network import Answer, is_loopback, is_own, resolved
from tb3_labs.doctor.robot import Driver, MasterName

#: The name under which the doctor asks; it is registered nowhere.
CALLER = '/doctor_{}'.format(os.getpid())
#: Longest waits [s]: for the address of a name; for a connection or an answer; for both together.
RESOLVING = 1.0
ANSWERING = 1.0
QUESTION = RESOLVING + ANSWERING
#: A master's usual port.
PORT = 11311


# Calls that are given up after a time ---------------------------------------------------------


def within(seconds, function, *arguments):
    """Returns the value of a call, or raises its exception; TimeoutError after `seconds`."""
    try:
        return _begun(function, *arguments).result(seconds)
    except futures.TimeoutError:
        raise TimeoutError('no answer within {:.1f} s'.format(seconds)) from None


def together(calls):
    """Returns the value of each call, in order; `calls`: tuples of a function and its arguments.

    All calls run at the same time. A value is None if its call takes longer than QUESTION, or fails
    because of the network.
    """
    begun = [_begun(*call) for call in calls]
    end, values = time.monotonic() + QUESTION, []
    for future in begun:
        try:
            values.append(future.result(max(0.0, end - time.monotonic())))
        except (OSError, UnicodeError, futures.TimeoutError):
            values.append(None)
    return values


def _begun(function, *arguments):
    """Returns the Future of a call in a daemon thread. The program ends even if this thread is
    stuck; it would wait for a thread of a pool."""
    future = futures.Future()

    def run():
        try:
            future.set_result(function(*arguments))
        except Exception as problem:    # raised for the caller who asks for the result
            future.set_exception(problem)

    threading.Thread(target=run, daemon=True).start()
    return future


# Master and nodes -----------------------------------------------------------------------------

class _Transport(xmlrpc.client.Transport):
    """A transport with a timeout for each wait; it keeps the date of the answer."""

    date = None

    def make_connection(self, host):
        connection = super().make_connection(host)
        connection.timeout = ANSWERING
        return connection

    def parse_response(self, response):
        if hasattr(response, 'getheader'):
            self.date = response.getheader('Date')
        return super().parse_response(response)


class Peer:
    """A master or a node, by its URI. `answer` tells how the last question went."""

    def __init__(self, uri):
        self.uri, self.address, self.port = uri, '', 0
        #: The peer's clock minus ours, by the date of the last answer [s, exact to 1 s]; or None.
        self.date_offset = None
        self.answer = Answer(uri, 'silent')

    def ask(self, method, *arguments):
        """Returns the reply of the peer. None if there is no reply: `answer` tells why."""
        begun = time.monotonic()
        try:
            value, problem = self._ask(method, arguments), ''
        except Exception as trouble:    # a peer may answer with anything
            value, problem = None, _problem(trouble)
        self.answer = Answer(self.uri, problem, self.address, time.monotonic() - begun)
        return value

    def _ask(self, method, arguments):
        self._find()
        transport = _Transport()
        proxy = xmlrpc.client.ServerProxy('http://{}:{}/'.format(self.address, self.port),
                                          transport)
        code, reason, value = within(ANSWERING, getattr(proxy, method), CALLER, *arguments)
        if transport.date:
            # The date has only whole seconds: on average, half a second is missing.
            told = email.utils.parsedate_to_datetime(transport.date).timestamp()
            self.date_offset = told + 0.5 - time.time()
        if code != 1:
            raise RuntimeError(reason)
        return value

    def _find(self):
        if self.address:
            return
        try:
            parts = urllib.parse.urlparse(self.uri)
            self.port = parts.port or 0
        except ValueError:
            self.port = 0
        if not self.port or not parts.hostname or parts.scheme != 'http':
            raise ValueError('malformed')
        try:
            self.address = within(RESOLVING, resolved, parts.hostname)
        except (OSError, UnicodeError):
            raise socket.gaierror('unresolved') from None


def _problem(trouble):
    """Returns the key of network.PROBLEMS for an exception."""
    for kind, problem in ((socket.gaierror, 'unresolved'), (ConnectionRefusedError, 'refused'),
                          (TimeoutError, 'silent'), (socket.timeout, 'silent'),
                          (ConnectionError, 'strange'), (http.client.HTTPException, 'strange'),
                          (OSError, 'unreachable')):
        if isinstance(trouble, kind):
            return problem
    return 'malformed' if str(trouble) == 'malformed' else 'strange'


class Graph:
    """The nodes around one robot in `namespace` ('/' or '/robot3/'), by the state of a master."""

    def __init__(self, namespace, state):
        publishers, subscribers, _ = (
            {topic: list(nodes) for topic, nodes in part} for part in state)
        self.imu, self.odom, self.joints, self.drivers = (
            publishers.get(namespace + name, [])
            for name in ('imu', 'odom', 'joint_states', 'cmd_vel'))
        # Nodes that hear cmd_vel but are not a robot (a recorder, the panel, a driver that looks
        # for other drivers) are left out if a robot's node hears cmd_vel too.
        hearers = subscribers.get(namespace + 'cmd_vel', [])
        self.hearers = [node for node in hearers if node in self.imu + self.odom] or [
            node for node in hearers if node not in self.drivers]
        #: {topic of the body: nodes that publish it}.
        self.body = {name: publishers.get(namespace + name, []) for name in BODY_TOPICS}
        is_board = any(self.body.values())
        #: Topics that a board lacks, although it has others of the body.
        self.missing = [name for name in ('battery_state', 'sensor_state')
                        if is_board and not self.body[name]]
        #: Nodes that may print the lines of the board.
        self.serial_nodes = [
            node for node in publishers.get('/rosout', []) if node in self.imu or (
                not self.imu and node.rpartition('/')[0] + '/' == namespace
                and any(name in node.rpartition('/')[2] for name in SERIAL_NODES))]
        self.robot_nodes = sorted(set(self.imu + self.odom + self.hearers))
        #: The namespaces that have a robot, other than this one.
        self.others = sorted({topic[:-len('odom')] for topic in publishers
                              if topic.endswith('/odom')} - {namespace})


def peers_of(master, nodes):
    """Returns {node: Peer}, each by the URI that the master knows."""
    uris = together([(Peer(master.uri).ask, 'lookupNode', node) for node in nodes])
    return {node: Peer(str(uri or '')) for node, uri in zip(nodes, uris)}


def ask_all(peers, method):
    """Returns {node: its reply}. A reply is None if it failed: the Peer's `answer` tells why."""
    return dict(zip(peers, together([(peer.ask, method) for peer in peers.values()])))


def master_names(peers, master):
    """Returns a MasterName for each node that tells its master's URI; `peers`: {node: Peer}."""
    uris = ask_all(peers, 'getMasterUri')
    masters = {node: Peer(uri) for node, uri in uris.items() if isinstance(uri, str)}
    ask_all(masters, 'getPid')
    names = []
    for node, theirs in masters.items():
        # if the robot says localhost, this is the robot
        address = peers[node].address if is_loopback(theirs.address) else theirs.address
        names.append(MasterName(node, theirs.uri.rstrip('/'), theirs.address,
                                _is_ours(master, address, theirs.port)))
    return names


def second_masters(master, addresses):
    """Returns 'address:port' of other masters than ours, here and at the given addresses."""
    places = {(address, PORT) for address in addresses} | {('127.0.0.1', PORT)}
    places = [place for place in sorted(places) if not _is_ours(master, *place)]
    peers = [Peer('http://{}:{}'.format(*place)) for place in places]
    uris = together([(peer.ask, 'getUri') for peer in peers])
    return ['{}:{}'.format(*place) for place, uri in zip(places, uris) if uri]


def _is_ours(master, address, port):
    """Is our master at this address and port? Each address of its computer counts."""
    same = address == master.address or is_own(address) and is_own(master.address)
    return same and port == master.port


def local_drivers(drivers, hearer):
    """Returns a Driver for each of `drivers`, {node: Peer} of this computer. None if the robot's
    node, the Peer `hearer`, does not answer."""
    bus = hearer.ask('getBusInfo')
    if bus is None:
        return None
    heard = {str(row[1]).rstrip('/') for row in bus if row[2] == 'i'}
    return [Driver(node, peer.uri, peer.uri.rstrip('/') in heard)
            for node, peer in sorted(drivers.items())]
