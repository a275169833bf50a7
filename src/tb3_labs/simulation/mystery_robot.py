"""Mystery robots: the simulated robot with one hidden fault, to be found by measuring.

A number from 1 to LAST_NUMBER always gives the same robot. In each block of numbers (1 to 11, 12 to
22, ...) each of the FAULT_KINDS occurs once, in a random order, and neighbours differ. Only
``random.Random(text).random()`` is used, since Python guarantees its sequence for all versions.

Nothing here is secret: a reader of this file can compute the answer, and so can a patient user of
`mystery.py --answer`. The exercise asks for a measurement that proves the fault.

Units: the value of each fault has another unit; times are in seconds since the robot's start.
"""
import random
from dataclasses import dataclass, field, fields, replace
from typing import Any, List, Mapping, Tuple

from tb3_labs.config import Config
from tb3_labs.simulation.simulator_config import SimulatorConfig

#: The last number; the first one is 1.
LAST_NUMBER = 9999
#: Time without a fault before each occurrence of a fault that comes and goes [s].
BETWEEN_FAULTS = 12.0
#: A mystery robot may have other values of these settings: they are not faults.
ALLOWED_SETTINGS = ('model', 'start_x', 'start_y', 'start_yaw_deg', 'imu_rate', 'odom_rate',
                    'speed', 'mystery')


@dataclass(frozen=True)
class Fault:
    """A kind of fault. It changes the `settings` of the SimulatorConfig, and sets the one called
    `setting` to the value times `scale`. A fault without `setting` comes and goes; its value is the
    time that it lasts."""

    name: str
    size: Tuple[float, float]       # range of the value, without sign; see mystery_answer.MEANINGS
    signed: bool                    # may the value be negative?
    digits: int                     # of the drawn value, after the decimal point
    setting: str = ''
    scale: float = 1.0
    settings: Mapping[str, Any] = field(default_factory=dict)


#: All kinds of faults, with the names that answers use. Another kind would change the fault of each
#: number.
FAULT_KINDS = (
    Fault('imu offset', (20.0, 160.0), True, 0, 'imu_offset_deg'),
    Fault('imu drift', (10.0, 60.0), True, 0, 'imu_drift_deg_per_min'),
    Fault('wheel mismatch', (3.0, 8.0), True, 1, 'wheel_mismatch', 0.01),
    Fault('slip', (10.0, 40.0), False, 0, 'slip', 0.01),
    Fault('frozen imu', (2.0, 6.0), False, 1, settings={'imu_frozen': True}),
    Fault('frozen odometry', (2.0, 6.0), False, 1, settings={'odom_frozen': True}),
    Fault('silent imu', (2.0, 6.0), False, 1, settings={'imu_silent': True}),
    Fault('silent odometry', (2.0, 6.0), False, 1, settings={'odom_silent': True}),
    Fault('sensor latency', (0.2, 0.6), False, 2, 'sensor_latency'),
    Fault('command latency', (0.3, 1.0), False, 2, 'command_latency'),
    Fault('network stalls', (0.5, 1.5), False, 2, 'longest_stall',
          settings={'stalls_per_min': 30.0}),
)


class HiddenFault:
    """The fault of mystery `number`, which changes the `settings` of a robot.

    Raises ``ValueError`` if there is no such number, or if `settings` or a config in
    `surroundings` has a value that is neither the default nor of a setting in ALLOWED_SETTINGS.
    """

    def __init__(self, number: int, settings: SimulatorConfig, *surroundings: Config) -> None:
        self.fault, self.value, seed = draw(number)
        for config in (settings, *surroundings):
            for item in fields(config):
                value = getattr(config, item.name)
                if item.name not in ALLOWED_SETTINGS and value != item.default:
                    raise ValueError(f'{item.name} = {value!r} is not valid together with mystery '
                                     f'= {number}: beside the hidden fault no other is set, and '
                                     'no network or host')
        changes = dict(self.fault.settings)
        if self.fault.setting:
            changes[self.fault.setting] = self.value * self.fault.scale
        self._faulty = replace(settings, seed=seed, **changes)
        self._sound = replace(settings, seed=seed)

    def settings_at(self, now: float) -> SimulatorConfig:
        """Returns the robot's settings at `now` [s] after its start: the same object until they
        change."""
        is_sound = not self.fault.setting and now % (BETWEEN_FAULTS + self.value) < BETWEEN_FAULTS
        return self._sound if is_sound else self._faulty


def draw(number: int) -> Tuple[Fault, float, int]:
    """Returns (fault, its value, seed of the noise) of mystery `number`."""
    if not 1 <= number <= LAST_NUMBER:
        raise ValueError(
            f'mystery = {number} is not valid: a whole number from 1 to {LAST_NUMBER}')
    block, place = divmod(number - 1, len(FAULT_KINDS))
    fault = FAULT_KINDS[_order(block)[place]]
    generator = random.Random(f'mystery {number}')
    low, high = fault.size
    value = round(low + (high - low) * generator.random(), fault.digits)
    if fault.signed and generator.random() < 0.5:
        value = -value
    return fault, value, int(1e6 * generator.random())


def _order(block: int) -> List[int]:
    """Returns the order of faults in a block. It does not begin with the last block's end."""
    order = _shuffled(block)
    if block and order[0] == _shuffled(block - 1)[-1]:
        order[:2] = order[1], order[0]
    return order


def _shuffled(block: int) -> List[int]:
    generator = random.Random(f'order of block {block}')
    return sorted(range(len(FAULT_KINDS)), key=lambda _: generator.random())
