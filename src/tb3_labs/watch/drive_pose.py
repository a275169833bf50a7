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
    MAX_PROBE_LAG, POSE_TOLERANCE, REFERENCES_OF, RIGHT_SHARE, SHORT_LAG, Frame, local_frames,
    part_with_control, unit_of)
from tb3_labs.watch.quantities import SAME_SHARE, Quantity, matching_quantities, sample_ages
from tb3_labs.watch.variables import Series, shortened_value

#: A variable with fewer values in a frame is not judged.
MIN_VALUES = 10
#: The values in a window of this length, with the worst value in its middle, are used to find the
#: quantity that a wrong variable follows [s].
FOLLOWED_WINDOW = 60.0
#: The scale of all quantities here. Two places or angles are equal up to POSE_TOLERANCE.
SCALE = POSE_TOLERANCE / SAME_SHARE


def place_quantities(samples: Any, frame: Frame) -> Iterator[Quantity]:
    """Yields the quantities that a node may take for its local place in `frame`. The first two are
    correct, since the handout does not ask for a declared pose. Each other quantity has one
    mistake; the last quantity is the place in ``odom``."""
    here, declared = samples.x + 1j * samples.y, frame.declared_place
    moved, turned = here - frame.place, frame.odometry_yaw - frame.declared_yaw
    displacement = 'the displacement since the reset, '
    for name, place, angle, start in (
            (displacement + 'rotated by minus the yaw at the reset', moved, turned, declared),
            (displacement + 'rotated by minus the yaw at the reset, without the declared pose',
             moved, frame.odometry_yaw, 0j),
            (displacement + 'not rotated', moved, 0.0, declared),
            (displacement + 'rotated by plus the yaw at the reset', moved, -turned, declared),
            (displacement + 'rotated by minus the yaw of the IMU', moved,
             frame.imu_yaw - frame.declared_yaw, declared),
            (displacement + 'rotated by minus the present yaw', moved, samples.yaw, declared),
            (displacement + 'rotated by minus the yaw without the declared one', moved,
             frame.odometry_yaw, declared),
            ('the place in the odometry, not displaced, rotated by minus the yaw at the reset',
             here, turned, declared),
            ('the place in the odometry', here, 0.0, 0j)):
        yield Quantity(name, samples.arrival, place * np.exp(-1j * angle) + start, SCALE)


def yaw_readings(node_run: NodeRun, frame: Frame, sensor: str,
                 window: Tuple[float, float]) -> Iterator[Tuple[Quantity, float]]:
    """Yields (quantity, its value at the start of the frame) for each quantity that a node may read
    in place of the yaw of the `sensor`, IMU or odometry, in a `window` of the frame [s]. The first
    quantity is correct."""
    run = node_run.run
    # the other quantities include the correct yaw, too, under the name `correct`
    if sensor == 'IMU':
        samples, at_start, correct = run.imu, frame.imu_yaw, 'the yaw'
    else:
        samples, at_start, correct = run.odometry, frame.odometry_yaw, 'the yaw of the odometry'
    samples = samples.take(in_window(samples.arrival, window))
    yield Quantity('the yaw of the ' + sensor, samples.arrival, samples.yaw, SCALE), at_start
    for quantities in (node_run.imu_quantities, node_run.odometry_quantities):
        times = quantities[0].time
        part = in_window(times, window)
        first = min(int(np.searchsorted(times, frame.begin)), len(times) - 1)
        # matching_quantities is faster if quantities share one array of times
        times = times[part]
        for each in quantities:
            name = re.sub(',? in radians|, from -180 to 180', '', each.name)
            # on the unit circle, a heading in any range equals the heading from -180 to 180
            if name != correct and ('from -180' in each.name or not each.per_degree):
                yield Quantity(name, times, each.value[part], SCALE), each.value[first]


def in_window(times: np.ndarray, window: Tuple[float, float]) -> slice:
    """Returns the indices of the times in a window (begin, end). The times are sorted."""
    return slice(*np.searchsorted(times, window))


def local_yaw_quantities(node_run: NodeRun, frame: Frame,
                         window: Tuple[float, float]) -> Iterator[Quantity]:
    """Yields the quantities that a local yaw may follow. The first two are correct."""
    readings = yaw_readings(node_run, frame, 'IMU', window)
    yaw, at_reset = next(readings)
    since = yaw.value - at_reset
    yield made_of(yaw, ' since the reset', since + frame.declared_yaw)
    yield made_of(yaw, ' since the reset, without the declared pose', since)
    yield made_of(yaw, ', not from the reset on', yaw.value + frame.declared_yaw)
    for yaw, at_reset in readings:
        is_in_degrees = ' in degrees' in yaw.name
        declared = np.degrees(frame.declared_yaw) if is_in_degrees else frame.declared_yaw
        yield made_of(yaw, ' since the reset', yaw.value - at_reset + declared)
        if is_in_degrees:
            yield made_of(yaw, ', minus the radians at the reset',
                          yaw.value - np.radians(at_reset) + declared)


