"""The run report, from bag to page, on a drive that is known in closed form.

The robot drives straight along local's x axis, a little too short, turning by a tenth of a degree
each second; the ground truth misses by more. Then it is reset where it stands, and gives up.
"""
import base64
import cmath
import csv
import importlib.util
import math
import os
import pathlib
import re
import sys
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from known_motion import angle_between
from tb3_labs.geometry.angles import wrap_all
from tb3_labs.geometry.quaternions import yaw_from_quaternion, yaws_from_quaternions
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.report import analysis
from tb3_labs.report.epochs import epochs, local_in_odom
from tb3_labs.report.run_data import (
    Poses, SenderClock, States, times_on_recorders_clock)
from tb3_labs.robot.turtlebot3 import robot_model

rosbag = pytest.importorskip('rosbag', reason='rosbag cannot be imported')
pytest.importorskip('matplotlib', reason='matplotlib is not installed')

import rospy  # noqa: E402
from geometry_msgs.msg import PoseStamped, TransformStamped, Twist  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from sensor_msgs.msg import Imu  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

from tb3_labs.report.figures import LEAP, paths, thin  # noqa: E402
from tb3_labs.ros.bags.reader import BagProblem, read_run  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
RECORDINGS = pathlib.Path(os.environ.get('TB3_LABS_RECORDINGS') or
                          ROOT.parent / 'shared' / 'recordings')
BURGER = robot_model('burger')
BEGIN = 1.7e9                            # of the recording
AHEAD, DELAY = 0.775, 0.002              # of the robot's clock; of the network
ODOM_T_LOCAL = 2.0 + 1.0j, 0.5           # (place, yaw): where local stands at first
WORLD_T_LOCAL = -3.0 + 4.0j, 2.0
IMU_OFFSET = math.radians(140.56)
MISS, MISS_DEG = 0.012, 0.7              # by local_pose
TRUE_END, TRUE_DEG = 0.97 + 0.04j, 2.0   # 0.05 m from the goal
RESET, DECLARED = 10.0, (1.0 + 0.5j, math.pi / 2.0)
STATES = ((0.5, 'ROTATE_TO_GOAL'), (1.0, 'MOVE_FORWARD'), (6.0, 'ROTATE_TO_FINAL'),
          (7.0, 'GOAL_REACHED'), (10.02, 'ROTATE_TO_GOAL'), (11.5, 'gave up: it is stuck, alas'))
END = 12.0


def way(time):
    """(fraction of the way, yaw [rad]) in the first local frame."""
    yaw_deg = np.interp(time, [1.0, 6.0, 7.0], [0.0, 0.5, MISS_DEG])
    return float(np.interp(time, [1.0, 6.0], [0.0, 1.0])), math.radians(yaw_deg)


def placed(frame, place, yaw):
    """A pose of `frame` seen from its parent: (place, yaw)."""
    return frame[0] + cmath.exp(1j * frame[1]) * place, frame[1] + yaw


def fill(pose, place, yaw):
    """Write (place, yaw) into a Pose or a Transform."""
    position = getattr(pose, 'position', None) or pose.translation
    orientation = getattr(pose, 'orientation', None) or pose.rotation
    position.x, position.y = place.real, place.imag
    orientation.z, orientation.w = math.sin(yaw / 2.0), math.cos(yaw / 2.0)


def stamped(message, time, frame='', ahead=AHEAD):
    message.header.stamp = rospy.Time.from_sec(BEGIN + time + ahead)
    message.header.frame_id = frame
    return message


def sensors(time, number):
    """(name, message) of what the robot sends at `time`."""
    fraction, yaw = way(time)
    place, odom_yaw = placed(ODOM_T_LOCAL, (1.0 - MISS) * fraction, yaw)
    if not 7.2 < time < 8.0:             # a gap, put in on purpose
        imu = stamped(Imu(), time, 'imu_link')
        imu.orientation.z = math.sin((odom_yaw + IMU_OFFSET) / 2.0)
        imu.orientation.w = math.cos((odom_yaw + IMU_OFFSET) / 2.0)
        yield 'imu', imu
    if number % 5 == 0:
        odometry = stamped(Odometry(), time, 'odom')
        odometry.child_frame_id = 'base_footprint'
        fill(odometry.pose.pose, place, odom_yaw)
        odometry.twist.twist.linear.x = 0.1976 if 1.0 <= time < 6.0 else 0.0
        odometry.twist.twist.angular.z = -143.6 if number == 500 else 0.0
        yield 'odom', odometry


