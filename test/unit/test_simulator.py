"""The embedded robot against physics and the firmware's known behaviour."""
import math
import pathlib
import time
import xml.etree.ElementTree as ElementTree
from dataclasses import fields, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import ImuSample, OdometrySample, with_stamp
from tb3_labs.robot.turtlebot3 import MODELS
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator import FAULTS, STARTING, Simulator, SimulatorConfig

QUIET = SimulatorConfig(imu_noise_deg=0.0, gyro_noise=0.0)
STIFF = replace(QUIET, motor_lag=0.0)
MOTOR_STEP = 0.033 * 0.229 * 2 * math.pi / 60   # rim speed of one step of the motor [m/s]
TICK = 0.033 * 0.001533981                       # travel of one encoder tick [m]
LAUNCH = pathlib.Path(__file__).parents[2] / 'launch' / 'fake_robot.launch'


def drive(robot, seconds, linear, angular):
    """Samples of a drive whose command is repeated at 20 Hz."""
    samples = []
    for _ in range(round(seconds * 20)):
        robot.command(linear, angular)
        samples += robot.step(0.05)
    return samples


def imu_of(samples):
    return [sample for sample in samples if isinstance(sample, ImuSample)]


def odom_of(samples):
    return [sample for sample in samples if isinstance(sample, OdometrySample)]


def close(pose, other, metres=1e-9, radians=1e-9):
    return (pose.distance_to(other) <= metres and abs(wrap(pose.yaw - other.yaw)) <= radians)


# Time ---------------------------------------------------------------------------------------------

def test_a_long_step_gives_every_sample_that_is_due():
    samples = Simulator(QUIET).step(10.0)
    assert [s.stamp for s in imu_of(samples)] == pytest.approx([k / 200 for k in range(1, 2001)])
    assert [s.stamp for s in odom_of(samples)] == pytest.approx([k / 30 for k in range(1, 301)])
    assert [s.stamp for s in samples] == sorted(s.stamp for s in samples)


@pytest.mark.parametrize('imu_rate, odom_rate', [(170, 30), (118, 25), (20, 20), (1000, 200)])
def test_rates_are_kept(imu_rate, odom_rate):
    samples = Simulator(SimulatorConfig(imu_rate=imu_rate, odom_rate=odom_rate)).step(7.0)
    assert (len(imu_of(samples)), len(odom_of(samples))) == (7 * imu_rate, 7 * odom_rate)


def test_a_thousand_small_steps_are_one_large_step():
    robot, samples = Simulator(), []
    for _ in range(1000):
        samples += robot.step(0.001)
    assert samples == Simulator().step(1.0)


def test_ten_steps_are_one_also_where_they_add_up_to_less():
    config = SimulatorConfig(sensor_latency=0.1)
    robot, samples = Simulator(config), []
    for _ in range(10):
        samples += robot.step(0.1)
    assert robot.now < 1.0      # what was measured at 0.9 s arrives all the same
    assert samples == Simulator(config).step(1.0) and samples[-1].stamp == pytest.approx(0.9)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.0, 0.3), min_size=1, max_size=20), st.integers(0, 1000),
       st.sampled_from([{'sensor_latency': 0.02}, NETWORKS['good'], NETWORKS['bad'],
                        {'stalls_per_min': 120.0, 'stalled': 'commands'}]))
