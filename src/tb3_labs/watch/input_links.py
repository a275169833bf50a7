"""The chains of the gamepad lab, of the mouse in the IMU lab, and of the IMU exercise.

    pad:     axes -> command; buttons -> has_control -> ctrl_relinq -> command; button -> reset
    mouse:   place, active -> command, none in a turn
    printed: the IMU's heading -> the number that is printed
"""
import re
from typing import List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.watch.chain import Broken, Inside, example, stays
from tb3_labs.watch.inputs import (
    ANSWERED, Device, events, flag, law, link_of, no_zero, sent, silent, stimulus)
from tb3_labs.watch.quantities import Quantity, delay, followed
from tb3_labs.watch.variables import Series, number

# -- the gamepad

#: The fields of a command, and the handout's speeds of a full stick [m/s], [rad/s].
FIELDS, FACTORS = ('linear.x', 'angular.z'), (0.22, 2.84)
#: The stimuli that show the pad's numbers: of the axes that drive and turn, of A, B and Y; the
#: handout's numbers.
PLAYED, HANDOUT = ('left stick up', 'right stick left', 'A', 'B', 'Y'), (1, 3, 0, 1, 2)
SERVICE = 'set_pose'
XYZ = r'{}:\s+x: ([-+.\w]+)\s+y: ([-+.\w]+)\s+z: ([-+.\w]+)'
ORIENTATION = re.compile(XYZ.format('orientation') + r'\s+w: ([-+.\w]+)')
PLACES = re.compile(XYZ.format('position')), re.compile(
    r'^\s*(?:x|y|theta|yaw): ([-+.\w]+)$', re.MULTILINE)


class Pad(NamedTuple):
    """The numbers of the axes that drive and turn, and of the buttons A, B and Y. `is_known`: the
    check played this pad."""

    numbers: Tuple[int, ...]
    is_known: bool

    def button(self, name: str) -> int:
        return self.numbers[2 + 'ABY'.index(name)]

    def words(self, name: str) -> str:
        return 'button {} ({})'.format(self.button(name), name)


def pad(inside: Inside) -> Pad:
    """The pad that the check played; that of the handout if it played none."""
    found, heard = [], inside.run.pad
    for name, moved, usual in zip(PLAYED, 2 * [heard.axes] + 3 * [heard.buttons], HANDOUT):
        begin = stimulus(inside, name)
        part = moved[(heard.arrival > begin - 0.01) & (heard.arrival < begin + 0.2)]
        found.append(int(np.argmax(np.abs(part).sum(axis=0))) if part.any() else usual)
    return Pad(tuple(found), stimulus(inside, PLAYED[0]) < np.inf)


def played(inside: Inside) -> Device:
    """What a node heard of the pad."""
    heard = inside.run.pad

    def place(row: np.ndarray) -> str:
        axes = heard.axes.shape[1]
        return ' and '.join(
            'axis {} at {:g}'.format(k, row[k]) if k < axes else 'button {} down'.format(k - axes)
            for k in np.flatnonzero(row)) or 'all axes at 0'
    return Device(heard.arrival, np.hstack([heard.axes, heard.buttons]), place)


def presses(inside: Inside, names: str = 'AB') -> List[Tuple[float, float, str]]:
    """(begin, next one of them, name) of the presses of these buttons."""
    heard, found = inside.run.pad, []
    for name in names:
        column = heard.buttons[:, inside.known(pad).button(name)]
        found += [(float(at), name) for at in heard.arrival[1:][np.diff(column) > 0.0]]
    found.sort()
    ends = [at for at, _ in found[1:]] + [inside.run.duration]
    return [(at, end, name) for (at, name), end in zip(found, ends)]


def stick_laws(inside: Inside) -> List[Optional[Broken]]:
    """The Broken of each field that follows a stick."""
    device, own, heard = played(inside), inside.known(pad), inside.run.pad
    forms = [Quantity('{} {}'.format(words, k), device.time, value, 1.0)
             for words, columns in (('axis', heard.axes), ('button', heard.buttons))
             for k, value in enumerate(columns.T)]
    found = []
    for name, factor, axis in zip(FIELDS, FACTORS, own.numbers):
        others = [each for k, each in enumerate(forms) if k != axis and each.value.any()]
        found.append(law(inside, device, sent(inside), name, [forms[axis]] + others, factor))
    return [each and each._replace(is_weak=each.is_weak or not own.is_known) for each in found]


