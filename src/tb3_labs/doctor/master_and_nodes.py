"""Can this computer, the master and the nodes around one robot reach each other?

Master and nodes answer the XML-RPC calls of ROS's Master API and Slave API (wiki.ros.org). The
doctor's calls only read and change nothing.
"""
import difflib
import http.client
import os
import re
import xmlrpc.client
from dataclasses import dataclass
from typing import Collection, Iterator, Mapping

from tb3_labs.doctor import BRINGUP_REMEDY, Finding, fault, ok, warning
from tb3_labs.doctor.computer import Computer, address_of, is_loopback

CALLER_ID = f'/doctor_{os.getpid()}'    # the master does not know this name
ANSWER_TIMEOUT = 1.0                    # [s]
#: {problem of a Peer: words for the user}
PROBLEM_TEXTS = {
    'malformed': 'is not an address such as http://192.168.0.5:11311',
    'unresolved': 'has a name that this computer cannot resolve',
    'refused': 'refuses: the computer is on, but nothing listens there',
    'silent': 'does not answer as a ROS program'}
SENSORS = 'imu', 'odom', 'joint_states'     # topics
#: The robot or a node of the labs subscribes to these topics.
SUBSCRIBED_TOPICS = 'cmd_vel', 'joy', 'mouse_info', 'ctrl_relinq', 'turn'
LAB_TOPICS = (*SENSORS, *SUBSCRIBED_TOPICS, 'heading', 'reset')
#: A wrong topic probably means a right topic if difflib finds at least this similarity of names.
MIN_NAME_SIMILARITY = 0.65


@dataclass
class Peer:
    """A master or a node that the doctor calls, and the outcome of the latest call."""

    uri: str
    problem: str = 'silent'    # a key of PROBLEM_TEXTS, or '' if the peer has answered
    address: str = ''          # the IP address of the host in `uri`

    def __post_init__(self):
        self.host = ''
        match = re.fullmatch(r'http://([^/:]+):(\d+)/?', self.uri)
        if match:
            self.host = match.group(1)
            self.port = int(match.group(2))

    def ask(self, method, *arguments):
        """Call `method`. Returns the answer, or None if there is no answer. Sets `problem`."""
        self.address = address_of(self.host)
        if not self.address:
            self.problem = 'unresolved' if self.host else 'malformed'
            return None
        try:
            connection = http.client.HTTPConnection(
                self.address, self.port, timeout=ANSWER_TIMEOUT)
            request = xmlrpc.client.dumps((CALLER_ID, *arguments), method)
            connection.request('POST', '/', request, {'Content-Type': 'text/xml'})
            with connection.getresponse() as answer:
                parameters, _ = xmlrpc.client.loads(answer.read())
            code, reason, value = parameters[0]
            if code != 1:
                raise RuntimeError(reason)
            self.problem = ''
            return value
        except ConnectionRefusedError:
            self.problem = 'refused'
        except Exception:    # a program that is not of ROS may answer with any bytes
            self.problem = 'silent'
        return None


def judge_master(master: Peer) -> Finding:
    """Judges whether a master answers."""
    where = repr(master.uri)
    if master.address and master.address not in where:
        where += f' ({master.address})'
    if not master.problem:
        return ok('Master', where + ' answers')
    if master.problem == 'refused':
        remedy = ('start roscore, or a launch file, on that computer; first end each launch file '
                  'that runs there without its master')
    elif master.problem == 'silent':
        remedy = ('is that computer on, in the same network, and is the address still its own? '
                  'ping ' + master.address)
    else:
        remedy = 'export ROS_MASTER_URI=http://ADDRESS:11311'
    return fault('Master', f'ROS_MASTER_URI {where} {PROBLEM_TEXTS[master.problem]}', remedy)