def lab_topics(time, number):
    """(name, message) of what the package sends besides."""
    fraction, yaw = way(time)
    truth = stamped(PoseStamped(), time, 'world')
    fill(truth.pose, *placed(WORLD_T_LOCAL, TRUE_END * fraction, yaw * TRUE_DEG / MISS_DEG))
    yield 'ground_truth', truth
    if number % 5 == 0:
        local = stamped(PoseStamped(), time, 'local')
        fill(local.pose, *(DECLARED if time >= RESET else ((1.0 - MISS) * fraction, yaw)))
        yield 'local_pose', local
        transform = stamped(TransformStamped(), time, 'odom')
        transform.child_frame_id = 'local'
        fill(transform.transform, *frame_at(time))
        yield '/tf', TFMessage([stamped(TransformStamped(), time, 'odom'), transform])
        yield 'cmd_vel', Twist()
    for begin, state in STATES:
        if abs(time - begin) < 1e-6:
            yield 'goal_state', String(state)
            goal = stamped(PoseStamped(), time, 'local', ahead=0.0)   # from the laptop
            fill(goal.pose, 1.0 + 0.0j, 0.0)
            yield 'current_goal', goal


def frame_at(time):
    """Where local stands in odom: (place, yaw)."""
    if time < RESET:
        return ODOM_T_LOCAL
    place, yaw = placed(ODOM_T_LOCAL, 1.0 - MISS, math.radians(MISS_DEG))
    yaw -= DECLARED[1]
    return place - cmath.exp(1j * yaw) * DECLARED[0], yaw


def write_bag(path, namespaces=('',), sources=(sensors, lab_topics), keep=lambda name: True, **how):
    """Record the drive, once for each namespace; None: by relative names."""
    with rosbag.Bag(str(path), 'w', **how) as bag:
        for number in range(int(END * 100) + 1):
            time = number / 100.0
            for name, message in (pair for source in sources for pair in source(time, number)):
                for namespace in namespaces if keep(name) else ():
                    relative = name[0] == '/' or namespace is None
                    topic = name if relative else namespace + '/' + name
                    bag.write(topic, message, rospy.Time.from_sec(BEGIN + time + DELAY))
    return path


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp('bags') / 'run.bag')


@pytest.fixture(scope='module')
def run(bag):
    return read_run(bag)


def lab_report(*words):
    """The exit status of the command."""
    spec = importlib.util.spec_from_file_location('lab_report', str(ROOT / 'scripts/lab_report.py'))
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    return script.main([str(word) for word in words])


def in_degrees(miss):
    return miss[0], abs(math.degrees(miss[1]))


def test_topics_that_were_recorded_by_relative_names(tmp_path):
    run = read_run(write_bag(tmp_path / 'relative.bag', namespaces=(None,)))
    first, _ = analysis.drives(run, BURGER)
    assert in_degrees(first.measured) == pytest.approx((MISS, MISS_DEG), abs=1e-6)


def test_the_drives_numbers(run):
    first, second = analysis.drives(run, BURGER)
    assert in_degrees(first.measured) == pytest.approx((MISS, MISS_DEG), abs=1e-6)
    assert in_degrees(first.true) == pytest.approx((0.05, TRUE_DEG), abs=1e-6)
    assert (first.outcome, second.outcome) == ('reached', 'gave up: it is stuck, alas')
    assert first.time == pytest.approx(6.5, abs=0.005)
    assert first.least_time == pytest.approx(1.0 / BURGER.max_linear)
    assert first.in_state == pytest.approx(
        {'ROTATE_TO_GOAL': 0.5, 'MOVE_FORWARD': 5.0, 'ROTATE_TO_FINAL': 1.0}, abs=0.005)
    assert math.degrees(first.drift) == pytest.approx(0.47, abs=0.002)    # 4.7 s at 0.1 deg/s
    assert math.degrees(first.deviation) == pytest.approx(0.47, abs=0.002)
    assert in_degrees(second.measured) == pytest.approx((0.5, 90.0), abs=1e-6)
    assert in_degrees(second.true) == pytest.approx((0.5, 90.0), abs=1e-6)
    assert math.isnan(second.drift)


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


def recorded(run, by_tf):
    """The run with or without tf."""
    return run if by_tf else replace(run, frames=Poses.none())


def changed(poses, time, parent_T_frame, until=math.inf):
    """The poses, from `time` on seen in the parent of their frame."""
    seen, now = poses.seen_from(parent_T_frame), (poses.time > time - 0.01) & (poses.time < until)
    return replace(poses, **{name: np.where(now, getattr(seen, name), getattr(poses, name))
                             for name in ('x', 'y', 'yaw')})


