"""Bags of any kind give the same run. The reader drops and counts invalid messages."""
import bz2
import math
import os
import re
import struct
import tracemalloc
from dataclasses import replace
from io import BytesIO
from time import process_time

import numpy as np
import pytest
import rosbag
import rospy
from recorded_run import (  # noqa: F401
    BEGIN, DELAY, MISS, MISS_DEG, in_degrees, known_run, run, sensors, write_bag)
from geometry_msgs.msg import Twist, Vector3
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Imu, JointState, Joy, LaserScan
from std_msgs.msg import Bool, Empty, Float32, Float64, Header, String

from tb3_labs.msg import MouseController
from tb3_labs.recording import bag_reader
from tb3_labs.recording.bag_reader import CLOCK_JUMPED, BagProblem
from tb3_labs.recording.ros_bag import read_run

DROPPED = 'invalid messages of /{} that were dropped: 1'


def test_one_robot_of_several(tmp_path):
    path = write_bag(tmp_path / 'two.bag', namespaces=('/robot3', '/robot4'), sources=(sensors,))
    with pytest.raises(BagProblem, match='--ns robot'):
        read_run(path)
    assert len(read_run(path, 'robot3').odometry) == 241
    with pytest.raises(BagProblem, match='robot5'):
        read_run(path, 'robot5')


def events(run):
    """(time, topic, message) of people and nodes at three moments."""
    line = Log(name='/move_to_goal', msg='Local pose set to x=1.00, y=0.50, yaw=1.57')
    line.header.stamp = rospy.Time.from_sec(BEGIN + 1.0)
    yield 1.0, '/rosout', line
    yield 1.0, '/rosout', Log(name='/move_to_goal', msg='Goal reached!')
    yield 2.0, 'turn', Float64(-90.0)
    yield 2.0, 'turn', Float64(math.nan)
    yield 3.0, 'ctrl_relinq', Bool(True)
    yield 3.0, 'joy', Joy(axes=[0.0], buttons=[0, 0, 1])
    yield 3.5, 'reset', Empty()


def test_resets_turns_and_control_that_were_recorded(tmp_path):
    run = read_run(write_bag(tmp_path / 'events.bag', sources=(sensors, events)))
    assert run.resets.time == pytest.approx([1.0], abs=5e-3)
    assert (list(run.turn_requests.time), run.notes) == ([pytest.approx(2.0, abs=5e-3)], (DROPPED.format('turn'),))
    assert math.degrees(run.turn_requests.value[0]) == pytest.approx(-90.0)
    assert list(run.control.value) == [1.0] and run.devices == ('joy',)
    assert run.board_resets.time == pytest.approx([3.5], abs=5e-3)


def devices(run):
    """A mouse, and a command in fields that no wheel follows."""
    yield 3.5, 'mouse_info', MouseController(Header(stamp=rospy.Time.from_sec(BEGIN + 3.5)), Bool(True), -1.0, 0.5)
    yield 4.0, 'cmd_vel', Twist(Vector3(0.1, 0.2, 0.3), Vector3(0.4, 0.5, 0.6))
    yield 4.5, 'cmd_vel', Twist(Vector3(0.1, math.nan, 0.0), Vector3(0.0, 0.0, 0.6))
    yield 5.0, 'cmd_vel', Twist(Vector3(math.nan, 0.0, 0.0), Vector3(0.0, 0.0, 0.6))


def test_the_mouse_and_all_fields_of_a_command(tmp_path):
    run = read_run(write_bag(tmp_path / 'devices.bag', sources=(sensors, devices)))
    assert (run.mouse.x[0], run.mouse.y[0], run.mouse.active[0]) == (-1.0, 0.5, 1.0)
    sent = run.commands
    assert [part[0] for part in (sent.linear, sent.sideways, sent.upward, sent.rolling, sent.pitching,
                                 sent.angular)] == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    # a command with a speed that no wheel follows is kept
    assert list(sent.linear) == [0.1, 0.1] and sent.sideways[1] > 1e3
    assert run.notes == (DROPPED.format('cmd_vel'),) and len(sent.between(4.2, 9.0)) == 1


