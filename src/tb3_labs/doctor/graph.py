"""The master, and the nodes around one robot: can they and this computer reach each other?

They are asked by XML-RPC calls of ROS's Master API and Slave API (wiki.ros.org) that only read.
"""
import difflib
import http.client
import os
import re
import time
import xmlrpc.client
from dataclasses import dataclass
from typing import Collection, Iterator, Mapping

from tb3_labs.doctor import Line, fault, ok, warning
from tb3_labs.doctor.computer import Address, is_loopback, quoted, address_of

#: The name under which the doctor asks; it is registered nowhere.
CALLER = f'/doctor_{os.getpid()}'
#: Longest wait for an answer [s].
ANSWER_TIMEOUT = 1.0
#: {problem in reaching a program at an address: its words}
PROBLEMS = {
    'malformed': 'is not an address such as http://192.168.0.5:11311',
    'unresolved': 'has a name that this computer cannot resolve',
    'refused': 'refuses: the computer is on, but nothing listens there',
    'silent': 'does not answer as a ROS program'}
#: The sensors of a robot: each is a topic.
SENSORS = 'imu', 'odom', 'joint_states'
#: The topics that the robot, or a node of the labs, subscribes to, and all topics of the labs.
SUBSCRIBED = 'cmd_vel', 'joy', 'mouse_info', 'ctrl_relinq', 'turn'
TOPICS = (*SENSORS, *SUBSCRIBED, 'heading', 'reset')
#: Likeness from which a name may be meant for another, and from which it surely is. A line names at
#: most MOST_NAMED nodes.
POSSIBLY_MEANT, SURELY_MEANT, MOST_NAMED = 0.65, 0.8, 3
TURTLESIM = re.compile('/turtle[0-9]+/')    # the topics of turtlesim
BRINGUP = "restart the robot's bringup, and look at its first lines"


@dataclass
class Peer:
    """A master or a node at `uri`, and the outcome of the last question to it."""

    uri: str
    problem: str = 'silent'    # a key of PROBLEMS, or '' after an answer
    address: str = ''          # of the name in `uri`
    round_trip: float = 0.0    # time until the answer [s]

    def __post_init__(self):
        found = re.fullmatch(r'http://([^/:]+):(\d+)/?', self.uri)
        self.name, self.port = (found.group(1), int(found.group(2))) if found else ('', 0)

    def ask(self, method, *arguments):
        """Returns the reply. Without one it returns None, and `problem` has the reason."""
        self.address = address_of(self.name)
        if not self.address:
            self.problem = 'unresolved' if self.name else 'malformed'
            return None
        begun = time.monotonic()
        try:
            link = http.client.HTTPConnection(self.address, self.port, timeout=ANSWER_TIMEOUT)
            link.request('POST', '/', xmlrpc.client.dumps((CALLER, *arguments), method),
                         {'Content-Type': 'text/xml'})
            with link.getresponse() as answer:
                ((code, reason, value),), _ = xmlrpc.client.loads(answer.read())
            if code != 1:
                raise RuntimeError(reason)
        except Exception as trouble:    # a peer may answer with anything
            is_refused = isinstance(trouble, ConnectionRefusedError)
            self.problem = 'refused' if is_refused else 'silent'
            return None
        self.problem, self.round_trip = '', time.monotonic() - begun
        return value


def peers_of(master, nodes):
    """Returns {node: Peer} by the URIs that the master knows. Each Peer was asked once."""
    peers = {}
    for node in nodes:
        peers[node] = Peer(str(Peer(master.uri).ask('lookupNode', node) or ''))
        peers[node].ask('getPid')
    return peers


# The master -------------------------------------------------------------------------------------

def judge_master(master: Peer) -> Line:
    """Does a master answer?"""
    where = quoted(master.uri) if master.uri else '(empty)'
    if master.address and master.address not in where:
        where += f' ({master.address})'
    if not master.problem:
        return ok('Master', f'{where} answers in {1000.0 * master.round_trip:.0f} ms')
    with_http = 'http://' + master.uri.strip()    # rospy takes no address without http
    if master.problem == 'refused':
        remedy = ('start roscore, or a launch file, on that computer; first end each launch file '
                  'that runs there without its master')
    elif master.problem == 'silent':
        remedy = ('is that computer on, in the same network, and is the address still its own? '
                  'ping ' + master.address)
    else:
        remedy = 'export ROS_MASTER_URI=' + (
            with_http if Peer(with_http).name else 'http://ADDRESS:11311')
    return fault('Master', f'ROS_MASTER_URI {where} {PROBLEMS[master.problem]}', remedy)


# Publishers and subscribers ----------------------------------------------------------------------

