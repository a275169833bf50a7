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
    ANSWERED, Device, events, field, first, law, no_zero, part_of, sent, silent, stimulus)
from tb3_labs.watch.quantities import PART, SAME, Quantity, delay, followed
from tb3_labs.watch.variables import Series

# -- the gamepad

#: The fields of a command: name, words, factor [m/s], [rad/s].
STICKS = (('linear', 'linear.x', 0.22), ('angular', 'angular.z', 2.84))
#: A reset is called within CALLED after its button [s].
CALLED, SERVICE, WITHOUT_SERVICE = 2.5, 'set_pose', 'Y without a service'
XYZ = r'{}:\s+x: (\S+)\s+y: (\S+)\s+z: (\S+)'
ORIENTATION = re.compile(XYZ.format('orientation') + r'\s+w: (\S+)')
PLACES = re.compile(XYZ.format('position')), re.compile(
    r'^\s*(?:x|y|theta|yaw): (\S+)$', re.MULTILINE)


class Pad(NamedTuple):
    """The numbers of the axes and buttons. `is_known`: the check played this pad."""

    linear: int = 1
    angular: int = 3
    a: int = 0
    b: int = 1
    y: int = 2
    is_known: bool = False


def pad(inside: Inside) -> Pad:
    """The numbers of the pad that the check played; those of the handout if it played none."""
    found, heard = [], inside.run.pad
    for name, moved in (('left stick up', heard.axes), ('right stick left', heard.axes),
                        ('A', heard.buttons), ('B', heard.buttons), ('Y', heard.buttons)):
        begin = stimulus(inside, name)
        chosen = (heard.arrival > begin - 0.01) & (heard.arrival < begin + 0.2)
        found.append(int(np.argmax(np.abs(moved[chosen]).sum(axis=0))) if moved[chosen].any() else None)
    usual = Pad()
    return Pad(*(each if each is not None else default for each, default in zip(found, usual)),
               is_known=found[0] is not None)


def played(inside: Inside) -> Device:
    """What a node heard of the pad."""
    heard, axes = inside.run.pad, inside.run.pad.axes.shape[1]

    def place(row: np.ndarray) -> str:
        return ' and '.join(
            'axis {} at {:g}'.format(k, row[k]) if k < axes else 'button {} down'.format(k - axes)
            for k in np.flatnonzero(row)) or 'all axes at 0'
    return Device(heard.arrival, np.hstack([heard.axes, heard.buttons]), place)


def presses(inside: Inside, names: str) -> List[Tuple[float, float, str]]:
    """(begin, next one of them, name) of the presses of these buttons."""
    heard, numbers = inside.run.pad, inside.known(pad)
    found = []
    for name in names:
        column = heard.buttons[:, getattr(numbers, name.lower())]
        found += [(float(at), name) for at in heard.arrival[1:][np.diff(column) > 0.0]]
    found.sort()
    ends = [at for at, _ in found[1:]] + [inside.run.duration]
    return [(at, end, name) for (at, name), end in zip(found, ends)]


def called(inside: Inside, name: str) -> str:
    return 'button {} ({})'.format(getattr(inside.known(pad), name.lower()), name)


def stick_laws(inside: Inside) -> List[Optional[Broken]]:
    """The Broken of each field that a stick gives."""
    device, numbers, heard = played(inside), inside.known(pad), inside.run.pad
    forms = [Quantity('axis {}'.format(k), device.time, value, 1.0)
             for k, value in enumerate(heard.axes.T)]
    buttons = [Quantity('button {}'.format(k), device.time, value, 1.0)
               for k, value in enumerate(heard.buttons.T) if value.any()]
    found = []
    for name, words, factor in STICKS:
        right = forms[getattr(numbers, name)]
        others = [each for each in forms + buttons if each is not right and each.value.any()]
        broken = law(inside, device, field(sent(inside), name, words), [right] + others, factor)
        found.append(broken and broken._replace(
            is_weak=broken.is_weak or not numbers.is_known))
    return found