def test_how_time_is_cut_changes_nothing(cuts, seed, network):
    config = SimulatorConfig(seed=seed, dropouts_per_min=30.0, **network)
    fine, coarse = Simulator(config), Simulator(config)
    for robot in fine, coarse:
        robot.command(0.15, 1.0)
    samples = [sample for cut in cuts for sample in fine.step(cut)]
    assert samples == coarse.step(sum(cuts))
    assert close(fine.truth, coarse.truth)
    # and goes on like that on another network
    other = replace(config, network_cut=False, **NETWORKS['busy'])
    samples = []
    for robot in fine, coarse:
        robot.configure(replace(other, network_cut=True))
        robot.command(-0.1, 0.5)
        samples.append(robot.step(0.0))
    assert samples == [[], []]
    samples = [[sample for _ in range(10) for sample in fine.step(0.05)], coarse.step(0.5)]
    assert samples == [[], []]
    for robot in fine, coarse:
        robot.configure(other)
    samples = [sample for _ in range(40) for sample in fine.step(0.025)]
    assert samples == coarse.step(1.0)
    assert close(fine.truth, coarse.truth)


def test_the_seed_decides_the_noise():
    assert Simulator(SimulatorConfig(seed=3)).step(1.0) == Simulator(
        SimulatorConfig(seed=3)).step(1.0)
    assert Simulator(SimulatorConfig(seed=3)).step(1.0) != Simulator(
        SimulatorConfig(seed=4)).step(1.0)


def test_no_time_no_samples_and_no_way_back():
    robot = Simulator()
    assert robot.step(0.0) == [] and robot.now == 0.0
    for nonsense in (-0.1, math.nan, math.inf):
        with pytest.raises(ValueError):
            robot.step(nonsense)


def test_much_faster_than_real_time():
    robot, start = Simulator(), time.process_time()
    drive(robot, 30.0, 0.1, 0.5)
    # A quiet computer does 1500; this only catches a mistake that makes it useless.
    assert 30.0 / (time.process_time() - start) > 200.0


# Motion -------------------------------------------------------------------------------------------

def test_motors_follow_with_their_time_constant():
    robot = Simulator(replace(QUIET, motor_lag=0.1))
    robot.command(0.2, 0.0)
    speed = 252 * MOTOR_STEP  # 0.2 m/s is 252.7 steps
    for k in range(1, 12):
        robot.step(1 / 30)
        since = robot.now - 1 / 30  # the board acts at its first tick
        fading = math.exp(-since / 0.1)
        assert robot.true_velocity == pytest.approx((speed * (1 - fading), 0.0), abs=1e-12)
        assert robot.truth.x == pytest.approx(speed * (since - 0.1 * (1 - fading)), abs=1e-12)


def test_constant_command_is_a_circle():
    robot = Simulator(STIFF)
    drive(robot, 20.0, 0.1, 0.5)
    left, right = 75 * MOTOR_STEP, 176 * MOTOR_STEP  # 0.06 and 0.14 m/s, cut to whole steps
    rate = (right - left) / 0.16
    radius = (left + right) / 2 / rate
    turned = rate * (20.0 - 1 / 30)
    assert close(robot.truth, Pose2(radius * math.sin(turned), radius * (1 - math.cos(turned)),
                                    turned))


def test_pose_while_the_speed_changes():
    """From straight ahead into a curve, against the integral of the same exponentials in 30,000
    steps."""
    robot = Simulator(QUIET)
    drive(robot, 1.0, 0.2, 0.0)
    before = robot.truth
    drive(robot, 0.5, 0.1, 1.3)
    left, right = (int((0.1 + s * 0.104) / MOTOR_STEP) * MOTOR_STEP for s in (-1, 1))
    straight = 252 * MOTOR_STEP
    x, y, yaw = straight / 30, 0.0, 0.0   # up to the board's next tick
    dt = (0.5 - 1 / 30) / 30000
    for k in range(30000):
        fading = math.exp(-(k + 0.5) * dt / 0.05)
        turn = (right - left) / 0.16 * (1 - fading) * dt
        way = ((left + right) / 2 * (1 - fading) + straight * fading) * dt
        x += way * math.cos(yaw + turn / 2)
        y += way * math.sin(yaw + turn / 2)
        yaw += turn
    assert close(before.inverse() @ robot.truth, Pose2(x, y, yaw), metres=1e-5, radians=1e-8)


