"""The bag of a trial has what was done and seen. Who records never waits for the disk."""
import errno
import math
import random
import threading
from io import BytesIO

import pytest
import rosbag
from sensor_msgs.msg import Joy
from std_msgs.msg import String

from recorded_trial import BEGIN, true_sensors
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.marking.marks import Marks, marks_after_trial, points_of, read_points
from tb3_labs.marking.trial import ros_recording
from tb3_labs.marking.trial.from_bag import MAX_OUTPUT_LENGTH, read_trial
from tb3_labs.marking.trial.processes import MAX_CHARACTERS_PER_SECOND, NodeOutput
from tb3_labs.marking.trial.ros_recording import CHUNK_BYTES, TrialBag
from tb3_labs.ros.conversions import to_pose_stamped, to_twist


@pytest.fixture
def clock(monkeypatch):
    """The time of ROS [s]. The test sets clock[0]."""
    now = [BEGIN]
    monkeypatch.setattr(ros_recording, 'ros_time', lambda: now[0])
    return now


def robot(bag, at, yaw):
    """Record a robot that is at (1, 2). The IMU's sample is serialized, as a Recorder hands it over."""
    pose, data = Pose2(1.0, 2.0, yaw), BytesIO()
    odometry, imu = true_sensors(at, pose)
    imu.serialize(data)
    bag.add('imu', (imu._type, data.getvalue(), imu._md5sum, type(imu)), at)
    bag.add('odom', odometry, at)
    bag.add('ground_truth', to_pose_stamped(pose, 'world', at), at)


def test_a_trial_is_read_as_it_was_done(tmp_path, clock):
    bag, step = TrialBag(tmp_path / 'trial.bag'), 0.05
    output = NodeOutput(bag)
    bag.add_event('trial', lab='turn', node='lab2/turtlebot_controller.py')
    bag.add_event('start', needed='imu')
    for k in range(41):     # a turn by 200 degrees, across 180
        clock[0] = BEGIN + k * step
        robot(bag, clock[0], math.radians(90.0 + 5.0 * k))
        bag.add('cmd_vel', to_twist(0.1, 1.5), clock[0])
        if k == 3:
            output.add('Input l or r')
            output.flush()
            bag.add_event('ready')
            bag.add_event('run', listens=['/imu'], publishes={'/cmd_vel': 'geometry_msgs/Twist'})
            bag.add_event('begin', name='l')
        if k == 20:
            output.add('l\ndone\n')
            output.flush()
            bag.add_event('end', facts={'moved': True, 'rested': False}, died=False)
            output.add('and this comes after it')
            output.flush()
            bag.add_event('begin', name='r')      # the trial is interrupted in this stimulus
    bag.add_event('odd', text='nan m/s and 0 rad/s')
    bag.add_event('not offered', names=['mouse up'], reason='it does not listen to mouse_info')
    for _ in range(2):
        bag.add_event('remark', text='Once.')
        bag.add_event('finding', text='For the instructor.')
    bag.close()
    seen = read_trial(tmp_path / 'trial.bag')
    assert (seen.lab, seen.file) == ('turn', 'turtlebot_controller.py')
    scene = seen.enter_scene('l')
    assert scene.end - scene.begin == pytest.approx(17 * step, abs=1e-3)
    assert (scene.printed, scene.line_count) == ('l\ndone\n', 2)
    assert scene.facts == {'moved': True, 'rested': False}
    assert scene.turned_deg == pytest.approx(85.0, abs=5.1)     # a step of 5 degrees may be outside
    assert scene.commands[:, 1:].tolist() == [[0.1, 1.5]] * len(scene.commands)
    assert len(scene.commands) in (16, 17, 18)
    whole = seen.truth[-1][3] - seen.truth[0][3]
    assert math.degrees(whole) == pytest.approx(200.0, abs=1e-6)     # continuous
    [run] = seen.processes
    assert run.ready is not None and run.end is None and run.subscribed_topics == ['/imu']
    assert run.printed == 'Input l or rl\ndone\nand this comes after it'
    assert not seen.has_stimulus('r') and seen.not_offered == {
        'mouse up': 'it does not listen to mouse_info'}
    assert (seen.remarks, seen.findings) == (['Once.'], ['For the instructor.'])
    assert [words for _, words in seen.not_finite] == ['nan m/s and 0 rad/s']
    marks = marks_after_trial(Marks('Ann'), seen, 'turn', points_of('turn', read_points(None)))
    assert marks.node == 'lab2/turtlebot_controller.py' and not marks.points == marks.full_points
    with rosbag.Bag(str(tmp_path / 'trial.bag')) as bag:
        assert bag.get_type_and_topic_info().topics['/ground_truth'].message_count == 41


