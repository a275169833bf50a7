"""The settings of the simulated robot, with unit, bounds and default (:mod:`tb3_labs.config`).

Launch files, parameters and dynamic_reconfigure use the same names as the fields below.
"""
from dataclasses import dataclass
from typing import Dict

from tb3_labs.config import Config, setting
from tb3_labs.robot.turtlebot3 import DEFAULT_MODEL, MODELS


@dataclass(frozen=True)
class SimulatorConfig(Config):
    """The settings of the simulated robot. The FIXED_FIELDS cannot change while the robot runs."""

    model: str = setting(DEFAULT_MODEL, 'kind of TurtleBot3', choices=tuple(MODELS))
    start_x: float = setting(0.0, 'x at the start, true and by odometry', 'm', -1000.0, 1000.0)
    start_y: float = setting(0.0, 'y at the start, true and by odometry', 'm', -1000.0, 1000.0)
    start_yaw_deg: float = setting(
        0.0, 'heading at the start, true and by odometry', 'deg', -360.0, 360.0)
    imu_offset_deg: float = setting(
        0.0, 'yaw of the IMU minus yaw of the odometry at the start', 'deg', -360.0, 360.0)
    seed: int = setting(1, 'seed of noise and network', low=0, high=2 ** 31 - 1)

    imu_rate: float = setting(200.0, 'samples of the IMU', '1/s', 1.0, 1000.0)
    odom_rate: float = setting(30.0, 'samples of the odometry', '1/s', 1.0, 200.0)
    imu_noise_deg: float = setting(
        0.005, 'white noise of the yaw, standard deviation', 'deg', 0.0, 10.0)
    gyro_noise: float = setting(
        0.001, 'white noise of the rate of turn, standard deviation; up to 0.00106 a robot at rest '
        'has no noise', 'rad/s', 0.0, 1.0)
    imu_drift_deg_per_min: float = setting(
        0.0, 'drift of the yaw, and bias of the gyro', 'deg/min', -600.0, 600.0)
    gyro_bias_deg: float = setting(
        0.0, 'bias of the gyro after a calibration in motion, until the next `reset`',
        'deg/s', -180.0, 180.0)
    # yaw_lag, wheel_lag and stamp_step were measured with the real firmware on a fast computer.
    yaw_lag: float = setting(
        0.0135, 'age of yaw and rate of turn at the stamps of IMU and odometry', 's', 0.0, 1.0)
    wheel_lag: float = setting(
        0.0085, "age of the encoders' reading at the odometry's stamp", 's', 0.0, 1.0)
    stamp_step: float = setting(
        0.0, 'largest error of the stamps; the error changes at each time sync, every 5 s',
        's', 0.0, 0.25)
    wheel_mismatch: float = setting(
        0.0, 'fraction by which the right wheel is smaller than the firmware assumes', '',
        -0.5, 0.5)
    slip: float = setting(
        0.0, "fraction of the wheels' travel that is lost; 1 = wheels turn, robot stands", '',
        0.0, 1.0)
    motor_lag: float = setting(
        0.05, 'time constant of the motors, first order', 's', 0.0, 2.0)
    command_latency: float = setting(0.0, 'delay of each command', 's', 0.0, 5.0)
    sensor_latency: float = setting(0.0, 'delay of each sample', 's', 0.0, 5.0)
    command_jitter: float = setting(
        0.0, 'mean of an additional random delay of each command (exponential)', 's', 0.0, 1.0)
    sensor_jitter: float = setting(
        0.0, 'mean of an additional random delay of each sample (exponential)', 's', 0.0, 1.0)
    stalls_per_min: float = setting(
        0.0, 'random stalls of the network: all is delayed, then arrives at once', '1/min',
        0.0, 120.0)
    # The default of longest_stall is the longest stall in the recordings.
    longest_stall: float = setting(
        0.4, 'longest stall; the length of a stall is random', 's', 0.0, 10.0)
    # The firmware calibrates the gyro with 512 readings at 200 Hz and gives up after 5 s.
    reset_pause: float = setting(
        2.56, 'time of a `reset`: the board only calibrates its gyro, and the motors run on',
        's', 0.0, 10.0)

    motors_off: bool = setting(
        False, 'fault: the wheels do not obey commands, because their torque is off')
    battery_cut: bool = setting(
        False, 'fault: the servos have no power, so the odometry repeats its last step')
    imu_silent: bool = setting(False, 'fault: no samples of the IMU')
    imu_frozen: bool = setting(False, 'fault: the same IMU sample repeated, with new stamps')
    odom_silent: bool = setting(False, 'fault: no samples of the odometry')
    odom_frozen: bool = setting(False, 'fault: the same odometry repeated, with new stamps')
    network_cut: bool = setting(
        False, 'fault: nothing arrives in either direction; at the end all arrives at once')


#: The fields that cannot change while the robot runs.
FIXED_FIELDS = ('model', 'start_x', 'start_y', 'start_yaw_deg', 'imu_offset_deg', 'seed')

#: {computer that is connected to the robot's board: {field: value}}. The values were measured with
#: the real firmware, first on a fast computer, then on a computer as slow as a Raspberry Pi.
HOSTS: Dict[str, Dict[str, float]] = {
    'default': {},
    'laptop': dict(imu_rate=171.0, odom_rate=29.9, stamp_step=0.008),
    'pi': dict(imu_rate=115.0, odom_rate=28.8, yaw_lag=0.085, wheel_lag=0.075, stamp_step=0.02),
}