@pytest.mark.parametrize('options, declared', [({}, [(1.0, 0.5, 1.57)]), ({'namespaces': ('/robot3',)}, [])])
def test_a_reset_is_a_line_of_the_robots_own_log(options, declared, tmp_path):
    resets = read_run(write_bag(tmp_path / 'run.bag', sources=(sensors, events), **options)).resets
    assert [*zip(resets.x, resets.y, resets.yaw)] == [pytest.approx(pose) for pose in declared]


@pytest.mark.parametrize('topic, kind, checksum, left_out', [
    ('/turn', 'evil/Evil', 'f' * 32, '/turn (evil/Evil)'),
    ('/turn', Float64._type, 'e' * 32, '/turn (std_msgs/Float64)'),
    ('/turn', Float64._type, Float64._md5sum, '')])
def test_a_definition_in_a_bag_is_never_run(tmp_path, topic, kind, checksum, left_out):
    """rosbag pastes the names of constants into Python code."""
    path, data = write_bag(tmp_path / 'evil.bag', sources=(sensors,)), BytesIO()
    Float64(90.0).serialize(data)
    with rosbag.Bag(str(path), 'a') as bag:
        bag.write(topic, (kind, data.getvalue(), checksum, Float64), rospy.Time(BEGIN + 3), raw=True,
                  connection_header={'topic': topic, 'type': kind, 'md5sum': checksum,
                                     'message_definition': 'float64 data\nuint8 open({!r},"w").x=1'
                                     .format(str(tmp_path / 'harm'))})
    run = read_run(path)
    assert len(run.imu) > 100 and [math.degrees(turn) for turn in run.turn_requests.value] == (
        [] if left_out else [90.0])
    assert sorted(os.listdir(str(tmp_path))) == ['evil.bag']
    assert left_out in ' '.join(run.notes) and len(run.notes) == bool(left_out)


def test_only_topics_that_the_report_reads_are_named_as_unread(tmp_path):
    """The robot has a laser scanner, and another IMU. Somebody sends a text on turn."""
    def others(run):
        for topic, message in (('scan', LaserScan()), ('joint_states', JointState()), ('heading', Float32()),
                               ('turn', String('left')), ('imu', String('broken'))):
            yield 2.0, topic, message

    def sensors_elsewhere(run):
        return ((time, topic.replace('imu', 'imu_raw'), message) for time, topic, message in sensors(run))
    read = read_run(write_bag(tmp_path / 'scan.bag', sources=(sensors_elsewhere, others)))
    note, = read.notes
    assert re.findall(r'/\w+ \([^)]*\)', note) == ['/imu (std_msgs/String)', '/turn (std_msgs/String)']


def set_at(moment, by):
    return lambda time: time + (by if time > BEGIN + moment else 0.0)


def on_the_recorders_clock(clock):
    """The robot's messages if both share one clock."""
    def stamped(run):
        for time, topic, message in sensors(run):
            message.header.stamp = rospy.Time.from_sec(clock(BEGIN + time))
            yield time, topic, message
    return stamped


@pytest.mark.parametrize('is_shared', [True, False])
@pytest.mark.parametrize('by', [-0.3, -5.0, -86400.0 * 1096, 3700.0, 86400.0])
def test_a_recording_is_read_until_its_clock_is_set(by, is_shared, run, tmp_path):
    clock = set_at(4.0, by)
    source = on_the_recorders_clock(clock) if is_shared else sensors
    read = read_run(write_bag(tmp_path / 'set.bag', sources=(source, events), clock=clock))
    assert read.duration == pytest.approx(4.0, abs=0.05)
    assert read.notes[-1] == CLOCK_JUMPED + ': the report ends at 4.0 s'
    for part in 'imu', 'odometry':
        samples = getattr(read, part)
        time = getattr(run, part).time[:len(samples)]
        assert time[-1] == pytest.approx(4.0, abs=0.05)
        assert samples.time == pytest.approx(time, abs=0.02) and samples.arrival == pytest.approx(time, abs=0.02)
    assert read.control.time == pytest.approx([3.0], abs=0.02)


