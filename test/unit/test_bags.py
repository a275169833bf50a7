"""Bags of any kind are read into the same run, and invalid messages are dropped and counted."""
import math
import tracemalloc

import numpy as np
import pytest
import rospy
from recorded_run import (  # noqa: F401
    BEGIN, BURGER, MISS, MISS_DEG, bag, in_degrees, rosbag, run, sensors, write_bag)
from std_msgs.msg import String

from tb3_labs.report import analysis
from tb3_labs.ros.bags.reader import BagProblem, read_run


def test_topics_that_were_recorded_by_relative_names(tmp_path):
    run = read_run(write_bag(tmp_path / 'relative.bag', namespaces=(None,)))
    first, _ = analysis.drives(run, BURGER)
    assert in_degrees(first.measured) == pytest.approx((MISS, MISS_DEG), abs=1e-6)


@pytest.mark.parametrize('how', [{'chunk_threshold': 10000}, {'compression': 'bz2'}])
def test_a_bag_of_many_chunks_or_compressed_holds_the_same(run, tmp_path, how):
    other = read_run(write_bag(tmp_path / 'other.bag', **how))
    assert other.recorded() == run.recorded()
    for part in run.recorded():
        for name, values in vars(getattr(run, part)).items():
            assert np.array_equal(values, getattr(getattr(other, part), name)), (part, name)


def test_messages_that_are_not_wanted_take_no_memory(tmp_path):
    """rosbag's own index of them would take 250 bytes for each: an hour's recording, 500 MB."""
    path, others = tmp_path / 'noisy.bag', 10000
    with rosbag.Bag(str(path), 'w', chunk_threshold=10000) as bag:
        for number in range(others):
            bag.write('other', String(), rospy.Time.from_sec(BEGIN + 0.001 * number))
        for name, message in sensors(0.0, 0):
            bag.write(name, message, rospy.Time.from_sec(BEGIN + 10.0))
    tracemalloc.start()
    read_run(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100 * others


def test_one_robot_of_several(tmp_path):
    path = write_bag(tmp_path / 'two.bag', ('/robot3', '/robot4'), (sensors,))
    with pytest.raises(BagProblem, match='--ns robot'):
        read_run(path)
    assert read_run(path, 'robot3').topics == {'imu': '/robot3/imu', 'odometry': '/robot3/odom'}
    with pytest.raises(BagProblem, match='robot5'):
        read_run(path, 'robot5')


def test_bad_quaternions_are_dropped_and_counted(tmp_path):
    def spoiled(time, number):
        for name, message in sensors(time, number):
            if name == 'imu' and number in (10, 20):
                message.orientation.z = message.orientation.w = math.nan if number == 10 else 0.0
            yield name, message
    run = read_run(write_bag(tmp_path / 'bad.bag', sources=(spoiled,)))
    assert (run.dropped['imu'], len(run.imu)) == (2, 1120)
