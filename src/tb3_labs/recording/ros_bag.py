"""Reads a rosbag into a RunData. The bag must have a topic of type Imu and one of type Odometry.

The library rosbag makes Python code of the definitions of messages in a bag, and runs this code.
But a bag may come from a stranger. So this reader uses only the installed message classes, and does
not read topics of other types.
"""
import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu, Joy
from std_msgs.msg import Bool, Empty, Float32, Float64, String
from tf2_msgs.msg import TFMessage

from tb3_labs.msg import MouseController
from tb3_labs.recording.messages import (
    RecordedClock, Table, resets_in, times_on_recorders_clock)
from tb3_labs.recording.records import Bag, BagProblem
from tb3_labs.recording.run_data import Numbers, RunData

#: The topics that a recording may lack: {field of RunData: (name of the topic, class)}.
OPTIONAL_TOPICS = {
    'commands': ('cmd_vel', Twist), 'local_pose': ('local_pose', PoseStamped),
    'ground_truth': ('ground_truth', PoseStamped), 'goals': ('current_goal', PoseStamped),
    'states': ('goal_state', String),
    'turn_requests': ('turn', Float64), 'control': ('ctrl_relinq', Bool),
    'mouse': ('mouse_info', MouseController),
    'events': ('trial', String), 'printed': ('printed', String),
    'variables': ('variables', DiagnosticArray)}
#: The classes of all topics of record.launch, by type and checksum.
CLASSES = {(made._type, made._md5sum): made for made in (
    Imu, Odometry, TFMessage, Log, Empty, Float32, Joy, PoseWithCovarianceStamped,
    *(made for _, made in OPTIONAL_TOPICS.values()))}
#: The topics by which a person drives. They may have any type.
DEVICE_TOPICS = 'joy', 'mouse_info'


def read_run(path, namespace=None, log=lambda line: None):
    """Returns the RunData of the bag file `path`, or raises BagProblem.

    If several robots were recorded, only the robot in `namespace` is read. ``log(line)`` is called
    with each line about parts of the bag that are not read.
    """
    try:
        bag = Bag(str(path), _class_of)
        run = _run(bag, str(path), namespace)
    except BagProblem as problem:
        raise BagProblem(f'{path}: {problem}') from None
    except Exception as problem:        # a stranger's bytes may be anything
        reason = getattr(problem, 'strerror', None) or problem
        raise BagProblem(f'{path}: cannot be read ({reason})') from None
    unknown = {f'{each.topic} ({each.message_type})' for each in bag.streams
               if _class_of(each) is None}
    if unknown:
        log(f"{path}: not read, since these types are not installed here, or not as they are in "
            f"the bag: {', '.join(sorted(unknown))}")
    for note in run.notes:
        log(f'{path}: {note}')
    return run


def _class_of(connection):
    """Returns the installed class of the connection's messages, or None."""
    return CLASSES.get((connection.message_type, connection.checksum))


def _run(bag, path, namespace):
    types = {each.topic: _class_of(each) for each in bag.streams}
    try:
        topics = choose_topics(types, namespace)
        prefix = parent(topics['odometry'])
        in_order = {part: _in_order(bag, topic, types[topic]) for part, topic in topics.items()}
        tables = {part: Table(part, types[topics[part]], prefix, bag.start, arrival, messages)
                  for part, (arrival, messages, _) in in_order.items()}
        for part in ('imu', 'odometry'):
            if not len(tables[part].arrival):
                raise BagProblem(f'not one good message on {topics[part]} (bad quaternions?)')
    except BagProblem as problem:
        if bag.problem:
            problem = f'was not read to its end: {bag.problem}; until there: {problem}'
        raise BagProblem(problem) from None
    clock = RecordedClock.of(tables['odometry'].arrival, tables['odometry'].stamp)
    samples = {part: table.samples(clock) for part, table in tables.items()}
    if 'log' in samples:
        samples['resets'] = resets_in(samples['log'])
    arrival, _, senders = in_order.get('commands', (np.empty(0), [], []))
    names, index = np.unique(np.array(senders, object), return_inverse=True)
    samples['sender_index'] = Numbers(
        arrival, times_on_recorders_clock(arrival, arrival, clock), index.astype(float))
    duration = max(float(each.arrival.max()) for each in samples.values() if len(each))
    notes = (f'{bag.problem}: the report ends at {duration:.1f} s',) if bag.problem else ()
    devices = tuple(name for name in DEVICE_TOPICS if prefix + name in types)
    dropped = {part: table.dropped for part, table in tables.items()}
    return RunData(path, bag.start, duration, topics=topics, notes=notes, devices=devices,
                   senders=tuple(names), dropped=dropped, **samples)


def _in_order(bag, topic, made):
    """Returns (arrivals, messages, senders) of the messages of class `made` on a topic, sorted by
    arrival. The messages of several senders follow each other in the bag's streams."""
    streams = [(connection.sender, stream) for connection, stream in bag.streams.items()
               if connection.topic == topic and _class_of(connection) is made]
    arrival = np.concatenate([stream.arrival for _, stream in streams])
    messages = [message for _, stream in streams for message in stream.messages]
    senders = [sender for sender, stream in streams for _ in stream.messages]
    order = np.argsort(arrival, kind='stable')
    return arrival[order], [messages[k] for k in order], [senders[k] for k in order]


def choose_topics(types, namespace):
    """Returns {field of RunData: topic} of the robot in `namespace`, or of the only robot if
    `namespace` is None. `types` is {topic: installed class or None}. May raise BagProblem."""
    prefix = None if namespace is None else f"/{namespace.strip('/')}/".replace('//', '/')
    topics = {'imu': _by_type(types, Imu, 'imu', prefix),
              'odometry': _by_type(types, Odometry, 'odom', prefix)}
    prefix = prefix or parent(topics['odometry'])
    for part, (name, kind) in OPTIONAL_TOPICS.items():
        found = [topic for topic, made in types.items()
                 if made is kind and topic == prefix + name]
        if found:
            topics[part] = found[0]
    if types.get('/tf') is TFMessage:
        topics['frames'] = '/tf'
    if types.get('/rosout') is Log:
        topics['log'] = '/rosout'
    return topics


def _by_type(types, kind, name, prefix):
    """Returns the topic of type `kind` in the namespace `prefix`, or in any namespace if `prefix`
    is None. If there are several topics, the topic with this `name` is returned. Raises BagProblem
    if there is not exactly one such topic."""
    topics = [topic for topic, made in types.items() if made is kind
              and (prefix is None or topic.startswith(prefix))]
    if not topics:
        place = f' in {prefix}' if prefix else ''
        raise BagProblem('no {} was recorded{}; the bag has: {}'.format(
            kind._type, place, ', '.join(sorted(types)) or 'no messages at all'))
    exact = [topic for topic in topics if prefix and topic == prefix + name]
    named = [topic for topic in topics if topic.rsplit('/', 1)[-1] == name]
    found = exact or named or topics
    if len(found) > 1:
        raise BagProblem('several topics of {} were recorded ({}): choose a robot, such as --ns {}'
                         .format(kind._type, ', '.join(sorted(found)),
                                 parent(sorted(found)[-1]).strip('/') or '/'))
    return found[0]


def parent(topic):
    """Returns the namespace of a topic, such as `/robot3/` of `/robot3/odom`."""
    return topic.rpartition('/')[0] + '/'