def odometry_jumps(run, time, jump):
    """The odometry is moved by `jump` from `time` on, and ``local`` with it."""
    return replace(run, odometry=changed(run.odometry, time, jump),
                   frames=changed(run.frames, time, jump))


def steps_backwards(run, time, driven):
    """The IMU crosses +/-180 deg: what was `driven` before `time` [m] is backwards in odom."""
    k = np.searchsorted(run.odometry.time, time - 0.01)
    yaw, angular, linear = run.odometry.yaw[k], *np.array(
        [run.odometry.angular, run.odometry.linear])
    angular[k], linear[k] = -188.0, driven / 0.05
    run = odometry_jumps(run, time, Pose2(-2.0 * driven * math.cos(yaw),
                                          -2.0 * driven * math.sin(yaw)))
    return replace(run, odometry=replace(run.odometry, angular=angular, linear=linear))


def declared(run, time, new_T_old, until=RESET):
    """A reset at `time`: ``local`` is another one until the next reset."""
    x, y, yaw = (np.full(len(run.frames), value) for value in (
        new_T_old.x, new_T_old.y, new_T_old.yaw))
    frames = run.frames @ Poses(run.frames.time, run.frames.time, x, y, yaw).inverse()
    now = (frames.time > time - 0.01) & (frames.time < until - 0.01)
    return replace(
        run, local_pose=changed(run.local_pose, time, new_T_old, until - 0.01),
        frames=replace(run.frames, **{name: np.where(
            now, getattr(frames, name), getattr(run.frames, name)) for name in ('x', 'y', 'yaw')}))


def resets(run):
    """The times after which the run's resets are found, each in one interval of the odometry."""
    return [pytest.approx(epoch.begin + 0.025, abs=0.026) for epoch in epochs(run)[1:]]


@pytest.mark.parametrize('by_tf', [True, False])
def test_a_reset_is_found_by_tf_and_by_local_pose(run, by_tf):
    run = recorded(run, by_tf)
    assert [RESET] == resets(run)
    for epoch, time in zip(epochs(run), (0.0, RESET)):
        place, yaw = frame_at(time)
        assert (epoch.odom_T_local.x, epoch.odom_T_local.y) == pytest.approx(
            (place.real, place.imag), abs=1e-6)
        assert angle_between(epoch.odom_T_local.yaw, yaw) < 1e-6


@pytest.mark.parametrize('by_tf', [True, False])
@pytest.mark.parametrize('time, driven', [
    (3.0, (1.0 - MISS) / 100.0),     # in full drive, 20 messages a second for 5 s: 9.9 mm
    (6.95, 2e-5),                    # in the last turn
    (7.0, 2e-5), (RESET, 2e-5)])     # as the drive ends; and as a reset comes
def test_the_firmwares_step_backwards_is_no_reset(run, time, driven, by_tf):
    run = recorded(steps_backwards(run, time, driven), by_tf)
    assert [RESET] == resets(run)
    first, second = analysis.drives(run, BURGER)
    assert in_degrees(first.measured) == pytest.approx((MISS, MISS_DEG), abs=1e-6)
    assert in_degrees(first.true) == pytest.approx((0.05, TRUE_DEG), abs=1e-6)
    assert in_degrees(second.true) == pytest.approx((0.5, 90.0), abs=1e-6)


@pytest.mark.parametrize('by_tf', [True, False])
@pytest.mark.parametrize('time', [6.9, 8.5])
def test_an_odometry_that_is_set_to_zero_is_no_reset(run, time, by_tf):
    here = run.odometry.pose(np.searchsorted(run.odometry.time, time - 0.01))
    run = odometry_jumps(run, time, here.inverse())
    moved = run.frames.pose(-1)
    assert [RESET] == resets(recorded(run, by_tf))
    first, second = analysis.drives(recorded(run, by_tf), BURGER)
    assert in_degrees(first.measured) == pytest.approx((MISS, MISS_DEG), abs=1e-6)
    assert in_degrees(first.true) == pytest.approx((0.05, TRUE_DEG), abs=1e-6)
    assert in_degrees(second.measured) == pytest.approx((0.5, 90.0), abs=1e-6)
    now = local_in_odom(recorded(run, by_tf), run.frames.time[-1:])
    assert (now.x[0], now.y[0]) == pytest.approx((moved.x, moved.y), abs=1e-6)


@pytest.mark.parametrize('by_tf', [True, False])
def test_a_robot_that_is_turned_while_its_odometry_is_set_to_zero(run, by_tf):
    odom, local = (poses.pose(np.searchsorted(poses.time, 8.49))
                   for poses in (run.odometry, run.local_pose))
    turned = Pose2(0.0, 0.0, math.radians(3.0))
    run = declared(odometry_jumps(run, 8.5, odom.inverse()), 8.5,
                   local @ turned @ local.inverse())
    yaw = wrap_all(run.imu.yaw + np.where(run.imu.time > 8.49, turned.yaw, 0.0))
    assert [RESET] == resets(recorded(replace(run, imu=replace(run.imu, yaw=yaw)), by_tf))


