"""Faults of the simulated robot, and the effects of its network."""
from dataclasses import replace

import pytest
from simulated import MOTOR_STEP, STIFF, drive, imu_of, odom_of, switch

from tb3_labs.robot.samples import ImuSample, OdometrySample, with_stamp
from tb3_labs.simulation.network import NETWORKS
from tb3_labs.simulation.simulator import Simulator
from tb3_labs.simulation.simulator_config import SimulatorConfig


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


def test_the_network_changes_what_arrives_when_but_not_what_is_measured():
    """The noise is the same, nothing is lost, and each sensor's samples keep their order."""
    direct = Simulator().step(60.0)
    late = Simulator(SimulatorConfig(**NETWORKS['bad'])).step(61.0)
    for kind in imu_of, odom_of:
        assert kind(late)[:len(kind(direct))] == kind(direct)


def test_a_cut_holds_up_samples_and_they_come_in_one_burst():
    robot, uncut = Simulator(), Simulator()
    samples = robot.step(1.0)
    switch(robot, network_cut=True)
    assert robot.step(0.5) == [] and robot.step_in_bursts(0.25) == []
    switch(robot, network_cut=False)
    bursts = robot.step_in_bursts(0.1)
    assert (len(imu_of(bursts[0])), len(odom_of(bursts[0]))) == (150, 22)
    # from then on each arrives when it is measured: two together only where both sensors are due
    assert all(len({sample.stamp for sample in burst}) == 1 for burst in bursts[1:])
    assert sum(len(imu_of(burst)) for burst in bursts[1:]) == 20
    assert samples + [sample for burst in bursts for sample in burst] == uncut.step(1.85)


def test_the_firmware_stops_in_a_cut_and_then_obeys_the_newest_command():
    robot = Simulator(STIFF)
    robot.step(1.0)
    robot.command(0.1, 0.0)
    robot.step(0.1)
    switch(robot, network_cut=True)
    for _ in range(8):
        robot.command(-0.05, 0.0)    # delayed, and no command for the timeout
        robot.step(0.05)
    assert robot.true_velocity[0] > 0.09
    robot.command(0.2, 0.0)
    robot.step(0.1)
    assert robot.true_velocity == (0.0, 0.0)
    robot.step(5.0)
    assert robot.true_velocity == (0.0, 0.0)
    switch(robot, network_cut=False)      # the latest one, sent 5.1 s ago, arrives now
    robot.step(1 / 30)
    assert robot.true_velocity[0] == pytest.approx(0.2, abs=MOTOR_STEP)
    robot.step(0.49 - 1 / 30)        # the timeout counts from the arrival
    assert robot.true_velocity[0] > 0.19
    robot.step(0.01 + 1 / 30)
    assert robot.true_velocity == (0.0, 0.0)


@pytest.mark.parametrize('fault, lost', [('imu_silent', ImuSample),
                                         ('odom_silent', OdometrySample)])
def test_silence_is_switched_on_and_off(fault, lost):
    robot = Simulator()
    count = len(robot.step(1.0))
    switch(robot, **{fault: True})
    samples = robot.step(1.0)
    assert samples and not any(isinstance(s, lost) for s in samples)
    switch(robot, **{fault: False})
    assert len(robot.step(1.0)) == count


@pytest.mark.parametrize('fault, frozen_of', [('imu_frozen', imu_of), ('odom_frozen', odom_of)])
def test_a_frozen_sensor_repeats_itself_with_new_stamps(fault, frozen_of):
    robot = Simulator()
    drive(robot, 1.0, 0.1, 0.5)
    switch(robot, **{fault: True})
    frozen = frozen_of(drive(robot, 1.0, 0.1, 0.5))
    assert len(frozen) >= 29 and len({s.stamp for s in frozen}) == len(frozen)
    assert all(with_stamp(s, 0.0) == with_stamp(frozen[0], 0.0) for s in frozen)
    for is_frozen in (False, True):     # and the next time it repeats another sample
        switch(robot, **{fault: is_frozen})
        other = frozen_of(drive(robot, 0.1, 0.1, 0.5))[-1]
        assert with_stamp(other, 0.0) != with_stamp(frozen[0], 0.0)


def test_dropouts_silence_both_sensors_and_what_is_no_fault_leaves_them_alone():
    plain = Simulator(SimulatorConfig(dropouts_per_min=6.0, imu_rate=60.0, imu_frozen=True))
    tuned, stamps = Simulator(plain.config), []
    samples = plain.step(300.0)
    for k in range(300):
        switch(tuned, motor_lag=0.001 * k)
        stamps += [sample.stamp for sample in tuned.step(1.0)]
    assert stamps == [sample.stamp for sample in samples]
    lengths = [gap for gap in (b - a for a, b in zip(stamps, stamps[1:])) if gap > 0.02]
    # 10 s to the next, 2.3 s long on average: 24 in five minutes, give or take 5
    assert 12 < len(lengths) < 36
    assert min(lengths) >= 0.3 and max(lengths) <= 4.3 + 0.02
    assert len({sample.yaw for sample in imu_of(samples)}) == 1


def test_without_battery_the_odometry_repeats_its_last_step_and_the_wheels_stand():
    """As the firmware does, also after a reset. The speeds in joint_states go on, too."""
    robot = Simulator(STIFF)
    before, wheels = odom_of(drive(robot, 1.0, 0.2, 0.0))[-1], robot.sensors.odometer
    angles, speeds = wheels.wheel_angles, wheels.wheel_speeds
    switch(robot, battery_cut=True)
    place, last = robot.truth, odom_of(drive(robot, 5.0, 0.0, 0.0))[-1]
    assert robot.truth.distance_to(place) < 0.01
    assert last.pose.x - before.pose.x == pytest.approx(5.0 * before.linear, abs=0.01)
    robot.reset()
    last = odom_of(drive(robot, 3.0, 0.0, 0.0))[-1]
    assert last.linear == pytest.approx(before.linear) and last.pose.x > 0.05
    assert wheels.wheel_angles == angles and wheels.wheel_speeds == pytest.approx(speeds)
    switch(robot, battery_cut=False)
    assert odom_of(drive(robot, 1.0, 0.0, 0.0))[-1].linear == 0.0


def test_motors_that_are_off_stand_whatever_is_commanded_and_obey_again():
    robot = Simulator(STIFF)
    drive(robot, 0.5, 0.1, 0.0)
    switch(robot, motors_off=True)
    drive(robot, 0.1, 0.1, 0.0)
    place = robot.truth
    drive(robot, 1.0, 0.1, 1.0)
    assert robot.truth == place and robot.true_velocity == (0.0, 0.0)
    switch(robot, motors_off=False)
    drive(robot, 0.1, 0.1, 0.0)
    assert robot.true_velocity[0] == pytest.approx(0.1, abs=MOTOR_STEP)