def test_who_records_does_not_wait_for_the_disk(tmp_path, monkeypatch):
    is_free, write = threading.Event(), rosbag.Bag.write

    def slow(*arguments, **options):
        is_free.wait(20.0)
        write(*arguments, **options)
    monkeypatch.setattr(rosbag.Bag, 'write', slow)
    bag = TrialBag(tmp_path / 'trial.bag')
    for k in range(100):
        bag.add_event('remark', text=str(k))
    assert not is_free.is_set()     # nobody has waited for the disk
    is_free.set()
    bag.close()
    with rosbag.Bag(str(tmp_path / 'trial.bag')) as bag:
        assert bag.get_message_count() == 100


def test_of_an_endless_output_the_end_and_the_number_of_lines_are_kept(tmp_path, clock):
    bag = TrialBag(tmp_path / 'trial.bag')
    output = NodeOutput(bag)
    bag.add_event('trial', lab='imu', node='ice6/imu_sub.py')
    bag.add_event('start', needed='imu')
    bag.add_event('begin', name='a')
    line = 'x' * 99 + '\n'
    for k in range(5000):
        clock[0] = BEGIN + 2.0 + k * 1e-3
        output.add(line)
        if k % 50 == 0:
            robot(bag, clock[0], 0.0)
    output.add('the last \x1b[1mwords\x1b[0m\n')
    output.flush()
    bag.add_event('end', facts={}, died=False)
    bag.close()
    seen = read_trial(tmp_path / 'trial.bag')
    scene = seen.enter_scene('a')
    assert scene.printed.endswith('the last words\n') and scene.line_count == 5001
    recorded = sum(map(len, seen.recording.printed.text))
    assert recorded <= MAX_CHARACTERS_PER_SECOND * 7 and len(scene.printed) <= MAX_OUTPUT_LENGTH


def test_a_bag_that_is_not_of_a_trial_is_refused(tmp_path):
    bag = TrialBag(tmp_path / 'trial.bag')
    for k in range(3):
        robot(bag, BEGIN + k, 0.0)
    bag.close()
    with pytest.raises(ValueError, match='no trial'):
        read_trial(tmp_path / 'trial.bag')


@pytest.mark.parametrize('by', [-2.0, 4000.0])
def test_a_trial_during_which_the_clock_jumps_is_not_judged(by, tmp_path):
    """The first part of a trial alone would cost the node points."""
    bag = TrialBag(tmp_path / 'trial.bag')
    bag.add_event('trial', BEGIN, lab='imu', node='ice6/imu_sub.py')
    for k in range(100):
        robot(bag, BEGIN + 0.1 * k + by * (k > 50), 0.0)
    bag.close()
    with pytest.raises(ValueError, match="clock was set, or the computer slept; type the same command again"):
        read_trial(tmp_path / 'trial.bag')


def test_a_full_bag_takes_only_what_a_node_is_judged_by(tmp_path, monkeypatch):
    monkeypatch.setattr(ros_recording, 'FULL_BAG_BYTES', 20000)
    bag, noise = TrialBag(tmp_path / 'trial.bag'), random.Random(7)
    bag.add_event('trial', lab='imu', node='ice6/imu_sub.py')
    for k in range(1000):
        bag.add('joy', Joy(axes=[noise.random() for _ in range(400)]), BEGIN + k * 0.01)
        robot(bag, BEGIN + k * 0.01, 0.0)
    bag.close()
    assert (tmp_path / 'trial.bag').stat().st_size < 20000 + 3 * CHUNK_BYTES
    assert len(read_trial(tmp_path / 'trial.bag').truth) == 1000
    with rosbag.Bag(str(tmp_path / 'trial.bag')) as bag:
        assert bag.get_message_count('/joy') < 1000


def test_a_recording_that_a_full_disk_cut_off_is_none(tmp_path, monkeypatch):
    write = rosbag.Bag.write

    def full(bag, topic, *arguments, **options):
        if topic == '/printed':
            raise OSError(errno.ENOSPC, 'No space left on device')
        write(bag, topic, *arguments, **options)
    monkeypatch.setattr(rosbag.Bag, 'write', full)
    bag = TrialBag(tmp_path / 'trial.bag')
    bag.add_event('trial', lab='imu', node='ice6/imu_sub.py')
    bag.add('printed', String('x'))
    bag.add_event('broken', text='')
    bag.close()
    assert bag.problem.errno == errno.ENOSPC and not (tmp_path / 'trial.bag').exists()
