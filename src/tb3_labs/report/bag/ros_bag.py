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
from tb3_labs.report.bag.messages import RecordedClock, Table, times_on_recorders_clock
from tb3_labs.report.bag.records import Bag, BagProblem
from tb3_labs.report.motion.resets_and_goals import resets_in
from tb3_labs.report.run_data import Numbers, RunData

#: The topics that a recording may lack: {field of RunData: (name of the topic, class)}.
OPTIONAL_TOPICS = {
    'commands': ('cmd_vel', Twist), 'local_pose': ('local_pose', PoseStamped),
    'ground_truth': ('ground_truth', PoseStamped), 'goals': ('current_goal', PoseStamped),
    'states': ('goal_state', String), 'resets': ('initialpose', PoseWithCovarianceStamped),
    'turn_requests': ('turn', Float64), 'control': ('ctrl_relinq', Bool),
    'mouse': ('mouse_info', MouseController),
    'events': ('trial', String), 'printed': ('printed', String),
    'variables': ('variables', DiagnosticArray)}
#: The classes of all topics of record.launch, by type and checksum.
CLASSES = {(made._type, made._md5sum): made for made in (
    Imu, Odometry, TFMessage, Log, DiagnosticArray, Empty, Float32, Joy,
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
    unknown = {f'{each.topic} ({each.kind})' for each in bag.streams if _class_of(each) is None}
    if unknown:
        log(f"{path}: not read, since these types are not installed here, or not as they are in "
            f"the bag: {', '.join(sorted(unknown))}")
    for note in run.notes:
        log(f'{path}: {note}')
    return run


def _class_of(connection):
    """Returns the installed class of the connection's messages, or None."""
    return CLASSES.get((connection.kind, connection.checksum))


def _run(bag, path, namespace):
    types = _types(bag)
    try:
        topics = choose_topics(types, namespace)
        prefix = parent(topics['odometry'])
        in_order = {part: _in_order(bag, topic, types[topic][0]) for part, topic in topics.items()}
        tables = {part: Table(part, types[topics[part]][0], prefix, bag.start, arrival, messages)
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
    absolute = {_absolute(topic) for topic in types}
    devices = tuple(name for name in DEVICE_TOPICS if prefix + name in absolute)
    dropped = {part: table.dropped for part, table in tables.items()}
    return RunData(path, bag.start, duration, topics=topics, notes=notes, devices=devices,
                   senders=tuple(names), dropped=dropped, **samples)


def _types(bag):
    """Returns {topic: (installed class or None, number of messages)}."""
    types = {}
    for connection, stream in bag.streams.items():
        known, number = types.get(connection.topic, (None, 0))
        types[connection.topic] = (known or _class_of(connection), number + len(stream.messages))
    return types


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
    `namespace` is None. `_types` returns the `types`. May raise BagProblem."""
    prefix = None if namespace is None else f"/{namespace.strip('/')}/".replace('//', '/')
    topics = {'imu': _by_type(types, Imu, 'imu', prefix),
              'odometry': _by_type(types, Odometry, 'odom', prefix)}
    prefix = prefix or parent(topics['odometry'])
    for part, (name, kind) in OPTIONAL_TOPICS.items():
        found = [topic for topic, (of, _) in types.items()
                 if of is kind and _absolute(topic) == prefix + name]
        if found:
            topics[part] = found[0]
    if types.get('/tf', ('',))[0] is TFMessage:
        topics['frames'] = '/tf'
    if types.get('/rosout', ('',))[0] is Log:
        topics['log'] = '/rosout'
        # a line in the log shows that a reset was done; initialpose shows only a request
        topics.pop('resets', None)
    return topics


def _by_type(types, kind, ending, prefix):
    """Returns the topic of type `kind` in the namespace `prefix` whose last name is `ending`. If
    there is not exactly one, returns the topic with the most messages. Raises BagProblem if several
    robots have such a topic."""
    names = [topic for topic, (of, _) in types.items() if of is kind
             and (prefix is None or _absolute(topic).startswith(prefix))]
    if not names:
        place = f' in {prefix}' if prefix else ''
        raise BagProblem('no {} was recorded{}; the bag has: {}'.format(
            kind._type, place, ', '.join(sorted(types)) or 'no messages at all'))
    named = [topic for topic in names if topic.rsplit('/', 1)[-1] == ending]
    exact = [topic for topic in named if prefix and _absolute(topic) == prefix + ending]
    if exact:
        return exact[0]
    if len({parent(topic) for topic in named}) > 1:
        raise BagProblem('several robots were recorded ({}): choose one, such as --ns {}'.format(
            ', '.join(sorted(named)), parent(sorted(named)[-1]).strip('/') or '/'))
    return max(named or names, key=lambda topic: types[topic][1])


def _absolute(topic):
    """Returns the absolute name of a topic, since a bag may have relative names."""
    return '/' + topic.lstrip('/')


def parent(topic):
    """Returns the namespace of a topic, such as `/robot3/` of `/robot3/odom`."""
    return _absolute(topic).rpartition('/')[0] + '/'
