"""The chains of the gamepad lab, of the mouse in the IMU lab, and of the IMU exercise.

    pad:     axes -> command; buttons -> has_control -> ctrl_relinq -> command; button -> reset
    mouse:   place, active -> command, none in a turn
    printed: the IMU's heading -> the number that is printed
"""
import re
from itertools import product
from typing import List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.watch.chain import Broken, Inside, belief, example
from tb3_labs.watch.inputs import (
    ANSWERED, Device, events, law, link_of, sent, stimulus, unanswered)
from tb3_labs.watch.quantities import Quantity, delay, followed
from tb3_labs.watch.variables import Series, number

# -- the gamepad

#: The fields of a command, and the handout's speeds of a full stick [m/s], [rad/s].
FIELDS, FACTORS = ('linear.x', 'angular.z'), (0.22, 2.84)
#: The stimuli that show the pad's numbers: of the axes that drive and turn, of A, B and Y; the
#: handout's numbers.
PLAYED, HANDOUT = ('left stick up', 'right stick left', 'A', 'B', 'Y'), (1, 3, 0, 1, 2)
#: A number of the pose in a request, and those of the reset: x, y, z, and x, y, z, w.
PLACE, RESET = re.compile(r'\b[xyzw]: (\S+)'), (0, 0, 0, 0, 0, 0, 1)


class Pad(NamedTuple):
    """The numbers of the axes that drive and turn, and of the buttons A, B and Y. `is_known`: the
    check played this pad."""

    numbers: Tuple[int, ...]
    is_known: bool

    def words(self, name: str) -> str:
        return 'button {} ({})'.format(self.numbers[PLAYED.index(name)], name)


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


def presses(inside: Inside, names: str) -> List[Tuple[float, float, str]]:
    """(begin, next one of them, name) of the presses of these buttons."""
    heard, numbers = inside.run.pad, inside.known(pad).numbers
    found = sorted(
        (float(at), name) for name in names
        for at in heard.arrival[1:][np.diff(heard.buttons[:, numbers[PLAYED.index(name)]]) > 0.0])
    ends = [at for at, _ in found[1:]] + [inside.run.duration]
    return [(at, end, name) for (at, name), end in zip(found, ends)]


def stick_laws(inside: Inside) -> List[Optional[Broken]]:
    """The Broken of each field that follows a stick."""
    own, heard = inside.known(pad), inside.run.pad
    forms = [Quantity('{} {}'.format(words, k), heard.arrival, value, 1.0)
             for words, columns in (('axis', heard.axes), ('button', heard.buttons))
             for k, value in enumerate(columns.T)]
    found = [law(inside, played(inside), sent(inside), name,
                 [[forms[axis]]] + [[each] for each in forms if each is not forms[axis]], factor)
             for name, factor, axis in zip(FIELDS, FACTORS, own.numbers)]
    return [each and each._replace(is_weak=each.is_weak or not own.is_known) for each in found]


def wrong_control(inside: Inside) -> Optional[Broken]:
    """Do the sticks drive, and not while the robot is handed over by A, until it is taken by B?"""
    own, pressed = inside.known(pad), presses(inside, 'AB')
    if not own.is_known:
        return None
    found = [unanswered(
        sent(inside), played(inside), lambda row: row[list(own.numbers[:2])].any(),
        lambda begin, end: any(at <= begin < until and name == 'A' for at, until, name in pressed)),
        *(wrong_button(inside, *each) for each in pressed)]
    broken = min(filter(None, found), key=lambda each: each.moment, default=None)
    last = [each for each in presses(inside, 'ABY') if broken and each[0] <= broken.moment][-1:]
    for begin, _, name in last:
        broken = broken._replace(words='{}; the last button was {}'.format(
            broken.words, own.words(name)))
        for each in inside.variables.values():
            if set(each.text) == {'True', 'False'} and any(
                    each.at(at) != each.at(at + ANSWERED) for at, *_ in pressed):
                return broken._replace(words='{}, and {} was {} after it'.format(
                    broken.words, each.name, each.text_at(begin + ANSWERED)), variable=each.name)
    return broken