def wrong_stick(inside: Inside) -> Optional[Broken]:
    """Does each field follow its axis, with its sign, and not faster than the handout's?"""
    return first(inside.known(stick_laws), weak=False)


def other_stick(inside: Inside) -> Optional[Broken]:
    """Is each field the handout's number times its axis?"""
    return first(inside.known(stick_laws), weak=True)


def is_handed_over(inside: Inside, time: float) -> bool:
    """Is A the last one of A and B that was pressed?"""
    return [name for at, _, name in presses(inside, 'AB') if at <= time][-1:] == ['A']


def sticks_let_go(inside: Inside) -> Optional[Broken]:
    """Does a zero follow when the sticks are let go?"""
    numbers = inside.known(pad)
    return next(filter(None, (
        no_zero(sent(inside), begin, 'the sticks were let go') for begin, _, row in
        played(inside).held() if not row[numbers.linear] and not row[numbers.angular]
        and not is_handed_over(inside, begin))), None)


def wrong_control(inside: Inside) -> Optional[Broken]:
    """Is the robot handed over by A, and taken back by B, and does the node then send commands?"""
    numbers, said, commands = inside.known(pad), inside.run.control, sent(inside)
    quiet = silent(commands, played(inside), lambda row: row[numbers.linear] or row[numbers.angular],
                   lambda begin, end: is_handed_over(inside, begin))
    for begin, end, name in presses(inside, 'AB') if numbers.is_known else ():
        if quiet is not None and quiet.moment < begin:
            break
        words, own = '', inside.find('has_control')
        chosen = (said.arrival > begin - 0.02) & (said.arrival < min(end, begin + 1.0))
        extra = (commands.arrival > begin + ANSWERED) & (commands.arrival < end)
        if not chosen.any():
            words = 'nothing came on ctrl_relinq after ' + called(inside, name)
        elif said.value[chosen][-1] != (name == 'A'):
            words = 'ctrl_relinq said {} after {}'.format(name == 'B', called(inside, name))
        elif name == 'A' and extra.any():
            words = '{} commands came while the robot was handed over, after {}'.format(
                extra.sum(), called(inside, name))
        if words:
            is_kept = own is not None and own.at(begin + ANSWERED) == (name == 'A')
            return Broken('{} stayed {} after {}: {}'.format(
                own.name, name == 'A', called(inside, name), words) if is_kept else words, begin,
                own.name if is_kept else '')
    if quiet is None:
        return None
    last = [each for each in presses(inside, 'ABY') if each[0] < quiet.moment][-1:]
    own = inside.find('has_control')
    return quiet._replace(words=quiet.words + (
        '; the last button was {}'.format(called(inside, last[0][2])) if last else '') + (
        ', and {} was False'.format(own.name)
        if own is not None and own.at(quiet.moment + ANSWERED) == 0.0 else ''))


def wrong_reset(inside: Inside) -> Optional[Broken]:
    """Does Y call the reset with (0, 0, 0) and a rotation?"""
    calls = events(inside, 'call')
    tried = presses(inside, 'Y')[:1] if len(inside.run.events) and stimulus(
        inside, WITHOUT_SERVICE) > stimulus(inside, 'Y') < np.inf else []
    for begin, _, name in tried:
        mine = [call for at, call in calls if begin <= at < begin + CALLED]
        if not mine:
            other = [each for each in presses(inside, 'AB') for at, _ in calls
                     if each[0] <= at < each[0] + 1.0]
            return Broken('no reset was called after {}{}'.format(called(
                inside, name), '; one was called after ' + called(
                    inside, other[0][2]) if other else ''), begin)
        service, request = str(mine[0].get('service', '')), str(mine[0].get('request', ''))
        if service.strip('/') != SERVICE:
            return Broken('it called {}, the handout has {}'.format(service, SERVICE), begin)
        return wrong_request(request, begin)
    return None