def is_handed_over(inside: Inside, time: float) -> bool:
    """Is A the last one of A and B that was pressed?"""
    return [name for at, _, name in presses(inside) if at <= time][-1:] == ['A']


def is_moved(inside: Inside, row: np.ndarray) -> bool:
    """Is a stick out of its middle?"""
    own = inside.known(pad)
    return own.is_known and bool(row[list(own.numbers[:2])].any())


def sticks_let_go(inside: Inside) -> Optional[Broken]:
    """Does a zero follow when the sticks are let go?"""
    return next(filter(None, (
        no_zero(sent(inside), begin, 'when the sticks were let go')
        for begin, _, row in played(inside).held()
        if not row.any() and not is_handed_over(inside, begin))), None)


def sticks_ignored(inside: Inside) -> Optional[Broken]:
    """Do commands come while a stick is held, but for a robot that is handed over?"""
    found = silent(sent(inside), played(inside), lambda row: is_moved(inside, row),
                   lambda begin, end: is_handed_over(inside, begin))
    if found is None:
        return None
    pressed = [(at, name) for at, _, name in presses(inside, 'ABY') if at < found.moment]
    if pressed:
        found = found._replace(words='{}; the last button was {}'.format(
            found.words, inside.known(pad).words(pressed[-1][1])))
    if [name for _, name in pressed[-2:]] == ['A', 'B']:
        for each in inside.variables.values():
            before, after, now = (each.text_at(at) for at in (
                pressed[-2][0], pressed[-2][0] + ANSWERED, pressed[-1][0] + ANSWERED))
            if before != after == now and {before, after} == {'True', 'False'}:
                return found._replace(words='{}, and {} stayed {}'.format(
                    found.words, each.name, now), variable=each.name)
    return found


def wrong_control(inside: Inside) -> Optional[Broken]:
    """Is the robot handed over by A, and taken back by B, with commands only in between?"""
    said, commands, own = inside.run.control, sent(inside), flag(inside, 'has_control')
    ignored = sticks_ignored(inside)
    for begin, end, name in presses(inside) if inside.known(pad).is_known else ():
        if ignored is not None and ignored.moment < begin:
            break
        words, button = '', inside.known(pad).words(name)
        chosen = (said.arrival > begin - 0.02) & (said.arrival < min(end, begin + 1.0))
        extra = (commands.arrival > begin + ANSWERED) & (commands.arrival < end)
        if not chosen.any():
            words = 'nothing came on ctrl_relinq after ' + button
        elif said.value[chosen][-1] != (name == 'A'):
            words = 'ctrl_relinq said {} after {}'.format(name == 'B', button)
        elif name == 'A' and extra.any():
            words = '{} commands came while the robot was handed over, after {}{}'.format(
                extra.sum(), button, ', with {} False'.format(own.name)
                if own is not None and own.at(begin + ANSWERED) == 0.0 else '')
        if words and own is not None and own.at(begin + ANSWERED) == (name == 'A'):
            return Broken('{} stayed {} after {}: {}'.format(
                own.name, name == 'A', button, words), begin, own.name)
        if words:
            return Broken(words, begin)
    return ignored


def wrong_reset(inside: Inside) -> Optional[Broken]:
    """Does Y call the reset with (0, 0, 0) and a rotation?"""
    calls, begin = events(inside, 'call'), stimulus(inside, PLAYED[-1])
    if begin == np.inf:
        return None
    button = inside.known(pad).words(PLAYED[-1])
    end = min((at for at in inside.run.states.arrival if at > begin), default=np.inf)
    mine = [call for at, call in calls if begin <= at < end]
    if mine:
        service, request = (str(mine[0].get(part, '')) for part in ('service', 'request'))
        return wrong_request(request, begin) if service.strip('/') == SERVICE else Broken(
            'after {} it called {}, the handout has {}'.format(button, service, SERVICE), begin)
    other = [inside.known(pad).words(name) for pressed, _, name in presses(inside)
             if any(pressed <= at < pressed + 1.0 for at, _ in calls)]
    return Broken('no reset was called after {}{}'.format(
        button, '; one was called after ' + other[0] if other else ''), begin)