@pytest.mark.parametrize('model', MODELS)
@pytest.mark.parametrize('linear', [-9.0, -0.1, 0.0, 0.1, 9.0])
@pytest.mark.parametrize('angular', [-9.0, -1.0, 0.0, 1.0, 9.0])
def test_no_command_moves_a_wheel_faster_than_it_can(model, linear, angular):
    limits = MODELS[model]
    robot = Simulator(replace(QUIET, model=model))
    drive(robot, 2.0, linear, angular)
    v, w = robot.true_velocity
    assert abs(v) <= limits.max_linear and abs(w) <= limits.max_angular
    assert abs(v) + limits.half_track * abs(w) <= limits.max_wheel_speed
    assert v * linear >= 0.0 and w * angular >= 0.0


def test_full_speed_and_full_turn_are_clipped_separately():
    robot = Simulator(STIFF)
    drive(robot, 0.1, 5.0, 5.0)
    # 0.2108 m/s +/- 0.08 m x 2.635 rad/s: the right wheel would need twice what it can.
    v, w = robot.true_velocity
    assert v == pytest.approx(0.2108 / 2, abs=2 * MOTOR_STEP)
    assert w == pytest.approx(0.2108 / 0.16, abs=2 * MOTOR_STEP / 0.16)


@pytest.mark.parametrize('sign', [-1, 1])
def test_motor_speed_is_cut_towards_zero(sign):
    robot = Simulator(STIFF)
    drive(robot, 0.1, sign * 0.99 * MOTOR_STEP, 0.0)
    assert robot.true_velocity == (0.0, 0.0)
    drive(robot, 0.1, sign * 1.99 * MOTOR_STEP, 0.0)
    assert robot.true_velocity == pytest.approx((sign * MOTOR_STEP, 0.0))


def test_half_a_second_without_a_command_stops_the_wheels():
    robot = Simulator(STIFF)
    robot.command(0.1, 0.0)
    robot.step(0.49)
    assert robot.true_velocity[0] > 0.09
    robot.step(0.51 + 1 / 30 - 0.49)
    assert robot.true_velocity == (0.0, 0.0)


def test_commands_are_applied_at_30_hz_and_the_newest_wins():
    robot = Simulator(STIFF)
    robot.step(1 / 30 + 0.001)
    robot.command(0.1, 0.0)
    robot.command(-0.1, 0.0)
    robot.step(0.03)
    assert robot.true_velocity == (0.0, 0.0)
    robot.step(0.003)
    assert robot.true_velocity[0] == pytest.approx(-0.1, abs=MOTOR_STEP)


@pytest.mark.parametrize('bad', [(math.nan, 0.0), (0.0, math.inf), (-math.inf, math.nan)])
def test_a_command_that_is_not_finite_is_refused_and_the_old_one_holds(bad):
    robot = Simulator(STIFF)
    robot.command(0.1, 0.0)
    robot.step(0.1)
    with pytest.raises(ValueError, match='not finite'):
        robot.command(*bad)
    robot.step(0.1)
    assert robot.true_velocity[0] > 0.09


@settings(max_examples=25, deadline=None)
@given(st.floats(-100, 100), st.floats(-100, 100), st.floats(-360, 360))
def test_the_start_only_moves_the_whole_drive(x, y, yaw_deg):
    moved = Simulator(replace(QUIET, start_x=x, start_y=y, start_yaw_deg=yaw_deg))
    plain = Simulator(QUIET)
    for robot in moved, plain:
        drive(robot, 2.0, 0.1, 0.7)
    start = Pose2(x, y, math.radians(yaw_deg))
    assert close(moved.truth, start @ plain.truth, metres=1e-9, radians=1e-9)


# Sensors ------------------------------------------------------------------------------------------

