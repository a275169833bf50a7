"""Reads a rosbag into a RunData. The bag must have a topic of type Imu and one of type Odometry.

The library rosbag makes Python code of the definitions of messages in a bag, and runs this code.
But a bag may come from a stranger. So this reader uses only the installed message classes, and does
not read topics of other types.
"""
import math
import struct
from collections import Counter
from functools import lru_cache

import genpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu, Joy
from std_msgs.msg import Bool, Empty, Float32, Float64, String
from tf2_msgs.msg import TFMessage

from tb3_labs.msg import MouseController
from tb3_labs.report.bag.messages import make_collectors, samples_of
from tb3_labs.report.bag.records import Bag, BagProblem, ReadLimits, TooLarge, open_bag
from tb3_labs.report.run_data import RunData

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
#: The first reading keeps the records for the second reading if their size is below this [bytes].
MAX_KEPT_BYTES = 2 ** 26
#: A record takes this memory in addition to its data [bytes].
RECORD_OVERHEAD = 500
#: The recorder's clock was set back if a message of a topic arrived by more than this before the
#: previous message [s]. A busy recorder may exchange two messages that are nearer to each other.
MIN_SET_BACK = 0.2
#: If all topics are silent for longer than this [s], the clock was set forward, or the computer
#: slept. A smaller jump of the clock looks like a silence of all topics.
MAX_OUTAGE = 3600.0
#: The problem of a recording whose clock jumped. The recording is read until the jump, since all
#: times after the jump are wrong.
CLOCK_JUMPED = "the recording computer's clock was set, or the computer slept"
#: The topics by which a person drives. They may have any type.
DEVICE_TOPICS = 'joy', 'mouse_info'
#: If topics are not read, at most this many of them are named.
NAMED_TOPICS = 5


def read_run(path, namespace=None, log=lambda line: None):
    """Returns the RunData of the bag file `path`, or raises BagProblem.

    If several robots were recorded, only the robot in `namespace` is read. ``log(line)`` is called
    with each line about parts of the bag that are not read.
    """
    try:
        with open_bag(path) as file:
            return _read(Bag(file, path), path, namespace, log)
    except BagProblem as problem:
        raise BagProblem(f'{path}: {problem}') from None
    except FileNotFoundError:
        raise BagProblem(f'{path}: there is no such file') from None
    except Exception as problem:        # a stranger's bytes may be anything
        raise BagProblem('{}: cannot be read ({}); is it a bag, and a whole one?'.format(
            path, ' '.join(str(getattr(problem, 'strerror', None) or problem).split()))) from None


def _contents(bag):
    """Returns (types, senders, unknown, records). `types` is {topic: (installed class or None,
    number of messages)}. `senders` is {topic: names}. `unknown` has the topic and type of each
    topic that cannot be read. `records` is None if the records are too large to keep."""
    numbers, records = Counter(), []
    size = 0
    for record in bag.messages(_class_of, ReadLimits()):
        numbers[record.connection] += 1
        size += RECORD_OVERHEAD + len(record.data)
        if size < MAX_KEPT_BYTES:
            records.append(record)
    types, senders, unknown = {}, {}, set()
    for connection, number in numbers.items():
        topic, made = connection.topic, _class_of(connection)
        known, count = types.get(topic, (None, 0))
        types[topic] = known or made, count + number
        if made is None:
            unknown.add(f'{topic} ({connection.kind})')
        else:
            senders.setdefault(topic, set()).add(connection.sender)
    is_whole = size < MAX_KEPT_BYTES and not bag.problem
    return types, senders, sorted(unknown), records if is_whole else None


def _class_of(connection):
    """Returns the installed class of the connection's messages, or None."""
    return CLASSES.get((connection.kind, connection.checksum))


