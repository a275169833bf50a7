"""The chains of the gamepad lab, of the mouse in the IMU lab, and of the IMU exercise.

    pad:     axes -> command; buttons -> has_control -> ctrl_relinq -> command; button -> reset
    mouse:   place, active -> command, none in a turn
    printed: the IMU's heading -> the number that is printed
"""
import re
from itertools import islice, product
from typing import List, Optional

import numpy as np

from tb3_labs.handout import (
    ANGULAR_AXIS, LINEAR_AXIS, MAX_SPEED, MAX_TURN, MOUSE_DEAD_ZONE, MOUSE_FULL, PRINTED_HEADING)
from tb3_labs.watch.broken_link import BrokenLink, NodeRun, belief, example, stays
from tb3_labs.watch.device_laws import (
    ANSWERED, Device, events_of, link_of, stimulus, unanswered, wrong_factor)
from tb3_labs.watch.quantities import Quantity, delay, matching_quantities
from tb3_labs.watch.variables import Series

# -- the gamepad

#: The fields of a command.
FIELDS = ('linear.x', 'angular.z')
#: The stimuli that show a pad's axes.
STICKS = 'left stick up', 'right stick left'


def axes(node_run: NodeRun) -> List[int]:
    """The axes that drive and turn on the pad that the check played, or those of the handout."""
    received, found = node_run.run.pad, []
    for begin, usual in zip([stimulus(node_run, stick) for stick in STICKS],
                            (LINEAR_AXIS, ANGULAR_AXIS)):
        moved = np.abs(received.between(begin - 0.01, begin + 0.2).axes).sum(axis=0)
        found.append(int(np.argmax(moved)) if moved.any() else usual)
    return found


def heard_pad(node_run: NodeRun) -> Device:
    """The messages of the pad that a node received."""
    received = node_run.run.pad
    return Device(received.arrival, np.hstack([received.axes, received.buttons]), [
        *map('axis {}'.format, range(received.AXES)),
        *map('button {}'.format, range(received.BUTTONS))])


def stick_laws(node_run: NodeRun) -> List[Optional[BrokenLink]]:
    """The BrokenLink of each field that follows a stick; weak if the pad is not known."""
    pad = heard_pad(node_run)
    forms = [Quantity(name, pad.time, value, 1.0) for name, value in zip(pad.names, pad.value.T)]
    found = [wrong_factor(node_run, pad, node_run.commands, name, [forms[axis], *forms], factor)
             for name, factor, axis in zip(FIELDS, (MAX_SPEED, MAX_TURN), node_run.cached(axes))]
    return [each and each._replace(is_weak=each.is_weak or stimulus(node_run, STICKS[0]) == np.inf)
            for each in found]


def wrong_button(node_run: NodeRun, name: str, begin: float, end: float) -> Optional[BrokenLink]:
    """Does A hand the robot over, does B take it, and does Y call the reset?"""
    control, sent = node_run.run.control, node_run.commands.arrival
    published = [str(value == 1.0) for at, value in zip(control.arrival, control.value)
                 if begin < at < min(end, begin + 1.0)][-1:]
    came = ((sent > begin + ANSWERED) & (sent < end)).sum()
    resets = sum(begin < at < end for at, _ in events_of(node_run, 'call'))
    is_right = {'A': published == ['True'] and not came and not resets,
                'B': published == ['False'] and not resets, 'Y': resets > 0}
    return None if is_right[name] or begin == np.inf else BrokenLink(
        'after {} ctrl_relinq said {}, {} commands came, and {} resets were called'.format(
            name, *published or ['nothing'], came, resets), begin)


def wrong_control(node_run: NodeRun) -> Optional[BrokenLink]:
    """Do the sticks drive, and the buttons do what they should?"""
    a, b, y = begins = [stimulus(node_run, name) for name in 'ABY']
    found = [unanswered(
        node_run.commands, heard_pad(node_run), lambda row: row[node_run.cached(axes)].any(),
        lambda begin, end: stimulus(node_run, STICKS[0]) == np.inf or a <= begin < b)]
    found += map(wrong_button, [node_run] * 3, 'ABY', begins, (b, y, np.inf))
    broken = min(filter(None, found), key=lambda each: each.moment, default=None)
    for each in node_run.variables.values():
        if broken and set(each.text) == {'True', 'False'} and any(
                each.at(at) != each.at(at + ANSWERED) for at in begins if at <= broken.moment):
            return BrokenLink('{}; {} was {}'.format(
                broken.words, each.name, each.text_at(broken.moment + ANSWERED)), broken.moment,
                    each.name if broken is found[0] else '')
    return broken


PAD_LINKS = link_of(stick_laws, weak=False), wrong_control, link_of(stick_laws, weak=True)

# -- the mouse of the IMU lab

#: `turning` is known within READ [s]. The part of mixed commands at which zero begins or ends.
READ, MIXED = 0.15, 0.3
#: No turn comes before this stimulus.
BESIDE = 'l beside the mouse'


def heard_mouse(node_run: NodeRun) -> Device:
    """The messages of the mouse that a node received."""
    received = node_run.run.mouse
    return Device(received.arrival,
                  np.column_stack([received.x, received.y, 1.0 - received.active]),
                  ('mouse x', 'mouse y', 'mouse inactive'))


