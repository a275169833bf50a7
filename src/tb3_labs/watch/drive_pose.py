"""The link of the local pose, in the Transformation lab. It checks local_x, local_y, local_yaw and
their references, and finds the wrong quantities that these variables may follow.

Here, places are complex numbers, x + iy. Angles are compared on the unit circle, so that their
range does not matter.
"""
import re
from itertools import islice, product
from typing import Any, Iterator, Tuple

import numpy as np

from tb3_labs.watch.broken_link import BrokenLink, NodeRun, expected, worst_index
from tb3_labs.watch.drive_states import (
    LONGEST_LAG, POSE_TOLERANCE, REFERENCES_OF, RIGHT_SHARE, SHORT_LAG, Frame, local_frames,
    part_with_control, unit_of)
from tb3_labs.watch.quantities import SAME_SHARE, Quantity, matching_quantities, sample_ages
from tb3_labs.watch.variables import Series, shortened_value

#: A variable with fewer values in a frame is not judged.
FEWEST_VALUES = 10
#: The search for the followed quantity uses the values within this time of the worst value [s].
FOLLOWED_WINDOW = 60.0


def mistake_combinations(*options: Any) -> Iterator[Tuple[Any, ...]]:
    """Yields (number of mistakes, chosen values...) for each choice of one value per option. The
    first value of an option is correct, and the other values are mistakes."""
    for chosen in product(*options):
        mistakes = sum(choice is not option[0] for choice, option in zip(chosen, options))
        yield (mistakes, *chosen)


def in_window(times: np.ndarray, window: Tuple[float, float]) -> slice:
    """Returns the indices of the times in a window (begin, end). The times are sorted."""
    return slice(*np.searchsorted(times, window))


def place_quantities(samples: Any, before: Frame, frame: Frame) -> Iterator[Quantity]:
    """Yields the quantities that a node may take for its local place in `frame`. The first two are
    correct. `samples` are of the odometry. The frame `before` came before `frame`."""
    here, scale = samples.x + 1j * samples.y, POSE_TOLERANCE / SAME_SHARE
    turned = frame.odometry_yaw - frame.declared_yaw
    turned_before = before.odometry_yaw - before.declared_yaw
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


#: A local yaw or a reference is a weighted sum of three readings: the present one, the one at the
#: last reset, and the one at the reset before. Each formula has its words and the three factors.
LOCAL_FORMULAS = ((' since the reset', 1, -1, 0), (' since the reset before', 1, 0, -1),
                  (', not from the reset on', 1, 0, 0),
                  (', minus the radians at the reset', 1, -np.pi / 180.0, 0))
REFERENCE_FORMULAS = ((' at the reset', 0, 1, 0), (' at the reset before', 0, 0, 1), ('', 1, 0, 0))


def readings(node_run: NodeRun, before: Frame, frame: Frame, name: str,
             window: Tuple[float, float]) -> Iterator[Tuple[Quantity, Any, Any]]:
    """Yields each quantity that a node may read for a yaw or a reference, with its value at the
    start of `frame` and its value at the start of `before`. The first quantity is correct."""
    sensor = 'IMU' if name in ('local_yaw', 'initial_global_yaw') else 'odometry'
    samples = node_run.run.imu if sensor == 'IMU' else node_run.run.odometry
    samples = samples.take(in_window(samples.arrival, window))
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
        part = in_window(times, window)
        this, last = np.searchsorted(times, (frame.begin, before.begin)).clip(max=len(times) - 1)
        times = times[part]
        for each in quantities:
            # on the unit circle, a heading in any range equals the heading from -180 to 180
            if 'from -180' in each.name or not each.per_degree:
                text = re.sub(',? in radians|, from -180 to 180', '', each.name)
                mistakes = 1 + ('yaw' not in text) + ('odometry' in text)
                mistakes += text.replace('x, y, z, w', '').count(',')
                yield each._replace(name=text, time=times, value=each.value[part],
                                    mistakes=mistakes), each.value[this], each.value[last]


def pose_quantities(node_run: NodeRun, before: Frame, frame: Frame, name: str,
                    window: Tuple[float, float]) -> Iterator[Quantity]:
    """Yields the quantities that the variable `name` may follow in a `window` of a frame [s]. Their
    values are in comparable form. The first quantity is correct. The second one is correct, too,
    since the handout does not ask for a declared pose."""
    if name in ('local_x', 'local_y'):
        odometry = node_run.run.odometry
        samples = odometry.take(in_window(odometry.arrival, window))
        quantities = place_quantities(samples, before, frame)
    else:
        quantities = reading_quantities(node_run, before, frame, name, window)
    for each in quantities:
        yield each._replace(value=comparable(name, each.value))