class RobotGraph:
    """The nodes around the robot in `namespace`. `state` is the answer to getSystemState."""

    def __init__(self, namespace, state):
        self.namespace = namespace
        self.publishers, self.subscribers, _ = map(dict, state)
        #: {topic of a sensor: nodes that publish the topic}
        self.sensor_publishers = {
            name: self.publishers.get(namespace + name, []) for name in SENSORS}
        self.cmd_vel_publishers = self.publishers.get(namespace + 'cmd_vel', [])
        # A recorder, the panel and drivers also listen to cmd_vel. If a node of the robot listens,
        # all other listeners are left out.
        listeners = self.subscribers.get(namespace + 'cmd_vel', [])
        sensor_nodes = self.sensor_publishers['imu'] + self.sensor_publishers['odom']
        sensor_listeners = [node for node in listeners if node in sensor_nodes]
        pure_listeners = [node for node in listeners if node not in self.cmd_vel_publishers]
        self.cmd_vel_listeners = sensor_listeners or pure_listeners
        self.robot_nodes = sorted({*sensor_nodes, *self.cmd_vel_listeners})
        namespaces = {topic[:-len('odom')] for topic in self.publishers if topic.endswith('/odom')}
        self.other_robots = sorted(namespaces - {namespace})

    def right_topic(self, topic, node, names):
        """Returns the robot's topic that `node` probably means by `topic`. The name of this topic
        is one of `names`. Returns '' if `topic` is right, belongs to another robot, or resembles
        none of these names."""
        is_right = topic in [self.namespace + name for name in LAB_TOPICS]
        if is_right or self._is_of_another_robot(topic, node):
            return ''
        path = topic.lower()
        # imu/data and raw_imu contain the word imu, but simulator does not
        sensor_names = [name for name in names
                        if name in SENSORS and re.search('(?<![a-z])' + name, path)]
        _, _, base_name = path.rpartition('/')
        similar_names = difflib.get_close_matches(base_name, names, n=1, cutoff=MIN_NAME_SIMILARITY)
        right_names = sensor_names + similar_names      # the likeliest first
        return self.namespace + right_names[0] if right_names else ''

    def _is_of_another_robot(self, topic, node):
        namespace = topic.rpartition('/')[0] + '/'
        if namespace in ('/', self.namespace):
            return False
        return node.startswith(namespace) or not namespace.startswith(self.namespace)


def judge_robot(graph: RobotGraph) -> Finding:
    """Judges whether there is exactly one robot in the namespace."""
    namespace = graph.namespace.rstrip('/')
    imu, odom = graph.sensor_publishers['imu'], graph.sensor_publishers['odom']
    if not imu and not odom:
        text = f'nobody publishes {namespace}/imu or {namespace}/odom'
        remedy = "start the robot's bringup, or roslaunch tb3_labs fake_robot.launch"
        if graph.other_robots:
            text += f" (there is one in {', '.join(graph.other_robots)})"
            remedy = 'rosrun tb3_labs doctor.py ' + graph.other_robots[0]
        return fault('Robot', text, remedy)
    for topic, nodes in (('imu', imu), ('odom', odom)):
        if len(nodes) > 1:
            text = (f"{len(nodes)} robots answer: {', '.join(sorted(nodes))} all publish "
                    f'{namespace}/{topic}')
            return fault('Robot', text, 'switch all but one off, or give each robot a namespace, '
                         'or a master, of its own')
        if not nodes:
            return fault('Robot', f'nobody publishes {namespace}/{topic}', BRINGUP_REMEDY)
    if not graph.cmd_vel_listeners:
        return fault('Robot', f'nobody hears {namespace}/cmd_vel: the robot cannot be driven',
                     BRINGUP_REMEDY)
    listeners = ', '.join(sorted(graph.cmd_vel_listeners))
    return ok('Robot', f'{imu[0]} publishes {namespace}/imu and odom, {listeners} hears cmd_vel')