def test_the_odometry_follows_the_truth_to_the_ticks():
    robot = Simulator(replace(QUIET, start_x=1.0, start_y=-2.0, start_yaw_deg=-100.0))
    for linear, angular in ((0.2, 0.0), (0.1, 0.6), (-0.1, -0.6), (0.0, 1.0)):
        sample = odom_of(drive(robot, 2.0, linear, angular))[-1]
        assert sample.stamp == pytest.approx(robot.now)
        assert close(sample.pose, robot.truth, metres=2 * TICK + 1e-4, radians=1e-9)
        v, w = robot.true_velocity
        assert sample.linear == pytest.approx(v, abs=TICK * 30)
        assert sample.angular == pytest.approx(w, abs=1e-6)


def test_wheel_angles_are_whole_ticks_of_the_travel():
    robot = Simulator(QUIET)
    drive(robot, 3.0, 0.15, 0.0)
    for angle in robot.wheel_angles:
        assert angle * 0.033 == pytest.approx(robot.truth.x, abs=1.01 * TICK)
        assert angle / 0.001533981 == pytest.approx(round(angle / 0.001533981), abs=0.01)
    assert robot.wheel_speeds == pytest.approx((0.15 / 0.033,) * 2, abs=0.0016 * 30)


@pytest.mark.parametrize('offset', [0.0, 140.0, -105.5, 180.0, 360.0])
def test_imu_and_odometry_differ_by_the_offset(offset):
    robot = Simulator(replace(QUIET, start_yaw_deg=50.0, imu_offset_deg=offset))
    samples = drive(robot, 4.0, 0.0, -2.0)
    yaw_at = {round(s.stamp, 6): s.yaw for s in imu_of(samples)}
    pairs = [(yaw_at[round(s.stamp, 6)], s.pose.yaw) for s in odom_of(samples)
             if round(s.stamp, 6) in yaw_at]
    assert len(pairs) > 30
    for imu_yaw, odom_yaw in pairs:
        assert -math.pi < imu_yaw <= math.pi and -math.pi < odom_yaw <= math.pi
        assert wrap(imu_yaw - odom_yaw - math.radians(offset)) == pytest.approx(0.0, abs=1e-9)


def test_the_imu_sees_every_moment_of_a_turn_that_begins():
    robot = Simulator(replace(QUIET, motor_lag=0.1))
    rate = 101 * MOTOR_STEP / 0.08   # 1 rad/s is 101.1 steps
    for sample in imu_of(drive(robot, 0.4, 0.0, 1.0)):
        since = max(0.0, sample.stamp - 1 / 30)
        fading = math.exp(-since / 0.1)
        assert sample.yaw_rate == pytest.approx(rate * (1 - fading), abs=1e-9)
        assert sample.yaw == pytest.approx(rate * (since - 0.1 * (1 - fading)), abs=1e-9)


@pytest.mark.parametrize('direction', [-1, 1])
@pytest.mark.parametrize('offset', [0.0, 90.0])
def test_one_spike_where_the_imu_crosses_half_a_turn(direction, offset):
    config = replace(STIFF, start_yaw_deg=direction * 140.0, imu_offset_deg=offset)
    robot = Simulator(config)
    samples = odom_of(drive(robot, 6.0, 0.05, direction * 1.0))
    spikes = [s for s in samples if abs(s.angular) > 10.0]
    assert len(spikes) == 1
    # The board takes the crossing for a whole turn the other way within 1/30 s.
    rate = robot.true_velocity[1]
    assert spikes[0].angular == pytest.approx(rate - direction * 2 * math.pi * 30, abs=0.01)
    before = samples[samples.index(spikes[0]) - 1]
    moved = before.pose.inverse() @ spikes[0].pose
    assert moved.x == pytest.approx(-0.05 / 30, abs=2 * TICK)     # taken backwards
    assert samples[-1].pose.yaw == pytest.approx(robot.truth.yaw, abs=1e-9)


