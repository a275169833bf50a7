"""The local pose of the Transformation lab: what local_x, local_y, local_yaw and their references
should be, and what they follow instead.

Places are complex numbers here, x + iy. Angles are compared on the unit circle, so in any range.
"""
import re
from itertools import islice, product
from typing import Any, Iterator, Tuple

import numpy as np

from tb3_labs.watch.broken_link import BrokenLink, NodeRun, expected, farthest
from tb3_labs.watch.drive_states import (
    LONGEST_LAG, POSE_TOLERANCE, REFERENCES_OF, RIGHT_SHARE, SHORT_LAG, Frame, frames,
    part_with_control, unit_of)
from tb3_labs.watch.quantities import SAME_SHARE, Quantity, ages, matching_quantities
from tb3_labs.watch.variables import Series, shortened_value

#: A variable with fewer values is not judged.
FEWEST_VALUES = 10
#: The followed quantity is looked for in the NAMED_TIME around the worst value [s].
NAMED_TIME = 60.0


def mistake_combinations(*options: Any) -> Iterator[Tuple[Any, ...]]:
    """Yields (number of choices that are not the first option, the choices) of all combinations."""
    for chosen in product(*options):
        yield (sum(one is not each[0] for one, each in zip(chosen, options)), *chosen)


def place_quantities(samples: Any, before: Frame, frame: Frame) -> Iterator[Quantity]:
    """Yields the quantities that a node may take for its local place, as complex numbers, by these
    samples of the odometry; the first two are right. `before`: the frame before."""
    here, scale = samples.x + 1j * samples.y, POSE_TOLERANCE / SAME_SHARE
    turned, turned_before = (each.odometry_yaw - each.declared_yaw for each in (frame, before))
    bases = (('the displacement since the reset', here - frame.place),
             ('the displacement since the reset before', here - before.place),
             ('the place in the odometry, not displaced', here))
    turns = (('rotated by {} the yaw at the reset', turned), ('not rotated', 0.0),
             ('rotated by {} the yaw of the IMU', frame.imu_yaw - frame.declared_yaw),
             ('rotated by {} the present yaw', samples.yaw),
             ('rotated by {} the yaw at the reset before', turned_before),
             ('rotated by {} the yaw without the declared one', frame.odometry_yaw))
    for mistakes, (base, place), (turn, angle), (side, sign) in mistake_combinations(
            bases, turns, (('minus', -1j), ('plus', 1j))):
        yield Quantity(f'{base}, {turn.format(side)}', samples.arrival,
                       place * np.exp(sign * angle) + frame.declared_place, scale,
                       mistakes=mistakes)
        if not mistakes:
            yield Quantity(base + ', without the declared pose', samples.arrival,
                           place * np.exp(-1j * frame.odometry_yaw), scale, mistakes=1)


#: The formulas of a local yaw, and of a reference: (words, the factors of the present reading, of
#: the reading at the reset, of the reading at the reset before).
LOCAL_FORMULAS = ((' since the reset', 1, -1, 0), (' since the reset before', 1, 0, -1),
                  (', not from the reset on', 1, 0, 0),
                  (', minus the radians at the reset', 1, -np.pi / 180.0, 0))
REFERENCE_FORMULAS = ((' at the reset', 0, 1, 0), (' at the reset before', 0, 0, 1), ('', 1, 0, 0))


def readings(node_run: NodeRun, before: Frame, frame: Frame, name: str,
             window: Tuple[float, float]) -> Iterator[Tuple[Quantity, Any, Any]]:
    """Yields (a quantity that a node may read for a yaw or a reference, its value at the begin of
    the frame, and of the frame before). The first is right."""
    sensor = 'IMU' if name in ('local_yaw', 'initial_global_yaw') else 'odometry'
    samples = node_run.run.imu if sensor == 'IMU' else node_run.run.odometry
    samples = samples.take(slice(*np.searchsorted(samples.arrival, window)))
    if 'yaw' not in name:
        yield Quantity('the place of the odometry', samples.arrival, samples.x + 1j * samples.y,
                       0.0), frame.place, before.place
        return
    yaw = Quantity('the yaw of the ' + sensor, samples.arrival, samples.yaw, 0.0)
    if sensor == 'IMU':
        yield yaw, frame.imu_yaw, before.imu_yaw
    else:
        yield yaw, frame.odometry_yaw, before.odometry_yaw
    for quantities in (node_run.imu_quantities, node_run.odometry_quantities):
        times = quantities[0].time
        part = slice(*np.searchsorted(times, window))
        this, last = np.searchsorted(times, (frame.begin, before.begin)).clip(max=len(times) - 1)
        times = times[part]
        for each in quantities:
            # the other ranges are equal on the circle
            if 'from -180' in each.words or not each.per_degree:
                words = re.sub(',? in radians|, from -180 to 180', '', each.words)
                mistakes = 1 + ('yaw' not in words) + ('odometry' in words)
                mistakes += words.replace('x, y, z, w', '').count(',')
                yield each._replace(words=words, time=times, value=each.value[part],
                                    mistakes=mistakes), each.value[this], each.value[last]