def reading_quantities(node_run: NodeRun, before: Frame, frame: Frame, name: str,
                       window: Tuple[float, float]) -> Iterator[Quantity]:
    """Yields the quantities that a local yaw or a reference may follow."""
    is_local = name in REFERENCES_OF
    formulas = LOCAL_FORMULAS if is_local else REFERENCE_FORMULAS
    # (clause, factor of the declared pose): a reference lacks what the local yaw adds
    declared_factors = (('', 0.0), (', without the declared pose', -1.0))
    if is_local:
        declared_factors = (('', 1.0), (', without the declared pose', 0.0))
    place = frame.declared_place * np.exp(1j * (frame.odometry_yaw - frame.declared_yaw))
    for each, at_reset, at_reset_before in readings(node_run, before, frame, name, window):
        if 'yaw' not in name:
            declared = place
        elif ' in degrees' in each.name:
            declared = frame.declared_yaw * (180.0 / np.pi)
        else:
            declared = frame.declared_yaw
        for mistakes, (formula, now, this, last), (without, factor) in mistake_combinations(
                formulas, declared_factors):
            value = now * each.value + this * at_reset + factor * declared
            if last:
                value = value + last * at_reset_before
            yield each._replace(name=each.name + formula + without, value=value,
                                scale=POSE_TOLERANCE / SAME_SHARE,
                                mistakes=each.mistakes + mistakes)


def comparable(name: str, value: np.ndarray) -> np.ndarray:
    """Returns the values of the variable `name` in comparable form. A yaw becomes a point on the
    unit circle, and a complex place becomes its x or its y."""
    if 'yaw' in name:
        return np.cos(value) + 1j * np.sin(value)       # faster than exp
    return np.imag(value) if name.endswith('y') and np.iscomplexobj(value) else np.real(value)


def wrong_pose(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Yields the wrong variables of the local pose. The wrong references of a variable are
    yielded before the variable."""
    known = node_run.cached(local_frames)
    for (before, frame), name in product(zip(known[:1] + known, known), REFERENCES_OF):
        for wrong in wrong_in_frame(node_run, before, frame, name):
            for reference in REFERENCES_OF[name]:
                yield from wrong_in_frame(node_run, before, frame, reference)
            yield wrong


def wrong_in_frame(node_run: NodeRun, before: Frame, frame: Frame,
                   name: str) -> Iterator[BrokenLink]:
    """Yields the variable `name` if it does not follow the correct quantity in a frame."""
    series, is_local = node_run.variable(name), name in REFERENCES_OF
    if series is None or np.isnan([frame.place, frame.odometry_yaw, frame.imu_yaw]).any():
        return
    window = (frame.begin - LONGEST_LAG, frame.end)
    accepted = list(islice(pose_quantities(node_run, before, frame, name, window), 2))
    correct = accepted[0]
    # the node receives its first message shortly after the frame's start
    first = correct.time[correct.time >= frame.begin][:1]
    if not len(first):
        return
    value = comparable(name, series.value * (unit_of(series) if is_local else 1.0))
    in_frame = Series(name, series.time, series.text, value).between(
        first[0] + LONGEST_LAG, frame.end)
    part = part_with_control(node_run, in_frame)
    if np.isfinite(part.value).sum() < FEWEST_VALUES or matching_quantities(
            part, accepted, RIGHT_SHARE):
        return
    should = correct.at(part.time)
    worst = worst_index(part, should)
    behaviour = ''
    moved = np.nan_to_num(np.abs(part.value - part.value[0])).max(initial=0.0)
    if moved > 2.0 * POSE_TOLERANCE or not is_local:
        begin = part.time[worst] - FOLLOWED_WINDOW / 2.0
        end = part.time[worst] + FOLLOWED_WINDOW / 2.0
        quantities = pose_quantities(node_run, before, frame, name,
                                     (max(window[0], begin), min(window[1], end)))
        behaviour = followed_text(part.between(begin, end), quantities)
    behaviour = behaviour or late_text(part, correct)
    is_constant = len(set(part.text)) == 1
    stayed_at_reset = frame.is_reset and (
        series.text_at(frame.begin - SHORT_LAG) == part.text[0])
    if is_constant and (is_local or stayed_at_reset):
        behaviour = 'stayed ' + shortened_value(part.text[0])
    elif not is_local and 'followed' not in behaviour:
        return      # this node does not use the reference as the handout does
    correct_value = np.angle(should[worst]) if 'yaw' in name else should[worst]
    message = expected(f'{frame.clause}{series.name} {behaviour}', correct.name)
    yield BrokenLink(
        f'{message}: it was {shortened_value(part.text[worst])} when this was {correct_value:.3g}',
        part.time[worst], series.name)


def followed_text(part: Series, quantities: Iterator[Quantity]) -> str:
    """Returns a clause on the quantities that a variable follows; '' if it follows none. Only the
    quantities with the fewest mistakes are named."""
    found = matching_quantities(part, quantities, RIGHT_SHARE)
    fewest = min((each.mistakes for each in found), default=0)
    texts = dict.fromkeys(each.name for each in found if each.mistakes == fewest)
    return 'followed ' + ', or '.join(list(texts)[:2]) if texts else ''


def late_text(part: Series, correct: Quantity) -> str:
    """Returns a clause: how late a variable follows the correct quantity, or that it does not."""
    delays = np.sort(sample_ages(part, correct._replace(scale=1.0), 60.0))
    longest = delays[int(RIGHT_SHARE * (len(part.time) - 1))]
    return f'came up to {longest:.1f} s late' if longest < np.inf else 'did not follow it'
