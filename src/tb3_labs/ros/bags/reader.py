"""rosbag -> RunData, for any bag with an Imu and an Odometry."""
import struct

import numpy as np
import rosbag

from tb3_labs.report.run_data import RunData, SenderClock
from tb3_labs.ros.bags.collectors import make_collectors
from tb3_labs.ros.bags.rosbag_internals import BagByChunks
from tb3_labs.ros.bags.topics import BagProblem, choose_topics, devices, parent


def read_run(path, namespace=None, progress=lambda fraction: None):
    """The RunData of the bag file `path`.

    `namespace` chooses a robot where there are several; `progress` is called with the share that
    has been read, 0 to 1. Raises BagProblem.
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
    return _arrange(recording, collectors)


def _one_line(problem):
    return ' '.join(str(getattr(problem, 'strerror', None) or problem).split())


def _gather(path, namespace, progress):
    """({RunData's field: value} of the bag itself, {RunData's field: collector})."""
    with BagByChunks(str(path)) as bag:
        types = {topic: (info.msg_type, info.message_count) for topic, info
                 in bag.get_type_and_topic_info().topics.items() if info.message_count}
        topics = choose_topics(types, namespace)
        start, total = bag.get_start_time(), sum(types[topic][1] for topic in topics.values())
        prefix = parent(topics['odometry'])
        collectors = make_collectors(
            {part: types[topic][0] for part, topic in topics.items()}, prefix)
        add = {topic: collectors[part].add for part, topic in topics.items()}
        step = max(1, total // 200)
        for number, (topic, message, arrival) in enumerate(
                bag.read_messages(list(add), raw=True)):
            add[topic](message[1], arrival.to_sec() - start, start)
            if number % step == 0:
                progress(number / total)
        progress(1.0)
        return dict(name=str(path), start=start, duration=bag.get_end_time() - start,
                    topics=topics, devices=devices(types, prefix)), collectors


def _arrange(recording, collectors):
    """The RunData of all that was gathered."""
    odometry = collectors['odometry']
    clock = SenderClock.of(np.array(odometry.arrival), np.array(odometry.stamp)) if (
        len(odometry.stamp)) else None
    samples = {part: collector.samples(clock) for part, collector in collectors.items()}
    for part in ('imu', 'odometry'):
        if not len(samples[part]):
            raise BagProblem('{}: not one good message on {} (bad quaternions?)'.format(
                recording['name'], recording['topics'][part]))
    dropped = {part: collector.bad for part, collector in collectors.items()}
    return RunData(dropped=dropped, **recording, **samples)