def test_noise_has_the_size_asked_for():
    samples = imu_of(Simulator(SimulatorConfig(imu_noise_deg=0.2, gyro_noise=0.03)).step(60.0))
    for values, sigma in (([math.degrees(s.yaw) for s in samples], 0.2),
                          ([s.yaw_rate for s in samples], 0.03)):
        mean = sum(values) / len(values)
        spread = math.sqrt(sum((v - mean) ** 2 for v in values) / len(values))
        # 12000 numbers: the mean is good to 1 %, the spread to 0.7 % of sigma (one sigma)
        assert abs(mean) < 0.04 * sigma and spread == pytest.approx(sigma, rel=0.03)
    a, b = [s.yaw for s in samples], [s.yaw_rate for s in samples]
    correlation = sum(p * q for p, q in zip(a, b)) / len(a) / math.radians(0.2) / 0.03
    assert abs(correlation) < 0.04


def test_drift_reaches_imu_and_odometry_but_not_the_robot():
    robot = Simulator(replace(QUIET, imu_drift_deg_per_min=6.0))
    samples = robot.step(120.0)
    imu, odom = imu_of(samples)[-1], odom_of(samples)[-1]
    assert math.degrees(imu.yaw) == pytest.approx(12.0)
    assert math.degrees(odom.pose.yaw) == pytest.approx(12.0)
    assert math.degrees(imu.yaw_rate) == pytest.approx(0.1)
    assert robot.truth == Pose2()


def test_a_smaller_right_wheel_bends_the_way_to_the_right():
    robot = Simulator(replace(STIFF, wheel_mismatch=0.03))
    odometry = odom_of(drive(robot, 5.0, 0.1, 0.0))[-1]
    left = 126 * MOTOR_STEP * (5.0 - 1 / 30)
    assert robot.truth.yaw == pytest.approx(-0.03 * left / 0.16, rel=1e-9)
    assert odometry.pose.yaw == pytest.approx(robot.truth.yaw, abs=1e-9)  # the IMU sees it


def test_slip_loses_travel_and_the_encoders_do_not_know():
    robot = Simulator(replace(STIFF, slip=0.2))
    odometry = odom_of(drive(robot, 5.0, 0.1, 0.0))[-1]
    assert robot.truth.x == pytest.approx(0.8 * odometry.pose.x, abs=2 * TICK)
    stuck = Simulator(replace(STIFF, slip=1.0))
    odometry = odom_of(drive(stuck, 5.0, 0.1, 1.0))[-1]
    assert stuck.truth == Pose2() and odometry.pose.x > 0.4


# Reset --------------------------------------------------------------------------------------------

def test_reset_zeroes_the_odometry_and_leaves_the_imu():
    robot = Simulator(replace(QUIET, start_x=2.0, start_yaw_deg=30.0, imu_offset_deg=10.0))
    drive(robot, 2.0, 0.1, 0.3)
    drive(robot, 0.5, 0.0, 0.0)
    imu_before = imu_of(robot.step(0.1))[-1]
    truth, moment = robot.truth, robot.now
    robot.reset()
    assert robot.step(1.0) == []
    robot.reset()   # lost: the board is busy
    samples = robot.step(3.0)
    assert min(s.stamp for s in samples) == pytest.approx(moment + 512 / 200, abs=0.01)
    # 0.6 s after the stop the wheels still turn by some nanometres.
    for sample in odom_of(samples)[0], odom_of(samples)[-1]:
        assert close(sample.pose, Pose2(), metres=1e-6, radians=1e-6)
    assert imu_of(samples)[-1].yaw == pytest.approx(imu_before.yaw, abs=1e-6)
    assert robot.wheel_angles == (0.0, 0.0)
    assert close(robot.truth, truth, metres=1e-6, radians=1e-6)


