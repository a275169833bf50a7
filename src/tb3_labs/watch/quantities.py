"""The quantities that a variable may follow, and the search for the quantities that it follows.

A quantity is a number that a formula gives for each message of a sensor. A variable follows a
quantity if each value of the variable is the number of a recent message.
"""
import math
from dataclasses import replace
from itertools import product
from typing import Callable, Iterable, Iterator, List, NamedTuple, Optional, Sequence

import numpy as np

from tb3_labs.geometry.arrays import euler, last_before
from tb3_labs.watch.variables import Series

#: Two numbers are equal if they differ by at most this share of the quantity's scale.
SAME_SHARE = 3e-4
#: A variable follows a quantity if at least this share of its values comes from recent samples.
FOLLOWING_SHARE = 0.98
#: A sample stays recent until this time after the arrival of the next sample [s]. The last sample
#: always stays recent.
RECENT_TIME = 0.5
#: The node may receive a sample up to this time before the recorder does [s].
ARRIVAL_LEAD = 0.03
#: Longer delays between a quantity and a variable are not found [s].
MAX_VARIABLE_DELAY = 8.0
#: At most about this many values of a variable are compared.
MAX_VALUES = 400
#: Each fourth value is compared first, because this excludes most quantities in little time.
COARSE_STEP = 4
#: A quantity is at rest while it changes by at most this share of its scale.
MOVED_SHARE = 0.005


class Quantity(NamedTuple):
    """A number for each sample of a sensor. `name` names the number and its unit. `scale` is about
    the range of the number. `per_degree` is the change of a heading for one degree to the left; 0
    if the quantity is not a heading."""

    name: str
    time: np.ndarray
    value: np.ndarray
    scale: float
    per_degree: float = 0.0

    def at(self, times: np.ndarray) -> np.ndarray:
        """Returns the number of the last sample before each time, or of the first sample."""
        return self.value[last_before(self.time, times).clip(0)]


class RecentSamples(NamedTuple):
    """The recent samples at each reading. In each array a row is a reading, and a column is a
    sample, newest first. The arrays have the index, the age [s], and whether the sample exists."""

    sample: np.ndarray
    age: np.ndarray
    exists: np.ndarray


def recent_samples(readings: np.ndarray, times: np.ndarray, longest: float) -> RecentSamples:
    """Returns for each of the times `readings` the samples that are at most `longest` old [s].
    `times` are the times of all samples, at least one."""
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    most = min(len(times), int((longest + ARRIVAL_LEAD) / max(step, 1e-3)) + 2)
    index = last_before(times, readings + ARRIVAL_LEAD)[:, None] - np.arange(most)
    replaced_at = np.append(times[1:], np.inf)    # a sample gets old when the next sample comes
    age = (readings[:, None] - replaced_at[index.clip(0)]).clip(0.0)
    return RecentSamples(index.clip(0), age, (index >= 0) & (age <= longest))


def is_equal(series: Series, quantity: Quantity, samples: RecentSamples) -> np.ndarray:
    """Returns an array: does the value (row) equal the quantity's number at the recent sample
    (column)?"""
    distance = np.abs(series.value[:, None] - quantity.value[samples.sample])
    return samples.exists & (distance <= SAME_SHARE * quantity.scale)


def sample_ages(series: Series, quantity: Quantity, longest: float = RECENT_TIME) -> np.ndarray:
    """Returns for each value of a variable the age of the newest sample with this value [s]; inf if
    no sample of the last `longest` seconds has this value. The newest sample has the age 0."""
    if not len(quantity.time) or not len(series.time):
        return np.full(len(series.time), np.inf)
    samples = recent_samples(series.time, quantity.time, longest)
    return np.where(is_equal(series, quantity, samples), samples.age, np.inf).min(axis=1)