def test_a_local_that_is_not_moved_along_is_another_one(run):
    """A node that knows nothing of the robot's own reset: its local jumps with the odometry."""
    here = run.odometry.pose(np.searchsorted(run.odometry.time, 8.49))
    run = replace(run, odometry=changed(run.odometry, 8.5, here.inverse()))
    jump = run.frames.pose(0).inverse() @ here.inverse() @ run.frames.pose(0)
    run = replace(run, local_pose=changed(run.local_pose, 8.5, jump, RESET - 0.01))
    assert [8.5, RESET] == resets(run)


def test_a_board_that_restarts_is_a_reset(run):
    """Odometry and IMU jump: move_to_goal begins anew at (0, 0, 0), here in the same place of odom.
    """
    run = odometry_jumps(run, -1.0, run.frames.pose(0).inverse())
    here = run.odometry.pose(np.searchsorted(run.odometry.time, 8.49))
    run = declared(odometry_jumps(run, 8.5, here.inverse()), 8.5, here.inverse())
    assert np.abs(np.hypot(run.frames.x, run.frames.y)[run.frames.time < 9.9]).max() < 1e-6
    yaw = wrap_all(run.imu.yaw + np.where(run.imu.time > 8.49, 1.0, 0.0))
    assert [8.5, RESET] == resets(replace(run, imu=replace(run.imu, yaw=yaw)))


@pytest.mark.parametrize('by_tf', [True, False])
@pytest.mark.parametrize('new', [Pose2(0.03, 0.0, 0.0), Pose2(0.0, 0.0, math.radians(1.5))])
def test_a_reset_of_place_or_heading_alone(run, new, by_tf):
    here = run.local_pose.pose(np.searchsorted(run.local_pose.time, 8.49))
    run = steps_backwards(declared(run, 8.5, here @ new @ here.inverse()), 8.5, 2e-5)
    assert [8.5, RESET] == resets(recorded(run, by_tf))


def test_a_reset_by_next_to_nothing_is_one(run):
    run = declared(run, 0.2, Pose2(0.0, 0.0004, 0.0))
    assert [0.2, RESET] == resets(run)
    first, _ = analysis.drives(run, BURGER)
    # where it stood at 0.2 s is 0.4 mm to the left now, as is where it truly ends
    assert first.true[0] == pytest.approx(abs(1.0 - TRUE_END - 0.0004j), abs=1e-6)


@pytest.mark.parametrize('by_tf', [True, False])
def test_resets_in_quick_succession(run, by_tf):
    run = declared(run, 8.5, Pose2(0.3, 0.0, 1.0), 8.55)
    run = declared(run, 8.55, Pose2(0.0, 0.1, -1.0))
    assert [8.5, 8.55, RESET] == resets(recorded(run, by_tf))


@pytest.mark.parametrize('by_tf', [True, False])
@pytest.mark.parametrize('driven', [0.0, (1.0 - MISS) / 100.0])
def test_a_reset_while_it_drives(run, driven, by_tf):
    """The second time at the very moment of the firmware's step backwards."""
    new = Pose2(0.2, -0.1, 0.3)
    run = declared(run, 3.0, new)
    run = recorded(steps_backwards(run, 3.0, driven) if driven else run, by_tf)
    time = np.array([0.5, 1.0, 3.02, 4.0, 7.0])
    run = replace(run, states=States(time, time, np.array(
        ['ROTATE_TO_GOAL', 'MOVE_FORWARD'] * 2 + ['GOAL_REACHED'], dtype=object)))
    assert [3.0, RESET] == resets(run)
    first, second = analysis.drives(run, BURGER)
    assert (first.outcome, second.outcome) == ('ended by a reset', 'reached')
    fraction, yaw = way(2.95)
    assert in_degrees(first.measured) == pytest.approx(
        (1.0 - (1.0 - MISS) * fraction, math.degrees(yaw)), abs=1e-6)
    place, yaw = placed((new.x + 1j * new.y, new.yaw), 1.0 - MISS, math.radians(MISS_DEG))
    assert in_degrees(second.measured) == pytest.approx(
        (abs(1.0 - place), math.degrees(yaw)), abs=1e-6)