def wrong_button(inside: Inside, begin: float, end: float, name: str) -> Optional[Broken]:
    """Does a press of A or B publish its value, and does no command come after A?"""
    said, commands = inside.run.control, sent(inside)
    chosen = said.value[(said.arrival > begin - 0.02) & (said.arrival < min(end, begin + 1.0))]
    extra = (commands.arrival > begin + ANSWERED) & (commands.arrival < end)
    if not len(chosen):
        return Broken('nothing came on ctrl_relinq', begin)
    if chosen[-1] != (name == 'A'):
        return Broken('ctrl_relinq said {}'.format(name == 'B'), begin)
    return Broken('{} commands came while the robot was handed over'.format(
        extra.sum()), begin) if name == 'A' and extra.any() else None


def wrong_reset(inside: Inside) -> Optional[Broken]:
    """Does Y call the reset with (0, 0, 0) and a rotation?"""
    begin, pressed, calls = stimulus(inside, 'Y'), presses(inside, 'ABY'), events(inside, 'call')
    after = [name for at, _ in calls for name in [
        name for begin, end, name in pressed if begin <= at < end]]
    if begin < np.inf and 'Y' not in after:
        return Broken('no reset was called after {}{}'.format(
            inside.known(pad).words('Y'), ''.join('; one was called after ' + inside.known(
                pad).words(name) for name in after[:1])), begin)
    for at, call in calls:
        pose = [number(each) for each in PLACE.findall(str(call.get('request', '')))]
        if len(pose) == len(RESET) and np.abs(np.abs(pose) - RESET).max() > 1e-3:
            return Broken('the pose in the request of the reset was {}; it should be {}'.format(
                *(', '.join(map('{:g}'.format, each)) for each in (pose, RESET))), at)
    return None


PAD_LINKS = link_of(stick_laws, weak=False), wrong_control, wrong_reset, link_of(
    stick_laws, weak=True)

# -- the mouse of the IMU lab

#: A command is amid those of a turn if they come within AMID [s] before and after it. The times of
#: `turning` are known within READ [s].
AMID, READ = 0.3, 0.15
#: The handout's factor [m/s], [rad/s], and its dead zone. No turn comes before the stimulus BESIDE.
HALF, DEAD, BESIDE = 0.5, 0.25, 'l beside the mouse'


def mouse(inside: Inside) -> Device:
    """What a node heard of the mouse."""
    heard = inside.run.mouse
    return Device(heard.arrival, np.column_stack([heard.x, heard.y, heard.active]),
                  lambda row: 'the mouse at ({:g}, {:g}){}'.format(
                      row[0], row[1], '' if row[2] else ', not active'))


