"""Reads a bag into a RunData. The bag needs an Imu topic and an Odometry topic.

The library rosbag turns the message definitions in a bag into Python code, and runs this code.
Since a bag may come from a stranger, this module reads only messages whose class is installed.
"""
import posixpath
from dataclasses import replace
from operator import itemgetter

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool, Empty, Float64, String
from tf2_msgs.msg import TFMessage

from tb3_labs.msg import MouseController
from tb3_labs.recording.bag_reader import Bag, BagProblem
from tb3_labs.recording.run_data import RunData
from tb3_labs.recording.samples_from_messages import (
    RecordedClock, resets_in, stamped_samples, times_on_recorder_clock)

#: {field of RunData: (name, class)} of each topic that need not be in a bag.
OPTIONAL_TOPICS = {
    'commands': ('cmd_vel', Twist), 'local_pose': ('local_pose', PoseStamped),
    'ground_truth': ('ground_truth', PoseStamped), 'goals': ('current_goal', PoseStamped),
    'states': ('goal_state', String), 'turn_requests': ('turn', Float64),
    'control': ('ctrl_relinq', Bool), 'mouse': ('mouse_info', MouseController),
    'events': ('trial', String), 'printed': ('printed', String),
    'variables': ('variables', DiagnosticArray), 'frames': ('/tf', TFMessage),
    'board_resets': ('reset', Empty), 'log': ('/rosout', Log)}
#: {(type, checksum): class} for each type of messages that is read.
MESSAGE_CLASSES = {(cls._type, cls._md5sum): cls for cls in (
    Imu, Odometry, *(message_type for _, message_type in OPTIONAL_TOPICS.values()))}
DEVICE_TOPICS = 'joy', 'mouse_info'     # the type of their messages does not matter


def read_run(path, namespace=None):
    """Returns the RunData of the bag file `path`, or raises BagProblem. If several robots were
    recorded, only the robot in `namespace` is read. `RunData.notes` tells what was not read."""
    try:
        return _run_of_bag(Bag(str(path), _class_of), str(path), namespace)
    except BagProblem as error:
        raise BagProblem(f'{path}: {error}') from None
    except Exception as error:      # a stranger's bytes may cause any error
        problem = getattr(error, 'strerror', None) or error
        raise BagProblem(f'{path}: cannot be read ({problem})') from None


def _class_of(connection):
    return MESSAGE_CLASSES.get((connection.message_type, connection.checksum))


def _run_of_bag(bag, path, namespace):
    types = {connection.topic: _class_of(connection) for connection in bag.streams}
    notes = []
    try:
        topics = choose_topics(types, namespace)
        prefix = namespace_of(topics['odometry'])
        samples = _samples_of_topics(bag, topics, types, prefix, notes)
    except BagProblem as error:
        if not bag.problem:
            raise
        raise BagProblem(
            f'was not read to its end: {bag.problem}; until there: {error}') from None

    clock = RecordedClock.of(samples['odometry'].arrival, samples['odometry'].time)
    for field, stamped in samples.items():
        time = times_on_recorder_clock(stamped.arrival, stamped.time, clock)
        samples[field] = replace(stamped, time=time)
    if 'log' in samples:
        samples['resets'] = resets_in(samples['log'])
    duration = max(float(stamped.arrival[-1]) for stamped in samples.values() if len(stamped))
    if bag.problem:
        notes.append(f'{bag.problem}: the report ends at {duration:.1f} s')
    read_types = {posixpath.join(prefix, name): message_type for name, message_type in (
        ('imu', Imu), ('odom', Odometry), *OPTIONAL_TOPICS.values())}
    unread = {f'{connection.topic} ({connection.message_type})' for connection in bag.streams
              if connection.topic in read_types
              and _class_of(connection) is not read_types[connection.topic]}
    if unread:
        notes.append('not read, since the type, or its version, is not the one that is read here: '
                     + ', '.join(sorted(unread)))
    devices = tuple(name for name in DEVICE_TOPICS if prefix + name in types)
    return RunData(path, bag.start, duration, notes=tuple(notes), devices=devices, **samples)


def _samples_of_topics(bag, topics, types, prefix, notes):
    """Returns {field of RunData: samples}. Their `time` is on the sender's clock. Adds a note to
    `notes` for each topic with invalid messages. Raises BagProblem if a sensor has no samples."""
    samples = {}
    for field, topic in topics.items():
        received = _received(bag, topic, types[topic])
        samples[field], dropped_count = stamped_samples(
            field, types[topic](), prefix, bag.start, received)
        if dropped_count:
            notes.append(f'invalid messages of {topic} that were dropped: {dropped_count}')
    for field in ('imu', 'odometry'):
        if not len(samples[field]):
            raise BagProblem(f'not one good message on {topics[field]} (bad quaternions?)')
    return samples


def _received(bag, topic, message_type):
    """Returns (arrival, sender, bytes) of each message of this type on a topic, earliest first."""
    received = [(arrival, connection.sender, message)
                for connection, stream in bag.streams.items()
                if connection.topic == topic and _class_of(connection) is message_type
                for arrival, message in stream]
    return sorted(received, key=itemgetter(0))


def choose_topics(types, namespace):
    """Returns {field of RunData: topic} for the robot in `namespace`. If `namespace` is None, the
    bag must have one robot. `types` is {topic: installed class or None}. May raise BagProblem."""
    prefix = None
    if namespace is not None:
        prefix = f"/{namespace.strip('/')}/".replace('//', '/')
    topics = {'imu': _topic_of_type(types, Imu, 'imu', prefix),
              'odometry': _topic_of_type(types, Odometry, 'odom', prefix)}
    prefix = prefix or namespace_of(topics['odometry'])
    for field, (name, message_type) in OPTIONAL_TOPICS.items():
        topic = posixpath.join(prefix, name)        # join() adds no prefix to /tf and /rosout
        if types.get(topic) is message_type:
            topics[field] = topic
    return topics


def _topic_of_type(types, message_type, name, prefix):
    """Returns the topic of this type in the namespace `prefix`. If several topics have this type,
    returns the topic called `name`. Raises BagProblem if the topic is missing or ambiguous."""
    topics = [topic for topic, installed_type in types.items() if installed_type is message_type
              and (prefix is None or topic.startswith(prefix))]
    if not topics:
        place = f' in {prefix}' if prefix else ''
        recorded = ', '.join(sorted(types)) if types else 'no messages at all'
        raise BagProblem(f'no {message_type._type} was recorded{place}; the bag has: {recorded}')
    if prefix and prefix + name in topics:
        return prefix + name
    named = [topic for topic in topics if posixpath.basename(topic) == name]
    best_topics = sorted(named or topics)
    if len(best_topics) > 1:
        robot = namespace_of(best_topics[-1]).strip('/') or '/'
        raise BagProblem('several topics of {} were recorded ({}): choose a robot, such as --ns {}'
                         .format(message_type._type, ', '.join(best_topics), robot))
    return best_topics[0]


def namespace_of(topic):
    """Returns the namespace of a topic, such as `/robot3/` for `/robot3/odom`."""
    return topic.rpartition('/')[0] + '/'