def test_a_tf_of_noise_says_nothing_of_resets(run):
    rng = np.random.RandomState(1)
    x, y, yaw = 0.001 * rng.standard_normal((3, len(run.frames)))
    noise = Poses(run.frames.time, run.frames.time, x, y, yaw)
    assert [RESET] == resets(replace(run, frames=run.frames @ noise))


@pytest.mark.parametrize('noisy', ['imu', 'odometry'])
def test_noise_in_one_of_two_headings_is_no_reset(run, noisy):
    """local_pose has the other one."""
    samples = getattr(run, noisy)
    yaw = wrap_all(samples.yaw + 0.02 * np.random.RandomState(1).standard_normal(len(samples)))
    run = replace(run, **{noisy: replace(samples, yaw=yaw)})
    assert [RESET] == resets(recorded(run, by_tf=False))


def test_a_reset_in_a_gap_of_tf_is_where_local_pose_jumps(run):
    kept = (run.frames.time < 9.3) | (run.frames.time > 10.7)
    assert [RESET] == resets(replace(run, frames=run.frames.take(kept)))


@pytest.mark.parametrize('later', [-0.01, 0.0, 0.01])
def test_tf_and_local_pose_of_one_moment_belong_together(run, later):
    """Here the drive lasts until the reset, and its last pose is the last one of the old frame."""
    frames, time = run.frames, np.array([9.0, 9.5, 10.02, 11.0])
    run = replace(run, frames=replace(frames, time=frames.time + later), states=States(
        time, time, np.array(['ROTATE_TO_FINAL', 'GOAL_REACHED'] * 2, dtype=object)))
    assert [RESET] == resets(run)
    first, second = analysis.drives(run, BURGER)
    assert in_degrees(first.measured) == pytest.approx((MISS, MISS_DEG), abs=1e-6)
    assert in_degrees(second.true) == pytest.approx((0.5, 90.0), abs=1e-6)


def test_an_odometry_that_misses_a_message_explains_a_little(run):
    run = odometry_jumps(run, 3.0, Pose2(0.01, 0.0, 0.0))
    assert len(resets(run)) == 2
    kept = np.abs(run.odometry.time - 3.0) > 0.01
    assert [RESET] == resets(replace(run, odometry=run.odometry.take(kept)))


def test_errors_to_the_goal_over_time(run):
    time, distance, angle = analysis.goal_errors(run)
    middle = np.argmin(np.abs(time - 3.5))
    assert distance[middle] == pytest.approx(1.0 - 0.5 * (1.0 - MISS), abs=1e-6)
    assert math.degrees(angle[middle]) == pytest.approx(-0.25, abs=1e-6)
    assert (distance[-1], math.degrees(angle[-1])) == pytest.approx((0.5, -90.0))


def test_rates_and_the_gap_in_the_imu(run):
    imu, odometry = analysis.rate(run.imu), analysis.rate(run.odometry)
    assert (imu.gaps, odometry.gaps) == (1, 0)
    assert (imu.longest, imu.longest_arrival) == pytest.approx((0.8, 0.8), abs=1e-6)
    assert (odometry.messages, odometry.mean) == (241, pytest.approx(20.0))
    assert (run.odometry.angular.min(), run.odometry.angular.max()) == (-143.6, 0.0)


def test_imu_minus_odometry_and_the_way(run):
    offset = analysis.yaw_offset(run)
    assert math.degrees(offset.mean) == pytest.approx(140.56, abs=1e-3)
    assert max(offset.spread, abs(offset.drift), abs(offset.deviation).max()) < 1e-6
    assert not any((offset.time > 7.6) & (offset.time < 7.65))      # in the middle of the gap
    assert analysis.path_length(run.odometry) == pytest.approx(1.0 - MISS)


SENT = np.arange(100) / 10.0


def test_clocks(run):
    assert run.odometry.time == pytest.approx(run.odometry.arrival, abs=1e-6)
    assert SenderClock.of(SENT, SENT + AHEAD).lag == pytest.approx(-AHEAD)
    for set_at in 0.3, 0.5, 0.8:
        for by in 1e6, 2.0, -2.0, -1e6:
            stamp = SENT + AHEAD + np.where(SENT > 10.0 * set_at, by, 0.0)
            assert times_on_recorders_clock(SENT, stamp, None) == pytest.approx(SENT, abs=1e-6)


@pytest.mark.parametrize('begin, end, arrival', [
    (3.0, 5.0, 5.0),       # the recorder was busy, and took all of it at once
    (0.0, 0.6, 0.6),       # so it was when it began
    (9.25, 9.95, 10.6),    # and when it ended
    (6.0, 8.0, 6.0)])      # its simulated clock stood still
