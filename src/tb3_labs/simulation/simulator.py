"""Simulates a TurtleBot3 with its firmware, motors and sensors.

    robot = Simulator(SimulatorConfig(start_x=1.0, start_yaw_deg=90.0))
    robot.command(0.1, 0.5)
    for sample in robot.step(0.02):
        ...                            # ImuSample or OdometrySample, in order of arrival

With the same seed the samples are the same, even if the steps have another length. The pose `truth`
is in the frame `world`. At the start the odometry's pose is equal to `truth`, and the IMU's yaw
differs from the true yaw by `imu_offset_deg`. Stamps are in seconds since the start.
"""
import math
from itertools import chain, groupby
from operator import itemgetter
from typing import List

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import Sample
from tb3_labs.robot.turtlebot3 import CONTROL_RATE, robot_model
from tb3_labs.simulation.drivetrain import Body
from tb3_labs.simulation.firmware import RESET_MESSAGE, Board, motor_speeds
from tb3_labs.simulation.imu import UNCALIBRATED_BIAS
from tb3_labs.simulation.network import NetworkLink
from tb3_labs.simulation.sensors import Schedule, Sensors
from tb3_labs.simulation.simulator_config import SimulatorConfig

#: A step also includes the events in this time [s] after its end. Without this tolerance, many
#: small steps could include fewer events than one large step, because their sum is rounded.
TIME_TOLERANCE = 1e-9


class Simulator:
    """One robot. Two threads must not call its methods at the same time."""

    def __init__(self, config: SimulatorConfig = SimulatorConfig()) -> None:
        self._model = robot_model(config.model)
        start = Pose2(config.start_x, config.start_y, wrap(math.radians(config.start_yaw_deg)))
        self._body = Body(self._model, start, math.radians(config.imu_offset_deg), config.seed)
        self.sensors = Sensors(self._model, self._body, config)
        self.now = 0.0    # time [s] since the start
        self._motor_schedule = Schedule(CONTROL_RATE)
        self._command_link = NetworkLink('command', config.seed)
        self._sensor_link = NetworkLink('sensor', config.seed)
        self._board = Board()
        self._motor_command = 0.0, 0.0    # (forward speed [m/s], rate of turn [rad/s])
        self._body.set_gyro_bias(math.radians(config.gyro_bias_deg))
        self._apply(config)

    @property
    def truth(self) -> Pose2:    # world_T_base
        return self._body.pose_at(self.now)

    def configure(self, config: SimulatorConfig) -> None:
        """From now on use all settings of `config` except FIXED_FIELDS."""
        if config is self.config:
            return
        self._body.advance_to(self.now)
        if config.gyro_bias_deg != self.config.gyro_bias_deg:
            self._body.set_gyro_bias(math.radians(config.gyro_bias_deg))
        self._apply(config)

    def _apply(self, config: SimulatorConfig) -> None:
        self.config = config
        body = self._body
        body.drivetrain.set_physics(config.motor_lag, config.wheel_mismatch, config.slip)
        body.imu.configure(
            yaw_noise=math.radians(config.imu_noise_deg), turn_rate_noise=config.gyro_noise,
            drift=math.radians(config.imu_drift_deg_per_min) / 60.0, sample_age=config.yaw_lag)
        body.save_motion()
        self.sensors.configure(config, self.now)
        for link in (self._command_link, self._sensor_link):
            link.configure(config, self.now)

    def command(self, linear: float, angular: float) -> None:
        """Send a command now. `linear` is the forward speed [m/s], `angular` the rate of turn
        [rad/s]. NaN and infinity are allowed; see :mod:`tb3_labs.simulation.firmware`."""
        self._command_link.send([(linear, angular)], [self.now])

    def reset(self) -> None:
        """Send a `reset` to the board now; see :mod:`tb3_labs.simulation.firmware`."""
        self._command_link.send([RESET_MESSAGE], [self.now])
        self._read_messages(self.now)

    def step(self, dt: float) -> List[Sample]:
        """Let `dt` seconds pass; `dt` >= 0. Returns the samples that arrive, in order."""
        return list(chain.from_iterable(self.step_in_bursts(dt)))

    def step_in_bursts(self, dt: float) -> List[List[Sample]]:
        """Let `dt` seconds pass; `dt` >= 0. Returns one list of samples for each moment at which
        samples arrive. After a stall of the network several samples arrive together."""
        self._advance(dt)
        sent = self.sensors.pop_samples()
        self._sensor_link.send(sent, [sample.stamp for sample in sent])
        arrivals = self.sensors.clock.restamp(self._sensor_link.pop(self.now + TIME_TOLERANCE))
        bursts = groupby(arrivals, key=itemgetter(0))    # by the time of arrival
        return [[sample for _, sample in burst] for _, burst in bursts]

    def _advance(self, dt: float) -> None:
        """Let `dt` seconds pass, and handle all events in this time, in order."""
        self.now += dt
        horizon = self.now + TIME_TOLERANCE
        board, sensors = self._board, self.sensors
        motor_schedule, odom_schedule = self._motor_schedule, sensors.odom_schedule
        while True:
            event_time = min(motor_schedule.due, odom_schedule.due, board.calibration_end)
            imu_stamps = sensors.imu_schedule.pop_until(min(event_time, horizon))
            if not board.is_calibrating:
                sensors.measure_imu(imu_stamps)
            if event_time > horizon:
                return

            # events at the same moment are handled in the order board, motors, odometry, IMU
            if board.calibration_end == event_time:
                self._body.advance_to(event_time)
                self._body.set_gyro_bias(board.end_calibration(self._body.yaw))
            elif motor_schedule.due == event_time:
                self._set_motors(motor_schedule.pop())
            else:
                odom_schedule.pop()
                if not board.is_calibrating:
                    sensors.measure_odometry(event_time)

    def _set_motors(self, stamp: float) -> None:
        self._read_messages(stamp)
        if self._board.is_calibrating:
            return
        command = self._board.command_in_force(stamp)
        if self.config.motors_off or self.config.battery_cut:
            command = 0.0, 0.0
        if command != self._motor_command:
            self._body.advance_to(stamp)
            self._motor_command = command
            self._body.drivetrain.set_goal_speeds(*motor_speeds(*command, self._model))
            self._body.save_motion()

    def _read_messages(self, stamp: float) -> None:
        """Let the board read its messages. After a reset the board calibrates the gyro."""
        if self._board.read_up_to_reset(self._command_link.pop(stamp)):
            self._body.advance_to(stamp)
            self._board.begin_calibration(stamp, self.config.reset_pause, self._body.yaw)
            self.sensors.reset_odometry()
            self._body.set_gyro_bias(UNCALIBRATED_BIAS)