def turning(node_run: NodeRun, time: np.ndarray) -> np.ndarray:
    """The part of the time around these times in which the node turned; 0.5 if it is not known."""
    flag = node_run.find('turning')
    if flag is None or not set(flag.text) <= {'True', 'False'}:
        return 0.5 * (time > stimulus(node_run, BESIDE))
    return np.array([np.append(flag.between(at - READ, at + READ).value, flag.at(at)).mean()
                     for at in time])


def mouse_laws(node_run: NodeRun) -> List[Optional[BrokenLink]]:
    """The BrokenLink of each field that follows the mouse."""
    commands, received = node_run.commands, node_run.run.mouse
    commands = commands.take(turning(node_run, commands.arrival) == 0.0)
    x, y = np.abs(received.x) > MOUSE_DEAD_ZONE, np.abs(received.y) > MOUSE_DEAD_ZONE
    forms = {axis: [Quantity(axis + zone + active, received.arrival, place * is_far * is_on, 1.0)
                    for (zone, is_far), (active, is_on) in product(
                        ((' outside of the dead zone', far), ('', 1.0),
                         (' outside of both dead zones', x & y)),
                        (('', received.active), (', also while it is not active', 1.0)))]
             for axis, place, far in (('x', received.x, x), ('y', received.y, y))}
    mouse = heard_mouse(node_run)
    last = mouse.sample(commands.arrival)
    # the marker records y as up for a client whose sign it knows; another one may count down
    is_known = any(event['up'] for _, event in events_of(node_run, 'mouse client'))
    up = 1.0 if is_known else np.sign(
        np.dot(commands.linear, np.append(received.y, 0.0)[last])) or 1.0
    return [wrong_factor(node_run, mouse, commands, field, forms[axis] + forms[other], factor)
            for field, axis, other, factor in (('linear.x', 'y', 'x', up * MOUSE_FULL),
                                               ('angular.z', 'x', 'y', -MOUSE_FULL))]


def mouse_ignored(node_run: NodeRun) -> Optional[BrokenLink]:
    """Does the mouse give commands, and a zero in its middle and when it is deactivated?"""
    return unanswered(
        node_run.commands, heard_mouse(node_run),
        lambda row: not row[2] and np.abs(row[:2]).max() > MOUSE_DEAD_ZONE,
        lambda begin, end: not node_run.runs_from(begin, end) or turning(
            node_run, np.arange(begin - READ, end, READ)).any())


def mouse_in_turn(node_run: NodeRun) -> Optional[BrokenLink]:
    """Does the mouse give no command while the node turns?"""
    commands = node_run.commands
    inner = commands.take((turning(node_run, commands.arrival) == 1.0) & (
        heard_mouse(node_run).sample(commands.arrival) >= 0))
    is_zero = inner.angular == 0.0
    if len(inner) < 3 or np.diff(is_zero).mean() < MIXED:
        return None
    return BrokenLink('{} of {} commands while turning was True were those of the mouse'.format(
        is_zero.sum(), len(inner)), float(inner.arrival[np.argmax(is_zero)]))


MOUSE_LINKS = (link_of(mouse_laws, weak=False), mouse_ignored, mouse_in_turn,
               link_of(mouse_laws, weak=True))

# -- the IMU exercise

HEADING_LINE = re.compile(PRINTED_HEADING.format(r'(-?[\d.]*\d(?:e[-+]?\d+)?)'))


def printed_headings(node_run: NodeRun) -> Series:
    """The headings that the node printed in its first run."""
    rows, end = node_run.run.printed, [*node_run.run.starts[1:], np.inf][0]
    words = list(map(str, rows.words))
    at = np.repeat(rows.arrival, list(map(len, words)))
    lines = [(at[line.end() - 1], line.group(1)) for line in HEADING_LINE.finditer(''.join(words))]
    time, text = np.array([each for each in lines if each[0] < end], object).reshape(-1, 2).T
    return Series('the printed number', time.astype(float), text, text.astype(float))


def wrong_heading(node_run: NodeRun) -> Optional[BrokenLink]:
    """Is the printed number the heading from 0 to 360?"""
    series, quantities = printed_headings(node_run), node_run.imu
    if len(series.time) < 3 or not quantities:
        return None
    right, found = quantities[0], matching_quantities(series, quantities)
    if not found and not stays(series):
        heading = right.value[(np.searchsorted(right.time, series.time) - 1).clip(0)]
        angle = float(np.median((series.value - heading + 180.0) % 360.0 - 180.0))
        moved = right._replace(
            value=(right.value + angle) % 360.0, words='the heading {:+.1f} degrees, which was '
            '{:.1f} at the first line'.format(angle, heading[0]))
        late = (each._replace(words=f'{each.words}, up to {longest:.1f} s late')
                for each in quantities if 0.0 < abs(each.per_degree) <= 1.0
                for longest in [delay(series, each)] if longest < np.inf)
        wrapped = Series(series.name, series.time, series.text, series.value % 360.0)
        found = matching_quantities(wrapped, [moved]) or list(islice(late, 1))
    if not found:
        return belief(series, quantities)[1]
    moment, apart = example(series, right)
    return None if found[0] is right else BrokenLink('{} follows {}; it should be {}: {}'.format(
        series.name, found[0].words, right.words, apart), moment)