def judge_names(graph: RobotGraph) -> Iterator[Finding]:
    """Yields a finding on the nodes that listen to a wrong name, such as imu_data, and a finding on
    the nodes that publish a wrong name, such as turtle1/cmd_vel."""
    wrong_hearers = _mistake_sentences(
        '{node} listens to {wrong}, which nobody publishes; {right} is published by {partner}',
        graph, LAB_TOPICS, users=graph.subscribers, partners=graph.publishers)
    wrong_senders = _mistake_sentences(
        '{node} publishes {wrong}, which nobody hears; {right} is heard by {partner}',
        graph, SUBSCRIBED_TOPICS, users=graph.publishers, partners=graph.subscribers)
    for subject, mistakes in (('Hearers', wrong_hearers), ('Senders', wrong_senders)):
        if mistakes:
            yield warning(subject, '; '.join(mistakes),
                          'correct the name in the code, or by <remap> in the launch file')


def _mistake_sentences(text, graph, names, users, partners):
    """Returns the sentence `text` for each node that uses a wrong topic instead of one of `names`.
    `users` and `partners` are {topic: nodes}: one has the publishers, the other the subscribers. A
    topic without partners may be wrong."""
    sentences = []
    for topic in sorted(set(users) - set(partners)):
        for node in users[topic]:
            right = graph.right_topic(topic, node, names)
            if right not in partners:
                continue
            # a node that also uses the right topic makes no mistake
            if node in [*graph.robot_nodes, *partners[right], *users.get(right, [])]:
                continue
            # the sentence names a recorder only if no node of the robot uses the topic
            robot_partners = [node for node in partners[right] if node in graph.robot_nodes]
            partner = (robot_partners or partners[right])[0]
            sentences.append(text.format(node=node, wrong=topic, right=right, partner=partner))
    return sentences


def judge_nodes(peers: Mapping[str, Peer]) -> Finding:
    """Judges whether the nodes in `peers` {node: Peer} answer at their registered addresses."""
    for node, peer in sorted(peers.items()):
        if not peer.problem:
            continue
        uri = peer.uri.rstrip('/') or '(nothing)'
        text = f'{node} says it is at {uri}, which {PROBLEM_TEXTS[peer.problem]}'
        remedy = ('if it has ended: rosnode cleanup; else on the robot: export ROS_IP=ITS_ADDRESS, '
                  'then start it again')
        if is_loopback(peer.address):
            text += ': others cannot reach that'
        else:
            remedy = f'is the robot on, and in this network? ping {peer.host}; {remedy}'
        return fault('Nodes', text, remedy)
    return ok('Nodes', ', '.join(sorted(peers)) + ' answer')


def judge_return_path(publishers: Mapping[str, str], connected: Collection[str], robot: str,
                      computer: Computer, is_robot_elsewhere: bool) -> Finding:
    """Judges whether this computer's commands reach the node `robot`, which listens to cmd_vel.
    `publishers` is {node of this computer that publishes cmd_vel: URI}. `connected` has the URIs of
    nodes from which `robot` receives messages. From `computer.outgoing_address` this computer sends
    to the robot."""
    for node, uri in sorted(publishers.items()):
        uri = uri.rstrip('/')
        if uri not in connected:
            text = f'{robot} cannot reach {node} at {uri}: commands do not arrive'
            return fault('Way back', text, 'if sudo ufw status says active: sudo ufw allow from '
                         'ROBOTS_ADDRESS; else ' + computer.remedy)
    if publishers:
        return ok('Way back', f"{robot} is connected to {', '.join(sorted(publishers))}")
    if not is_robot_elsewhere:
        return ok('Way back', 'the robot is on this computer')
    name, address = computer.advertised_name, computer.outgoing_address
    if computer.resolved_address != address:
        needed = address or 'of this computer'
        return fault('Way back', f'the robot cannot reach {name}: it needs the address {needed}',
                     computer.remedy)
    if name != address:
        return warning('Way back', f'the robot must resolve the name {name}; start a lab, then '
                       'this line shows whether it does', computer.remedy)
    return ok('Way back', f'{name} is the address towards the robot; start a lab, then this line '
              'shows a firewall')