def wrong_request(request: str, begin: float) -> Optional[Broken]:
    """Is a request, as a text, (0, 0, 0) with a rotation and a covariance?"""
    place = next(filter(None, (each.findall(request) for each in PLACES)), [])
    numbers = [float(each) for row in place for each in ([row] if isinstance(row, str) else row)]
    if any(numbers):
        return Broken('the request of the reset had the position {}; it should be 0, 0, 0'.format(
            ', '.join(map('{:g}'.format, numbers))), begin)
    turned = [[float(each) for each in row] for row in ORIENTATION.findall(request)][:1]
    for x, y, z, w in turned:
        length = float(np.sqrt(x * x + y * y + z * z + w * w))
        if abs(length - 1.0) > 0.01 or abs(abs(w) - 1.0) > 1e-3:
            return Broken('the quaternion in the request of the reset was x {:g}, y {:g}, z {:g}, '
                          'w {:g}{}; it should be 0, 0, 0, 1'.format(
                              x, y, z, w, '' if abs(length - 1.0) < 0.01 else
                              ', of length {:.2g}'.format(length)), begin)
    covariance = re.search(r'covariance: \[(.*?)\]', request)
    if covariance and not any(float(each) for each in covariance.group(1).split(',')):
        return Broken('the covariance in the request of the reset is all zeros', begin, is_weak=True)
    return None


PAD_LINKS = (wrong_stick, sticks_let_go, wrong_control, wrong_reset, other_stick)

# -- the mouse of the IMU lab

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
    turning = inside.find('turning')
    if turning is None:
        return time > stimulus(inside, BESIDE)
    return np.array([max(turning.between(at - 0.12, at + 0.12).value, default=turning.at(at)) == 1.0
                     for at in time], dtype=bool)


def mouse_laws(inside: Inside) -> List[Optional[Broken]]:
    """The Broken of each field that the mouse gives."""
    device, commands, heard = mouse(inside), sent(inside), inside.run.mouse
    commands = commands.take(~is_turning(inside, commands.arrival))
    far = {'x': np.abs(heard.x) > DEAD, 'y': np.abs(heard.y) > DEAD}
    found = []
    for name, words, axes, factor in (('linear', 'linear.x', 'yx', HALF),
                                      ('angular', 'angular.z', 'xy', -HALF)):
        forms = []
        for place, own in ((' outside of the dead zone', 0), ('', None), (
                ' where the other one is outside of the dead zone', 1), (
                    ' where both are outside of the dead zone', 2)):
            for active, is_on in (('', heard.active), (', also while it is not active', 1.0)):
                for k, axis in enumerate(axes):
                    zone = {None: 1.0, 0: far[axis], 1: far[axes[1 - k]],
                            2: far['x'] & far['y']}[own]
                    forms.append(Quantity(axis + place + active, device.time,
                                          getattr(heard, axis) * zone * is_on, 1.0))
        series = field(commands, name, words)
        up = [event.get('up') for _, event in events(inside, 'mouse client')]
        if name == 'linear' and not any(up) and len(series.time) and (
                np.median(np.sign(series.value * np.interp(series.time, device.time, heard.y))[
                    series.value != 0.0] if series.value.any() else [0.0]) < 0.0):
            factor = -factor    # of a mouse that counts down
        found.append(law(inside, device, series, forms, factor))
    return found


def wrong_mouse(inside: Inside) -> Optional[Broken]:
    """Does each field follow the mouse, with its sign, its dead zone and its activity?"""
    return first(inside.known(mouse_laws), weak=False)


def other_mouse(inside: Inside) -> Optional[Broken]:
    """Is each field the handout's number times the place of the mouse?"""
    return first(inside.known(mouse_laws), weak=True)