def test_a_clock_that_is_set_forward_by_less_than_an_hour_looks_like_a_silence(run, tmp_path):
    read = read_run(write_bag(tmp_path / 'set.bag', sources=(sensors,), clock=set_at(4.0, 20.0)))
    assert read.notes == () and read.duration == pytest.approx(32.0, abs=0.05)
    time = run.odometry.time
    assert read.odometry.time == pytest.approx(np.where(time > 3.995, time + 20.0, time), abs=0.02)


def test_a_topic_behind_another_in_the_file_is_not_a_clock_that_was_set(run, tmp_path):
    with rosbag.Bag(str(tmp_path / 'sorted.bag'), 'w') as bag:
        for time, topic, message in sensors(run):
            bag.write('/' + topic, message, rospy.Time.from_sec(BEGIN + time))
    read = read_run(tmp_path / 'sorted.bag')
    assert read.notes == () and read.odometry.time == pytest.approx(run.odometry.time, abs=0.01)


# Bags of strangers: a reader that believes these small files needs gigabytes, or minutes -----------

def record(data, size=None, **header):
    """The bytes of a record of a bag, which says that its data have `size` bytes."""
    fields = b''.join(struct.pack('<I', len(name) + 1 + len(value)) + name.encode() + b'=' + value
                      for name, value in header.items())
    return b''.join([struct.pack('<I', len(fields)), fields,
                     struct.pack('<I', len(data) if size is None else size), data])


def connection(number, topic=b'/x', data=b''):
    return record(data, op=b'\7', topic=topic, conn=struct.pack('<I', number))


def chunk(content, by=b'bz2', size=None):
    return record(bz2.compress(content), size, op=b'\5', compression=by)


def imu_connection():
    names = {'topic': '/imu', 'type': Imu._type, 'md5sum': Imu._md5sum}
    data = b''.join(struct.pack('<I', len(name) + 1 + len(text)) + f'{name}={text}'.encode()
                    for name, text in names.items())
    return connection(0, b'/imu', data)


EMPTY_MESSAGE = record(b'', op=b'\2', conn=bytes(4), time=bytes(8))
SPARSE = 2 * 10 ** 9
DAMAGED = 'the recording was cut off, or is damaged'


@pytest.mark.parametrize('content, said', [
    (chunk(EMPTY_MESSAGE * 9)[:-9], DAMAGED), (chunk(chunk(chunk(bytes(2 ** 20)))), DAMAGED),
    (chunk(b'', b'lz4'), 'its chunks are packed by lz4; unpack it: rosbag decompress'),
    (record(b'BZh9' + bytes(99), op=b'\5', compression=b'bz2'), DAMAGED),
    (struct.pack('<I', 2 ** 32 - 1), DAMAGED), (bytes(2 ** 20), DAMAGED), (record(b'', op=b'\7'), DAMAGED),
    (record(b'', op=b'\2', conn=b'none'), DAMAGED), (record(b'', 2 ** 32 - 1, op=b'\4'), DAMAGED),
    (record(b'', SPARSE, op=b'\5', compression=b'bz2') + bytes(99), DAMAGED),
    (record(b'', SPARSE, op=b'\7', topic=b'/x', conn=bytes(4)) + bytes(99), DAMAGED),
    (imu_connection() + record(b'', SPARSE, op=b'\2', conn=bytes(4), time=bytes(8)), 'no nav_msgs/Odometry'),
    (chunk(bytes(2 ** 26 + 1)), 'it takes more than 2e+06 bytes'),
    (chunk(b''.join(map(connection, range(999)))), 'it takes more than 2e+06 bytes'),
    (chunk(imu_connection() + EMPTY_MESSAGE * 5000), 'it takes more than 2e+06 bytes'),
    (chunk(record(bytes(2 ** 18), op=b'\4')) * 20, 'it takes more than 2e+06 bytes')])
