"""Judges an answer to a mystery robot, which is the name of a fault and its value.

Units: MEANINGS has the unit of each value. Edge cases: The text about a wrong fault does not show
the right fault. An angle may be off by whole turns.
"""
from typing import NamedTuple, Tuple

from tb3_labs.geometry.angles import difference_degrees
from tb3_labs.simulation.mystery_robot import Fault, draw

#: Because of rounding, the error of a right value may exceed the tolerance by this.
ROUNDING = 1e-9


class Meaning(NamedTuple):
    """The meaning of a fault's value."""

    unit: str           # of the value
    tolerance: float    # largest error of a right value, in the unit
    quantity: str       # what the value is


#: {name of a fault: Meaning}
MEANINGS = {
    'imu offset': Meaning(
        'deg', 3.0, "the IMU's heading minus the odometry's, from -180 to 180"),
    'imu drift': Meaning(
        'deg/min', 2.0, "turn of the IMU's heading in a minute at rest, positive to the left"),
    'wheel mismatch': Meaning(
        '%', 0.5, 'share by which the right wheel is smaller than the left one; negative if it is '
        'larger. On a straight drive: turn [rad] = path [m] x share / distance of the wheels'),
    'slip': Meaning('%', 2.0, "share of the wheels' travel that does not move the robot"),
    'frozen imu': Meaning('s', 0.3, 'duration of one freeze, in which /imu repeats one sample'),
    'frozen odometry': Meaning(
        's', 0.3, 'duration of one freeze, in which /odom repeats one sample'),
    'silent imu': Meaning('s', 0.3, 'duration of one silence of /imu'),
    'silent odometry': Meaning('s', 0.3, 'duration of one silence of /odom'),
    'sensor latency': Meaning('s', 0.03, 'delay of each sample, from its stamp to its arrival'),
    'command latency': Meaning('s', 0.1, 'delay of each command, from its sending to its arrival'),
    'network stalls': Meaning(
        's', 0.15, 'the longest time for which nothing arrives on /imu and /odom'),
}


def judge(number: int, name: str, value: float) -> Tuple[bool, str]:
    """Returns (is the answer right?, the text for the student). Raises ``ValueError`` if the number
    of the robot, or the name of the fault, is not valid."""
    hidden, right, _ = draw(number)
    name = name.lower()
    if name not in MEANINGS:
        raise ValueError(f'{name!r} is not a fault. Valid: {", ".join(MEANINGS)}')
    if name != hidden.name:
        return False, f'Wrong: mystery {number} has another fault.'
    meaning = MEANINGS[name]
    error = value - right
    if meaning.unit == 'deg':
        error = difference_degrees(value, right)
    if abs(error) <= meaning.tolerance + ROUNDING:
        return True, f'Right: mystery {number} is {name!r}, {with_unit(hidden, right)}.'
    return False, ('The fault is right, its value is not: it may be off by '
                   f'{meaning.tolerance:g} {meaning.unit}. The value is {meaning.quantity}.')


def with_unit(fault: Fault, value: float) -> str:
    """Returns a value and its unit as text. If values of the fault may be negative, a positive
    value has the sign +."""
    sign = '+' if fault.signed else ''
    return f'{value:{sign}.{fault.digits}f} {MEANINGS[fault.name].unit}'