def test_stamps_count_where_the_recorder_is_late(begin, end, arrival):
    late = np.where((SENT > begin - 0.01) & (SENT < end), arrival, SENT)
    assert times_on_recorders_clock(late, SENT + AHEAD, None) == pytest.approx(SENT, abs=1e-6)


def test_stamps_that_are_passed_on_stay_the_senders():
    """local_pose bears the odometry's stamps, and comes long after it."""
    robot = SenderClock.of(SENT, SENT + AHEAD)
    passed_on = SENT[::2]
    assert times_on_recorders_clock(
        passed_on + 0.3, passed_on + AHEAD, robot) == pytest.approx(passed_on)
    own = passed_on + AHEAD + 0.033
    assert times_on_recorders_clock(passed_on + 0.3, own, robot) == pytest.approx(passed_on + 0.3)


def test_old_and_strange_stamps():
    arrival = np.array([0.0, 0.1, 2.0, 4.0])
    latched = np.array([-100.0, 0.1, 2.0, 4.0])
    assert times_on_recorders_clock(arrival, latched, None) == pytest.approx(arrival)
    assert times_on_recorders_clock(SENT, 0.0 * SENT - BEGIN, None) == pytest.approx(SENT)
    from_the_future = np.where(SENT == 5.0, 1e9, SENT)
    assert times_on_recorders_clock(SENT, from_the_future, None) == pytest.approx(SENT)


GOALS = {1: (1.0, 0.0), 2: (2.0, 0.0)}


@pytest.mark.parametrize('states, outcomes', [
    ([('ROTATE_TO_GOAL', 1), ('MOVE_FORWARD', 1)], ['recording ended']),
    ([('ROTATE_TO_GOAL', 1), ('waiting for control', 1)], ['waiting for control']),
    ([('ROTATE_TO_GOAL', 1), ('ROTATE_TO_GOAL', 2), ('GOAL_REACHED', 2)],
     ['replaced by a new goal', 'reached']),
    ([('MOVE_FORWARD', 1), ('stopped: no imu', 1), ('ROTATE_TO_GOAL', 1), ('GOAL_REACHED', 1)],
     ['reached']),
    ([('MOVE_FORWARD', 1), ('stopped: no imu', 1), ('ROTATE_TO_GOAL', 2), ('GOAL_REACHED', 2)],
     ['replaced by a new goal', 'reached']),
    ([('MOVE_FORWARD', 1), ('stopped: no imu', 1), ('gave up: no imu', 1)], ['gave up: no imu']),
    ([('ROTATE_TO_FINAL', 1), ('ROTATE_TO_GOAL', 1), ('GOAL_REACHED', 1)], ['reached']),
    ([('ROTATE_TO_FINAL', 1), ('ROTATE_TO_GOAL', 2), ('GOAL_REACHED', 2)],
     ['replaced by a new goal', 'reached']),
    ([('ROTATE_TO_GOAL', 1), ('stopped: no imu', 1), ('MOVE_FORWARD', 1), ('GOAL_REACHED', 1)],
     ['reached']),
    ([('waiting for control', 1), ('GOAL_REACHED', 1)], [])])
def test_how_drives_end(run, states, outcomes):
    time = 1.0 + np.arange(len(states))
    x, y = np.array([GOALS[goal] for _, goal in states]).T
    words = np.array([word for word, _ in states], dtype=object)
    run = replace(run, states=States(time, time, words), goals=Poses(time, time, x, y, 0.0 * x))
    assert [drive.outcome for drive in analysis.drives(run, BURGER)] == outcomes


@pytest.mark.parametrize('state', ['ROTATE_TO_GOAL', 'ROTATE_TO_FINAL'])
def test_a_drive_that_is_ended_by_a_reset(run, state):
    time = np.array([9.0, 10.02, 11.0])
    words = np.array([state, 'ROTATE_TO_GOAL', 'GOAL_REACHED'], dtype=object)
    run = replace(run, states=States(time, time, words))
    assert [drive.outcome for drive in analysis.drives(run, BURGER)] == [
        'ended by a reset', 'reached']


def test_a_short_drive_that_is_ended_by_a_reset(run):
    time = np.array([9.92, 10.02, 11.0])
    words = np.array(['ROTATE_TO_GOAL', 'ROTATE_TO_GOAL', 'GOAL_REACHED'], dtype=object)
    first, second = analysis.drives(replace(run, states=States(time, time, words)), BURGER)
    assert (first.outcome, second.outcome) == ('ended by a reset', 'reached')
    assert in_degrees(first.measured) == pytest.approx((MISS, MISS_DEG), abs=1e-6)
    assert in_degrees(second.measured) == pytest.approx((0.5, 90.0), abs=1e-6)


