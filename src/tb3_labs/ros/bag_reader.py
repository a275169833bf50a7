"""rosbag -> RunData, for any bag with an Imu and an Odometry.

The fields that count are unpacked from the serialized messages: an hour's recording holds a
million of them, and making objects of all would take minutes.
"""
import gc
import struct
from array import array

import numpy as np
import rosbag

from tb3_labs.report.run_data import (
    Commands, ImuSamples, OdometrySamples, Poses, RunData, States, steady_lag,
    times_on_recorders_clock, yaws_of)

IMU, ODOMETRY = 'sensor_msgs/Imu', 'nav_msgs/Odometry'
POSE, TWIST = 'geometry_msgs/PoseStamped', 'geometry_msgs/Twist'
STRING, TF = 'std_msgs/String', 'tf2_msgs/TFMessage'
#: RunData's field: (name of the topic, type), besides the IMU and the odometry.
OPTIONAL = {
    'commands': ('cmd_vel', TWIST), 'local_pose': ('local_pose', POSE),
    'ground_truth': ('ground_truth', POSE), 'goals': ('current_goal', POSE),
    'states': ('goal_state', STRING)}

HEADER = struct.Struct('<4xIII')                # seq, secs, nsecs, length of frame_id
LENGTH = struct.Struct('<I')
ORIENTATION_RATE = struct.Struct('<4d88xd')     # x, y, z, w; covariance; angular_velocity.z
POSE_SPEED = struct.Struct('<2d8x4d288xd')      # x, y; x, y, z, w; covariance; linear.x
PLACE_ORIENTATION = struct.Struct('<2d8x4d')    # x, y; x, y, z, w
SPEEDS = struct.Struct('<d32xd')                # linear.x, angular.z
FRAME_STEP = 1e-6


class BagProblem(Exception):
    """Why no report can be made of a bag, and what to do: one line."""


def read_run(path, namespace=None, progress=lambda fraction: None):
    """The RunData of the bag file `path`.

    `namespace` chooses a robot where there are several; `progress` hears how much has been read,
    0 to 1. Raises BagProblem.
    """
    try:
        recording, collectors = _gather(path, namespace, progress)
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
    gc.collect()    # a closed bag and its index, larger than the data, hold each other in memory
    return _arrange(recording, collectors)


def _one_line(problem):
    return ' '.join(str(getattr(problem, 'strerror', None) or problem).split())


def _types(bag):
    """{topic: (type, number of messages)} of the topics that have messages."""
    return {topic: (info.msg_type, info.message_count)
            for topic, info in bag.get_type_and_topic_info().topics.items() if info.message_count}


def _choose_topics(types, namespace):
    """{RunData's field: topic} of one robot."""
    prefix = None if namespace is None else '/{}/'.format(namespace.strip('/')).replace('//', '/')
    topics = {'imu': _by_type(types, IMU, 'imu', prefix),
              'odometry': _by_type(types, ODOMETRY, 'odom', prefix)}
    prefix = prefix or _parent(topics['odometry'])
    for part, (name, kind) in OPTIONAL.items():
        topic = next((topic for topic, (of, _) in types.items()
                      if of == kind and _absolute(topic) == prefix + name), None)
        if topic:
            topics[part] = topic
    if types.get('/tf', ('',))[0] == TF:
        topics['frames'] = '/tf'
    return topics


def _by_type(types, kind, ending, prefix):
    """The topic of a type: in `prefix`, by preference called `ending`, else the busiest."""
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
    if len({_parent(topic) for topic in named}) > 1:
        raise BagProblem('several robots were recorded ({}): choose one, such as --ns {}'.format(
            ', '.join(sorted(named)), _parent(sorted(named)[-1]).strip('/') or '/'))
    return max(named or names, key=lambda topic: types[topic][1])


def _absolute(topic):
    """`rosbag record` writes relative names down as they were given."""
    return '/' + topic.lstrip('/')


def _parent(topic):
    return _absolute(topic).rpartition('/')[0] + '/'