def subsampled(series: Series) -> Series:
    """Returns every n-th of the values that are numbers, at most about MAX_VALUES."""
    known = np.flatnonzero(np.isfinite(series.value))
    return series.take(known[::max(1, len(known) // MAX_VALUES)])


def matching_quantities(series: Series, quantities: Iterable[Quantity],
                        share: float = FOLLOWING_SHARE) -> List[Quantity]:
    """Returns the quantities that a variable follows, in the given order. If there are several,
    this run does not show which one the node uses."""
    # the variable may have its first value before the first message comes
    first = int(np.argmax(series.text != series.text[:1])) if len(series.text) else 0
    all_values = subsampled(series.take(slice(first, None)))
    if not len(all_values.time):
        return []
    some_values = all_values.take(slice(None, None, COARSE_STEP))
    most_misses = (1.0 - share) * len(all_values.time) + 1e-9
    found: List[Quantity] = []
    times = np.empty(0)
    for quantity in quantities:
        if not len(quantity.time):
            continue
        if quantity.time is not times:
            times = quantity.time
            samples = recent_samples(all_values.time, times, RECENT_TIME)
            some_samples = RecentSamples(*(rows[::COARSE_STEP] for rows in samples))
        # the few values are compared first, since this is fast
        if misses(some_values, quantity, some_samples) > most_misses:
            continue
        if misses(all_values, quantity, samples) <= most_misses:
            found.append(quantity)
    return found


def misses(series: Series, quantity: Quantity, samples: RecentSamples) -> int:
    """Returns how many values of a variable differ from the numbers of all recent samples."""
    return int((~is_equal(series, quantity, samples).any(axis=1)).sum())


def longest_delay(series: Series, quantity: Quantity) -> float:
    """Returns the longest delay with which a variable follows a quantity [s]; inf if the variable
    does not follow the quantity."""
    ages = np.sort(sample_ages(subsampled(series), quantity, MAX_VARIABLE_DELAY))
    if not len(ages):
        return math.inf
    return float(ages[int(FOLLOWING_SHARE * (len(ages) - 1))])


def median_pause(series: Series, quantity: Quantity) -> float:
    """Returns the median pause between two changes of a variable while a quantity changes [s]; 0 if
    there are fewer than three such pauses."""
    edges = np.searchsorted(quantity.time, series.changes).clip(0, len(quantity.time) - 1)
    steps = np.abs(np.diff(quantity.value[edges]))
    pauses = np.diff(series.changes)[steps > MOVED_SHARE * quantity.scale]
    return float(np.median(pauses)) if len(pauses) > 2 else 0.0


# -- headings

class YawRange(NamedTuple):
    """A form that a node may give to a yaw from -180 to 180 degrees. `sign` is the sign of its
    change for a turn to the left; 0 if the form is not a heading."""

    text: str
    formula: Callable[[np.ndarray], np.ndarray]
    sign: int


FROM_0_TO_360 = YawRange('from 0 to 360', lambda yaw: np.where(yaw < 0.0, yaw + 360.0, yaw), 1)
FROM_MINUS_180 = YawRange('from -180 to 180', lambda yaw: yaw, 1)
RANGES = (
    FROM_0_TO_360, FROM_MINUS_180,
    YawRange('plus 180 where it is negative', lambda yaw: np.where(yaw < 0.0, yaw + 180.0, yaw), 1),
    YawRange('plus 180', lambda yaw: yaw + 180.0, 1),
    YawRange('plus 360, also where it is positive', lambda yaw: yaw + 360.0, 1),
    YawRange('without its sign', np.abs, 0),
    YawRange('mirrored, from 0 to 360', lambda yaw: (-yaw) % 360.0, -1),
    YawRange('mirrored, from -180 to 180', lambda yaw: -yaw, -1))
#: The units that a node may give to a yaw, each (text, factor from degrees, rounding).
DEGREES, RADIANS = ('degrees', 1.0, np.asarray), ('radians', math.pi / 180.0, np.asarray)
UNITS = (DEGREES, RADIANS, ('degrees, converted to degrees twice', 180.0 / math.pi, np.asarray),
         ('degrees, cut to whole numbers', 1.0, np.trunc),
         ('degrees, rounded to whole numbers', 1.0, np.round),
         ('radians, cut to whole numbers', math.pi / 180.0, np.trunc))


def headings(time: np.ndarray, quaternion: Sequence[np.ndarray],
             sensor_clause: str = '') -> Iterator[Quantity]:
    """Yields the quantities that a node may take for the heading. The first is the correct heading.
    `quaternion` is w, x, y, z of each sample. `sensor_clause` is '' for the IMU."""
    w, x, y, z = quaternion
    roll, pitch, yaw = np.degrees(euler(w, x, y, z))
    for (unit, factor, rounded), yaw_range in product(UNITS, RANGES):
        name = f'the yaw{sensor_clause} in {unit}, '
        quantity = Quantity(name + yaw_range.text, time, rounded(yaw_range.formula(yaw) * factor),
                            max(360.0 * min(factor, 1.0), 1.0), yaw_range.sign * factor)
        if unit == 'degrees' and yaw_range is FROM_0_TO_360:
            quantity = quantity._replace(name='the heading, from 0 to 360 degrees' + sensor_clause)
        yield quantity
        if factor != 1.0 and yaw_range is FROM_0_TO_360:
            # the node may change the range after it has converted the unit
            yield quantity._replace(name=name + 'its number plus 360 where it is negative',
                                    value=rounded(yaw_range.formula(yaw * factor)))
    # a node may hand over the numbers in the order of ROS
    _, _, misread_yaw = np.degrees(euler(x, y, z, w))
    angles = (
        ('roll' + sensor_clause, roll), ('pitch' + sensor_clause, pitch),
        (f'yaw of the quaternion{sensor_clause} read in the order x, y, z, w,', misread_yaw))
    for (angle_name, angle), (unit, factor, _), yaw_range in product(
            angles, (DEGREES, RADIANS), (FROM_0_TO_360, FROM_MINUS_180)):
        yield Quantity(f'the {angle_name} in {unit}, {yaw_range.text}', time,
                       yaw_range.formula(angle * factor), 360.0 * factor)
    for part, value in zip('wxyz', quaternion):
        yield Quantity(f'the {part} of the quaternion{sensor_clause}', time, value, 1.0)


def heading_from_another_zero(series: Series, correct: Quantity, unit: float) -> Optional[Quantity]:
    """Returns the heading that a variable follows if this heading is 0 in another direction, such
    as the direction at the node's start; else None. `unit` is the change of the variable for one
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
