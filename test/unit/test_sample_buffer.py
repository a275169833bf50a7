"""Both sensors at one instant: orders of arrival, gaps, and clocks with faults."""
import math
from dataclasses import replace

import pytest

from known_motion import SteadyRobot, Truth, angle_between, assert_pose, held_back
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.localization.sample_buffer import SampleBuffer, Track
from tb3_labs.localization.sample_timing import SampleTiming
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.supervision.timeouts import MAX_INTERPOLATED_GAP, Lateness
from timed_part import TimedPart

SPINNING = SteadyRobot(angular=2.6, odometry_start=Truth(1 - 2j, 0.3), imu_offset=-1.8,
                       clock_ahead=0.775)


def filled(messages):
    history = TimedPart(SampleBuffer())
    for arrival, sample in messages:
        history.add(sample, arrival)
    return history


def pairs_of(history, messages):
    """Returns [(odometry sample, IMU yaw)] of a history that is read after each message."""
    pairs = []
    for arrival, sample in messages:
        history.add(sample, arrival)
        pairs.append(history.pop_pair())
    return [pair for pair in pairs if pair is not None]


def assert_right(pairs, robot, stamped_off=0.0, radians=1e-6):
    """Each pair's yaw is the IMU's own at the instant at which the odometry was measured."""
    assert pairs
    for odometry, yaw in pairs:
        truth = robot.imu(odometry.stamp - stamped_off - robot.clock_ahead).yaw
        assert angle_between(yaw, truth) <= radians


def instant_at(history, now):
    """(stamp, both readings) of `now` on the receiver's clock."""
    stamp = history.clock.to_sender_time(now)
    readings = None if stamp is None else history.readings_at(stamp)
    return None if readings is None else (stamp, readings)


def assert_instant(instant, robot, now, ahead=None, seconds=1e-6, radians=1e-6):
    """Both readings belong to the instant's stamp, which is `now` on the sender's clock."""
    stamp, (odom_T_base, imu_yaw) = instant
    time = stamp - (robot.clock_ahead if ahead is None else ahead)
    assert abs(time - now) <= seconds
    assert_pose(odom_T_base, robot.odometry_start.then(*robot.moved(time)), 1e-9, radians)
    assert angle_between(imu_yaw, robot.imu(time).yaw) <= radians


def restamped(messages, new_stamp):
    return [(arrival, sample._replace(stamp=new_stamp(arrival, sample.stamp)))
            for arrival, sample in messages]


@pytest.mark.parametrize('gap, known', [
    (MAX_INTERPOLATED_GAP, True), (MAX_INTERPOLATED_GAP + 0.01, False), (4.3, False)])
def test_nothing_is_interpolated_over_a_dropout(gap, known):
    track = Track(lambda start, end, fraction: start + fraction * (end - start))
    for time in (-0.1, 0.0, gap):
        track.add(time, 10.0 * time)
    assert track.value_at(gap / 4) == (pytest.approx(2.5 * gap) if known else None)
    assert track.value_at(gap) == pytest.approx(10.0 * gap)


@pytest.mark.parametrize('imu_late, odometry_late', [
    (0.0, 0.0), (0.02, 0.0), (0.25, 0.0), (0.0, 0.004), (0.0, 0.1), (0.0, 0.25)])
def test_the_order_of_arrival_does_not_matter(imu_late, odometry_late):
    """One source may be several samples ahead of the other, all the time."""
    messages = SPINNING.messages(0.0, 3.0, imu_delay=lambda: imu_late,
                                 odometry_delay=lambda: odometry_late)
    pairs = pairs_of(TimedPart(SampleBuffer()), messages)
    assert_right(pairs, SPINNING)
    assert len(pairs) >= 80
    stamps = [odometry.stamp for odometry, _ in pairs]
    assert stamps == sorted(set(stamps))


def without_imu(silent, end=8.0):
    """Messages of a robot whose IMU is silent for `silent` [s] from 2.0 s on."""
    return [(arrival, sample) for arrival, sample in SPINNING.messages(0.0, end)
            if not (isinstance(sample, ImuSample) and 2.0 < arrival < 2.0 + silent)]


@pytest.mark.parametrize('silent', [0.2, 0.9])
def test_the_odometry_bridges_a_gap_of_the_imu(silent):
    """If IMU samples come together, a node reads only the latest."""
    assert_right(pairs_of(TimedPart(SampleBuffer()), without_imu(silent)), SPINNING)
    history, now = filled(without_imu(silent, 2.0 + silent + 0.1)), 2.0 + 0.4 * silent
    assert_instant(instant_at(history, now), SPINNING, now, radians=1e-5)


def test_a_bridge_ends_at_the_yaw_of_the_imu_in_spite_of_slip():
    """The odometry turns a tenth less than the IMU: the difference is spread over the gap."""
    history = TimedPart(SampleBuffer())
    for time in (0.0, 0.1, 0.7, 0.8):
        history.add(ImuSample(10.0 + time, math.remainder(1.0 * time + 3.0, 2 * math.pi), 1.0), time)
    for k in range(9):
        time = 0.1 * k
        history.add(OdometrySample(10.0 + time, Pose2(0.0, 0.0, 0.9 * time), 0.0, 0.9), time)
    pose, imu_yaw = history.readings_at(10.4)
    assert angle_between(imu_yaw, 3.4) < 1e-9
    assert pose.yaw == pytest.approx(0.36)


