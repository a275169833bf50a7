"""Reads a rosbag into a RunData: any bag with an Imu and an Odometry.

A bag may come from a stranger, and it carries the definitions of its messages. rosbag makes Python
code of these definitions and runs it. Here only installed message classes are used; other topics
are not read.
"""
import genmsg
import genpy.dynamic
import rosbag
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu, Joy
from std_msgs.msg import Bool, Empty, Float32, Float64, String
from tf2_msgs.msg import TFMessage

from tb3_labs.msg import MouseController
from tb3_labs.report.messages import make_collectors, samples_of
from tb3_labs.report.run_data import RunData

#: RunData's field: (name of the topic, class), besides the IMU and the odometry.
OPTIONAL = {
    'commands': ('cmd_vel', Twist), 'local_pose': ('local_pose', PoseStamped),
    'ground_truth': ('ground_truth', PoseStamped), 'goals': ('current_goal', PoseStamped),
    'states': ('goal_state', String), 'resets': ('initialpose', PoseWithCovarianceStamped),
    'asked': ('turn', Float64), 'control': ('ctrl_relinq', Bool), 'presses': ('joy', Joy)}
#: (type, checksum) -> class of all topics of record.launch.
CLASSES = {(made._type, made._md5sum): made for made in (
    Imu, Odometry, TFMessage, Log, DiagnosticArray, Empty, Float32, MouseController,
    *(made for _, made in OPTIONAL.values()))}
#: Topics by which a person drives, of any type.
DEVICES = 'joy', 'mouse_info'
#: A bag begins with this.
BAG_VERSION = b'#ROSBAG V2'
#: A line names at most this many topics that are not read.
NAMED_TOPICS = 5


def _installed(kind, definition):
    """Called by rosbag in place of the function that makes code of a definition in the bag."""
    for (known, _), made in CLASSES.items():
        if known == kind:
            return {kind: made}
    raise genmsg.MsgGenerationException('not an installed type')


genpy.dynamic.generate_dynamic = _installed


class BagProblem(ValueError):
    """A bag cannot be reported. The message is one line with the reason and the remedy."""


def read_run(path, namespace=None, tell=lambda line: None):
    """Returns the RunData of the bag file `path`; `namespace` chooses one robot of several.

    ``tell(line)`` is told which topics are not read. Raises BagProblem.
    """
    try:
        return _read(path, namespace, tell)
    except BagProblem:
        raise
    except FileNotFoundError:
        raise BagProblem('{}: there is no such file'.format(path)) from None
    except rosbag.ROSBagUnindexedException:
        raise BagProblem('{0}: the recording was cut off and has no index; mend it with: '
                         'rosbag reindex {0}'.format(path)) from None
    except rosbag.ROSBagException as problem:
        raise BagProblem('{0}: not a whole bag file ({1}); if it was cut off, try: rosbag reindex '
                         '{0}'.format(path, _one_line(problem))) from None
    except Exception as problem:        # a stranger's bytes may be anything
        raise BagProblem('{}: cannot be read ({}); is it a bag, and a whole one?'.format(
            path, _one_line(problem))) from None


def _is_installed(topic, kind, checksum, *header):
    return (kind, checksum) in CLASSES


def _sorted_out(bag):
    """Returns ({topic: its installed class}, {topic: names of its senders}, ['topic (type)', ...]
    of all others)."""
    classes, senders, others = {}, {}, []

    def sort(topic, kind, checksum, definition, header):
        if _is_installed(topic, kind, checksum):
            classes[topic] = CLASSES[kind, checksum]
            senders.setdefault(topic, set()).update(
                [header['callerid'].decode(errors='replace')] if 'callerid' in header else [])
        else:
            others.append('{} ({})'.format(topic, kind))
    list(bag.read_messages(connection_filter=sort))     # reads no message
    return classes, senders, sorted(set(others))


def _one_line(problem):
    return ' '.join(str(getattr(problem, 'strerror', None) or problem).split())