class RobotGraph:
    """The nodes around one robot in `namespace` ('/' or '/robot3/'). `state`: the master's
    getSystemState; `types`: the master's (topic, type) of each topic."""

    def __init__(self, namespace, state, types=()):
        self.namespace = namespace
        self._types = {topic: kind for topic, kind in types if kind != '*'}
        publishers, subscribers = (
            {topic: list(nodes) for topic, nodes in part} for part in state[:2])
        self.publishers, self.subscribers = publishers, subscribers
        #: {'imu': nodes that publish it}, for each sensor. `drivers`: nodes that publish cmd_vel.
        self.sensors = {name: publishers.get(namespace + name, []) for name in SENSORS}
        self.drivers = publishers.get(namespace + 'cmd_vel', [])
        # If a robot's node listens to cmd_vel, other listeners (a recorder, the panel, a driver
        # that looks for other drivers) are left out.
        listeners = subscribers.get(namespace + 'cmd_vel', [])
        there = self.sensors['imu'] + self.sensors['odom']
        self.listeners = [node for node in listeners if node in there]
        if not self.listeners:
            self.listeners = [node for node in listeners if node not in self.drivers]
        self.robot_nodes = sorted(set(there + self.listeners))
        #: The namespaces that have a robot, other than this one.
        self.others = sorted({topic[:-len('odom')] for topic in publishers
                              if topic.endswith('/odom')} - {namespace})

    def right_name(self, topic, node, names):
        """Returns (topic, likeness): this robot's topic, with one of `names`, that is most like the
        `topic` of a node. ('', 0.0): the node's topic is right, or belongs to another robot."""
        place, _, word = topic.rpartition('/')
        is_elsewhere = place + '/' not in ('/', self.namespace) and (
            node.startswith(place + '/') or not (place + '/').startswith(self.namespace))
        if topic in [self.namespace + name for name in TOPICS] or is_elsewhere and not (
                topic.startswith(node + '/') or TURTLESIM.match(topic)):
            return '', 0.0
        like, name = max((likeness(word.lower(), name), name) for name in names)
        outer = place.rpartition('/')[2].lower()
        if outer in SENSORS:    # imu/data
            like, name = max((like, name), *((likeness(outer, each), each) for each in names))
        package, _, kind = self._types.get(topic, '').rpartition('/')
        kinds = {name: self._types.get(self.namespace + name, '').rpartition('/')[2]
                 for name in names}     # without the package: lab2/MouseController
        same = [name for name in names if kind and kinds[name] == kind]
        if same and package != 'std_msgs':      # vel_cmd, odometry/filtered
            return self.namespace + same[0], 1.0
        is_another_type = kind and kinds[name] and name not in same
        return self.namespace + name, 0.0 if is_another_type else like


def likeness(word: str, name: str) -> float:
    """Returns how much a word is like a name, from 0 to 1. imu_data is like imu, wheel_odom like
    odom. Words with different first letters are not alike: return is not turn."""
    like = 0.0
    if word[:1] == name[0]:
        like = difflib.SequenceMatcher(None, word, name).ratio()
    if name in SENSORS and re.search('(?<![a-z])' + name, word):
        like = max(like, POSSIBLY_MEANT)
    return like


def judge_robot(graph: RobotGraph) -> Line:
    """Is there one robot?"""
    at = graph.namespace.rstrip('/')
    imu, odom = graph.sensors['imu'], graph.sensors['odom']
    if not imu and not odom:
        there = f" (there is one in {', '.join(graph.others)})" if graph.others else ''
        named = graph.others[0].strip('/') if graph.others else ''
        return fault('Robot', 'nobody publishes {0}/imu or {0}/odom{1}'.format(at, there),
                     'rosrun tb3_labs doctor.py ' + named if named else "start the robot's "
                     'bringup, or roslaunch tb3_labs fake_robot.launch')
    for topic, nodes in (('imu', imu), ('odom', odom)):
        if len(nodes) > 1:
            return fault('Robot', '{} robots answer: {} all publish {}/{}'.format(
                len(nodes), ', '.join(sorted(nodes)), at, topic),
                'switch all but one off, or give each robot a namespace, or a master, of its own')
        if not nodes:
            return fault('Robot', f'nobody publishes {at}/{topic}', BRINGUP)
    if not graph.listeners:
        return fault('Robot', f'nobody hears {at}/cmd_vel: the robot cannot be driven',
                     BRINGUP)
    return ok('Robot', '{} publishes {}/imu and odom, {} hears cmd_vel'.format(
        imu[0], at, ', '.join(sorted(graph.listeners))))


