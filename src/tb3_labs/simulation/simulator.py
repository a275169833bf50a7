"""The embedded robot: a TurtleBot3 as its firmware, motors and sensors behave.

    robot = Simulator(SimulatorConfig(start_x=1.0, start_yaw_deg=90.0))
    robot.command(0.1, 0.5)
    for sample in robot.step(0.02):
        ...                            # ImuSample and OdometrySample, by time of arrival

Parts: :mod:`tb3_labs.simulation.firmware` turns commands into motor speeds and encoders into odometry,
:mod:`tb3_labs.simulation.drivetrain` moves the robot, :mod:`tb3_labs.simulation.imu` watches it turn,
:mod:`tb3_labs.simulation.faults` spoils the samples, and :mod:`tb3_labs.simulation.network` delays them and the
commands. Here is the clock that drives them. A step of any length gives every sample that arrives
in it, and cutting the same time into other steps changes nothing: the same seed gives the same
samples.

Frames: `truth` is in `world`, where the odometry starts without error; the IMU's yaw differs from
it by `imu_offset_deg`. Stamps count seconds from 0 and never jump.
Edge cases: a command that is not finite raises ``ValueError``; one that arrives while the board
recalibrates (see :meth:`Simulator.reset`) is lost; a second reset then is, too.
Source: the firmware where marked; noise from a recording of a real Burger at rest.
"""
import math
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter

from tb3_labs.config import Config, setting
from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.turtlebot3 import (
    COMMAND_TIMEOUT, CONTROL_RATE, DEFAULT_MODEL, MODELS, robot_model)
from tb3_labs.simulation.drivetrain import Drivetrain
from tb3_labs.simulation.faults import Dropouts, SensorFaults
from tb3_labs.simulation.firmware import Odometer, encoder, motor_speeds
from tb3_labs.simulation.imu import ImuModel
from tb3_labs.simulation.network import LONGEST_STALL, STALLED, Link, LinkSettings

#: Events this little after the end of a step belong to it: many small steps do not add up to
#: exactly one large one [s].
ROUNDING = 1e-9


@dataclass(frozen=True)
class SimulatorConfig(Config):
    """Everything that can be set about the embedded robot; `STARTING` lists what only a new
    start can change."""

    model: str = setting(DEFAULT_MODEL, 'kind of TurtleBot3', choices=tuple(MODELS))
    start_x: float = setting(0.0, 'true x at the start, also of the odometry', 'm', -1000.0, 1000.0)
    start_y: float = setting(0.0, 'true y at the start, also of the odometry', 'm', -1000.0, 1000.0)
    start_yaw_deg: float = setting(
        0.0, 'true heading at the start, also of the odometry', 'deg', -360.0, 360.0)
    imu_offset_deg: float = setting(
        0.0, 'yaw of the IMU minus yaw of the odometry at the start', 'deg', -360.0, 360.0)
    seed: int = setting(1, 'seed of noise, dropouts and network', low=0, high=2 ** 31 - 1)

    imu_rate: float = setting(200.0, 'samples of the IMU', '1/s', 1.0, 1000.0)
    odom_rate: float = setting(30.0, 'samples of the odometry', '1/s', 1.0, 200.0)
    imu_noise_deg: float = setting(
        0.005, 'white noise of the yaw, standard deviation', 'deg', 0.0, 10.0)
    gyro_noise: float = setting(
        0.001, 'white noise of the rate of turn, standard deviation', 'rad/s', 0.0, 1.0)
    imu_drift_deg_per_min: float = setting(
        0.0, 'drift of the yaw, and bias of the gyro', 'deg/min', -600.0, 600.0)
    wheel_mismatch: float = setting(
        0.0, 'fraction by which the right wheel is smaller than the firmware thinks', '',
        -0.5, 0.5)
    slip: float = setting(
        0.0, "fraction of the wheels' travel that is lost; 1 = wheels turn, robot stands", '',
        0.0, 1.0)
    motor_lag: float = setting(
        0.05, 'time constant of the motors, first order', 's', 0.0, 2.0)
    command_latency: float = setting(0.0, 'time a command is under way', 's', 0.0, 5.0)
    sensor_latency: float = setting(0.0, 'time a sample is under way', 's', 0.0, 5.0)
    command_jitter: float = setting(
        0.0, 'mean of a random time on top, drawn for each command (exponential)', 's', 0.0, 1.0)
    sensor_jitter: float = setting(
        0.0, 'mean of a random time on top, drawn for each sample (exponential)', 's', 0.0, 1.0)
    stalls_per_min: float = setting(
        0.0, 'stalls of the network: at random all is held up, then arrives at once', '1/min',
        0.0, 120.0)
    longest_stall: float = setting(
        LONGEST_STALL, 'longest stall; each lasts a random time up to this', 's', 0.0, 10.0)
    stalled: str = setting(STALLED[0], 'directions that stalls hold up', choices=STALLED)
    # 512 readings at 200 Hz; the firmware gives up after 5 s.
    reset_pause: float = setting(
        2.56, 'time the board recalibrates its gyro after `reset` and does nothing else', 's',
        0.0, 10.0)
    reset_runs_on: bool = setting(
        False, 'motors keep their speed during that pause (nothing in the firmware stops them)')

    motors_off: bool = setting(False, 'fault: the wheels stand, whatever is commanded')
    imu_silent: bool = setting(False, 'fault: no samples of the IMU')
    imu_frozen: bool = setting(False, 'fault: the same IMU sample again, with new stamps')
    odom_silent: bool = setting(False, 'fault: no samples of the odometry')
    odom_frozen: bool = setting(False, 'fault: the same odometry again, with new stamps')
    dropouts_per_min: float = setting(
        0.0, 'fault: both sensors silent at random, for 0.3 to 4.3 s', '1/min', 0.0, 60.0)
    network_cut: bool = setting(
        False, 'fault: nothing arrives in either direction; when it ends, all arrives at once')