def wrong_request(request: str, begin: float) -> Optional[Broken]:
    """Is a request, as a text, (0, 0, 0) with a rotation and a covariance?"""
    patterns = [pattern.findall(request) for pattern in PLACES]
    numbers = [number(each) for row in patterns[0] or [patterns[1]] for each in row]
    if any(numbers):
        return Broken('the request of the reset had the position {}; it should be 0, 0, 0'.format(
            ', '.join(map('{:g}'.format, numbers))), begin)
    for x, y, z, w in [map(number, row) for row in ORIENTATION.findall(request)]:
        length = float(np.sqrt(x * x + y * y + z * z + w * w))
        if abs(length - 1.0) > 0.01 or abs(abs(w) - 1.0) > 1e-3:
            return Broken('the quaternion in the request of the reset was x {:g}, y {:g}, z {:g}, '
                          'w {:g}{}; it should be 0, 0, 0, 1'.format(
                              x, y, z, w, '' if abs(length - 1.0) < 0.01 else
                              ', of length {:.2g}'.format(length)), begin)
    covariance = re.search(r'covariance: \[(.*?)\]', request)
    if covariance and not any(number(each) for each in covariance.group(1).split(',')):
        return Broken('the covariance in the request of the reset is all zeros', begin,
                      is_weak=True)
    return None


PAD_LINKS = (link_of(stick_laws, weak=False), sticks_let_go, wrong_control, wrong_reset,
             link_of(stick_laws, weak=True))

# -- the mouse of the IMU lab

#: A command is amid those of a turn if they come within AMID [s] before and after it.
AMID = 0.3
#: The handout's factor [m/s], [rad/s], and its dead zone. No turn comes before the stimulus BESIDE.
HALF, DEAD, BESIDE = 0.5, 0.25, 'l beside the mouse'


def mouse(inside: Inside) -> Device:
    """What a node heard of the mouse."""
    heard = inside.run.mouse
    return Device(heard.arrival, np.column_stack([heard.x, heard.y, heard.active]),
                  lambda row: 'the mouse at ({:g}, {:g}){}'.format(
                      row[0], row[1], '' if row[2] else ', not active'))


def asks(row: np.ndarray) -> bool:
    """Does a place of the mouse ask for a movement?"""
    return bool(row[2] and np.abs(row[:2]).max() > DEAD)


def is_turning(inside: Inside, time: np.ndarray) -> np.ndarray:
    """Did the node turn at these times?"""
    turning = flag(inside, 'turning')
    if turning is None:
        return time > stimulus(inside, BESIDE)
    return np.array([max(turning.between(at - 0.12, at + 0.12).value, default=turning.at(at)) == 1.0
                     for at in time], dtype=bool)


def mouse_laws(inside: Inside) -> List[Optional[Broken]]:
    """The Broken of each field that follows the mouse."""
    device, commands, heard = mouse(inside), sent(inside), inside.run.mouse
    commands = commands.take(~is_turning(inside, commands.arrival))
    far = {axis: np.abs(getattr(heard, axis)) > DEAD for axis in 'xy'}
    up = [event['up'] for _, event in events(inside, 'mouse client') if event.get('up')]
    found: List[Optional[Broken]] = []
    for name, factor, (own, other) in zip(
            FIELDS, (HALF, -HALF), (('y', 'x'), ('x', 'y'))):
        forms = [Quantity(axis + zone + active, device.time,
                          getattr(heard, axis) * is_far * is_on, 1.0)
                 for axis in (own, other) for zone, is_far in (
                     (' outside of the dead zone', far[axis]), ('', 1.0),
                     (' outside of both dead zones', far['x'] & far['y']))
                 for active, is_on in (('', heard.active), (', also while it is not active', 1.0))]
        found.append(law(inside, device, commands, name, forms, factor))
        if not up and own == 'y' and not law(inside, device, commands, name, forms, -factor):
            found[0] = None     # its y counts down
    return found


def mouse_ignored(inside: Inside) -> Optional[Broken]:
    """Does the mouse give commands, and a zero in its middle and when it is deactivated?"""
    device, commands = mouse(inside), sent(inside)
    return silent(commands, device, asks, lambda begin, end: is_turning(
        inside, np.linspace(begin, end, 5)).any()) or next(filter(None, (
            no_zero(commands, begin, 'with ' + device.place(row))
            for begin, _, row in device.held() if not asks(row)
            and not is_turning(inside, np.array([begin - 0.2, begin + 0.3])).any())), None)


