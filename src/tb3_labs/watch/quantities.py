"""The quantities that a variable may follow, and which of them it follows.

A node computes its variables from the messages that it hears. So a variable that follows a quantity
has, at each moment, the very number that the quantity had at one of the last samples. No list of
mistakes is needed: a quantity is a closed form of what was heard.

Angles of messages are in radians. A quantity has the unit in its words.
"""
import itertools
import math
from typing import Iterable, Iterator, List, NamedTuple, Sequence

import numpy as np

from tb3_labs.geometry.angle_arrays import euler
from tb3_labs.watch.variables import Series

#: A variable has a sample's number if it is nearer to it than this share of the quantity's scale.
SAME = 3e-4
#: It follows a quantity if this part of its values has the number of a sample that was the latest
#: one at most RECENT [s] before. In a silence the latest sample does not grow old.
PART, RECENT, SOON = 0.98, 0.5, 0.03
#: The longest delay that is looked for [s]. At most so many values of a variable are compared.
LATEST, MOST_VALUES = 8.0, 400
#: A quantity is compared with each SOMEth value first: they refuse most quantities.
SOME = 4
#: A quantity has moved if it has changed by this share of its scale.
MOVED = 0.005


class Quantity(NamedTuple):
    """A number over time, in words; `scale`: its range, about."""

    words: str
    time: np.ndarray
    value: np.ndarray
    scale: float
    per_degree: float = 0.0     # of a heading: its change for one degree to the left; 0: of none


class Recent(NamedTuple):
    """The samples that were the latest one at most `longest` [s] before each reading, a row for
    each reading, the newest first: their indices, their ages [s], and whether there is one."""

    sample: np.ndarray
    age: np.ndarray
    is_one: np.ndarray