#: What says how the robot starts; the other settings may change while it runs.
STARTING = ('model', 'start_x', 'start_y', 'start_yaw_deg', 'imu_offset_deg', 'seed')
#: The faults; a change of one starts all of them anew.
FAULTS = ('imu_silent', 'imu_frozen', 'odom_silent', 'odom_frozen', 'dropouts_per_min')


class Simulator:
    """One robot. Not safe to call from two threads at once."""

    def __init__(self, config=SimulatorConfig()):
        self._model = robot_model(config.model)
        start = Pose2(config.start_x, config.start_y, wrap(math.radians(config.start_yaw_deg)))
        self._drivetrain = Drivetrain(self._model, start)
        offset = math.radians(config.imu_offset_deg)
        self._imu = ImuModel(offset, config.seed)
        self._odometer = Odometer(self._model, start, wrap(start.yaw + offset))

        self._now = 0.0
        self._moved = 0.0           # up to here the drivetrain has moved
        self._control_rhythm = _Rhythm(CONTROL_RATE)
        self._odom_rhythm = _Rhythm(config.odom_rate)
        self._odometry_stamp = 0.0
        self._imu_rhythm = _Rhythm(config.imu_rate)

        self._command_link = Link('commands', config.seed)
        self._sensor_link = Link('sensors', config.seed)
        self._sent = []             # samples of this step, oldest first
        self._command = (-math.inf, 0.0, 0.0)   # arrival [s], forward speed, rate of turn
        self._obeyed = None         # (forward speed, rate of turn) that the motors follow
        self._busy_until = -math.inf
        self._resetting = False
        self._origin = Pose2()
        self._config = config
        self._plan_faults()
        self._apply(config)

    @property
    def config(self):
        return self._config

    @property
    def now(self):
        """Time since the start [s]."""
        return self._now

    @property
    def truth(self):
        """Where the robot truly is: world_T_base."""
        return self._drivetrain.ahead(self._now - self._moved).pose

    @property
    def odometry_origin(self):
        """Where the odometry's frame stands: world_T_odom, by the truth of the last reset."""
        return self._origin

    @property
    def true_velocity(self):
        """(forward speed [m/s], rate of turn [rad/s]) over the floor."""
        return self._drivetrain.ahead(self._now - self._moved).velocity

    @property
    def wheel_angles(self):
        """(left, right) as of the last odometry [rad]."""
        return self._odometer.wheel_angles

    @property
    def wheel_speeds(self):
        """(left, right) as of the last odometry [rad/s]."""
        return self._odometer.wheel_speeds

    @property
    def odometry_stamp(self):
        """When the last odometry was measured, whether or not it has arrived [s]."""
        return self._odometry_stamp

    def configure(self, config):
        """Go on with other settings; ``ValueError`` if one of `STARTING` differs."""
        for name in STARTING:
            if getattr(config, name) != getattr(self._config, name):
                raise ValueError('{} = {!r} is not valid: it only counts at the start'.format(
                    name, getattr(config, name)))
        self._move_to(self._now)
        self._apply(config)

    def _apply(self, config):
        before, self._config = self._config, config
        self._drivetrain.set_physics(config.motor_lag, config.wheel_mismatch, config.slip)
        self._imu.configure(math.radians(config.imu_noise_deg), config.gyro_noise,
                            math.radians(config.imu_drift_deg_per_min) / 60.0)
        self._imu_rhythm.set_rate(config.imu_rate, self._now)
        self._odom_rhythm.set_rate(config.odom_rate, self._now)
        self._apply_network(config)
        if any(getattr(config, name) != getattr(before, name) for name in FAULTS):
            self._plan_faults()

    def _apply_network(self, config):
        for link, delay, jitter in (
                (self._command_link, config.command_latency, config.command_jitter),
                (self._sensor_link, config.sensor_latency, config.sensor_jitter)):
            link.configure(LinkSettings(delay, jitter, config.stalls_per_min, config.longest_stall,
                                        config.stalled, config.network_cut), self._now)

    def _plan_faults(self):
        config = self._config
        dropouts = Dropouts(config.dropouts_per_min / 60.0, self._now, config.seed)
        self._imu_faults = SensorFaults(config.imu_silent, config.imu_frozen, dropouts)
        self._odom_faults = SensorFaults(config.odom_silent, config.odom_frozen, dropouts)

    def command(self, linear, angular):
        """A command is sent now: forward speed [m/s], rate of turn [rad/s]."""
        if not (math.isfinite(linear) and math.isfinite(angular)):
            raise ValueError('command ({}, {}) is not finite'.format(linear, angular))
        self._command_link.send(((linear, angular),), (self._now,))

    def reset(self):
        """The firmware's reset: the board recalibrates its gyro and is deaf and dumb meanwhile;
        then the odometry's pose is zero and the IMU's yaw is what it was. Keep the robot still.
        """
        if not self._resetting:
            self._move_to(self._now)
            self._resetting = True
            self._busy_until = self._now + self._config.reset_pause
            if not self._config.reset_runs_on:
                self._obeyed = None
                self._drivetrain.set_goals(0.0, 0.0)

    def step(self, dt):
        """Let `dt` seconds pass; the samples that arrive in that time, in order."""
        self._pass(dt)
        if self._sensor_link.is_clear:      # no detour where nothing is delayed
            sent, self._sent = self._sent, []
            return sent
        return [sample for _, sample in self._arrivals()]

    def step_in_bursts(self, dt):
        """As :meth:`step`, but samples that arrive at the same moment, as after a stall, are
        together in one list."""
        self._pass(dt)
        return [[sample for _, sample in burst]
                for _, burst in groupby(self._arrivals(), itemgetter(0))]

    def _arrivals(self):
        sent, self._sent = self._sent, []
        self._sensor_link.send(sent, [sample.stamp for sample in sent])
        return self._sensor_link.take(self._now + ROUNDING)

    def _pass(self, dt):
        if not 0.0 <= dt < math.inf:
            raise ValueError('a step of {} s'.format(dt))
        self._now += dt
        horizon = self._now + ROUNDING
        imu, odom, control = self._imu_rhythm, self._odom_rhythm, self._control_rhythm
        while True:
            # At one moment the board drives, then does odometry, then sends the IMU.
            tick = min(control.due, odom.due)
            if imu.due < tick:
                self._measure_imu(min(tick, horizon))
            if tick > horizon:
                return
            if control.due == tick:
                self._drive(control.take())
            else:
                self._measure_odometry(odom.take())

    def _move_to(self, stamp):
        """Bring the drivetrain, and the error of the IMU, up to `stamp`."""
        dt = stamp - self._moved
        if dt > 0.0:
            self._drivetrain.advance(dt)
            self._imu.advance(dt)
            self._moved = stamp

    def _drive(self, stamp):
        """The board's own tick: the newest command that has arrived goes to the motors."""
        for arrival, (linear, angular) in self._command_link.take(stamp):
            if arrival >= self._busy_until:
                self._command = arrival, linear, angular
        if stamp < self._busy_until:
            return
        self._move_to(stamp)
        arrival, linear, angular = self._command
        if self._config.motors_off or stamp - arrival > COMMAND_TIMEOUT:
            linear = angular = 0.0
        if (linear, angular) != self._obeyed:
            self._obeyed = linear, angular
            self._drivetrain.set_goals(*motor_speeds(linear, angular, self._model))

    def _measure_imu(self, end):
        """Every IMU sample that is due before `end`."""
        stamps = self._imu_rhythm.take_until(end)
        if self._resetting:
            stamps = [stamp for stamp in stamps if stamp >= self._busy_until]
        samples = self._imu.measure(stamps, self._moved, self._drivetrain.turning)
        self._sent.extend(self._imu_faults.outcome(samples))

    def _measure_odometry(self, stamp):
        if stamp < self._busy_until:
            return
        self._move_to(stamp)
        left, right = self._drivetrain.angles
        ticks = encoder(left), encoder(right)
        if self._resetting:
            self._odometer.reset(ticks)
            self._origin = self._drivetrain.pose
            self._resetting = False
        seen = self._imu.measure([stamp], stamp, self._drivetrain.turning)[0]
        sample = self._odometer.update(stamp, ticks, seen.yaw)
        self._odometry_stamp = stamp
        self._sent.extend(self._odom_faults.outcome([sample]))


class _Rhythm:
    """Moments at a fixed rate, counted, so that no rounding adds up."""

    def __init__(self, rate):
        self._rate, self._base, self._count = rate, 0.0, 1
        self.due = 1.0 / rate

    def take_until(self, end):
        """All moments that are due before `end`."""
        moments, due, count = [], self.due, self._count
        while due < end:
            moments.append(due)
            count += 1
            due = self._base + count / self._rate
        self.due, self._count = due, count
        return moments

    def take(self):
        """The moment that is due; the next one becomes due."""
        due = self.due
        self._count += 1
        self.due = self._base + self._count / self._rate
        return due

    def set_rate(self, rate, now):
        """Another rate from `now` on."""
        if rate != self._rate:
            self._rate, self._base, self._count = rate, now, 1
            self.due = now + 1.0 / rate
