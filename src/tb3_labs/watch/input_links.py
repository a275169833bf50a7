"""The chains of the gamepad lab, of the mouse in the IMU lab, and of the IMU exercise.

    pad:     axes -> command; buttons -> has_control -> ctrl_relinq -> command; button -> reset
    mouse:   place, active -> command, none in a turn
    printed: the IMU's heading -> the number that is printed
"""
import re
from itertools import product
from typing import List, Optional

import numpy as np

from tb3_labs.handout import (
    ANGULAR_AXIS, LINEAR_AXIS, MAX_SPEED, MAX_TURN, MOUSE_DEAD_ZONE, MOUSE_FULL, PRINTED_HEADING)
from tb3_labs.watch.broken_link import (
    BrokenLink, NodeRun, expected, followed_heading, is_constant, wrong_value)
from tb3_labs.watch.device_laws import (
    ANSWER_DELAY, Device, events_of, law_link, stimulus_begin, unanswered, wrong_factor)
from tb3_labs.watch.quantities import (
    Quantity, heading_from_another_zero, longest_delay, matching_quantities)
from tb3_labs.watch.variables import Series

# -- the gamepad

#: The stimuli that show the axes of a pad.
FORWARD_STICK, TURNING_STICK = 'left stick up', 'right stick left'


def driving_axes(node_run: NodeRun) -> List[int]:
    """Returns the axes that drive and turn on the pad that the check played, or those of the
    handout."""
    found = []
    for stimulus, usual in ((FORWARD_STICK, LINEAR_AXIS), (TURNING_STICK, ANGULAR_AXIS)):
        begin = stimulus_begin(node_run, stimulus)
        moved = np.abs(node_run.run.pad.between(begin - 0.01, begin + 0.2).axes).sum(axis=0)
        found.append(int(np.argmax(moved)) if moved.any() else usual)
    return found


def pad_is_known(node_run: NodeRun) -> bool:
    """Has the check played the pad?"""
    return stimulus_begin(node_run, FORWARD_STICK) < np.inf


def pad_of(node_run: NodeRun) -> Device:
    """Returns the messages of the pad that a node received."""
    received = node_run.run.pad
    names = [f'axis {k}' for k in range(received.AXES)]
    names += [f'button {k}' for k in range(received.BUTTONS)]
    return Device(received.arrival, np.hstack([received.axes, received.buttons]), names)


def stick_laws(node_run: NodeRun) -> List[Optional[BrokenLink]]:
    """Returns the BrokenLink of each field that should follow a stick; it is weak if the pad is not
    known."""
    pad, (forward, turning) = pad_of(node_run), node_run.cached(driving_axes)
    forms = [Quantity(name, pad.time, value, 1.0) for name, value in zip(pad.names, pad.value.T)]
    found = [wrong_factor(node_run, pad, node_run.commands, field, [forms[axis], *forms], factor)
             for field, axis, factor in (('linear.x', forward, MAX_SPEED),
                                         ('angular.z', turning, MAX_TURN))]
    return [each and each._replace(is_weak=each.is_weak or not pad_is_known(node_run))
            for each in found]


def wrong_button(node_run: NodeRun, name: str, begin: float, end: float) -> Optional[BrokenLink]:
    """Returns the BrokenLink of a button: A hands the robot over, B takes it, Y calls the reset."""
    control, times = node_run.run.control, node_run.commands.arrival
    is_soon = (control.arrival > begin) & (control.arrival < min(end, begin + 1.0))
    published = 'nothing' if not is_soon.any() else str(control.value[is_soon][-1] == 1.0)
    commands = ((times > begin + ANSWER_DELAY) & (times < end)).sum()
    resets = sum(begin < time < end for time, _ in events_of(node_run, 'call'))
    is_right = {'A': published == 'True' and not commands and not resets,
                'B': published == 'False' and not resets, 'Y': resets > 0}
    return None if is_right[name] or begin == np.inf else BrokenLink(
        f'after {name} ctrl_relinq said {published}, {commands} commands came, and {resets} resets '
        'were called', begin)


def wrong_control(node_run: NodeRun) -> Optional[BrokenLink]:
    """Returns the first BrokenLink of the sticks without commands and of the buttons, with the flag
    of the node that a button changed."""
    begins = a, b, y = [stimulus_begin(node_run, name) for name in 'ABY']
    ignored = unanswered(
        node_run.commands, pad_of(node_run), lambda row: row[node_run.cached(driving_axes)].any(),
        lambda begin, end: not pad_is_known(node_run) or a <= begin < b)
    buttons = [wrong_button(node_run, name, begin, end) for name, begin, end in (
        ('A', a, b), ('B', b, y), ('Y', y, np.inf))]
    broken = min(filter(None, [ignored, *buttons]), key=lambda each: each.moment, default=None)
    if broken is None:
        return None
    before = [begin for begin in begins if begin <= broken.moment]
    for series in node_run.variables.values():
        if set(series.text) == {'True', 'False'} and any(
                series.at(begin) != series.at(begin + ANSWER_DELAY) for begin in before):
            text = series.text_at(broken.moment + ANSWER_DELAY)
            return BrokenLink(f'{broken.words}; {series.name} was {text}', broken.moment,
                              series.name if broken is ignored else '')
    return broken


PAD_LINKS = law_link(stick_laws, weak=False), wrong_control, law_link(stick_laws, weak=True)

# -- the mouse of the IMU lab

#: `turning` is known within KNOWN_WITHIN [s].
KNOWN_WITHIN = 0.15
#: Two callbacks publish if this share of the commands in a turn begin or end a zero.
MIXED_SHARE = 0.3
#: No turn comes before this stimulus.
BESIDE = 'l beside the mouse'