@pytest.mark.parametrize('lost, later', [(False, 0.001), (False, -0.001), (True, 0.001)])
def test_states_that_arrive_in_a_burst(run, lost, later):
    """They are as old as the goals say that were sent with them, in the same order."""
    arrival, sent = np.array([1.0, 8.0, 8.0, 8.0]), np.array([1.0, 6.0, 7.0, 7.5])
    states = States(arrival, arrival, np.array(
        ['ROTATE_TO_GOAL', 'MOVE_FORWARD', 'ROTATE_TO_FINAL', 'GOAL_REACHED'], dtype=object))
    heard = arrival + later * np.array([1, 3, 2, 1] if later < 0.0 else [1, 1, 2, 3])
    goals = Poses(heard, sent, 1.0 + 0.0 * sent, 0.0 * sent, 0.0 * sent)
    run = replace(run, states=states, goals=goals.take(slice(0, 3 if lost else 4)))
    assert [span.begin for span in analysis.spans(run)] == pytest.approx(
        [1.0, 6.0, 7.0, 8.0 if lost else 7.5])
    assert all(span.goal == Pose2(1.0, 0.0, 0.0) for span in analysis.spans(run))


def test_the_page_the_pictures_and_the_csv(bag, tmp_path, capsys):
    assert lab_report(bag, '-o', tmp_path / 'out') == 0
    assert str(tmp_path / 'out' / 'report.html') in capsys.readouterr().out
    page = (tmp_path / 'out' / 'report.html').read_text(encoding='utf-8')
    assert '0.99 m driven, 1 reset. ' in page
    images = re.findall(r'alt="(\w+)" src="data:image/png;base64,([^"]*)"', page)
    assert [name for name, _ in images] == ['paths', 'errors', 'heading', 'speeds']
    for name, image in images:
        png = base64.b64decode(image)
        assert png[:4] == b'\x89PNG' and png == (tmp_path / 'out' / (name + '.png')).read_bytes()
    text = re.sub('base64,[^"]*', '', page)
    assert not re.search('https?:|<script|<link|url\\(', text)
    rows = [re.findall('<td[^>]*>(.*?)</td>', row) for row in re.findall('<tr>(.*?)</tr>', text)]
    first, second = (row for row in rows if len(row) == 11)
    assert first[4:] == ['reached', '6.50', '4.74', '0.0120', '0.70', '0.0500', '2.00']
    assert second[4:5] + second[7:] == [
        'gave up: it is stuck, alas', '0.5000', '90.00', '0.5000', '90.00']
    assert next(row for row in rows if row[:1] == ['/imu']) == [
        '/imu', '1122', '93.4', '0.800', '1', '0.800', '0']
    with open(str(tmp_path / 'out' / 'run.csv'), newline='') as file:
        table = list(csv.DictReader(file))
    assert len(table) == 241
    row = table[70]                                              # 3.5 s: half the way
    assert float(row['time_s']) == pytest.approx(3.5, abs=1e-3)
    assert (row['local_x_m'], row['local_y_m'], row['local_yaw_deg']) == (
        '0.4940', '0.0000', '0.250')
    assert (row['distance_error_m'], row['linear_m_s'], row['state']) == (
        '0.5060', '0.1976', 'MOVE_FORWARD')
    assert float(row['odom_x_m']) == pytest.approx(2.0 + 0.494 * math.cos(0.5), abs=1e-4)
    assert table[-1]['state'] == 'gave up: it is stuck, alas'


def test_a_bag_of_sensors_only(tmp_path):
    path = write_bag(tmp_path / 'sensors.bag', sources=(sensors,))
    poses = analysis.local_poses(read_run(path))
    assert (poses.x[0], poses.y[0], poses.yaw[0]) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert (poses.x[-1], poses.y[-1], math.degrees(poses.yaw[-1])) == pytest.approx(
        (1.0 - MISS, 0.0, MISS_DEG), abs=1e-6)
    assert lab_report(path) == 0
    page = (tmp_path / 'sensors_report' / 'report.html').read_text(encoding='utf-8')
    assert 'No drives are listed' in page and 'declared (0, 0, 0)' in page


@pytest.mark.parametrize('name, offset_deg, metres', [
    ('burger_drive', 140.56, 4.46), ('burger_static', -105.51, 0.0)])
def test_recordings_of_a_real_robot(name, offset_deg, metres):
    path = RECORDINGS / (name + '.bag')
    if not path.exists():
        pytest.skip('no recording {}: set TB3_LABS_RECORDINGS'.format(path))
    run = read_run(path)
    offset = analysis.yaw_offset(run)
    assert math.degrees(offset.mean) == pytest.approx(offset_deg, abs=0.05)
    assert math.degrees(offset.spread) < 0.1
    assert analysis.path_length(run.odometry) == pytest.approx(metres, abs=0.01)
    assert analysis.drives(run, BURGER) == []


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


