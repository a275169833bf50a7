"""Checks the variables local_x, local_y and local_yaw of the Transformation lab. If a variable is
wrong, this module finds the quantity that the variable follows instead.

In this file a place (x, y) is the complex number x + iy. Angles are compared on the unit circle, so
that their range does not matter.
"""
from dataclasses import replace
from itertools import product
from typing import Any, Iterator, List

import numpy as np

from tb3_labs.geometry.angles import wrap
from tb3_labs.watch.broken_link import BrokenLink, NodeRun, should_be, worst_index
from tb3_labs.watch.drive_states import (
    MAX_PROBE_LAG, POSE_TOLERANCE, REFERENCES_OF, RIGHT_SHARE, SHORT_LAG, Frame, index_from,
    local_frames, part_with_control, unit_of)
from tb3_labs.watch.headings import angles_of
from tb3_labs.watch.variables import (
    SAME_SHARE, Quantity, Series, longest_delay, matching_quantities, shortened_value)

#: A variable with fewer values in a frame is not judged.
MIN_VALUES = 10
#: All quantities of this file have this scale. Two places, or two angles, are equal if they differ
#: by at most POSE_TOLERANCE.
SCALE = POSE_TOLERANCE / SAME_SHARE


def place_quantities(samples: Any, frame: Frame) -> Iterator[Quantity]:
    """Yields the quantities that a node may use as its local place in `frame`. Only the first two
    quantities are correct. A node need not add the pose that the reset declares."""
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
            ('the place in the odometry, not displaced, rotated by minus the yaw at the reset',
             here, turned, declared),
            ('the place in the odometry', here, 0.0, 0j)):
        yield Quantity(name, samples.arrival, place * np.exp(-1j * angle) + start, SCALE)


def yaw_readings(imu: Any, odometry: Any) -> List[Quantity]:
    """Returns the quantities that a node may use as the IMU's yaw, first the correct quantity."""
    readings = [('the yaw of the IMU', imu, imu.yaw),
                ('the yaw of the odometry', odometry, odometry.yaw),
                ('the yaw, mirrored', imu, -imu.yaw),
                ('the z of the quaternion', imu, imu.z)]
    readings += [(f'the {name}', imu, angle) for name, angle in angles_of(imu).items()
                 if name != 'yaw']
    return [Quantity(name, samples.arrival, value, SCALE) for name, samples, value in readings]


def local_yaw_quantities(imu: Any, odometry: Any, frame: Frame) -> Iterator[Quantity]:
    """Yields the quantities that a node may use as its local yaw. The first two quantities are
    correct."""
    yaw, *others = yaw_readings(imu, odometry)
    degrees = yaw._replace(name='the yaw in degrees', value=np.degrees(yaw.value))
    rows = [(yaw, ' since the reset', frame.declared_yaw - frame.imu_yaw),
            (yaw, ' since the reset, without the declared pose', -frame.imu_yaw),
            (yaw, ', not from the reset on', 0.0)]
    for each in (degrees, *others):
        at_reset = each.value[index_from(each.time, frame.begin)]
        rows.append((each, ' since the reset', frame.declared_yaw - at_reset))
    rows.append((degrees, ', minus the radians at the reset', -frame.imu_yaw))
    for each, clause, offset in rows:
        yield each._replace(name=each.name + clause, value=each.value + offset)


def pose_quantities(node_run: NodeRun, frame: Frame, name: str) -> List[Quantity]:
    """Returns the quantities that the variable `name` may follow in a frame. The first two are
    correct. `comparable` converts the values. Returns [] without samples of a sensor."""
    window = frame.begin - MAX_PROBE_LAG, frame.end
    imu, odometry = (samples.take(slice(*np.searchsorted(samples.arrival, window)))
                     for samples in (node_run.run.imu, node_run.run.odometry))
    if not len(imu) or not len(odometry):
        return []
    if name == 'local_yaw':
        quantities = local_yaw_quantities(imu, odometry, frame)
    else:
        quantities = place_quantities(odometry, frame)
    return [each._replace(value=comparable(name, each.value)) for each in quantities]


def comparable(name: str, value: np.ndarray) -> np.ndarray:
    """Returns the values of the variable `name` in comparable form. A yaw becomes a point on the
    unit circle, and a complex place becomes its x or its y."""
    if 'yaw' in name:
        return np.cos(value) + 1j * np.sin(value)       # faster than exp
    if not np.iscomplexobj(value):
        return value
    return value.imag if name == 'local_y' else value.real


