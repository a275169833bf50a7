"""The numbers that a node may take for its heading, and the link of the IMU exercise: the heading
that the node prints follows the heading by the IMU.
"""
import math
import re
from dataclasses import replace
from itertools import product
from typing import Callable, Iterator, List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.geometry.arrays import euler, wrap_all
from tb3_labs.handout import PRINTED_HEADING
from tb3_labs.watch.broken_link import BrokenLink, NodeRun, is_constant, should_be, wrong_value
from tb3_labs.watch.variables import Quantity, Series, longest_delay, matching_quantities

#: A variable is late if its pauses are longer than this while its quantity changes [s].
MAX_UPDATE_GAP = 0.3
#: If a variable follows no quantity, it is compared with the usable headings a second time, with a
#: tolerance that is larger by this factor. On a busy computer samples come late, or are lost. A
#: node may also cut or round its heading to whole degrees.
COARSE_FACTOR = 30.0
#: Longer delays between a heading and a printed number are not found [s].
MAX_HEADING_DELAY = 8.0
#: A quantity is at rest while it changes by at most this share of its scale.
MOVED_SHARE = 0.005
HEADING_LINE = re.compile(PRINTED_HEADING.format(r'(-?[\d.]*\d(?:e[-+]?\d+)?)'))


class YawRange(NamedTuple):
    """A range that a node may give to a yaw from -180 to 180 degrees. `formula` gets the yaw and a
    whole turn, both in the node's unit. `sign` is the sign of the result's change for a turn to the
    left; 0 if the result is not a heading."""

    text: str
    formula: Callable[[np.ndarray, float], np.ndarray]
    sign: int


FROM_0_TO_360 = YawRange(
    'from 0 to 360', lambda yaw, turn: np.where(yaw < 0.0, yaw + turn, yaw), 1)
FROM_MINUS_180 = YawRange('from -180 to 180', lambda yaw, turn: yaw, 1)
#: The node may change the range after it has converted the unit.
PLUS_360 = YawRange('its number plus 360 where it is negative',
                    lambda yaw, turn: np.where(yaw < 0.0, yaw + 360.0, yaw), 1)
RANGES = (
    FROM_0_TO_360, FROM_MINUS_180, PLUS_360,
    YawRange('plus 180 where it is negative',
             lambda yaw, turn: np.where(yaw < 0.0, yaw + turn / 2.0, yaw), 1),
    YawRange('plus 180', lambda yaw, turn: yaw + turn / 2.0, 1),
    YawRange('plus 360, also where it is positive', lambda yaw, turn: yaw + turn, 1),
    YawRange('without its sign', lambda yaw, turn: np.abs(yaw), 0),
    YawRange('mirrored, from 0 to 360', lambda yaw, turn: (-yaw) % turn, -1),
    YawRange('mirrored, from -180 to 180', lambda yaw, turn: -yaw, -1))
#: The units that a node may give to a yaw, each with its factor from degrees.
UNITS = (('degrees', 1.0), ('radians', math.pi / 180.0),
         ('degrees, converted to degrees twice', 180.0 / math.pi))


def heading_candidates(node_run: NodeRun) -> List[Quantity]:
    """Returns the quantities of the IMU that a node may take for the heading. The first is the
    correct heading."""
    imu = node_run.run.imu
    w, x, y, z = imu.w, imu.x, imu.y, imu.z
    roll, pitch, yaw = np.degrees(euler(w, x, y, z))
    # a node may hand over the numbers in the order of ROS
    _, _, misread_yaw = np.degrees(euler(x, y, z, w))
    found = []
    for angle, degrees, ranges in (
            ('yaw', yaw, RANGES), ('roll', roll, RANGES[:3]), ('pitch', pitch, RANGES[:3]),
            ('yaw of the quaternion read in the order x, y, z, w,', misread_yaw, RANGES[:3])):
        for (unit, factor), yaw_range in product(UNITS, ranges):
            turn = 360.0 * factor
            per_degree = yaw_range.sign * factor if angle == 'yaw' else 0.0
            found.append(Quantity(
                f'the {angle} in {unit}, {yaw_range.text}', imu.arrival,
                yaw_range.formula(degrees * factor, turn), min(turn, 360.0), per_degree))
    found += [Quantity(f'the {part} of the quaternion', imu.arrival, value, 1.0)
              for part, value in zip('wxyz', (w, x, y, z))]
    found[0] = found[0]._replace(name='the heading, from 0 to 360 degrees')
    return found


def is_usable_heading(quantity: Quantity, correct: Quantity) -> bool:
    """Does a quantity differ from the correct heading by less than a degree? It may have another
    range and another unit."""
    unit = quantity.per_degree
    if unit <= 0.0:
        return False
    error = wrap_all(quantity.value - correct.value / correct.per_degree * unit, 360.0 * unit)
    return bool((np.abs(error) < unit).all())


