"""Shared by the tests of the simulated robot: robots without noise, drives, and sums by hand."""
from dataclasses import replace

from tb3_labs.geometry.angles import wrap
from tb3_labs.robot.samples import ImuSample, OdometrySample
from tb3_labs.simulation.simulator_config import SimulatorConfig

QUIET = SimulatorConfig(imu_noise_deg=0.0, gyro_noise=0.0, yaw_lag=0.0, wheel_lag=0.0)
STIFF = replace(QUIET, motor_lag=0.0)
TICK = 0.033 * 0.001533981                       # travel of one encoder tick [m]


def drive(robot, seconds, linear, angular):
    """Samples of a drive whose command is repeated at 20 Hz."""
    samples = []
    for _ in range(round(seconds * 20)):
        robot.command(linear, angular)
        samples += robot.step(0.05)
    return samples


def switch(robot, **settings):
    robot.configure(replace(robot.config, **settings))


def imu_of(samples):
    return [sample for sample in samples if isinstance(sample, ImuSample)]


def odom_of(samples):
    return [sample for sample in samples if isinstance(sample, OdometrySample)]


def close(pose, other, metres=1e-9, radians=1e-9):
    return (pose.distance_to(other) <= metres and abs(wrap(pose.yaw - other.yaw)) <= radians)
