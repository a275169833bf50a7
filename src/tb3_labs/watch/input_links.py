"""The links of the gamepad lab, of the mouse in the IMU lab, and of the IMU exercise.

    pad:     axes -> command; buttons -> has_control -> ctrl_relinq -> command; button -> reset
    mouse:   x, y, active -> command
    printed: the IMU's heading -> the printed number
"""
import re
from itertools import product
from typing import Any, Iterator, List, Optional

import numpy as np

from tb3_labs.handout import (
    ANGULAR_AXIS, LINEAR_AXIS, MAX_ANGULAR_SPEED, MAX_LINEAR_SPEED, MOUSE_DEAD_ZONE, MOUSE_FULL,
    PRINTED_HEADING)
from tb3_labs.watch.broken_link import (
    BrokenLink, NodeRun, expected, followed_heading, is_constant, wrong_value)
from tb3_labs.watch.device_laws import (
    ANSWER_DELAY, Device, events_of, law_link, stimulus_begin, unanswered, wrong_factor)
from tb3_labs.watch.quantities import (
    Quantity, heading_from_another_zero, longest_delay, matching_quantities)
from tb3_labs.watch.variables import Series

# -- the gamepad

#: These stimuli of a trial show which axes of a pad drive and turn.
FORWARD_STICK, TURNING_STICK = 'left stick up', 'right stick left'


def driving_axes(node_run: NodeRun) -> List[int]:
    """Returns the numbers of the axes for driving and for turning. In a trial the stimuli show
    these axes. Without a trial, the handout's axes are returned."""
    found = []
    for stimulus, usual in ((FORWARD_STICK, LINEAR_AXIS), (TURNING_STICK, ANGULAR_AXIS)):
        begin = stimulus_begin(node_run, stimulus)
        moved = np.abs(node_run.run.pad.between(begin - 0.01, begin + 0.2).axes).sum(axis=0)
        found.append(int(np.argmax(moved)) if moved.any() else usual)
    return found


def pad_is_known(node_run: NodeRun) -> bool:
    return stimulus_begin(node_run, FORWARD_STICK) < np.inf


def pad_of(node_run: NodeRun) -> Device:
    """Returns the messages that a node received from the pad."""
    received = node_run.run.pad
    names = [f'axis {k}' for k in range(received.AXES)]
    names += [f'button {k}' for k in range(received.BUTTONS)]
    return Device(received.arrival, np.hstack([received.axes, received.buttons]), names)


def stick_laws(node_run: NodeRun) -> List[BrokenLink]:
    """Returns a BrokenLink for each field that does not follow its stick. All are weak if the pad
    is not known."""
    pad, (forward, turning) = pad_of(node_run), node_run.cached(driving_axes)
    forms = [Quantity(name, pad.time, value, 1.0) for name, value in zip(pad.names, pad.value.T)]
    fields = (('linear.x', forward, MAX_LINEAR_SPEED), ('angular.z', turning, MAX_ANGULAR_SPEED))
    found: List[BrokenLink] = []
    for field, axis, factor in fields:
        found += wrong_factor(
            node_run, pad, node_run.commands, field, [forms[axis], *forms], factor)
    is_known = pad_is_known(node_run)
    return [each._replace(is_weak=each.is_weak or not is_known) for each in found]


def wrong_button(node_run: NodeRun, name: str, begin: float, end: float) -> Iterator[BrokenLink]:
    """Yields the button `name`, pressed at `begin`, if its task was still not done at `end`.
    A hands the robot over, B takes it back, Y calls the reset."""
    control, times = node_run.run.control, node_run.commands.arrival
    is_soon = (control.arrival > begin) & (control.arrival < min(end, begin + 1.0))
    published = 'nothing' if not is_soon.any() else str(control.value[is_soon][-1] == 1.0)
    commands = ((times > begin + ANSWER_DELAY) & (times < end)).sum()
    resets = sum(begin < time < end for time, _ in events_of(node_run, 'call'))
    is_correct = {'A': published == 'True' and not commands and not resets,
                  'B': published == 'False' and not resets, 'Y': resets > 0}
    if begin < np.inf and not is_correct[name]:
        yield BrokenLink(f'after {name} ctrl_relinq said {published}, {commands} commands came, '
                         f'and {resets} resets were called', begin)