def mouse_silent(inside: Inside) -> Optional[Broken]:
    """Does the mouse give commands, and a zero in its middle and when it is deactivated?"""
    device, commands = mouse(inside), sent(inside)
    stops = [no_zero(commands, begin, '{} came'.format(device.place(row)))
             for begin, _, row in device.held()
             if not asks(row) and not is_turning(inside, np.array([begin - 0.2, begin + 0.3])).any()]
    return silent(commands, device, asks, lambda begin, end: is_turning(
        inside, np.linspace(begin, end, 5)).any()) or first(stops, weak=False)


def mouse_in_turn(inside: Inside) -> Optional[Broken]:
    """Does the mouse give no command while the node turns?"""
    turning, commands, device = inside.find('turning'), sent(inside), mouse(inside)
    if turning is None or not len(device.time):
        return None
    inner = np.array([turning.between(at - 0.15, at + 0.15).value.min(initial=turning.at(at))
                      for at in commands.arrival]) == 1.0
    last = device.sample(commands.arrival)
    mixed = inner & (last >= 0) & (commands.angular == 0.0)
    if mixed.sum() < 3 or not commands.angular[inner].any():
        return None
    k = int(np.flatnonzero(mixed)[0])
    return Broken('{} of {} commands while {} was True were those of the mouse, such as {:.2f} m/s '
                  'and {:.2f} rad/s with {}'.format(
                      mixed.sum(), inner.sum(), turning.name, commands.linear[k],
                      commands.angular[k], device.place(device.value[last[k]])),
                  float(commands.arrival[k]))


MOUSE_LINKS = (wrong_mouse, mouse_silent, mouse_in_turn, other_mouse)

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
    return part_of(series, time < end)


def wrong_heading(inside: Inside) -> Optional[Broken]:
    """Is the printed number the heading from 0 to 360?"""
    series, quantities = printed(inside), inside.imu
    right, moment = quantities[0], float(series.time[0]) if len(series.time) else 0.0
    if len(series.time) < 3 or followed(series, quantities[:1]):
        return None
    found = [each.words for each in followed(series, quantities)]
    # an order of the quaternion is told only if nothing simpler is equal to it
    found = found[:1] + [each for each in found[1:] if QUATERNION not in each
                         and each.split(',')[0] != found[0].split(',')[0]][:1]
    if not found and not stays(series):
        delays = ((delay(series, each), each.words) for each in quantities
                  if abs(each.per_degree) <= 1.0 and is_some_sample(series, each))
        found = shifted(series, right) or ['{}, up to {:.1f} s late'.format(words, late)
                                           for late, words in delays if late < np.inf][:1]
    if not found and stays(series):
        return Broken('{} stays at {}; it should be {}'.format(
            series.name, series.text[-1], right.words), moment)
    moment, numbers = example(series, right, 1.0)
    return Broken('{} {} {}; it should be {}: {}'.format(
        series.name, *('follows', ', or '.join(found), right.words) if found else (
            'does not follow', 'the heading', right.words), numbers), moment)


def is_some_sample(series: Series, quantity: Quantity) -> bool:
    """Is each value that of a sample, of any time?"""
    values = np.sort(quantity.value)
    after = np.searchsorted(values, series.value).clip(1, len(values) - 1)
    apart = np.minimum(np.abs(values[after] - series.value),
                       np.abs(values[after - 1] - series.value))
    return bool(np.mean(apart < SAME * quantity.scale) >= PART)


def shifted(series: Series, right: Quantity) -> List[str]:
    """Words on a heading to which an angle is added; [] if it is none."""
    sample = (np.searchsorted(right.time, series.time) - 1).clip(0)
    apart = (series.value - right.value[sample] + 180.0) % 360.0 - 180.0
    angle = float(np.median(apart))
    if not followed(Series(series.name, series.time, series.text, series.value % 360.0),
                    [right._replace(value=(right.value + angle) % 360.0)]):
        return []
    return ['the yaw {} {:.1f} degrees'.format('plus' if angle > 0.0 else 'minus', abs(angle))]


PRINTED_LINKS = (wrong_heading,)
