"""A mystery robot is a simulated robot with one hidden fault, which a student has to find.

Each number from 1 to LAST_NUMBER always gives the same robot. In each block of numbers (1 to 11, 12
to 22, ...) each of the FAULT_KINDS occurs once, in a random order. Neighbouring numbers have
different faults. All random numbers come from ``random.Random(text).random()``, because this call
returns the same numbers in all versions of Python.

A student can compute the hidden fault with this file. So the exercise asks for a measurement as a
proof. Times are in seconds since the start.
"""
import random
from dataclasses import dataclass, field, replace
from typing import Any, List, Mapping, Tuple

from tb3_labs.simulation.simulator_config import SimulatorConfig

LAST_NUMBER = 9999         # number of the last robot; the first robot has the number 1
SEED_COUNT = 1e6           # a seed is a whole number below this number
FAULT_PAUSE_TIME = 12.0    # time [s] between two occurrences of an intermittent fault


@dataclass(frozen=True)
class Fault:
    """A kind of fault. A fault with a `value_field` is constant. A fault without a `value_field` is
    intermittent, and its value is the duration [s] of each occurrence."""

    name: str
    value_field: str                    # this field of SimulatorConfig is the value times `scale`
    value_range: Tuple[float, float]    # least and largest absolute value
    digits: int                         # digits of the value after the decimal point
    unit: str                           # unit of the value
    tolerance: float                    # largest error of a right answer, in `unit`
    quantity: str                       # tells the student what to measure
    scale: float = 1.0
    is_signed: bool = False             # the value can be negative
    #: {field of SimulatorConfig: its content while the fault occurs}
    extra_settings: Mapping[str, Any] = field(default_factory=dict)

    def text(self, value: float) -> str:
        """Returns `value` with its unit. A positive value of a signed fault has a +."""
        sign = '+' if self.is_signed else ''
        return f'{value:{sign}.{self.digits}f} {self.unit}'


def _intermittent_fault(name: str, field_name: str, quantity: str) -> Fault:
    return Fault(name, '', (2.0, 6.0), digits=1, unit='s', tolerance=0.3, quantity=quantity,
                 extra_settings={field_name: True})


#: All kinds of faults. A new row changes which fault belongs to which number of a mystery robot.
FAULT_KINDS = (
    Fault('imu offset', 'imu_offset_deg', (20.0, 160.0), digits=0, unit='deg', tolerance=3.0,
          quantity="the IMU's heading minus the odometry's, from -180 to 180", is_signed=True),
    Fault('imu drift', 'imu_drift_deg_per_min', (10.0, 60.0), digits=0, unit='deg/min',
          tolerance=2.0, is_signed=True,
          quantity="turn of the IMU's heading in a minute at rest, positive to the left"),
    Fault('wheel mismatch', 'wheel_mismatch', (3.0, 8.0), digits=1, unit='%', tolerance=0.5,
          quantity='share by which the right wheel is smaller than the left one; negative if it is '
          'larger. On a straight drive: turn [rad] = path [m] x share / distance of the wheels',
          scale=0.01, is_signed=True),
    Fault('slip', 'slip', (10.0, 40.0), digits=0, unit='%', tolerance=2.0, scale=0.01,
          quantity="share of the wheels' travel that does not move the robot"),
    _intermittent_fault('frozen imu', 'imu_frozen',
                        'duration of one freeze, in which /imu repeats one sample'),
    _intermittent_fault('frozen odometry', 'odom_frozen',
                        'duration of one freeze, in which /odom repeats one sample'),
    _intermittent_fault('silent imu', 'imu_silent', 'duration of one silence of /imu'),
    _intermittent_fault('silent odometry', 'odom_silent', 'duration of one silence of /odom'),
    Fault('sensor latency', 'sensor_latency', (0.2, 0.6), digits=2, unit='s', tolerance=0.03,
          quantity='delay of each sample, from its stamp to its arrival'),
    Fault('command latency', 'command_latency', (0.3, 1.0), digits=2, unit='s', tolerance=0.1,
          quantity='delay of each command, from its sending to its arrival'),
    Fault('network stalls', 'longest_stall', (0.5, 1.5), digits=2, unit='s', tolerance=0.15,
          quantity='the longest time for which nothing arrives on /imu and /odom',
          extra_settings={'stalls_per_min': 30.0}),
)


class HiddenFault:
    """The fault of the mystery robot `number`. Without the fault, the robot has `settings`. Raises
    ``ValueError`` if the number is not valid."""

    def __init__(self, number: int, settings: SimulatorConfig) -> None:
        self.fault, self.value, seed = fault_of(number)
        changes = dict(self.fault.extra_settings)
        if self.fault.value_field:
            changes[self.fault.value_field] = self.value * self.fault.scale
        self._faulty = replace(settings, seed=seed, **changes)
        self._healthy = replace(settings, seed=seed)

    def settings_at(self, now: float) -> SimulatorConfig:
        """Returns the settings at `now` [s]. Returns the same object until the settings change."""
        if self.fault.value_field:
            return self._faulty
        period = FAULT_PAUSE_TIME + self.value
        is_pause = now % period < FAULT_PAUSE_TIME    # each period begins with the pause
        return self._healthy if is_pause else self._faulty


def fault_of(number: int) -> Tuple[Fault, float, int]:
    """Returns the fault of mystery robot `number`, the fault's value, and the seed of the noise."""
    if not 1 <= number <= LAST_NUMBER:
        raise ValueError(
            f'mystery = {number} is not valid: a whole number from 1 to {LAST_NUMBER}')
    block, place = divmod(number - 1, len(FAULT_KINDS))
    fault = _faults_of_block(block)[place]
    generator = random.Random(f'mystery {number}')
    low, high = fault.value_range
    value = round(low + (high - low) * generator.random(), fault.digits)
    if fault.is_signed and generator.random() < 0.5:
        value = -value
    return fault, value, int(SEED_COUNT * generator.random())


def _faults_of_block(block: int) -> List[Fault]:
    """Returns the FAULT_KINDS in the order in which they occur in a block. If the last fault of the
    block before would be first, the first two faults change places."""
    first, second, *others = _shuffled_faults(block)
    if block:
        *_, last_before = _shuffled_faults(block - 1)
        if first is last_before:
            first, second = second, first
    return [first, second, *others]


def _shuffled_faults(block: int) -> List[Fault]:
    generator = random.Random(f'order of block {block}')
    return sorted(FAULT_KINDS, key=lambda _: generator.random())
