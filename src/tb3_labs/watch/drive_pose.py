"""Checks the variables local_x, local_y and local_yaw of the Transformation lab. If a variable is
wrong, this module finds the quantity that the variable follows instead.

In this file a place (x, y) is the complex number x + iy, and angles are points on the unit circle.
"""
from dataclasses import replace
from itertools import product
from typing import Any, Iterator, List

import numpy as np

from tb3_labs.geometry.angles import wrap
from tb3_labs.watch.drive_states import (
    MAX_PROBE_DELAY, MIN_CORRECT_SHARE, POSE_TOLERANCE, PROBE_DELAY, REFERENCES_OF, NodeFrame,
    index_from, local_frames, radians_per_unit, readings_with_control)
from tb3_labs.watch.headings import angles_of
from tb3_labs.watch.mistake import Mistake, NodeRun, worst_index
from tb3_labs.watch.variables import (
    TOLERANCE_SHARE, Quantity, Series, longest_delay, matching_quantities, shortened_value)

MIN_JUDGED_VALUES = 10
#: With this scale, two places or two angles are equal if they differ by at most POSE_TOLERANCE.
SCALE = POSE_TOLERANCE / TOLERANCE_SHARE


def place_quantities(samples: Any, frame: NodeFrame) -> Iterator[Quantity]:
    """Yields the quantities that a node may use as its local place in `frame`. The first two are
    correct, because a node may add the pose that the reset declares, or leave it out."""
    start = frame.declared_position
    place = samples.x + 1j * samples.y
    path = place - frame.position
    yaw = frame.odometry_yaw - frame.declared_yaw
    prefix = 'the displacement since the reset, '
    for name, vector, angle, offset in (
            (prefix + 'rotated by minus the yaw at the reset', path, yaw, start),
            (prefix + 'rotated by minus the yaw at the reset, without the declared pose', path,
             frame.odometry_yaw, 0j),
            (prefix + 'not rotated', path, 0.0, start),
            (prefix + 'rotated by plus the yaw at the reset', path, -yaw, start),
            (prefix + 'rotated by minus the yaw of the IMU', path,
             frame.imu_yaw - frame.declared_yaw, start),
            (prefix + 'rotated by minus the present yaw', path, samples.yaw, start),
            ('the place in the odometry, not displaced, rotated by minus the yaw at the reset',
             place, yaw, start),
            ('the place in the odometry', place, 0.0, 0j)):
        yield Quantity(name, samples.arrival, vector * np.exp(-1j * angle) + offset, SCALE)


def yaw_readings(imu: Any, odometry: Any) -> List[Quantity]:
    """Returns the quantities that a node may use as the IMU's yaw. The first one is correct."""
    readings = [('the yaw of the IMU', imu, imu.yaw),
                ('the yaw of the odometry', odometry, odometry.yaw),
                ('the yaw, mirrored', imu, -imu.yaw),
                ('the z of the quaternion', imu, imu.z)]
    readings += [(f'the {name}', imu, angle) for name, angle in angles_of(imu).items()
                 if name != 'yaw']
    return [Quantity(name, samples.arrival, value, SCALE) for name, samples, value in readings]


def local_yaw_quantities(imu: Any, odometry: Any, frame: NodeFrame) -> Iterator[Quantity]:
    """Yields the quantities that a node may use as its local yaw. The first two are correct."""
    yaw, *wrong_yaws = yaw_readings(imu, odometry)
    degrees = yaw._replace(name='the yaw in degrees', value=np.degrees(yaw.value))
    rows = [(yaw, ' since the reset', frame.declared_yaw - frame.imu_yaw),
            (yaw, ' since the reset, without the declared pose', -frame.imu_yaw),
            (yaw, ', not from the reset on', 0.0)]
    for angle in (degrees, *wrong_yaws):
        angle_at_reset = angle.value[index_from(angle.time, frame.begin)]
        rows.append((angle, ' since the reset', frame.declared_yaw - angle_at_reset))
    rows.append((degrees, ', minus the radians at the reset', -frame.imu_yaw))
    for angle, clause, offset in rows:
        yield angle._replace(name=angle.name + clause, value=angle.value + offset)


def pose_quantities(node_run: NodeRun, frame: NodeFrame, name: str) -> List[Quantity]:
    """Returns the quantities that the variable `name` may follow in a frame, in comparable form.
    The first two quantities are correct. Returns [] if a sensor sent no samples in the frame."""
    begin = frame.begin - MAX_PROBE_DELAY
    imu = node_run.recording.imu.arrived_between(begin, frame.end)
    odometry = node_run.recording.odometry.arrived_between(begin, frame.end)
    if not len(imu) or not len(odometry):
        return []
    if name == 'local_yaw':
        quantities = local_yaw_quantities(imu, odometry, frame)
    else:
        quantities = place_quantities(odometry, frame)
    return [quantity._replace(value=comparable_values(name, quantity.value))
            for quantity in quantities]


