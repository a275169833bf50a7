"""Reads a rosbag into a RunData: any bag with an Imu and an Odometry."""
import struct

import rosbag

from tb3_labs.report.messages import make_collectors, samples_of
from tb3_labs.report.run_data import RunData

IMU, ODOMETRY = 'sensor_msgs/Imu', 'nav_msgs/Odometry'
POSE, TWIST = 'geometry_msgs/PoseStamped', 'geometry_msgs/Twist'
STRING, TF, LOG = 'std_msgs/String', 'tf2_msgs/TFMessage', 'rosgraph_msgs/Log'
POSE_ESTIMATE = 'geometry_msgs/PoseWithCovarianceStamped'
#: RunData's field: (name of the topic, type), besides the IMU and the odometry.
OPTIONAL = {
    'commands': ('cmd_vel', TWIST), 'local_pose': ('local_pose', POSE),
    'ground_truth': ('ground_truth', POSE), 'goals': ('current_goal', POSE),
    'states': ('goal_state', STRING), 'resets': ('initialpose', POSE_ESTIMATE),
    'asked': ('turn', 'std_msgs/Float64'), 'control': ('ctrl_relinq', 'std_msgs/Bool'),
    'presses': ('joy', 'sensor_msgs/Joy')}
#: Topics by which a person drives, of any type.
DEVICES = 'joy', 'mouse_info'


class BagProblem(ValueError):
    """A bag cannot be reported. The message is one line with the reason and the remedy."""


def read_run(path, namespace=None):
    """Returns the RunData of the bag file `path`; `namespace` chooses one robot of several.

    Raises BagProblem.
    """
    try:
        return _read(path, namespace)
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
    except (OSError, EOFError, ValueError, KeyError, struct.error) as problem:
        raise BagProblem('{}: cannot be read ({}); is it a bag, and a whole one?'.format(
            path, _one_line(problem))) from None


def _one_line(problem):
    return ' '.join(str(getattr(problem, 'strerror', None) or problem).split())


def _read(path, namespace):
    with rosbag.Bag(str(path)) as bag:
        types = {topic: (info.msg_type, info.message_count) for topic, info
                 in bag.get_type_and_topic_info().topics.items() if info.message_count}
        topics = choose_topics(types, namespace)
        start, prefix = bag.get_start_time(), parent(topics['odometry'])
        collectors = make_collectors(topics, prefix)
        of_topic = {topic: collectors[part] for part, topic in topics.items()}
        for topic, message, arrival in bag.read_messages(list(of_topic)):
            of_topic[topic].add(message, arrival.to_sec() - start, start)
        duration = bag.get_end_time() - start
    for part in ('imu', 'odometry'):
        if not len(collectors[part].arrival):
            raise BagProblem('{}: not one good message on {} (bad quaternions?)'.format(
                path, topics[part]))
    absolute = {_absolute(topic) for topic in types}
    return RunData(str(path), start, duration, topics=topics,
                   devices=tuple(name for name in DEVICES if prefix + name in absolute),
                   dropped={part: collector.bad for part, collector in collectors.items()},
                   **samples_of(collectors))


def choose_topics(types, namespace):
    """Returns {field of RunData: topic} of the robot in `namespace`; None: of the only robot.

    `types` is {topic: (type, number of messages)}. Raises BagProblem.
    """
    prefix = None if namespace is None else '/{}/'.format(namespace.strip('/')).replace('//', '/')
    topics = {'imu': _by_type(types, IMU, 'imu', prefix),
              'odometry': _by_type(types, ODOMETRY, 'odom', prefix)}
    prefix = prefix or parent(topics['odometry'])
    for part, (name, kind) in OPTIONAL.items():
        topic = next((topic for topic, (of, _) in types.items()
                      if of == kind and _absolute(topic) == prefix + name), None)
        if topic:
            topics[part] = topic
    if types.get('/tf', ('',))[0] == TF:
        topics['frames'] = '/tf'
    if types.get('/rosout', ('',))[0] == LOG:
        topics['log'] = '/rosout'
        topics.pop('resets', None)        # the answer to a reset says more than the request
    return topics


def _by_type(types, kind, ending, prefix):
    """Returns a topic of type `kind` in `prefix`: named `ending`, else with the most messages."""
    names = [topic for topic, (of, _) in types.items() if of == kind
             and (prefix is None or _absolute(topic).startswith(prefix))]
    if not names:
        raise BagProblem('no {} was recorded{}; the bag has: {}'.format(
            kind, ' in ' + prefix if prefix else '',
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
