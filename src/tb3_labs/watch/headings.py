"""Finds the number that a node uses as its heading. Checks the heading that a node prints."""
import math
import re
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple

import numpy as np

from tb3_labs.geometry.arrays import euler_angles, wrap_all
from tb3_labs.handout import PRINTED_HEADING
from tb3_labs.watch.mistake import Mistake, NodeRun, is_constant, worst_index
from tb3_labs.watch.variables import (
    Quantity, Series, longest_delay, matching_quantities, shortened_value)

#: A variable that follows no quantity is compared again, with tolerances larger by this factor,
#: because a node may round its heading to degrees. On a busy computer, samples also come late.
COARSE_FACTOR = 30.0
MIN_PRINTED_HEADINGS = 3
HEADING_LINE = re.compile(PRINTED_HEADING.format(r'(-?[\d.]*\d(?:e[-+]?\d+)?)'))
#: (name, formula) of each range that a node may use for a yaw. The arguments of a formula are a yaw
#: (from -180 to 180 degrees) and a whole turn, both in the node's unit.
YAW_RANGES: Tuple[Tuple[str, Callable[[np.ndarray, float], np.ndarray]], ...] = (
    ('from 0 to 360', lambda yaw, whole_turn: np.where(yaw < 0.0, yaw + whole_turn, yaw)),
    ('from -180 to 180', lambda yaw, whole_turn: yaw),
    ('its number plus 360 where it is negative',
     lambda yaw, whole_turn: np.where(yaw < 0.0, yaw + 360.0, yaw)),
    ('plus 180 where it is negative',
     lambda yaw, whole_turn: np.where(yaw < 0.0, yaw + whole_turn / 2.0, yaw)),
    ('plus 180', lambda yaw, whole_turn: yaw + whole_turn / 2.0),
    ('plus 360, also where it is positive', lambda yaw, whole_turn: yaw + whole_turn),
    ('without its sign', lambda yaw, whole_turn: np.abs(yaw)),
    ('mirrored, from 0 to 360', lambda yaw, whole_turn: -yaw % whole_turn),
    ('mirrored, from -180 to 180', lambda yaw, whole_turn: -yaw))
#: A variable is compared with angles other than the yaw in these ranges only.
RANGES_OF_OTHER_ANGLES = YAW_RANGES[:3]
#: (name, number per degree) of each unit that a node may use for a yaw.
YAW_UNITS = (('degrees', 1.0), ('radians', math.pi / 180.0),
             ('degrees, converted to degrees twice', 180.0 / math.pi))


def angles_of(imu: Any) -> Dict[str, np.ndarray]:
    """Returns {name: angles [rad]} of the angles that a node may use as the yaw of the IMU."""
    w, x, y, z = imu.w, imu.x, imu.y, imu.z
    roll, pitch, yaw = euler_angles(w, x, y, z)
    # a node may pass x, y, z, w to a function that expects w, x, y, z
    _, _, misread_yaw = euler_angles(x, y, z, w)
    return {'yaw': yaw, 'roll': roll, 'pitch': pitch,
            'yaw (of the quaternion read in the order x, y, z, w)': misread_yaw}


@lru_cache(maxsize=1)
def heading_candidates(node_run: NodeRun) -> List[Quantity]:
    """Returns the quantities that a node may use as its heading. The correct quantity is first."""
    imu = node_run.recording.imu
    correct, *others = angle_candidates(imu)
    correct = correct._replace(name='the heading, from 0 to 360 degrees')
    return [correct, *others, *component_candidates(imu)]


def angle_candidates(imu: Any) -> Iterator[Quantity]:
    """Yields each angle in each unit and range. The yaw in degrees, from 0 to 360, is first."""
    for (name, angle), (unit, factor) in product(angles_of(imu).items(), YAW_UNITS):
        number = np.degrees(angle) * factor
        whole_turn = 360.0 * factor
        is_yaw = name == 'yaw'
        for range_text, formula in YAW_RANGES if is_yaw else RANGES_OF_OTHER_ANGLES:
            yield Quantity(
                f'the {name} in {unit}, {range_text}', imu.arrival, formula(number, whole_turn),
                scale=min(whole_turn, 360.0), per_degree=factor if is_yaw else 0.0)


def component_candidates(imu: Any) -> Iterator[Quantity]:
    for component in 'wxyz':
        name = f'the {component} of the quaternion'
        number = getattr(imu, component)
        plus_360 = np.where(number < 0.0, number + 360.0, number)
        yield Quantity(name, imu.arrival, number, scale=1.0)
        yield Quantity(f'{name} plus 360 where it is negative', imu.arrival, plus_360, scale=1.0)