@pytest.mark.parametrize('runs_on', [False, True])
def test_reset_while_driving(runs_on):
    robot = Simulator(replace(QUIET, reset_runs_on=runs_on))
    drive(robot, 1.0, 0.1, 0.0)
    start = robot.truth.x
    robot.reset()
    assert drive(robot, 2.5, -0.1, 0.0) == []   # deaf as well as dumb
    way = robot.truth.x - start
    assert way == pytest.approx(0.25 if runs_on else 0.1 * 0.05, abs=0.002)


def test_a_command_to_the_busy_board_is_lost():
    robot = Simulator(replace(STIFF, reset_pause=0.3))
    robot.reset()
    robot.step(0.2)
    robot.command(0.1, 0.0)
    robot.step(0.2)
    assert robot.truth == Pose2()


# Faults and latencies -----------------------------------------------------------------------------

def test_a_sample_arrives_later_but_is_as_old_as_it_is():
    late, direct = Simulator(SimulatorConfig(sensor_latency=0.1)), Simulator()
    samples = direct.step(1.0)
    assert late.step(0.09) == []
    assert late.step(0.91) == [s for s in samples if s.stamp <= 0.9 + 1e-9]
    assert late.step(0.1) == [s for s in samples if s.stamp > 0.9 + 1e-9]


def test_a_command_under_way_has_no_effect_yet():
    robot = Simulator(replace(STIFF, command_latency=0.3))
    robot.command(0.1, 0.0)
    robot.step(0.29)
    assert robot.true_velocity == (0.0, 0.0)
    robot.step(0.05)
    assert robot.true_velocity[0] > 0.09
    robot.step(0.45)   # the timeout counts from the arrival
    assert robot.true_velocity[0] > 0.09
    robot.step(0.06)
    assert robot.true_velocity == (0.0, 0.0)


def test_the_network_changes_what_arrives_when_but_not_what_is_measured():
    """The noise is the same, nothing is lost, and each sensor's samples keep their order."""
    direct = Simulator().step(60.0)
    late = Simulator(SimulatorConfig(**NETWORKS['bad'])).step(61.0)
    for kind in imu_of, odom_of:
        assert kind(late)[:len(kind(direct))] == kind(direct)


def test_samples_are_late_by_the_jitter():
    robot = Simulator(SimulatorConfig(imu_rate=1.0, odom_silent=True, sensor_jitter=0.05))
    times = [robot.now - sample.stamp for _ in range(200000) for sample in robot.step(0.002)]
    # 0.05 s, and half a step until it is seen; 400 numbers: good to 5 %
    assert len(times) == pytest.approx(400, abs=1)
    assert sum(times) / len(times) == pytest.approx(0.05 + 0.001, rel=0.15)


def test_commands_are_late_by_the_jitter():
    robot = Simulator(replace(STIFF, command_jitter=0.2, seed=5))
    times = []
    for _ in range(200):
        robot.command(0.1, 0.0)
        sent = robot.now
        while robot.true_velocity[0] == 0.0 and robot.now < sent + 5.0:
            robot.step(0.005)
        times.append(robot.now - sent)
        robot.step(3.0)   # the command has timed out
        assert robot.true_velocity[0] == 0.0
    # 0.2 s, and up to the board's next tick, 1/60 s on average; 200 numbers: good to 7 %
    assert sum(times) / len(times) == pytest.approx(0.2 + 1 / 60 + 0.0025, rel=0.2)


def cut(robot, is_cut):
    robot.configure(replace(robot.config, network_cut=is_cut))


def test_a_cut_holds_up_samples_and_they_come_in_one_burst():
    robot, uncut = Simulator(), Simulator()
    samples = robot.step(1.0)
    cut(robot, True)
    assert robot.step(0.5) == [] and robot.step_in_bursts(0.25) == []
    cut(robot, False)
    bursts = robot.step_in_bursts(0.1)
    assert (len(imu_of(bursts[0])), len(odom_of(bursts[0]))) == (150, 22)
    # from then on each arrives when it is measured: two together only where both sensors are due
    assert all(len({sample.stamp for sample in burst}) == 1 for burst in bursts[1:])
    assert sum(len(imu_of(burst)) for burst in bursts[1:]) == 20
    assert samples + [sample for burst in bursts for sample in burst] == uncut.step(1.85)