def mouse_of(node_run: NodeRun) -> Device:
    """Returns the messages of the mouse that a node received."""
    received = node_run.run.mouse
    return Device(received.arrival,
                  np.column_stack([received.x, received.y, 1.0 - received.active]),
                  ('mouse x', 'mouse y', 'mouse inactive'))


def turning_share(node_run: NodeRun, times: np.ndarray) -> np.ndarray:
    """Returns the share of the time around these times in which the node turned; 0.5 if it is not
    known."""
    turning = node_run.flag('turning')
    if turning is None:
        return 0.5 * (times > stimulus_begin(node_run, BESIDE))
    return np.array([np.append(turning.between(time - KNOWN_WITHIN, time + KNOWN_WITHIN).value,
                               turning.at(time)).mean() for time in times])


def mouse_laws(node_run: NodeRun) -> List[Optional[BrokenLink]]:
    """Returns the BrokenLink of each field that should follow the mouse."""
    commands, received, mouse = node_run.commands, node_run.run.mouse, mouse_of(node_run)
    commands = commands.take(turning_share(node_run, commands.arrival) == 0.0)
    x_is_far, y_is_far = (np.abs(each) > MOUSE_DEAD_ZONE for each in (received.x, received.y))
    forms = {axis: [Quantity(axis + zone + active, received.arrival, place * is_far * is_on, 1.0)
                    for (zone, is_far), (active, is_on) in product(
                        ((' outside of the dead zone', axis_is_far), ('', 1.0),
                         (' outside of both dead zones', x_is_far & y_is_far)),
                        (('', received.active), (', also while it is not active', 1.0)))]
             for axis, place, axis_is_far in (('x', received.x, x_is_far),
                                              ('y', received.y, y_is_far))}
    up = 1.0
    # the marker records y as up for a client whose sign it knows; the y of another may count down
    if not any(event['up'] for _, event in events_of(node_run, 'mouse client')):
        y = np.append(received.y, 0.0)[mouse.index_at(commands.arrival)]
        up = np.sign(np.dot(commands.linear, y)) or 1.0
    return [wrong_factor(node_run, mouse, commands, field, forms[axis] + forms[other], factor)
            for field, axis, other, factor in (('linear.x', 'y', 'x', up * MOUSE_FULL),
                                               ('angular.z', 'x', 'y', -MOUSE_FULL))]


def mouse_ignored(node_run: NodeRun) -> Optional[BrokenLink]:
    """Returns the BrokenLink of a mouse without commands, or without a zero in its middle or when
    it is deactivated."""
    return unanswered(
        node_run.commands, mouse_of(node_run),
        lambda row: not row[2] and np.abs(row[:2]).max() > MOUSE_DEAD_ZONE,
        lambda begin, end: not node_run.may_run(begin, end) or turning_share(
            node_run, np.arange(begin - KNOWN_WITHIN, end, KNOWN_WITHIN)).any())


def mouse_in_turn(node_run: NodeRun) -> Optional[BrokenLink]:
    """Returns the BrokenLink of the mouse's zeros between the commands of a turn."""
    commands = node_run.commands
    inner = commands.take((turning_share(node_run, commands.arrival) == 1.0) & (
        mouse_of(node_run).index_at(commands.arrival) >= 0))
    is_zero = inner.angular == 0.0
    if len(inner) < 3 or np.diff(is_zero).mean() < MIXED_SHARE:
        return None
    return BrokenLink(f'{is_zero.sum()} of {len(inner)} commands while turning was True were those '
                      'of the mouse', float(inner.arrival[np.argmax(is_zero)]))


MOUSE_LINKS = (law_link(mouse_laws, weak=False), mouse_ignored, mouse_in_turn,
               law_link(mouse_laws, weak=True))

# -- the IMU exercise

HEADING_LINE = re.compile(PRINTED_HEADING.format(r'(-?[\d.]*\d(?:e[-+]?\d+)?)'))


def printed_headings(node_run: NodeRun) -> Series:
    """Returns the headings that the node printed in its first run."""
    printed, end = node_run.run.printed, [*node_run.run.starts[1:], np.inf][0]
    texts = [str(words) for words in printed.words]
    time_of_letter = np.repeat(printed.arrival, [len(text) for text in texts])
    lines = [(time_of_letter[line.end() - 1], line.group(1))
             for line in HEADING_LINE.finditer(''.join(texts))]
    lines = [(time, number) for time, number in lines if time < end]
    numbers = np.array([number for _, number in lines], dtype=object)
    return Series('the printed number', np.array([time for time, _ in lines], dtype=float),
                  numbers, numbers.astype(float))


def wrong_heading(node_run: NodeRun) -> Optional[BrokenLink]:
    """Returns the BrokenLink of a printed number that is not the heading from 0 to 360."""
    series, quantities = printed_headings(node_run), node_run.imu_quantities
    right = quantities[0]
    if len(series.time) < 3 or not len(right.time):
        return None
    followed = next(iter(matching_quantities(series, quantities)), None)
    if followed is None and not is_constant(series):
        followed = heading_from_another_zero(series, right, 1.0) or late_quantity(
            series, quantities)
    if followed is None:
        return followed_heading(series, quantities)[1]
    return None if followed is right else wrong_value(
        series, expected('follows ' + followed.words, right.words), right)


def late_quantity(series: Series, quantities: List[Quantity]) -> Optional[Quantity]:
    """Returns the first heading that a variable follows late."""
    for each in quantities:
        delay = longest_delay(series, each) if 0.0 < abs(each.per_degree) <= 1.0 else np.inf
        if delay < np.inf:
            return each._replace(words=f'{each.words}, up to {delay:.1f} s late')
    return None