def recent(read: np.ndarray, time: np.ndarray, longest: float) -> Recent:
    """The Recent samples of these readings; `time` has at least one sample."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    most = min(len(time), int((longest + SOON) / max(step, 1e-3)) + 2)
    sample = (np.searchsorted(time, read + SOON) - 1)[:, None] - np.arange(most)
    # a sample grows old when the next one comes
    age = (read[:, None] - np.append(time[1:], np.inf)[sample.clip(0)]).clip(0.0)
    return Recent(sample.clip(0), age, (sample >= 0) & (age <= longest))


def fits(series: Series, quantity: Quantity, samples: Recent) -> np.ndarray:
    """Has each value the number of each of its recent samples?"""
    return samples.is_one & (np.abs(
        series.value[:, None] - quantity.value[samples.sample]) <= SAME * quantity.scale)


def ages(series: Series, quantity: Quantity, longest: float = RECENT) -> np.ndarray:
    """The age [s] of the newest sample whose number each value has, 0 until the next sample comes;
    inf: none of the last `longest` seconds has it."""
    if not len(quantity.time) or not len(series.time):
        return np.full(len(series.time), np.inf)
    samples = recent(series.time, quantity.time, longest)
    fitting = fits(series, quantity, samples)
    newest = samples.age[np.arange(len(fitting)), fitting.argmax(axis=1)]
    return np.where(fitting.any(axis=1), newest, np.inf)


def thinned(series: Series) -> Series:
    """At most MOST_VALUES values of a series, those that are numbers."""
    known = np.flatnonzero(np.isfinite(series.value))
    known = known[::max(1, len(known) // MOST_VALUES)]
    return series.take(known)


def matching_quantities(series: Series, quantities: Iterable[Quantity],
                        part: float = PART) -> List[Quantity]:
    """The quantities that a variable follows, in their order. If there are several, this run does
    not show which of them the node uses."""
    # without the value before any message
    first = int(np.argmax(series.text != series.text[:1])) if len(series.text) else 0
    few, found = thinned(series.take(slice(first, None))), []
    some, time = few.take(slice(None, None, SOME)), np.empty(0)
    can_refuse = len(some.time) > (1.0 - part) * len(few.time)
    for each in quantities if len(few.time) else ():
        if not len(each.time):
            continue
        if each.time is not time:
            time, samples = each.time, recent(few.time, each.time, RECENT)
            samples_of_some = Recent(*(row[::SOME] for row in samples))
        if can_refuse:
            missed = (~fits(some, each, samples_of_some).any(axis=1)).sum()
            if (len(few.time) - missed) / len(few.time) < part:
                continue
        if fits(few, each, samples).any(axis=1).mean() >= part:
            found.append(each)
    return found


def delay(series: Series, quantity: Quantity) -> float:
    """The longest delay [s] with which a variable follows a quantity; inf: it does not."""
    found = np.sort(ages(thinned(series), quantity, LATEST))
    return float(found[int(PART * (len(found) - 1))]) if len(found) else math.inf


def pause(series: Series, quantity: Quantity) -> float:
    """The median time between two changes of a variable while a quantity changes [s]; 0: unknown.
    """
    edges = np.searchsorted(quantity.time, series.changes).clip(0, len(quantity.time) - 1)
    steps = np.abs(np.diff(quantity.value[edges]))
    pauses = np.diff(series.changes)[steps > MOVED * quantity.scale]
    return float(np.median(pauses)) if len(pauses) > 2 else 0.0


# -- headings

#: The ranges that a node may give to a yaw from -180 to 180: (words, closed form, its sign).
RANGES = (
    ('from 0 to 360', lambda yaw: np.where(yaw < 0.0, yaw + 360.0, yaw), 1),
    ('from -180 to 180', lambda yaw: yaw, 1),
    ('plus 180 where it is negative', lambda yaw: np.where(yaw < 0.0, yaw + 180.0, yaw), 1),
    ('plus 180', lambda yaw: yaw + 180.0, 1),
    ('plus 360, also where it is positive', lambda yaw: yaw + 360.0, 1),
    ('minus 360 where it is negative', lambda yaw: np.where(yaw < 0.0, yaw - 360.0, yaw), 1),
    ('plus 360 where it is positive', lambda yaw: np.where(yaw > 0.0, yaw + 360.0, yaw), 1),
    ('minus 360 where it is positive', lambda yaw: np.where(yaw > 0.0, yaw - 360.0, yaw), 1),
    ('plus 90, from 0 to 360', lambda yaw: (yaw + 90.0) % 360.0, 1),
    ('minus 90, from 0 to 360', lambda yaw: (yaw - 90.0) % 360.0, 1),
    ('without its sign', np.abs, 0),
    ('subtracted from 360', lambda yaw: 360.0 - yaw, -1),
    ('subtracted from 360 where it is negative',
     lambda yaw: np.where(yaw < 0.0, 360.0 - yaw, yaw), 0),
    ('modulo 180', lambda yaw: yaw % 180.0, 1),
    ('divided by 2', lambda yaw: yaw / 2.0, 0),
    ('divided by 2, plus 360 where it is negative',
     lambda yaw: yaw / 2.0 + np.where(yaw < 0.0, 360.0, 0.0), 0),
    ('mirrored, from 0 to 360', lambda yaw: (-yaw) % 360.0, -1),
    ('mirrored, from -180 to 180', lambda yaw: -yaw, -1))
RIGHT, HEADING = 'the yaw{} in degrees, from 0 to 360', 'the heading, from 0 to 360 degrees'
#: The units: (words, factor of degrees, rounding).
UNITS = (('degrees', 1.0, None), ('radians', math.pi / 180.0, None),
         ('degrees, converted to degrees twice', 180.0 / math.pi, None),
         ('radians, converted to radians twice', (math.pi / 180.0) ** 2, None),
         ('degrees, cut to whole numbers', 1.0, np.trunc),
         ('degrees, rounded to whole numbers', 1.0, np.round),
         ('radians, cut to whole numbers', math.pi / 180.0, np.trunc))
AXES = ('roll', 'pitch', 'yaw')
#: The order of a quaternion's numbers, as squaternion takes them, and others; first that of ROS.
ORDER = 'wxyz'
OTHER_ORDERS = sorted(itertools.permutations(range(4)), key=lambda order: order != (1, 2, 3, 0))


def headings(time: np.ndarray, quaternion: Sequence[np.ndarray],
             of: str = '') -> Iterator[Quantity]:
    """The quantities that a node may take for the heading; the first one is right. `quaternion`:
    w, x, y, z of each sample; `of`: words on its sensor, if it is not the IMU."""
    roll, pitch, yaw = np.degrees(euler(*quaternion))
    for (unit, factor, rounding), (words, form, sign) in itertools.product(UNITS, RANGES):
        # the range is made of degrees, or after the conversion of its number
        for name, value in ((f'the yaw{of} in {unit}, {words}', form(yaw) * factor),
                            ('the yaw{} in {}, {}'.format(of, unit, words.replace(
                                 'from 0 to 360', 'its number plus 360 where it is negative')),
                             form(yaw * factor)))[:1 if factor == 1.0 else 2]:
            yield Quantity(
                HEADING + of if name == RIGHT.format(of) else name, time,
                rounding(value) if rounding else value, max(360.0 * min(factor, 1.0), 1.0),
                sign * factor)
    for (axis, value), (words, form, _), (unit, factor, _) in itertools.product(
            (('roll', roll), ('pitch', pitch)), RANGES[:2], UNITS[:2]):
        yield Quantity(f'the {axis}{of} in {unit}, {words}', time,
                       form(value * factor), 360.0 * factor)
    for part, value in zip(ORDER, quaternion):
        for _, form, _ in (RANGES[1], RANGES[0]):
            yield Quantity('the {} of the quaternion{}{}'.format(part, of, '' if form is RANGES[
                1][1] else ', plus 360 where it is negative'), time, form(value), 1.0)
    for words, value in (('the arcsine of the z', np.arcsin(np.clip(quaternion[3], -1.0, 1.0))),
                         ('twice the arcsine of the z',
                          2.0 * np.arcsin(np.clip(quaternion[3], -1.0, 1.0))),
                         ('twice the arccosine of the w',
                          2.0 * np.arccos(np.clip(quaternion[0], -1.0, 1.0)))):
        for unit, factor in (('', 1.0), (', in degrees', 180.0 / math.pi)):
            yield Quantity(f'{words} of the quaternion{of}{unit}', time,
                           value * factor, 6.3 * factor)
    for order in OTHER_ORDERS:
        if order != (0, 1, 2, 3):
            read = np.degrees(euler(*(quaternion[k] for k in order)))
            for (axis, value), (_, form, _), (unit, factor, _) in itertools.product(
                    zip(AXES[::-1], read[::-1]), RANGES[:2], UNITS[:2]):
                yield Quantity('the {} of the quaternion{} read in the order {}, in {}'.format(
                    axis, of, ', '.join(ORDER[k] for k in order), unit), time,
                    form(value * factor), 360.0 * factor)