def _gather(path, namespace, progress):
    """({what RunData wants of the bag itself}, {RunData's field: collector})."""
    with rosbag.Bag(str(path)) as bag:
        topics = _choose_topics(_types(bag), namespace)
        start, total = bag.get_start_time(), bag.get_message_count(list(topics.values()))
        frame = (_parent(topics['odometry']) + 'local').strip('/')
        collectors = {part: _COLLECTORS.get(part, _PoseCollector)() for part in topics}
        if 'frames' in topics:
            collectors['frames'].child = frame.encode()
        add = {topic: collectors[part].add for part, topic in topics.items()}
        step = max(1, total // 200)
        for number, (topic, message, arrival) in enumerate(
                bag.read_messages(list(add), raw=True)):
            add[topic](message[1], arrival.to_sec() - start, start)
            if number % step == 0:
                progress(number / total)
        progress(1.0)
        return dict(name=str(path), start=start, duration=bag.get_end_time() - start,
                    topics=topics), collectors


def _arrange(recording, collectors):
    """The RunData of what was gathered."""
    odometry = collectors['odometry']
    lag = steady_lag(np.array(odometry.arrival), np.array(odometry.stamp))
    samples = {part: collector.samples(lag) for part, collector in collectors.items()}
    for part in ('imu', 'odometry'):
        if not len(samples[part]):
            raise BagProblem('{}: not one good message on {} (bad quaternions?)'.format(
                recording['name'], recording['topics'][part]))
    dropped = {part: collector.bad for part, collector in collectors.items()}
    return RunData(dropped=dropped, **recording, **samples)


class _Collector:
    """Gathers one topic's numbers, row after row."""

    kind, layout, stamped, strings = None, None, True, 1   # strings before the numbers

    def __init__(self):
        self.arrival, self.stamp, self.rows, self.bad = array('d'), array('d'), array('d'), 0

    def add(self, data, arrival, start):
        """Take a serialized message in; times in seconds since `start`."""
        try:
            stamp, offset = arrival, 0
            if self.stamped:
                secs, nsecs, length = HEADER.unpack_from(data)
                stamp, offset = (secs - start) + 1e-9 * nsecs, 16 + length
                for _ in range(self.strings - 1):
                    offset += 4 + LENGTH.unpack_from(data, offset)[0]
            row = self.layout.unpack_from(data, offset)
        except struct.error:
            self.bad += 1
            return
        self.rows.extend(row)
        self.arrival.append(arrival)
        self.stamp.append(stamp)

    def samples(self, robot_lag):
        """What was gathered, the bad left out."""
        arrival, stamp = np.array(self.arrival), np.array(self.stamp)
        width = len(self.layout.unpack(bytes(self.layout.size)))
        columns = self.columns(*np.array(self.rows).reshape(-1, width).T)
        good = np.logical_and.reduce([np.isfinite(column) for column in columns])
        self.bad += int(np.count_nonzero(~good))
        arrival, stamp = arrival[good], stamp[good]
        return self.kind(arrival, times_on_recorders_clock(arrival, stamp, robot_lag),
                         *(column[good] for column in columns))


class _ImuCollector(_Collector):
    kind, layout = ImuSamples, ORIENTATION_RATE

    @staticmethod
    def columns(x, y, z, w, rate):
        return yaws_of(w, x, y, z), rate


class _PoseCollector(_Collector):
    kind, layout = Poses, PLACE_ORIENTATION

    @staticmethod
    def columns(x, y, qx, qy, qz, qw, *more):
        return (x, y, yaws_of(qw, qx, qy, qz)) + more


class _OdometryCollector(_PoseCollector):
    kind, layout, strings = OdometrySamples, POSE_SPEED, 2


class _CommandCollector(_Collector):
    kind, layout, stamped = Commands, SPEEDS, False

    @staticmethod
    def columns(linear, angular):
        return linear, angular


class _StateCollector(_Collector):
    def __init__(self):
        super().__init__()
        self.words = []

    def add(self, data, arrival, start):
        self.words.append(data[4:].decode('utf-8', 'replace'))
        self.arrival.append(arrival)

    def samples(self, robot_lag):
        arrival = np.array(self.arrival)
        return States(arrival, arrival, np.array(self.words, dtype=object))


class _FrameCollector(_PoseCollector):
    """Of all transforms, where ``local`` stands in ``odom``, and of those only the changes."""

    def __init__(self):
        super().__init__()
        self.child, self._last = b'local', None

    def add(self, data, arrival, start):
        offset = 4
        for _ in range(LENGTH.unpack_from(data)[0]):
            begin = offset
            length = LENGTH.unpack_from(data, begin + 12)[0]
            name = begin + 16 + length
            length = LENGTH.unpack_from(data, name)[0]
            numbers = name + 4 + length
            if data[name + 4:numbers].lstrip(b'/') == self.child:
                row = PLACE_ORIENTATION.unpack_from(data, numbers)
                if self._last is None or max(
                        abs(one - other) for one, other in zip(row, self._last)) > FRAME_STEP:
                    secs, nsecs, _ = HEADER.unpack_from(data, begin)
                    self._last = row
                    self.rows.extend(row)
                    self.arrival.append(arrival)
                    self.stamp.append((secs - start) + 1e-9 * nsecs)
            offset = numbers + 56


_COLLECTORS = {'imu': _ImuCollector, 'odometry': _OdometryCollector,
               'commands': _CommandCollector, 'states': _StateCollector,
               'frames': _FrameCollector}