def reference_quantities(node_run: NodeRun, frame: Frame, name: str,
                         window: Tuple[float, float]) -> Iterator[Quantity]:
    """Yields the quantities that the reference `name` may follow. The first two are correct: a node
    may subtract the declared pose from its reference."""
    readings: Iterator[Tuple[Quantity, complex]]
    if 'yaw' in name:
        sensor = 'IMU' if name == 'initial_global_yaw' else 'odometry'
        readings = yaw_readings(node_run, frame, sensor, window)
        declared = frame.declared_yaw
    else:
        samples = node_run.run.odometry
        samples = samples.take(in_window(samples.arrival, window))
        readings = iter([(Quantity('the place of the odometry', samples.arrival,
                                   samples.x + 1j * samples.y, SCALE), frame.place)])
        declared = frame.declared_place * np.exp(1j * (frame.odometry_yaw - frame.declared_yaw))
    reading, at_reset = next(readings)
    yield made_of(reading, ' at the reset', at_reset)
    yield made_of(reading, ' at the reset, without the declared pose', at_reset - declared)
    yield reading
    for reading, at_reset in readings:
        yield made_of(reading, ' at the reset', at_reset)


def made_of(reading: Quantity, clause: str, value: Any) -> Quantity:
    """Returns the quantity that a node makes of a reading. `value` is an array, or one number."""
    return reading._replace(name=reading.name + clause, value=value + 0.0 * reading.value)


def pose_quantities(node_run: NodeRun, frame: Frame, name: str,
                    window: Tuple[float, float]) -> Iterator[Quantity]:
    """Yields the quantities that the variable `name` may follow in a `window` of a frame [s], with
    their values in comparable form. The first two are correct."""
    if name == 'local_yaw':
        quantities = local_yaw_quantities(node_run, frame, window)
    elif name in REFERENCES_OF:
        odometry = node_run.run.odometry
        quantities = place_quantities(odometry.take(in_window(odometry.arrival, window)), frame)
    else:
        quantities = reference_quantities(node_run, frame, name, window)
    for each in quantities:
        yield each._replace(value=comparable(name, each.value))


def comparable(name: str, value: np.ndarray) -> np.ndarray:
    """Returns the values of the variable `name` in comparable form. A yaw becomes a point on the
    unit circle, and a complex place becomes its x or its y."""
    if 'yaw' in name:
        return np.cos(value) + 1j * np.sin(value)       # faster than exp
    return np.imag(value) if name.endswith('y') and np.iscomplexobj(value) else np.real(value)


def wrong_pose(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Yields the wrong variables of the local pose. If the node computes a variable from wrong
    references, the references are yielded before the variable."""
    for frame, name in product(node_run.cached(local_frames), REFERENCES_OF):
        for wrong in wrong_in_frame(node_run, frame, name):
            for reference in REFERENCES_OF[name]:
                yield from wrong_in_frame(node_run, frame, reference)
            yield wrong


def wrong_in_frame(node_run: NodeRun, frame: Frame, name: str) -> Iterator[BrokenLink]:
    """Yields the variable `name` if it does not follow the correct quantity in a frame."""
    series, is_local = node_run.variable(name), name in REFERENCES_OF
    if series is None or np.isnan([frame.place, frame.odometry_yaw, frame.imu_yaw]).any():
        return
    window = (frame.begin - MAX_PROBE_LAG, frame.end)
    accepted = list(islice(pose_quantities(node_run, frame, name, window), 2))
    correct = accepted[0]
    # the node receives its first message shortly after the frame's start
    first = correct.time[correct.time >= frame.begin][:1]
    if not len(first):
        return
    unit = unit_of(series) if is_local else 1.0
    value = comparable(name, series.value * unit)
    in_frame = Series(name, series.time, series.text, value).between(
        first[0] + MAX_PROBE_LAG, frame.end)
    part = part_with_control(node_run, in_frame)
    if np.isfinite(part.value).sum() < MIN_VALUES:
        return
    if matching_quantities(part, accepted, RIGHT_SHARE):
        return
    should = correct.at(part.time)
    worst = worst_index(part, should)
    behaviour = ''
    moved = np.nan_to_num(np.abs(part.value - part.value[0])).max(initial=0.0)
    if moved > 2.0 * POSE_TOLERANCE or not is_local:
        begin = part.time[worst] - FOLLOWED_WINDOW / 2.0
        end = part.time[worst] + FOLLOWED_WINDOW / 2.0
        quantities = pose_quantities(node_run, frame, name,
                                     (max(window[0], begin), min(window[1], end)))
        behaviour = followed_text(part.between(begin, end), islice(quantities, 2, None))
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
    """Returns a clause on the first two quantities that a variable follows; '' if it follows
    none."""
    found = matching_quantities(part, quantities, RIGHT_SHARE)
    return 'followed ' + ', or '.join(each.name for each in found[:2]) if found else ''


def late_text(part: Series, correct: Quantity) -> str:
    """Returns a clause that says how late a variable follows the correct quantity, or that it does
    not follow this quantity."""
    delays = np.sort(sample_ages(part, correct._replace(scale=1.0), 60.0))
    longest = delays[int(RIGHT_SHARE * (len(part.time) - 1))]
    return f'came up to {longest:.1f} s late' if longest < np.inf else 'did not follow it'