def mouse_in_turn(inside: Inside) -> Optional[Broken]:
    """Does the mouse give no command while the node turns?"""
    turning, commands, device = flag(inside, 'turning'), sent(inside), mouse(inside)
    if turning is None or not len(device.time):
        return None
    inner = np.array([turning.between(at - 0.15, at + 0.15).value.min(initial=turning.at(at))
                      for at in commands.arrival]) == 1.0
    last, turns = device.sample(commands.arrival), commands.arrival[commands.angular != 0.0]
    before, after = (np.searchsorted(turns, commands.arrival + span) for span in (-AMID, AMID))
    own = np.searchsorted(turns, commands.arrival)
    mixed = np.flatnonzero(inner & (last >= 0) & (commands.angular == 0.0) & (before < own)
                           & (own < after))
    if len(mixed) < 3:
        return None
    k = int(mixed[0])
    return Broken('{} of {} commands while {} was True were those of the mouse, such as {:.2f} m/s '
                  'and {:.2f} rad/s with {}'.format(
                      len(mixed), inner.sum(), turning.name, commands.linear[k],
                      commands.angular[k], device.place(device.value[last[k]])),
                  float(commands.arrival[k]))


MOUSE_LINKS = (link_of(mouse_laws, weak=False), mouse_ignored, mouse_in_turn,
               link_of(mouse_laws, weak=True))

# -- the IMU exercise

QUATERNION = 'quaternion'
HEADING_LINE = re.compile(r'Current heading is (-?\d+(?:\.\d+)?(?:e[-+]?\d+)?) degrees')


def printed(inside: Inside) -> Series:
    """The headings that the node printed in its first run."""
    rows, end = inside.run.printed, ([*inside.run.starts[1:], np.inf])[0]
    words = [str(each) for each in rows.words]
    ends = np.cumsum([len(each) for each in words])
    lines = list(HEADING_LINE.finditer(''.join(words)))
    time = rows.arrival[np.searchsorted(ends, [each.end() for each in lines])] if lines else (
        np.empty(0))
    text = np.array([each.group(1) for each in lines], dtype=object)
    series = Series('the printed number', time, text, text.astype(float))
    return series.take(time < end)


def wrong_heading(inside: Inside) -> Optional[Broken]:
    """Is the printed number the heading from 0 to 360?"""
    series = printed(inside)
    quantities = inside.imu if len(series.time) > 2 else []
    if not quantities or followed(series, quantities[:1]):
        return None
    right, moment = quantities[0], float(series.time[0])
    found = [each.words for each in followed(series, quantities)]
    # an order of the quaternion is told only if nothing simpler is equal to it
    found = found[:1] + [each for each in found[1:] if QUATERNION not in each
                         and each.split(',')[0] != found[0].split(',')[0]][:1]
    if not found and not stays(series):
        delays = ((delay(series, each), each.words) for each in quantities
                  if 0.0 < abs(each.per_degree) <= 1.0)
        found = shifted(series, right) or ['{}, up to {:.1f} s late'.format(words, late)
                                           for late, words in delays if late < np.inf][:1]
    if not found and stays(series):
        return Broken('{} stays at {}; it should be {}'.format(
            series.name, series.text[-1], right.words), moment)
    moment, numbers = example(series, right)
    return Broken('{} {} {}; it should be {}: {}'.format(
        series.name, *('follows', ', or '.join(found), right.words) if found else (
            'does not follow', 'the heading', right.words), numbers), moment)


def shifted(series: Series, right: Quantity) -> List[str]:
    """Words on a heading to which an angle is added; [] if it is none."""
    sample = (np.searchsorted(right.time, series.time) - 1).clip(0)
    apart = (series.value - right.value[sample] + 180.0) % 360.0 - 180.0
    angle = float(np.median(apart))
    if not followed(Series(series.name, series.time, series.text, series.value % 360.0),
                    [right._replace(value=(right.value + angle) % 360.0)]):
        return []
    is_first = abs((angle + right.value[sample[0]] + 180.0) % 360.0 - 180.0) < 1.0
    return ['the yaw {} {:.1f} degrees{}'.format(
        'plus' if angle > 0.0 else 'minus', abs(angle),
        ', the yaw at its first line' if is_first else '')]


PRINTED_LINKS = (wrong_heading,)