def _read(bag, path, namespace, log):
    types, senders, unknown, records = _contents(bag)
    try:
        topics = choose_topics(types, namespace)
    except BagProblem as problem:
        raise _missing(problem, bag.problem, types) from None
    if unknown:
        more = len(unknown) - NAMED_TOPICS
        log('{}: not read, since these types are not installed here, or not as they are in the '
            'bag: {}{}'.format(path, ', '.join(unknown[:NAMED_TOPICS]),
                               f', {more} more' if more > 0 else ''))
    prefix = parent(topics['odometry'])
    limits = ReadLimits()
    collectors = make_collectors([*topics, 'sender_index'], prefix, limits)
    names = {name: k for k, name in enumerate(sorted(senders.get(topics.get('commands'), ())))}
    of_topic = {topic: (collectors[part], types[topic][0]) for part, topic in topics.items()}
    if records is None:
        records = bag.messages(
            lambda connection: connection.topic in of_topic and _class_of(connection), limits)
    start, problem = _collect(records, of_topic, collectors['sender_index'], names)
    problem = problem or bag.problem
    for collector in collectors.values():
        collector.close()
    for part in ('imu', 'odometry'):
        if not len(collectors[part].arrival):
            raise _missing(f'not one good message on {topics[part]} (bad quaternions?)',
                           problem, types)
    arrivals = [collector.arrival for collector in collectors.values()]
    duration = max(float(times.max()) for times in arrivals if len(times))
    notes = [f'{problem}: the report ends at {duration:.1f} s'] if problem else []
    for part, topic in topics.items():
        if collectors[part].is_full:
            number = len(collectors[part].arrival)
            notes.append(f'{topic} has more than {number} messages: the later ones are left out')
    for note in notes:
        log(f'{path}: {note}')
    absolute = {_absolute(topic) for topic in types}
    devices = tuple(name for name in DEVICE_TOPICS if prefix + name in absolute)
    dropped = {part: collector.bad for part, collector in collectors.items()}
    return RunData(str(path), start, duration, topics=topics, notes=tuple(notes), devices=devices,
                   senders=tuple(names), dropped=dropped, **samples_of(collectors))


def _missing(message, problem, types):
    """Returns the BagProblem with this message. `problem` is the reason why the bag was not read to
    its end, or ''. `types` has the topics that were read."""
    if not problem:
        return BagProblem(message)
    if not types:
        return BagProblem(f'was not read: {problem}')
    return BagProblem(f'was not read to its end: {problem}; until there: {message}')


def _collect(records, of_topic, sender_index, names):
    """Fill the collectors of `of_topic`, {topic: (Collector, class)}, from the records. Fill the
    Collector `sender_index` with the index of each command's sender. `names` is {sender: index}.
    Returns (time of the first message [s since 1970], the problem that ended the reading or '')."""
    # the records of a topic are read one after the other into the same message object
    messages = {topic: made() for topic, (_, made) in of_topic.items()}
    is_wanted = lru_cache(maxsize=None)(lambda connection: connection.topic in of_topic and (
        of_topic[connection.topic][1] is _class_of(connection)))
    start = None
    last = math.inf
    last_of_topic = {}      # {topic: arrival of its last message}
    try:
        for connection, (seconds, nanoseconds), data in records:
            if start is None:
                start = seconds + 1e-9 * nanoseconds
            if not is_wanted(connection):
                continue
            topic = connection.topic
            (collector, made), message = of_topic[topic], messages[topic]
            try:
                message.deserialize(data)
            except (genpy.DeserializationError, struct.error, ValueError):
                collector.bad += 1
                continue
            arrival = (seconds - start) + 1e-9 * nanoseconds
            is_set_back = arrival < last_of_topic.get(topic, arrival) - MIN_SET_BACK
            if is_set_back or arrival > last + MAX_OUTAGE:
                return start, CLOCK_JUMPED
            last = last_of_topic[topic] = arrival
            collector.add(message, arrival, start)
            if made is Twist:
                # a sender whose commands come after the end of the first reading is not in `names`
                sender_index.keep([names.setdefault(connection.sender, len(names))],
                                  arrival, arrival)
    except TooLarge as too_large:
        return start, str(too_large)
    return start, ''


def choose_topics(types, namespace):
    """Returns {field of RunData: topic} of the robot in `namespace`, or of the only robot if
    `namespace` is None. `_contents` returns the `types`. May raise BagProblem."""
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