def test_yaws_of_many_quaternions():
    rng = np.random.RandomState(1)
    tilt, yaw = rng.uniform(-0.3, 0.3, 200), rng.uniform(-math.pi, math.pi, 200)
    w, x, y, z = np.cos(yaw / 2), 0.0 * yaw, 0.0 * yaw, np.sin(yaw / 2)
    w, x, y, z = (w * np.cos(tilt / 2), w * np.sin(tilt / 2), z * np.sin(tilt / 2),
                  z * np.cos(tilt / 2))
    w, x, y, z = 0.99 * w, 0.99 * x, 0.99 * y, 0.99 * z
    expected = [yaw_from_quaternion(w=a, x=b, y=c, z=d) for a, b, c, d in zip(w, x, y, z)]
    assert np.abs(wrap_all(yaws_from_quaternions(w=w, x=x, y=y, z=z) - expected)).max() < 1e-9
    bad = np.array([[0.0] * 4, [math.nan, 0.0, 0.0, 1.0], [2.0, 0.0, 0.0, 0.0],
                    [math.inf, 0.0, 0.0, 0.0]]).T
    assert np.isnan(yaws_from_quaternions(**dict(zip('wxyz', bad)))).all()


def test_thinning_keeps_extremes_and_ends():
    values = np.zeros(100000)
    values[[777, 54321]] = 5.0, -5.0
    kept = thin(values)
    assert {0, 777, 54321, 99999} <= set(kept) and len(kept) < 3000


def test_the_true_path_is_drawn_along_an_odometry_that_is_set_to_zero(run):
    here = run.odometry.pose(np.searchsorted(run.odometry.time, 3.99))
    run = odometry_jumps(run, 4.0, here.inverse())
    in_odom, _ = paths(run, BURGER).axes
    lines = [line for line in in_odom.get_lines() if len(line.get_xdata()) > 5]
    truth = [line for line in lines if line.get_color() == '#bbbbbb']
    assert len(truth) == 3 and len(lines) == 6    # two pieces before the reset, one after it
    for line in lines:
        x, y = line.get_data()
        assert np.hypot(np.diff(x), np.diff(y)).max() < LEAP
        near = np.hypot(x[:, None] - run.odometry.x, y[:, None] - run.odometry.y).min(axis=1)
        assert near.max() < 0.06                  # it truly ends 0.05 m beside


def test_wrong_usage():
    with pytest.raises(SystemExit) as end:
        lab_report()
    assert end.value.code == 2


def spoil(what, bag, folder):
    """The command line that names something bad."""
    path = folder / 'bad.bag'
    if what == 'text':
        path.write_text('this is no bag')
    elif what == 'empty':
        path.write_bytes(b'')
    elif what == 'short':
        path.write_bytes(bag.read_bytes()[:len(bag.read_bytes()) // 2])
    elif what == 'unindexed':
        with rosbag.Bag(str(folder / 'open.bag'), 'w', chunk_threshold=100) as growing:
            growing.write('/imu', Imu())
            growing.flush()
            path.write_bytes((folder / 'open.bag').read_bytes())
    elif what == 'no odometry':
        write_bag(path, keep=lambda name: name != 'odom')
    elif what == 'no folder':
        path.write_text('a file in the way')
        return [bag, '-o', path / 'report']
    elif what == 'folder':
        path.mkdir()
    return [path]


@pytest.mark.parametrize('what, said', [
    ('missing', 'no such file'), ('text', 'bag'), ('empty', 'bag'), ('short', 'bag'),
    ('unindexed', 'rosbag reindex'), ('no odometry', 'no nav_msgs/Odometry'),
    ('no folder', 'choose another folder'), ('folder', 'irectory')])
def test_what_cannot_be_reported_is_said_in_one_line(what, said, bag, tmp_path, capsys):
    assert lab_report(*spoil(what, bag, tmp_path)) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and said in lines[0], lines


def test_without_matplotlib(bag, monkeypatch, capsys):
    for name in [name for name in sys.modules if name.startswith(
            ('matplotlib', 'tb3_labs.report.figures', 'tb3_labs.report.page'))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, 'matplotlib', None)
    monkeypatch.delattr('tb3_labs.report.page', raising=False)
    monkeypatch.delattr('tb3_labs.report.figures', raising=False)
    assert lab_report(bag) == 1
    assert 'python3-matplotlib' in capsys.readouterr().err