def test_what_arrives_together_is_known_from_what_arrives_one_after_the_other():
    """Bursts are the samples of a step, and one of them is a stall: nothing of it is missing."""
    config = SimulatorConfig(stalls_per_min=60.0, longest_stall=0.5)
    robot = Simulator(config)
    bursts = [burst for _ in range(40) for burst in robot.step_in_bursts(0.5)]
    assert [sample for burst in bursts for sample in burst] == Simulator(config).step(20.0)
    lengths = [burst[-1].stamp - burst[0].stamp for burst in bursts]
    # 1 s to the next one, 0.25 s long on average: 16 in 20 s, give or take 4
    assert 5 < sum(length > 0.0 for length in lengths) < 28
    assert 0.25 < max(lengths) <= 0.5
    for burst in bursts:
        stamps = [sample.stamp for sample in imu_of(burst)]
        assert all(b - a == pytest.approx(0.005) for a, b in zip(stamps, stamps[1:]))


def test_the_firmware_stops_in_a_cut_and_then_obeys_the_newest_command():
    robot = Simulator(STIFF)
    robot.step(1.0)
    robot.command(0.1, 0.0)
    robot.step(0.1)
    cut(robot, True)
    for _ in range(8):
        robot.command(-0.05, 0.0)    # held up, and no command for the timeout
        robot.step(0.05)
    assert robot.true_velocity[0] > 0.09
    robot.command(0.2, 0.0)
    robot.step(0.1)
    assert robot.true_velocity == (0.0, 0.0)
    robot.step(5.0)
    assert robot.true_velocity == (0.0, 0.0)
    cut(robot, False)                # the newest one, sent 5.1 s ago, arrives now
    robot.step(1 / 30)
    assert robot.true_velocity[0] == pytest.approx(0.2, abs=MOTOR_STEP)
    robot.step(0.49 - 1 / 30)        # the timeout counts from the arrival
    assert robot.true_velocity[0] > 0.19
    robot.step(0.01 + 1 / 30)
    assert robot.true_velocity == (0.0, 0.0)


@pytest.mark.parametrize('stalled', ['both', 'sensors', 'commands'])
def test_stalls_hold_up_the_directions_asked_for(stalled):
    robot = Simulator(replace(STIFF, stalls_per_min=120.0, longest_stall=4.0, stalled=stalled))
    longest, stops, arrived = 0.0, 0, 0.0
    for _ in range(6000):
        robot.command(0.1, 0.0)
        moving = robot.true_velocity[0] > 0.0
        samples = robot.step(0.01)
        stops += moving and robot.true_velocity[0] == 0.0
        arrived = robot.now if samples else arrived
        longest = max(longest, robot.now - arrived)
    # 24 stalls in 60 s, three of four longer than the board's patience and a tick
    assert stops == 0 if stalled == 'sensors' else stops > 8
    assert longest < 0.02 if stalled == 'commands' else 2.0 < longest <= 4.0


@pytest.mark.parametrize('fault, lost', [('imu_silent', ImuSample),
                                         ('odom_silent', OdometrySample)])
def test_silence_is_switched_on_and_off(fault, lost):
    robot = Simulator()
    count = len(robot.step(1.0))
    robot.configure(replace(robot.config, **{fault: True}))
    samples = robot.step(1.0)
    assert samples and not any(isinstance(s, lost) for s in samples)
    robot.configure(replace(robot.config, **{fault: False}))
    assert len(robot.step(1.0)) == count