def is_usable_heading(quantity: Quantity, correct: Quantity) -> bool:
    """Returns True if `quantity` is the correct heading within 1 degree, in any range and unit."""
    if not quantity.per_degree:
        return False
    correct_value = correct.value / correct.per_degree * quantity.per_degree
    error = wrap_all(quantity.value - correct_value, 360.0 * quantity.per_degree)
    return bool((np.abs(error) < quantity.per_degree).all())


def followed_quantity(series: Series, quantities: List[Quantity]) -> Optional[Quantity]:
    """Returns the quantity that a variable follows, or None. The first of the `quantities` must be
    the correct heading. If a node cannot turn by the returned quantity, `per_degree` is 0."""
    correct = quantities[0]
    matching = matching_quantities(series, quantities)
    coarse_quantities = [quantity._replace(scale=COARSE_FACTOR * quantity.scale)
                         for quantity in quantities]
    for candidate in matching or matching_quantities(series, coarse_quantities):
        if is_usable_heading(candidate, correct):
            return candidate
    if matching:
        return matching[0]._replace(per_degree=0.0)
    if is_constant(series):
        return None
    return heading_from_another_zero(series, correct) or late_heading(series, quantities)


def heading_from_another_zero(series: Series, correct: Quantity) -> Optional[Quantity]:
    """Returns the heading that a variable follows with a constant offset, or None. For example, a
    node may measure its heading from its direction at the start."""
    headings = correct.at(series.time)
    # angles are compared on the unit circle, so that their range does not matter
    heading_points = correct._replace(value=np.exp(1j * np.radians(correct.value)), scale=60.0)
    for unit, per_degree in YAW_UNITS[:2]:
        degrees = series.value / per_degree
        offset_points = np.exp(1j * np.radians(degrees - headings))
        median = complex(np.nanmedian(offset_points.real), np.nanmedian(offset_points.imag))
        offset = np.degrees(np.angle(median))
        points = replace(series, value=np.exp(1j * np.radians(degrees - offset)))
        if matching_quantities(points, [heading_points]):
            start = f'(at first {headings[0]:.1f} degrees)'
            return correct._replace(
                name=f'the heading {start} {offset:+.1f} degrees, in {unit}',
                value=(correct.value + offset) % 360.0 * per_degree, per_degree=per_degree)
    return None


def late_heading(series: Series, quantities: List[Quantity]) -> Optional[Quantity]:
    """Returns the first usable heading that a variable follows with a delay, or None."""
    for quantity in quantities:
        if is_usable_heading(quantity, quantities[0]):
            delay = longest_delay(series, quantity)
            if delay < np.inf:
                name = f'{quantity.name}, up to {delay:.1f} s late'
                return quantity._replace(name=name, per_degree=0.0)
    return None


def heading_mistake(series: Series, correct: Quantity, followed: Optional[Quantity]) -> Mistake:
    """Returns the Mistake, at the largest error, of a variable that should follow `correct`. The
    variable follows the quantity `followed` instead, or no quantity if `followed` is None."""
    if followed is not None:
        behaviour = 'follows ' + followed.name
    elif is_constant(series):
        behaviour = 'stays at ' + shortened_value(series.text[-1])
    else:
        behaviour = 'follows no angle of the IMU'
    expected = correct.at(series.time)
    worst = worst_index(series, expected)
    name = correct.name.partition(',')[0]
    values = f'it was {shortened_value(series.text[worst])} when {name} was {expected[worst]:.4g}'
    return Mistake(f'{series.name} {behaviour}; it should be {correct.name}: {values}',
                   series.time[worst], series.name)


def printed_headings(node_run: NodeRun) -> Series:
    """Returns the headings that the node printed in its first run."""
    recording = node_run.recording
    end = recording.starts[1] if len(recording.starts) > 1 else np.inf
    # a line that a node prints may be recorded in several pieces
    texts = [str(text) for text in recording.printed.text]
    time_of_character = np.repeat(recording.printed.arrival, [len(text) for text in texts])
    matches = list(HEADING_LINE.finditer(''.join(texts)))
    times = np.array([time_of_character[match.end() - 1] for match in matches], dtype=float)
    numbers = np.array([match.group(1) for match in matches], dtype=object)
    series = Series('the printed number', times, text=numbers, value=numbers.astype(float))
    return series.take(times < end)


def find_wrong_printed_heading(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake if the printed number is not the heading from 0 to 360 degrees."""
    series = printed_headings(node_run)
    quantities = heading_candidates(node_run)
    correct = quantities[0]
    if len(series.time) < MIN_PRINTED_HEADINGS or not len(correct.time):
        return
    followed = followed_quantity(series, quantities)
    if followed is None or followed.name != correct.name:
        yield heading_mistake(series, correct, followed)