def turning(inside: Inside, time: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Did the node turn at these times: perhaps, and for certain?"""
    flag = inside.find('turning')
    if flag is None or not set(flag.text) <= {'True', 'False'}:
        return time > stimulus(inside, BESIDE), np.zeros(len(time), bool)
    near = [np.append(flag.between(at - READ, at + READ).value, flag.at(at)) for at in time]
    return (np.array([each.any() for each in near], bool),
            np.array([each.all() for each in near], bool))


def mouse_laws(inside: Inside) -> List[Optional[Broken]]:
    """The Broken of each field that follows the mouse."""
    commands, heard = sent(inside), inside.run.mouse
    commands = commands.take(~turning(inside, commands.arrival)[0])
    x, y = np.abs(heard.x) > DEAD, np.abs(heard.y) > DEAD
    forms = {axis: [Quantity(axis + zone + active, heard.arrival, place * is_far * is_on, 1.0)
                    for (zone, is_far), (active, is_on) in product(
                        ((' outside of the dead zone', far), ('', 1.0),
                         (' outside of both dead zones', x & y)),
                        (('', heard.active), (', also while it is not active', 1.0)))]
             for axis, place, far in (('x', heard.x, x), ('y', heard.y, y))}
    found = [law(inside, mouse(inside), commands, name, [forms[own], forms[other]], factor)
             for name, own, other, factor in (
                 (FIELDS[0], 'y', 'x', HALF), (FIELDS[0], 'y', 'x', -HALF),
                 (FIELDS[1], 'x', 'y', -HALF))]
    is_up = any(event.get('up') for _, event in events(inside, 'mouse client'))
    # the y of a client that is not known may count down
    return [found[0] if is_up or found[1] else None, found[2]]


def mouse_ignored(inside: Inside) -> Optional[Broken]:
    """Does the mouse give commands, and a zero in its middle and when it is deactivated?"""
    return unanswered(
        sent(inside), mouse(inside), lambda row: row[2] and np.abs(row[:2]).max() > DEAD,
        lambda begin, end: turning(inside, np.arange(begin - READ, end, READ))[0].any())


def mouse_in_turn(inside: Inside) -> Optional[Broken]:
    """Does the mouse give no command while the node turns?"""
    commands, device = sent(inside), mouse(inside)
    if not len(device.time):
        return None
    is_turning = turning(inside, commands.arrival)[1]
    turns = commands.arrival[commands.angular != 0.0]
    before, own, after = (np.searchsorted(turns, commands.arrival + span)
                          for span in (-AMID, 0.0, AMID))
    last = device.sample(commands.arrival)
    mixed = np.flatnonzero(is_turning & (last >= 0) & (commands.angular == 0.0) & (before < own)
                           & (own < after))
    return Broken('{} of {} commands while turning was True were those of the mouse, such as '
                  '{:.2f} m/s with {}'.format(
                      len(mixed), is_turning.sum(), commands.linear[mixed[0]],
                      device.place(device.value[last[mixed[0]]])),
                  float(commands.arrival[mixed[0]])) if len(mixed) > 2 else None


MOUSE_LINKS = (link_of(mouse_laws, weak=False), mouse_ignored, mouse_in_turn,
               link_of(mouse_laws, weak=True))

# -- the IMU exercise

HEADING_LINE = re.compile(r'Current heading is (-?\d+(?:\.\d+)?(?:e[-+]?\d+)?) degrees')


def printed(inside: Inside) -> Series:
    """The headings that the node printed in its first run."""
    rows, end = inside.run.printed, ([*inside.run.starts[1:], np.inf])[0]
    words = [str(each) for each in rows.words]
    lines = list(HEADING_LINE.finditer(''.join(words)))
    ends = np.cumsum([len(each) for each in words])
    time = rows.arrival[np.searchsorted(ends, [each.end() for each in lines])] if lines else (
        np.empty(0))
    text = np.array([each.group(1) for each in lines], dtype=object)
    series = Series('the printed number', time, text, text.astype(float))
    return series.take(time < end)


def wrong_heading(inside: Inside) -> Optional[Broken]:
    """Is the printed number the heading from 0 to 360?"""
    series, quantities = printed(inside), inside.imu
    if len(series.time) < 3 or not quantities:
        return None
    right = quantities[0]
    used, broken = belief(series, quantities)
    if used is right or followed(series, quantities) and not used:
        return broken
    late = ((delay(series, each), each.words) for each in quantities
            if 0.0 < abs(each.per_degree) <= 1.0)
    words = [used.words] if used else shifted(series, right) or [
        '{}, up to {:.1f} s late'.format(each, longest) for longest, each in late
        if longest < np.inf][:1]
    moment, numbers = example(series, right)
    return Broken('{} follows {}; it should be {}: {}'.format(
        series.name, words[0], right.words, numbers), moment) if words else broken


def shifted(series: Series, right: Quantity) -> List[str]:
    """Words on a heading to which an angle is added; [] if it is none."""
    heading = right.value[(np.searchsorted(right.time, series.time) - 1).clip(0)]
    angle = float(np.median((series.value - heading + 180.0) % 360.0 - 180.0))
    return ['the heading {:+.1f} degrees, and at the first line the heading was {:.1f}'.format(
        angle, heading[0]) for _ in followed(
            Series(series.name, series.time, series.text, series.value % 360.0),
            [right._replace(value=(right.value + angle) % 360.0)])]


PRINTED_LINKS = (wrong_heading,)
