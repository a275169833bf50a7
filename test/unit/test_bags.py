"""Bags of any kind are read into the same run, and invalid messages are dropped and counted."""
import math
import os
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import rosbag
import rospy
from recorded_run import (  # noqa: F401
    BEGIN, BURGER, DELAY, MISS, MISS_DEG, in_degrees, run, sensors, write_bag)
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool, Float64

from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report.diagnosis import Diagnosis, diagnose
from tb3_labs.report.drives import drives
from tb3_labs.report.ros_bag import BagProblem, read_run
from tb3_labs.ros.conversions import to_pose_stamped, to_twist


def test_topics_that_were_recorded_by_relative_names(tmp_path):
    run = read_run(write_bag(tmp_path / 'relative.bag', namespaces=(None,)))
    first, _ = drives(run, BURGER)
    assert in_degrees(first.measured) == pytest.approx((MISS, MISS_DEG), abs=1e-6)


def test_one_robot_of_several(tmp_path):
    path = write_bag(tmp_path / 'two.bag', namespaces=('/robot3', '/robot4'), sources=(sensors,))
    with pytest.raises(BagProblem, match='--ns robot'):
        read_run(path)
    assert read_run(path, 'robot3').topics == {'imu': '/robot3/imu', 'odometry': '/robot3/odom'}
    with pytest.raises(BagProblem, match='robot5'):
        read_run(path, 'robot5')


def test_bad_quaternions_are_dropped_and_counted(run, tmp_path):
    yaw = np.where(np.arange(len(run.imu)) == 10, math.nan, run.imu.yaw)
    bad = replace(run, imu=replace(run.imu, yaw=yaw))
    read = read_run(write_bag(tmp_path / 'bad.bag', bad, sources=(sensors,)))
    assert (read.dropped['imu'], len(read.imu)) == (1, len(run.imu) - 1)


def events(run):
    """(time, topic, message) of what people and nodes say at three moments."""
    line = Log(name='/move_to_goal', msg='Local pose set to x=1.00, y=0.50, yaw=1.57')
    line.header.stamp = rospy.Time.from_sec(BEGIN + 1.0)
    yield 1.0, '/rosout', line
    yield 1.0, '/rosout', Log(name='/move_to_goal', msg='Goal reached!')
    yield 2.0, 'turn', Float64(-90.0)
    yield 2.0, 'turn', Float64(math.nan)
    estimate = PoseWithCovarianceStamped()
    estimate.pose.pose = to_pose_stamped(Pose2(3.0, 4.0, 0.5), 'local', 0.0).pose
    yield 2.0, 'initialpose', estimate
    yield 3.0, 'ctrl_relinq', Bool(True)
    for time, buttons in ((3.0, [0, 0, 1]), (3.1, [0, 0, 1]), (3.2, [1, 0, 1])):
        yield time, 'joy', Joy(axes=[0.0], buttons=buttons)


def test_resets_turns_and_control_that_were_recorded(tmp_path):
    run = read_run(write_bag(tmp_path / 'events.bag', sources=(sensors, events)))
    assert run.resets.time == pytest.approx([1.0], abs=5e-3)
    assert run.resets.pose(0) == Pose2(1.0, 0.5, 1.57)
    assert (list(run.asked.time), run.dropped['asked']) == ([pytest.approx(2.0, abs=5e-3)], 1)
    assert math.degrees(run.asked.value[0]) == pytest.approx(-90.0)
    assert list(run.control.value) == [1.0] and run.devices == ('joy',)
    # a button that is held counts once
    assert list(run.presses.value) == [2.0, 0.0]
    assert run.presses.time == pytest.approx([3.0, 3.2], abs=5e-3)


def test_without_rosout_a_pose_estimate_is_a_reset(tmp_path):
    run = read_run(write_bag(tmp_path / 'estimate.bag', sources=(sensors, events),
                             keep=lambda name: name != '/rosout'))
    pose = run.resets.pose(0)
    assert len(run.resets) == 1 and (pose.x, pose.y, pose.yaw) == pytest.approx((3.0, 4.0, 0.5))


def test_a_reset_of_another_robot_is_none(tmp_path):
    run = read_run(write_bag(
        tmp_path / 'other.bag', namespaces=('/robot3',), sources=(sensors, events)))
    assert len(run.resets) == 0 and len(run.asked) == 1


@pytest.mark.parametrize('topic, kind, checksum, left_out', [
    ('/evil', 'evil/Evil', 'f' * 32, '/evil (evil/Evil)'),
    ('/turn', Float64._type, 'e' * 32, '/turn (std_msgs/Float64)'),
    ('/turn', Float64._type, Float64._md5sum, '')])
@pytest.mark.parametrize('listed_as', ['', '/imu'])
def test_a_definition_in_a_bag_is_never_run(tmp_path, topic, kind, checksum, left_out, listed_as):
    """rosbag pastes the names of constants into Python code. A bag may list a message under
    another topic, too."""
    path, told, data = write_bag(tmp_path / 'evil.bag', sources=(sensors,)), [], BytesIO()
    Float64(90.0).serialize(data)
    with rosbag.Bag(str(path), 'a') as bag:
        bag.write(topic, (kind, data.getvalue(), checksum, Float64), rospy.Time(BEGIN + 3), raw=True,
                  connection_header={'topic': topic, 'type': kind, 'md5sum': checksum,
                                     'message_definition': 'float64 data\nuint8 open({!r},"w").x=1'
                                     .format(str(tmp_path / 'harm'))})
        if listed_as == '/imu':
            chunk = bag._curr_chunk_connection_indexes
            wrong, = chunk[bag._topic_connections[topic].id]
            bag._curr_chunk_info.connection_counts[0] = 1
            chunk[0] = [wrong]
            assert bag._connections[0].topic == '/imu'
    try:
        run = read_run(path, tell=told.append)
    except BagProblem as problem:
        assert listed_as and left_out and 'evil.bag' in str(problem)
    else:
        assert len(run.imu) > 100 and [math.degrees(turn) for turn in run.asked.value] == (
            [] if left_out else [90.0] * (2 if listed_as else 1))
    assert sorted(os.listdir(str(tmp_path))) == ['evil.bag']
    assert left_out in ' '.join(told) and len(told) == bool(left_out)


@pytest.mark.parametrize('senders, is_known', [
    (['/rostopic_12_1700000'], False), (['/rostopic_12_1700000', '/controller'], True)])
def test_what_a_person_drove_by_rostopic_is_not_diagnosed(tmp_path, senders, is_known):
    """An endless turn to the left at one rate, then a zero."""
    path = write_bag(tmp_path / 'by_hand.bag', sources=(sensors,))
    with rosbag.Bag(str(path), 'a') as bag:
        for number, sender in enumerate(senders):
            header = {'topic': '/cmd_vel', 'type': Twist._type, 'md5sum': Twist._md5sum,
                      'message_definition': Twist._full_text, 'callerid': sender}
            bag._topic_connections.pop('/cmd_vel', None)    # rosbag record: one for each sender
            for time, rate in ((1.0, 0.5), (1.4, 0.4), (1.8, 0.0)):
                bag.write('/cmd_vel', to_twist(0.0, rate), rospy.Time(BEGIN + time + 3 * number),
                          connection_header=header)
    run = read_run(path)
    assert list(run.senders) == sorted(senders)
    assert (diagnose(run) != Diagnosis('')) is is_known