def wrong_control(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Yields the first ignored stick or wrong button. Before that, yields this mistake with the
    value of each boolean variable that a button changed."""
    begins = a, b, y = [stimulus_begin(node_run, name) for name in 'ABY']
    ignored = list(unanswered(
        node_run.commands, pad_of(node_run), lambda row: row[node_run.cached(driving_axes)].any(),
        lambda begin, end: not pad_is_known(node_run) or a <= begin < b))
    found = [*ignored, *wrong_button(node_run, 'A', a, b), *wrong_button(node_run, 'B', b, y),
             *wrong_button(node_run, 'Y', y, np.inf)]
    if not found:
        return
    broken = min(found, key=lambda each: each.moment)
    before = [begin for begin in begins if begin <= broken.moment]
    for series in node_run.variables.values():
        if set(series.text) == {'True', 'False'} and any(
                series.at(begin) != series.at(begin + ANSWER_DELAY) for begin in before):
            text = series.text_at(broken.moment + ANSWER_DELAY)
            yield BrokenLink(f'{broken.message}; {series.name} was {text}', broken.moment,
                             series.name if broken in ignored else '')
    yield broken


PAD_LINKS = law_link(stick_laws, weak=False), wrong_control, law_link(stick_laws, weak=True)

# -- the mouse of the IMU lab

#: The recording may show a change of `turning` too early or too late by this time [s].
TURNING_UNCERTAINTY = 0.15
#: After the start of this stimulus, the node may turn while the mouse is active.
TURN_BESIDE_MOUSE = 'l beside the mouse'


def mouse_of(node_run: NodeRun) -> Device:
    """Returns the messages that a node received from the mouse."""
    received = node_run.run.mouse
    return Device(received.arrival,
                  np.column_stack([received.x, received.y, 1.0 - received.active]),
                  ('mouse x', 'mouse y', 'mouse inactive'))


def turning_share(node_run: NodeRun, times: np.ndarray) -> np.ndarray:
    """Returns, for each time, the share of the nearby readings in which `turning` was True. If the
    node may turn but lacks this variable, the share is 0.5."""
    turning = node_run.boolean_variable('turning')
    if turning is None:
        return 0.5 * (times > stimulus_begin(node_run, TURN_BESIDE_MOUSE))
    shares = []
    for time in times:
        near = turning.between(time - TURNING_UNCERTAINTY, time + TURNING_UNCERTAINTY).value
        shares.append(np.append(near, turning.at(time)).mean())
    return np.array(shares)


def mouse_forms(received: Any, axis: str) -> List[Quantity]:
    """Returns the quantities that a node may use for the `axis` x or y of the mouse. The first is
    correct."""
    is_far = {each: np.abs(getattr(received, each)) > MOUSE_DEAD_ZONE for each in 'xy'}
    zones = ((' outside of the dead zone', is_far[axis]), ('', 1.0),
             (' outside of both dead zones', is_far['x'] & is_far['y']))
    times = (('', received.active), (', also while it is not active', 1.0))
    return [Quantity(axis + zone + time, received.arrival,
                     getattr(received, axis) * is_counted * is_on, 1.0)
            for (zone, is_counted), (time, is_on) in product(zones, times)]


def mouse_laws(node_run: NodeRun) -> List[BrokenLink]:
    """Returns a BrokenLink for each field that does not follow the mouse."""
    commands, received, mouse = node_run.commands, node_run.run.mouse, mouse_of(node_run)
    commands = commands.take(turning_share(node_run, commands.arrival) == 0.0)
    x_forms, y_forms = mouse_forms(received, 'x'), mouse_forms(received, 'y')
    up = 1.0
    # the recorded y points up if the marker knew the mouse client; the y of another client may
    # point down
    if not any(event['up'] for _, event in events_of(node_run, 'mouse client')):
        y = np.append(received.y, 0.0)[mouse.index_at(commands.arrival)]
        up = np.sign(np.dot(commands.linear, y)) or 1.0
    return [
        *wrong_factor(node_run, mouse, commands, 'linear.x', y_forms + x_forms, up * MOUSE_FULL),
        *wrong_factor(node_run, mouse, commands, 'angular.z', x_forms + y_forms, -MOUSE_FULL)]


def mouse_ignored(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Yields a mouse that the node ignores: no command came while the mouse was active and off the
    middle, or no zero command came after the mouse became inactive or reached the middle."""
    return unanswered(
        node_run.commands, mouse_of(node_run),
        lambda row: not row[2] and np.abs(row[:2]).max() > MOUSE_DEAD_ZONE,
        lambda begin, end: not node_run.may_run(begin, end) or turning_share(
            node_run, np.arange(begin - TURNING_UNCERTAINTY, end, TURNING_UNCERTAINTY)).any())


MOUSE_LINKS = law_link(mouse_laws, weak=False), mouse_ignored, law_link(mouse_laws, weak=True)

# -- the IMU exercise

HEADING_LINE = re.compile(PRINTED_HEADING.format(r'(-?[\d.]*\d(?:e[-+]?\d+)?)'))


def printed_headings(node_run: NodeRun) -> Series:
    """Returns the headings that the node printed in its first run."""
    printed, end = node_run.run.printed, [*node_run.run.starts[1:], np.inf][0]
    texts = [str(text) for text in printed.text]
    time_of_letter = np.repeat(printed.arrival, [len(text) for text in texts])
    lines = [(time_of_letter[line.end() - 1], line.group(1))
             for line in HEADING_LINE.finditer(''.join(texts))]
    lines = [(time, number) for time, number in lines if time < end]
    numbers = np.array([number for _, number in lines], dtype=object)
    return Series('the printed number', np.array([time for time, _ in lines], dtype=float),
                  numbers, numbers.astype(float))


def wrong_heading(node_run: NodeRun) -> Iterator[BrokenLink]:
    """Yields a printed number that is not the heading from 0 to 360."""
    series, quantities = printed_headings(node_run), node_run.imu_quantities
    correct = quantities[0]
    if len(series.time) < 3 or not len(correct.time):
        return
    found = matching_quantities(series, quantities)
    followed = found[0] if found else None
    if followed is None and not is_constant(series):
        followed = heading_from_another_zero(series, correct, 1.0) or late_quantity(
            series, quantities)
    broken = followed_heading(series, quantities)[1] if followed is None else wrong_value(
        series, expected('follows ' + followed.name, correct.name), correct)
    if followed is not correct and broken is not None:
        yield broken


def late_quantity(series: Series, quantities: List[Quantity]) -> Optional[Quantity]:
    """Returns the first heading that a variable follows late, or None."""
    for each in quantities:
        delay = longest_delay(series, each) if 0.0 < abs(each.per_degree) <= 1.0 else np.inf
        if delay < np.inf:
            return each._replace(name=f'{each.name}, up to {delay:.1f} s late')
    return None