def comparable_values(name: str, value: np.ndarray) -> np.ndarray:
    """Returns values of the variable `name` in comparable form. A yaw becomes a point on the unit
    circle, and a complex place becomes its x or its y."""
    if 'yaw' in name:
        return np.cos(value) + 1j * np.sin(value)       # faster than exp
    if not np.iscomplexobj(value):
        return value
    return value.imag if name == 'local_y' else value.real


def find_wrong_pose(node_run: NodeRun) -> Iterator[Mistake]:
    """Yields a Mistake for each wrong variable, after the Mistakes of the variable's references."""
    for frame, name in product(local_frames(node_run), REFERENCES_OF):
        for wrong in find_wrong_variable(node_run, frame, name):
            for reference in REFERENCES_OF[name]:
                yield from find_wrong_reference(node_run, frame, reference)
            yield wrong


def find_wrong_reference(node_run: NodeRun, frame: NodeFrame, name: str) -> Iterator[Mistake]:
    """Yields a Mistake if the reference `name` is wrong because the node did not set it at the
    reset, or set it to another yaw."""
    series = node_run.variable(name)
    if series is None:
        return
    sensor, correct = {
        'initial_global_yaw': ('the yaw of the IMU', frame.imu_yaw),
        'initial_odom_yaw': ('the yaw of the odometry', frame.odometry_yaw),
        'initial_global_x': ('the place of the odometry', frame.position.real),
        'initial_global_y': ('the place of the odometry', frame.position.imag)}[name]
    readings = series.between(frame.begin + MAX_PROBE_DELAY, frame.end)
    if len(set(readings.text)) != 1:
        return
    value = readings.value[0]
    value_text = shortened_value(readings.text[0])
    error = wrap(value - correct) if 'yaw' in name else value - correct
    if abs(error) <= POSE_TOLERANCE:
        return

    behaviour = ''
    if frame.is_reset and series.text_at(frame.begin - PROBE_DELAY) == readings.text[0]:
        behaviour = 'stayed ' + value_text
    elif 'yaw' in name:
        behaviour = followed_yaw_text(node_run, value, frame.begin)
    if behaviour:
        yield Mistake(
            f'{frame.clause}{series.name} {behaviour}; it should be {sensor} at the reset: '
            f'it was {value_text} when this was {correct:.3g}', readings.time[0], series.name)


def followed_yaw_text(node_run: NodeRun, value: float, reset_at: float) -> str:
    """Returns a clause with the yaw that had this `value` at the reset, or '' if no yaw had it."""
    for yaw in yaw_readings(node_run.recording.imu, node_run.recording.odometry):
        if abs(wrap(value - yaw.at(reset_at))) <= POSE_TOLERANCE:
            return f'followed {yaw.name} at the reset'
    return ''


def find_wrong_variable(node_run: NodeRun, frame: NodeFrame, name: str) -> Iterator[Mistake]:
    """Yields a Mistake if the variable `name` does not follow a correct quantity in a frame."""
    series = node_run.variable(name)
    quantities = pose_quantities(node_run, frame, name)
    if series is None or not quantities:
        return
    correct_quantities, other_quantities = quantities[:2], quantities[2:]
    correct = correct_quantities[0]
    # before the first message in the new frame, the node cannot compute its new pose
    message_times = correct.time[correct.time >= frame.begin]
    if not len(message_times):
        return
    readings = series.between(message_times[0] + MAX_PROBE_DELAY, frame.end)
    values = comparable_values(name, readings.value * radians_per_unit(series))
    readings = readings_with_control(node_run, replace(readings, value=values), MAX_PROBE_DELAY)
    if np.isfinite(readings.value).sum() < MIN_JUDGED_VALUES:
        return
    if matching_quantities(readings, correct_quantities, MIN_CORRECT_SHARE):
        return
    expected = correct.at(readings.time)
    worst = worst_index(readings, expected)
    correct_value = np.angle(expected[worst]) if 'yaw' in name else expected[worst]
    behaviour = behaviour_text(readings, correct, other_quantities)
    value_text = shortened_value(readings.text[worst])
    yield Mistake(
        f'{frame.clause}{series.name} {behaviour}; it should be {correct.name}: it was '
        f'{value_text} when this was {correct_value:.3g}', readings.time[worst], series.name)


def behaviour_text(readings: Series, correct: Quantity, others: List[Quantity]) -> str:
    """Returns a clause on what a variable does that does not follow the quantity `correct`. If the
    variable follows one of the `others`, the clause names the other quantity."""
    if len(set(readings.text)) == 1:
        return 'stayed ' + shortened_value(readings.text[0])
    largest_change = np.nan_to_num(np.abs(readings.value - readings.value[0])).max()
    matching = matching_quantities(readings, others, MIN_CORRECT_SHARE)
    if matching and largest_change > 2.0 * POSE_TOLERANCE:
        return 'followed ' + matching[0].name
    delay = longest_delay(readings, correct._replace(scale=1.0))
    return f'came up to {delay:.1f} s late' if delay < np.inf else 'followed no known quantity'