def pose_quantities(node_run: NodeRun, before: Frame, frame: Frame, name: str,
                    window: Tuple[float, float]) -> Iterator[Quantity]:
    """Yields the quantities that a variable of the pose or a reference may follow in a `window` of
    a frame [s], as they are compared. The first two are right: the handout does not ask for a
    declared pose."""
    if name in ('local_x', 'local_y'):
        odometry = node_run.run.odometry
        samples = odometry.take(slice(*np.searchsorted(odometry.arrival, window)))
        for each in place_quantities(samples, before, frame):
            yield each._replace(value=comparable(name, each.value))
        return
    is_local = name in REFERENCES_OF
    formulas = LOCAL_FORMULAS if is_local else REFERENCE_FORMULAS
    shares = (('', is_local), (', without the declared pose', is_local - 1))
    place = frame.declared_place * np.exp(1j * (frame.odometry_yaw - frame.declared_yaw))
    for each, at_reset, at_reset_before in readings(
            node_run, before, frame, name, window):
        declared = place if 'yaw' not in name else frame.declared_yaw * (
            180.0 / np.pi if ' in degrees' in each.words else 1.0)
        for mistakes, (words, now, this, last), (kept, share) in mistake_combinations(
                formulas, shares):
            value = now * each.value + this * at_reset + share * declared
            value = value + last * at_reset_before if last else value
            yield each._replace(
                words=each.words + words + kept, value=comparable(name, value),
                scale=POSE_TOLERANCE / SAME_SHARE, mistakes=each.mistakes + mistakes)


def comparable(name: str, value: np.ndarray) -> np.ndarray:
    """Returns numbers as they are compared: a yaw on the unit circle, of a place its x or y."""
    if 'yaw' in name:
        return np.cos(value) + 1j * np.sin(value)       # faster than exp
    return np.imag(value) if name.endswith('y') and np.iscomplexobj(value) else np.real(value)


def wrong_pose(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Yields the wrong variables of the local pose, first their wrong references."""
    known = node_run.cached(frames)
    for (before, frame), name in product(zip(known[:1] + known, known), REFERENCES_OF):
        for wrong in wrong_variable(node_run, before, frame, name):
            for reference in REFERENCES_OF[name]:
                yield from wrong_variable(node_run, before, frame, reference)
            yield wrong


def wrong_variable(node_run: NodeRun, before: Frame, frame: Frame,
                   name: str) -> Iterator[BrokenLink]:
    """Yields a variable that does not follow the right quantity in a frame."""
    series, is_local = node_run.find(name), name in REFERENCES_OF
    if series is None or np.isnan([frame.place, frame.odometry_yaw, frame.imu_yaw]).any():
        return
    window = (frame.begin - LONGEST_LAG, frame.end)
    rights = list(islice(pose_quantities(node_run, before, frame, name, window), 2))
    right = rights[0]
    # a node knows nothing of the frame before its first message in it
    first = right.time[right.time >= frame.begin][:1]
    if not len(first):
        return
    value = comparable(name, series.value * (unit_of(series) if is_local else 1.0))
    part = part_with_control(node_run, Series(name, series.time, series.text, value).between(
        first[0] + LONGEST_LAG, frame.end))
    if np.isfinite(part.value).sum() < FEWEST_VALUES or matching_quantities(
            part, rights, RIGHT_SHARE):
        return
    should = right.at(part.time)
    worst = farthest(part, should)
    moved = np.nan_to_num(np.abs(part.value - part.value[0])).max(initial=0.0)
    words = ''
    if moved > 2.0 * POSE_TOLERANCE or not is_local:
        begin, end = part.time[worst] - NAMED_TIME / 2.0, part.time[worst] + NAMED_TIME / 2.0
        words = followed_text(part.between(begin, end), pose_quantities(
            node_run, before, frame, name, (max(window[0], begin), min(window[1], end))))
    words = words or late_text(part, right)
    if len(set(part.text)) == 1 and (is_local or frame.is_reset and (
            series.text_at(frame.begin - SHORT_LAG) == part.text[0])):
        words = 'stayed ' + shortened_value(part.text[0])
    elif not is_local and 'followed' not in words:
        return      # it has another meaning here
    yield BrokenLink('{}: it was {} when this was {:.3g}'.format(
        expected(f'{frame.words}{series.name} {words}', right.words),
        shortened_value(part.text[worst]),
        np.angle(should[worst]) if 'yaw' in name else should[worst]),
        part.time[worst], series.name)


def followed_text(part: Series, quantities: Iterator[Quantity]) -> str:
    """Returns a clause on the followed quantities with the fewest mistakes, '' if there is none."""
    found = matching_quantities(part, quantities, RIGHT_SHARE)
    fewest = min((each.mistakes for each in found), default=0)
    texts = dict.fromkeys(each.words for each in found if each.mistakes == fewest)
    return 'followed ' + ', or '.join(list(texts)[:2]) if texts else ''


def late_text(part: Series, right: Quantity) -> str:
    """Returns a clause on a variable that follows the right quantity late, or not at all."""
    late = np.sort(ages(part, right._replace(scale=1.0), 60.0))
    late = late[int(RIGHT_SHARE * (len(part.time) - 1))]
    return f'came up to {late:.1f} s late' if late < np.inf else 'did not follow it'
