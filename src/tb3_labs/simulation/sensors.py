"""Makes the samples of IMU and odometry, with the board's stamps and the faults of sensors.

Times are in seconds, rates in 1/s. Source: recordings of real TurtleBot3s, in which sensors were
silent for 0.3 to 4.3 s, and one sensor repeated a sample with new stamps for half a minute.
"""
import random
from collections import deque
from typing import Deque, Dict, List, NamedTuple, Sequence, Tuple

from tb3_labs.geometry.angles import wrap
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.robot.samples import Sample
from tb3_labs.robot.turtlebot3 import RobotModel
from tb3_labs.simulation.drivetrain import Body
from tb3_labs.simulation.firmware import Odometer, encoder_ticks
from tb3_labs.simulation.network import Arrival
from tb3_labs.simulation.simulator_config import SimulatorConfig

#: The IMU makes this number of samples in the longest stall, which takes 10 s.
MAX_SAMPLES = 2000
SYNC_PERIOD = 5.0    # the serial node sets the board's clock once in this time [s]


class WheelReading(NamedTuple):
    """The angles and speeds (left, right) of the wheels at one sample of the odometry."""

    stamp: float
    angles: Tuple[float, float]    # [rad]
    speeds: Tuple[float, float]    # [rad/s]


class Schedule:
    """The moments 1/`rate`, 2/`rate`, ... [s] of a periodic event."""

    def __init__(self, rate: float) -> None:
        self._rate = 0.0
        self.set_rate(rate, now=0.0)

    def set_rate(self, rate: float, now: float) -> None:
        """Use `rate` [1/s] from `now` [s] on. An equal rate changes nothing."""
        if rate != self._rate:
            self._rate = rate
            self._start = now
            self._count = 1
            self.due = now + 1.0 / rate    # the next moment [s]

    def pop(self) -> float:
        """Returns the moment `due` [s] and sets `due` to the next moment."""
        due = self.due
        self._count += 1
        self.due = self._start + self._count / self._rate
        return due

    def pop_until(self, end: float) -> List[float]:
        """Returns all moments before `end` [s]. The next call may return `end` itself."""
        moments = []
        while self.due < end:
            moments.append(self.pop())
        return moments


class BoardClock:
    """The board's clock. After each synchronisation its error is random, up to `max_error` [s]."""

    def __init__(self, max_error: float, seed: int) -> None:
        self._max_error, self._seed = max_error, seed
        self._sync_number = -1
        self._error = 0.0

    def error_at(self, now: float) -> float:
        """Returns the error [s] of the clock at the true time `now` [s]."""
        number = int(now / SYNC_PERIOD)
        if number != self._sync_number:
            generator = random.Random(f'time sync {number} {self._seed}')
            self._sync_number = number
            self._error = generator.uniform(-self._max_error, self._max_error)
        return self._error

    def restamp(self, arrivals: List[Arrival]) -> List[Arrival]:
        """Returns `arrivals` with stamps of the board's clock instead of true stamps."""
        if not self._max_error:
            return arrivals
        return [(moment, sample._replace(stamp=sample.stamp + self.error_at(sample.stamp)))
                for moment, sample in arrivals]


class Sensors:
    """Measures the motion of a Body by the IMU and the odometry."""

    def __init__(self, model: RobotModel, body: Body, config: SimulatorConfig) -> None:
        pose = body.drivetrain.pose
        self._body, self._config = body, config
        self.odometer = Odometer(model, pose, wrap(pose.yaw + body.imu.yaw_error))
        self.imu_schedule = Schedule(config.imu_rate)
        self.odom_schedule = Schedule(config.odom_rate)
        self._samples: List[Sample] = []    # oldest first
        self._is_reset_due = False
        self.world_T_odom = Pose2()    # a reset of the odometry changes this pose
        #: A reading for each sample of the odometry, even for a sample that was not sent.
        self.wheel_readings: Deque[WheelReading] = deque(maxlen=MAX_SAMPLES)
        # {'imu' or 'odom': the sample that this sensor repeats while it is frozen}
        self._frozen: Dict[str, Sample] = {}

    def configure(self, config: SimulatorConfig, now: float) -> None:
        self._config = config
        self.imu_schedule.set_rate(config.imu_rate, now)
        self.odom_schedule.set_rate(config.odom_rate, now)
        self.clock = BoardClock(config.stamp_step, config.seed)

    def reset_odometry(self) -> None:
        """Let the next odometry sample set the pose to zero."""
        self._is_reset_due = True

    def measure_imu(self, stamps: List[float]) -> None:
        samples = self._body.imu.measure(stamps)
        self._send('imu', samples, self._config.imu_silent, self._config.imu_frozen)

    def measure_odometry(self, stamp: float) -> None:
        self._body.advance_to(stamp)
        left, right = self._body.wheel_angles_at(stamp - self._config.wheel_lag)
        ticks = None if self._config.battery_cut else (encoder_ticks(left), encoder_ticks(right))
        if self._is_reset_due:
            self.odometer.reset(ticks)
        [imu_sample] = self._body.imu.measure([stamp])
        sample = self.odometer.update(stamp, ticks, imu_sample.yaw)
        if self._is_reset_due:
            self._is_reset_due = False
            self.world_T_odom = self._body.drivetrain.pose @ sample.pose.inverse()
        self.wheel_readings.append(WheelReading(
            stamp=stamp + self.clock.error_at(stamp), angles=self.odometer.wheel_angles,
            speeds=self.odometer.wheel_speeds))
        self._send('odom', [sample], self._config.odom_silent, self._config.odom_frozen)

    def _send(self, sensor: str, samples: Sequence[Sample], is_silent: bool,
              is_frozen: bool) -> None:
        """Send `samples`. A silent sensor sends nothing. A frozen sensor sends the same sample
        again and again, with the stamps of `samples`."""
        if is_silent:
            return
        if not is_frozen:
            self._frozen.pop(sensor, None)
        elif samples:
            frozen = self._frozen.setdefault(sensor, samples[0])
            samples = [frozen._replace(stamp=sample.stamp) for sample in samples]
        self._samples.extend(samples)

    def pop_samples(self) -> List[Sample]:
        """Returns the samples since the last call, oldest first, with true stamps."""
        samples, self._samples = self._samples, []
        return samples