def judge_names(graph: RobotGraph) -> Iterator[Line]:
    """Yields a line if nodes listen to a wrong name, such as imu_data, and a line if nodes publish
    a wrong name, such as turtle1/cmd_vel. A node may publish topics that nobody hears: if the right
    name has a publisher, only a name that is very much like it is called wrong."""
    for subject, words, side, other, names in (
            ('Hearers', '{} listens to {}, which nobody publishes; {} is published by {}',
             graph.subscribers, graph.publishers, TOPICS),
            ('Senders', '{} publishes {}, which nobody hears; {} is heard by {}',
             graph.publishers, graph.subscribers, SUBSCRIBED)):
        findings = []
        for topic in sorted(set(side) - set(other)):
            for node in side[topic]:
                right, like = graph.right_name(topic, node, names)
                least = SURELY_MEANT if subject == 'Senders' and right in side else POSSIBLY_MEANT
                if like < least or right not in other:
                    continue
                # a node that also uses the right name is not mistaken
                if node not in [*graph.robot_nodes, *other[right], *side.get(right, [])]:
                    user = min(other[right], key=lambda each: each not in graph.robot_nodes)
                    findings.append(words.format(node, topic, right, user))
        if findings:
            yield warning(subject, '; '.join(findings[:MOST_NAMED]),
                          'mend the name in its code, or by <remap> in its launch file')


# The way there ----------------------------------------------------------------------------------

def judge_nodes(peers: Mapping[str, Peer]) -> Line:
    """Do the robot's nodes answer at the addresses that the master knows? `peers`: {node: Peer}"""
    remedy = 'on the robot: export ROS_IP=ITS_ADDRESS, then start it again'
    for node, peer in sorted(peers.items()):
        if not peer.problem:
            continue
        text = '{} says it is at {}, which {}'.format(
            node, peer.uri.rstrip('/') or '(nothing)', PROBLEMS[peer.problem])
        if is_loopback(peer.address):
            return fault('Nodes', text + ': others cannot reach that',
                         'if it has ended: rosnode cleanup; else ' + remedy)
        if peer.problem == 'unresolved':
            remedy += f'; or here: add "ITS_ADDRESS {peer.name}" to /etc/hosts'
        elif peer.problem == 'refused':
            remedy = 'rosnode cleanup, then start {} again; is {} really {}?'.format(
                node, peer.name, peer.address)
        else:
            remedy = 'is the robot on, and in this network? ping {}; {}'.format(
                peer.address or peer.name, remedy)
        return fault('Nodes', text, remedy)
    return ok('Nodes', ', '.join('{} answers in {:.0f} ms'.format(
        node, 1e3 * peer.round_trip) for node, peer in sorted(peers.items())))


def judge_types(topic: str, robot: str, received: str, other_types: Mapping[str, str]) -> Line:
    """Returns the line on drivers that publish another type than `received`, the type to which the
    node `robot` listens on `topic`. `other_types`: {driver: type of its messages}."""
    return fault('Commands', '{} on {}, but {} hears {}: no such command arrives'.format(
        ', '.join('{} publishes {}'.format(*each) for each in sorted(other_types.items())),
        topic, robot, received), f'publish {received} there')


# The way back -----------------------------------------------------------------------------------

def judge_return_path(drivers: Mapping[str, str], received: Collection[str], robot: str,
                      here: Address, robot_elsewhere: bool) -> Line:
    """Do commands of this computer reach the robot's node `robot`, which listens to cmd_vel?
    `drivers`: {node of this computer that publishes cmd_vel: URI}; `received`: URIs of the nodes to
    which `robot` is connected; `here.outgoing_address`: this computer's address on the way to the
    robot."""
    for node, uri in sorted(drivers.items()):
        if uri.rstrip('/') not in received:
            return fault('Way back', '{} cannot reach {} at {}: commands do not arrive'.format(
                robot, node, uri.rstrip('/')), 'if sudo ufw status says active: sudo ufw allow '
                'from ROBOTS_ADDRESS; else ' + here.advice)
    if drivers:
        return ok('Way back', f"{robot} is connected to {', '.join(sorted(drivers))}")
    if not robot_elsewhere:
        return ok('Way back', 'the robot is on this computer')
    if here.resolved != here.outgoing_address:
        return fault('Way back', 'the robot cannot reach {}: it needs the address {}'.format(
            here.advertised, here.outgoing_address or 'nowhere'), here.advice)
    if here.advertised != here.outgoing_address:
        return warning('Way back', 'the robot must resolve the name {}; start a lab, then this '
                       'line shows it'.format(here.advertised), here.advice)
    return ok('Way back', '{} is the address towards the robot; start a lab, then this line shows '
              'a firewall'.format(here.advertised))