@pytest.mark.parametrize('whose, new_stamp', [
    (ImuSample, lambda stamp: 0.0), (OdometrySample, lambda stamp: 0.0),
    (object, lambda stamp: 0.0), (ImuSample, lambda stamp: 1234.5),
    (OdometrySample, lambda stamp: 1234.5), (object, lambda stamp: 1234.5),
    # odometry stamped by another machine: both sensors have only the arrival in common
    (OdometrySample, lambda stamp: stamp + 5.0), (OdometrySample, lambda stamp: stamp - 5.0),
    (OdometrySample, lambda stamp: stamp + 1e9)])
def test_arrivals_replace_stamps_that_are_not_a_clock(whose, new_stamp):
    history = filled(
        (arrival, sample._replace(stamp=new_stamp(sample.stamp)) if isinstance(sample, whose) else sample)
        for arrival, sample in SPINNING.messages(0.0, 4.0))
    assert not history.clock.uses_stamps
    assert_instant(instant_at(history, 3.5), SPINNING, 3.5, ahead=0.0)


def test_the_receivers_clock_goes_back_while_stamps_are_zero():
    turned = replace(SPINNING, imu_offset=1.0)
    messages = SPINNING.messages(0.0, 3.0) + turned.messages(2.0, 2.6)
    history = filled(restamped(messages, lambda arrival, stamp: 0.0))
    assert_instant(instant_at(history, 2.5), turned, 2.5, ahead=0.0)


@pytest.mark.parametrize('step, imu_late', [
    (5.0, 0.0), (1.5, 0.02), (-1.5, 0.0), (-0.2, 0.0), (-0.2, 0.02), (0.5, 0.0), (3600.0, 0.0)])
def test_a_step_of_the_senders_clock_begins_an_epoch(step, imu_late):
    robot = replace(SPINNING, clock_ahead=10000.0)
    messages = restamped(robot.messages(0.0, 6.0, imu_delay=lambda: imu_late),
                         lambda arrival, stamp: stamp + (step if stamp > 10003.03 else 0.0))
    history = TimedPart(SampleBuffer())
    assert_right(pairs_of(history, [m for m in messages if m[0] <= 3.03]), robot)
    pairs_of(history, [m for m in messages if 3.03 < m[0] <= 3.1])
    pairs = pairs_of(history, [m for m in messages if m[0] > 3.1])
    assert history.clock.uses_stamps
    assert len(pairs) >= 85
    assert_right(pairs, robot, stamped_off=step)
    now = 5.55
    assert_instant(instant_at(history, now), robot, now, robot.clock_ahead + step, imu_late + 1e-6)


@pytest.mark.parametrize('stall', [0.9, 1.6, 4.0])
def test_late_messages_do_not_begin_an_epoch(stall):
    end = 2.1 + stall
    messages = held_back(SPINNING.messages(0.0, end + 1.0), 2.1, end)
    history = TimedPart(SampleBuffer())
    assert_right(pairs_of(history, messages), SPINNING)
    assert history.clock.uses_stamps
    assert_instant(instant_at(history, end + 0.7), SPINNING, end + 0.7)


def test_a_stamp_that_is_repeated_three_times_is_not_a_clock():
    timing = SampleTiming()
    for k, stamp in enumerate([7.0] * 3 + [8.0] * 4):
        timing.on_imu(ImuSample(stamp, 0.0, 0.0), 1.0 + 0.01 * k)
        assert timing.clock.uses_stamps is (k < 6)


def test_a_step_or_a_long_silence_begins_an_epoch():
    """The last stamp is ahead of the stamp before, but by less than the silence."""
    timing = SampleTiming()
    for arrival, stamp, epoch in ((1.0, 101.0, 0), (2.2, 102.2, 0), (2.3, 104.0, 1),
                                  (8.3, 105.0, 2)):
        timing.on_imu(ImuSample(stamp, 0.0, 0.0), arrival)
        assert timing.clock.epoch == epoch


def test_messages_that_were_held_up_are_late():
    lateness = Lateness()
    lateness.on_message(49.9, 1001.4)       # the fastest message decides, not the first one
    lateness.on_message(50.0, 1000.0)
    assert [lateness.on_message(50.1 + k, 1010.0 + 0.001 * k) for k in range(10)] == pytest.approx(
        [9.9 - 0.999 * k for k in range(10)])
    assert lateness.on_message(60.1, 1010.1) == pytest.approx(0.0)


@pytest.mark.parametrize('step', [0.4, 10.0])
def test_a_clock_that_was_set_back_is_used_after_5_seconds(step):
    lateness = Lateness()
    lateness.on_message(50.0, 1000.0)
    seen = [lateness.on_message(50.0 - step + 0.1 * k, 1000.0 + 0.1 * k) for k in range(1, 80)]
    assert seen[:49] == pytest.approx([step] * 49) and seen[51:] == pytest.approx([0.0] * 28)


@pytest.mark.parametrize('stamp, step', [
    (100.02, 0.02), (100.0, 0.1), (0.0, 0.1), (99.0, 0.1), (160.0, 0.1)])
def test_the_step_is_by_arrivals_if_the_stamps_stand_or_jump(stamp, step):
    timing = SampleTiming()
    timing.on_imu(ImuSample(100.0, 0.0, 0.0), 1.0)
    assert timing.on_imu(ImuSample(stamp, 0.0, 0.0), 1.1).interval == pytest.approx(step)