def followed_heading(series: Series, quantities: List[Quantity]
                     ) -> Tuple[Optional[Quantity], Optional[BrokenLink]]:
    """Returns (the usable heading that a variable follows, None). If there is no such heading,
    returns (None, the BrokenLink). The first of the `quantities` is the correct heading."""
    correct = quantities[0]
    found = matching_quantities(series, quantities)
    candidates = found or matching_quantities(
        series, [each._replace(scale=COARSE_FACTOR * each.scale) for each in quantities])
    usable = [each for each in candidates if is_usable_heading(each, correct)]
    if usable:
        return usable[0], None
    if is_constant(series) and not found:
        message = should_be(f'{series.name} stays at {series.text[-1][:40]}', correct.name)
        return None, wrong_value(series, '', correct)._replace(message=message)
    if found:
        followed = 'follows ' + found[0].name
        return None, wrong_value(series, should_be(followed, correct.name), correct)
    behaviour = 'does not follow ' + correct.name
    pause = median_pause(series, correct)
    if pause > MAX_UPDATE_GAP:
        behaviour += f', but changes only every {pause:.1f} s while that changes'
    return None, wrong_value(series, behaviour, correct)


def heading_from_another_zero(series: Series, correct: Quantity, unit: float) -> Optional[Quantity]:
    """A variable may follow a heading that is 0 in another direction, for instance in the direction
    at the node's start. Returns this heading, or None. `unit` is the change of the variable for one
    degree."""
    heading = correct.at(series.time)
    offset = np.exp(1j * np.radians(series.value / unit - heading))
    middle = complex(np.nanmedian(offset.real), np.nanmedian(offset.imag))
    zero = np.degrees(np.angle(middle))
    # angles are compared on the unit circle
    circle = replace(series, value=np.exp(1j * np.radians(series.value / unit - zero)))
    correct_circle = correct._replace(value=np.exp(1j * np.radians(correct.value)), scale=60.0)
    if not matching_quantities(circle, [correct_circle]):
        return None
    return correct._replace(
        name=f'the heading {zero:+.1f} degrees, which was {heading[0]:.1f} at the first line',
        value=(correct.value + zero) % 360.0 * unit, per_degree=unit)


def median_pause(series: Series, quantity: Quantity) -> float:
    """Returns the median pause between two changes of a variable while a quantity changes [s]; 0 if
    there are fewer than three such pauses."""
    edges = np.searchsorted(quantity.time, series.changes).clip(0, len(quantity.time) - 1)
    steps = np.abs(np.diff(quantity.value[edges]))
    pauses = np.diff(series.changes)[steps > MOVED_SHARE * quantity.scale]
    return float(np.median(pauses)) if len(pauses) > 2 else 0.0


# -- the IMU exercise

def printed_headings(node_run: NodeRun) -> Series:
    """Returns the headings that the node printed in its first run."""
    printed = node_run.run.printed
    starts = node_run.run.starts
    end_of_run = starts[1] if len(starts) > 1 else np.inf
    texts = [str(text) for text in printed.text]
    time_of_letter = np.repeat(printed.arrival, [len(text) for text in texts])
    lines = list(HEADING_LINE.finditer(''.join(texts)))
    times = np.array([time_of_letter[line.end() - 1] for line in lines], dtype=float)
    numbers = np.array([line.group(1) for line in lines], dtype=object)
    return Series('the printed number', times, numbers, numbers.astype(float)).take(
        times < end_of_run)


def wrong_printed_heading(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Yields the printed number if it does not follow the heading from 0 to 360."""
    series, quantities = printed_headings(node_run), node_run.cached(heading_candidates)
    correct = quantities[0]
    if len(series.time) < 3 or not len(correct.time):
        return
    followed, broken = followed_heading(series, quantities)
    if broken is not None and 'does not follow' in broken.message:
        followed = (heading_from_another_zero(series, correct, 1.0)
                    or late_heading(series, quantities))
    if followed is not None and followed.name != correct.name:
        broken = wrong_value(series, should_be('follows ' + followed.name, correct.name), correct)
    if broken is not None:
        yield broken


def late_heading(series: Series, quantities: List[Quantity]) -> Optional[Quantity]:
    """Returns the first heading that a variable follows late, or None."""
    for quantity in quantities:
        delay = longest_delay(series, quantity, MAX_HEADING_DELAY)
        if quantity.per_degree and delay < np.inf:
            return quantity._replace(name=f'{quantity.name}, up to {delay:.1f} s late')
    return None