def _read(path, namespace, tell):
    with open(str(path), 'rb') as file:
        if file.read(len(BAG_VERSION)) != BAG_VERSION:     # to reindex an older one runs its code
            raise BagProblem('{}: not a bag of version 2'.format(path))
    with rosbag.Bag(str(path)) as bag:
        classes, senders, others = _sorted_out(bag)
        if others:
            tell('{}: not read, since these types are not installed here, or not as they are in '
                 'the bag: {}'.format(path, ', '.join(others[:NAMED_TOPICS] + ['{} more'.format(
                     len(others) - NAMED_TOPICS)] * (len(others) > NAMED_TOPICS))))
        infos = bag.get_type_and_topic_info().topics
        types = {topic: (classes.get(topic), info.message_count)
                 for topic, info in infos.items() if info.message_count}
        topics = choose_topics(types, namespace)
        start, prefix = bag.get_start_time(), parent(topics['odometry'])
        collectors = make_collectors(topics, prefix)
        of_topic = {topic: collectors[part] for part, topic in topics.items()}
        for topic, message, arrival in bag.read_messages(
                list(of_topic), connection_filter=_is_installed):
            of_topic[topic].add(message, arrival.to_sec() - start, start)
        duration = bag.get_end_time() - start
    for part in ('imu', 'odometry'):
        if not len(collectors[part].arrival):
            raise BagProblem('{}: not one good message on {} (bad quaternions?)'.format(
                path, topics[part]))
    absolute = {_absolute(topic) for topic in types}
    return RunData(str(path), start, duration, topics=topics,
                   senders=tuple(sorted(senders.get(topics.get('commands'), ()))),
                   devices=tuple(name for name in DEVICES if prefix + name in absolute),
                   dropped={part: collector.bad for part, collector in collectors.items()},
                   **samples_of(collectors))


def choose_topics(types, namespace):
    """Returns {field of RunData: topic} of the robot in `namespace`; None: of the only robot.

    `types` is {topic: (class or None, number of messages)}. Raises BagProblem.
    """
    prefix = None if namespace is None else '/{}/'.format(namespace.strip('/')).replace('//', '/')
    topics = {'imu': _by_type(types, Imu, 'imu', prefix),
              'odometry': _by_type(types, Odometry, 'odom', prefix)}
    prefix = prefix or parent(topics['odometry'])
    for part, (name, kind) in OPTIONAL.items():
        topic = next((topic for topic, (of, _) in types.items()
                      if of == kind and _absolute(topic) == prefix + name), None)
        if topic:
            topics[part] = topic
    if types.get('/tf', ('',))[0] is TFMessage:
        topics['frames'] = '/tf'
    if types.get('/rosout', ('',))[0] is Log:
        topics['log'] = '/rosout'
        topics.pop('resets', None)        # the answer to a reset says more than the request
    return topics


def _by_type(types, kind, ending, prefix):
    """Returns a topic of type `kind` in `prefix`: named `ending`, else with the most messages."""
    names = [topic for topic, (of, _) in types.items() if of is kind
             and (prefix is None or _absolute(topic).startswith(prefix))]
    if not names:
        raise BagProblem('no {} was recorded{}; the bag has: {}'.format(
            kind._type, ' in ' + prefix if prefix else '',
            ', '.join(sorted(types)) or 'no messages at all'))
    named = [topic for topic in names if topic.rsplit('/', 1)[-1] == ending]
    exact = [topic for topic in named if prefix and _absolute(topic) == prefix + ending]
    if exact:
        return exact[0]
    if len({parent(topic) for topic in named}) > 1:
        raise BagProblem('several robots were recorded ({}): choose one, such as --ns {}'.format(
            ', '.join(sorted(named)), parent(sorted(named)[-1]).strip('/') or '/'))
    return max(named or names, key=lambda topic: types[topic][1])


def _absolute(topic):
    """Returns the absolute name: `rosbag record` keeps relative names as they were given."""
    return '/' + topic.lstrip('/')


def parent(topic):
    """The namespace of a topic: `/robot3/` of `/robot3/odom`."""
    return _absolute(topic).rpartition('/')[0] + '/'