def test_a_small_file_takes_neither_memory_nor_time(content, said, tmp_path, monkeypatch):
    monkeypatch.setattr(bag_reader, 'MAX_MEMORY_BYTES', 2e6)
    path = tmp_path / 'run.bag'
    with open(path, 'wb') as file:
        file.write(bag_reader.BAG_VERSION + content)
        if len(content) < 500:
            file.truncate(SPARSE + 500)      # the file is as long as it claims
    tracemalloc.start()
    begun = process_time()
    with pytest.raises(BagProblem, match=re.escape(said)) as raised:
        read_run(path)
    took, peak = process_time() - begun, tracemalloc.get_traced_memory()[1] / 2 ** 20
    tracemalloc.stop()
    assert '\n' not in str(raised.value) and peak < 200.0 and took < 5.0


@pytest.mark.parametrize('options', [{}, {'compression': 'bz2', 'chunk_threshold': 10000}])
def test_a_recording_is_read_until_it_takes_too_much_memory(options, tmp_path, monkeypatch):
    path = tmp_path / 'run.bag'
    with rosbag.Bag(str(path), 'w', **options) as bag:
        for time, topic, message in sorted(sensors(known_run()), key=lambda row: row[0]):
            bag.write('/' + topic, message, rospy.Time.from_sec(BEGIN + time))
    run = read_run(path)
    assert run.duration == pytest.approx(12.0) and not run.notes
    monkeypatch.setattr(bag_reader, 'MAX_MEMORY_BYTES', 5e5)
    run = read_run(path)
    assert 0.5 < run.duration < 9.0
    assert run.notes == (f'it takes more than 5e+05 bytes of memory: the report ends at {run.duration:.1f} s',)


def test_a_message_that_is_too_large_is_dropped(tmp_path):
    line = Log(name='/x', msg='y' * 300000)
    run = read_run(write_bag(tmp_path / 'run.bag', sources=(sensors, lambda run: [(5.0, '/rosout', line)])))
    assert (len(run.log), run.notes) == (0, (DROPPED.format('rosout'),))


@pytest.mark.parametrize('topic, part, column, value', [
    ('imu', 'imu', 'yaw', math.nan), ('odom', 'odometry', 'x', math.inf), ('odom', 'odometry', 'x', -2e5)])
def test_a_number_that_no_robot_has_is_dropped_with_its_message(topic, part, column, value, run, tmp_path):
    table = getattr(run, part)
    numbers = np.where(np.arange(len(table)) == 10, value, getattr(table, column))
    read = read_run(write_bag(tmp_path / 'bad.bag', replace(
        run, **{part: replace(table, **{column: numbers})}), sources=(sensors,)))
    assert (read.notes, len(getattr(read, part))) == ((DROPPED.format(topic),), len(table) - 1)


@pytest.mark.parametrize('part', [0.3, 0.9])
def test_a_recording_that_was_cut_off_is_read_to_the_cut(part, run, tmp_path):
    path = write_bag(tmp_path / 'run.bag', sources=(sensors,))
    path.write_bytes(path.read_bytes()[:int(part * path.stat().st_size)])
    read = read_run(path)
    assert 12.0 * part - 2.0 < read.duration < 12.0 * part + 1.0
    assert read.notes == (f'{DAMAGED}: the report ends at {read.duration:.1f} s',)


@pytest.mark.parametrize('begin, said', [
    (b'', 'the file is empty'), (b'#ROSBAG V1.2\n', 'not a bag of ROS 1, version 2.0'),
    (b'SQLite format 3\0', "rosbags-convert --src '{}' --dst")])
def test_the_message_about_a_file_that_is_not_a_bag_has_a_remedy(begin, said, tmp_path):
    path = tmp_path / 'a $(b)\n.bag'
    path.write_bytes(begin)
    with pytest.raises(BagProblem, match=re.escape(said.format(path))):
        read_run(path)