@pytest.mark.parametrize('fault, frozen_of', [('imu_frozen', imu_of), ('odom_frozen', odom_of)])
def test_a_frozen_sensor_repeats_itself_with_new_stamps(fault, frozen_of):
    robot = Simulator()
    drive(robot, 1.0, 0.1, 0.5)
    robot.configure(replace(robot.config, **{fault: True}))
    frozen = frozen_of(drive(robot, 1.0, 0.1, 0.5))
    assert len(frozen) >= 29 and len({s.stamp for s in frozen}) == len(frozen)
    assert all(with_stamp(s, 0.0) == with_stamp(frozen[0], 0.0) for s in frozen)
    robot.configure(replace(robot.config, **{fault: False}))
    thawed = frozen_of(drive(robot, 0.1, 0.1, 0.5))
    assert with_stamp(thawed[-1], 0.0) != with_stamp(frozen[0], 0.0)


def test_dropouts_silence_both_sensors_for_a_while():
    samples = Simulator(SimulatorConfig(dropouts_per_min=6.0)).step(3600.0)
    gaps = [(a.stamp, b.stamp) for a, b in zip(samples, samples[1:]) if b.stamp - a.stamp > 0.01]
    lengths = [end - start for start, end in gaps]
    # 10 s to the next, 2.3 s long on average: 293 an hour, give or take sqrt(293)
    assert 240 < len(gaps) < 350
    assert min(lengths) >= 0.3 and max(lengths) <= 4.3 + 0.01
    assert sum(lengths) / len(lengths) == pytest.approx(2.3, abs=0.3)


def test_what_belongs_to_the_start_cannot_change_later():
    robot = Simulator()
    other = {'model': 'waffle', 'start_x': 1.0, 'start_y': 1.0, 'start_yaw_deg': 1.0,
             'imu_offset_deg': 1.0, 'seed': 2}
    assert set(other) == set(STARTING)
    for name, value in other.items():
        with pytest.raises(ValueError, match=name):
            robot.configure(replace(robot.config, **{name: value}))
    assert robot.config == SimulatorConfig()


@pytest.mark.parametrize('name', sorted(
    {item.name for item in fields(SimulatorConfig)} - set(STARTING) - set(FAULTS)
    - {'stalled', 'network_cut'}))
def test_physics_may_change_while_it_drives(name):
    """Nothing jumps: what has been driven so far stays."""
    robot = Simulator(QUIET)
    drive(robot, 1.0, 0.1, 0.5)
    robot.step(0.013)   # between two ticks of the board
    truth = robot.truth
    value = getattr(robot.config, name)
    changed = (not value) if isinstance(value, bool) else 0.3 + value / 2.0 if value < 1 else 20.0
    if name == 'reset_pause':
        changed = 1.0
    robot.configure(replace(robot.config, **{name: changed}))
    assert close(robot.truth, truth, metres=1e-6, radians=1e-6)
    assert drive(robot, 1.0, 0.1, 0.5)


@pytest.mark.parametrize('bad', [
    {'model': 'pioneer'}, {'slip': 1.1}, {'slip': -0.1}, {'imu_rate': 0.0},
    {'motor_lag': -1.0}, {'start_x': math.nan}, {'sensor_latency': math.inf},
    {'imu_silent': 1}, {'seed': 1.5}, {'stalled': 'imu'}, {'stalls_per_min': 121.0},
    {'command_jitter': -0.001}, {'odom_rate': 'often'}, {'wheel_mismatch': 1.0}])
def test_nonsense_is_refused_by_name(bad):
    with pytest.raises(ValueError, match=list(bad)[0]):
        SimulatorConfig(**bad)


def test_the_launch_file_offers_every_setting_in_the_same_words():
    offered = {arg.get('name'): arg.get('doc') for arg in
               ElementTree.parse(str(LAUNCH)).getroot().findall('arg')}
    for item in fields(SimulatorConfig):
        unit = item.metadata['unit']
        assert offered[item.name] == item.metadata['meaning'] + (
            ' [{}]'.format(unit) if unit else '')