def wrong_pose(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Checks the variables of the local pose. If a variable and its reference are wrong, the
    reference is yielded first."""
    for frame, name in product(node_run.cached(local_frames), REFERENCES_OF):
        for wrong in wrong_in_frame(node_run, frame, name):
            for reference in REFERENCES_OF[name]:
                yield from wrong_reference(node_run, frame, reference)
            yield wrong


def wrong_reference(node_run: NodeRun, frame: Frame, name: str) -> Iterator[BrokenLink]:
    """Checks the reference `name` in a frame. A wrong reference is reported in two cases: the
    reset did not change the reference, or the reference is another yaw."""
    run = node_run.run
    series = node_run.variable(name)
    sensor, correct = {
        'initial_global_yaw': ('the yaw of the IMU', frame.imu_yaw),
        'initial_odom_yaw': ('the yaw of the odometry', frame.odometry_yaw),
        'initial_global_x': ('the place of the odometry', frame.place.real),
        'initial_global_y': ('the place of the odometry', frame.place.imag)}[name]
    if series is None:
        return
    part = series.between(frame.begin + MAX_PROBE_LAG, frame.end)
    if len(set(part.text)) != 1:
        return
    text = shortened_value(part.text[0])
    error = part.value[0] - correct
    if 'yaw' in name:
        error = wrap(error)
    if abs(error) <= POSE_TOLERANCE:
        return
    behaviours = []
    if frame.is_reset and series.text_at(frame.begin - SHORT_LAG) == part.text[0]:
        behaviours.append('stayed ' + text)
    elif 'yaw' in name:
        behaviours += [
            f'followed {each.name} at the reset' for each in yaw_readings(run.imu, run.odometry)
            if abs(wrap(part.value[0] - each.at(frame.begin))) <= POSE_TOLERANCE]
    if behaviours:
        observation = f'{frame.clause}{series.name} {behaviours[0]}'
        message = should_be(observation, sensor + ' at the reset')
        yield BrokenLink(f'{message}: it was {text} when this was {correct:.3g}', part.time[0],
                         series.name)


def wrong_in_frame(node_run: NodeRun, frame: Frame, name: str) -> Iterator[BrokenLink]:
    """Checks that the variable `name` follows the correct quantity in a frame."""
    series = node_run.variable(name)
    quantities = pose_quantities(node_run, frame, name)
    if series is None or not quantities:
        return
    correct = quantities[0]
    # the node receives its first message shortly after the frame's start
    received = correct.time[correct.time >= frame.begin]
    if not len(received):
        return
    part = series.between(received[0] + MAX_PROBE_LAG, frame.end)
    part = part_with_control(
        node_run, replace(part, value=comparable(name, part.value * unit_of(series))))
    is_known = np.isfinite(part.value).sum() >= MIN_VALUES
    if not is_known or matching_quantities(part, quantities[:2], RIGHT_SHARE):
        return
    expected = correct.at(part.time)
    worst = worst_index(part, expected)
    correct_value = np.angle(expected[worst]) if 'yaw' in name else expected[worst]
    behaviour = behaviour_text(part, correct, quantities[2:])
    message = should_be(f'{frame.clause}{series.name} {behaviour}', correct.name)
    yield BrokenLink(
        f'{message}: it was {shortened_value(part.text[worst])} when this was {correct_value:.3g}',
        part.time[worst], series.name)


def behaviour_text(part: Series, correct: Quantity, others: List[Quantity]) -> str:
    """Returns a clause on a variable that does not follow the quantity `correct`. If the variable
    follows one of the `others`, the clause names this quantity."""
    if len(set(part.text)) == 1:
        return 'stayed ' + shortened_value(part.text[0])
    moved = np.nan_to_num(np.abs(part.value - part.value[0])).max()
    followed = matching_quantities(part, others, RIGHT_SHARE)
    if followed and moved > 2.0 * POSE_TOLERANCE:
        return 'followed ' + followed[0].name
    delay = longest_delay(part, correct._replace(scale=1.0))
    return f'came up to {delay:.1f} s late' if delay < np.inf else 'followed no known quantity'
