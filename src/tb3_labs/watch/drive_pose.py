"""The local pose of the Transformation lab: what a node's references and its local_x, local_y and
local_yaw should be, and what they follow instead.

A local frame begins at each start of the node and at each reset. Places are complex numbers here,
x + iy: a rotation is a product. Angles are compared on the unit circle, so in any range.
"""
from itertools import product
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.watch.chain import Broken, Inside
from tb3_labs.watch.quantities import SAME, Quantity, ages, followed, headings
from tb3_labs.watch.turn_links import short
from tb3_labs.watch.variables import Series

#: A pose is right within APART [m], [rad], in the part MOST of at least FEW values.
APART, MOST, FEW = 0.03, 0.9, 10
#: A variable is read LATE after its cause, a change SOON after it [s].
LATE, SOON = 0.4, 0.1
#: A robot rests for this time after a node was started [s].
RESTS = 1.5
#: The variables of the pose, and the references that each of them uses.
USED = {'local_yaw': ('initial_global_yaw',), 'local_x': ('initial_global_x', 'initial_odom_yaw'),
        'local_y': ('initial_global_y', 'initial_odom_yaw')}


class Frame(NamedTuple):
    """A local frame: its begin and end [s], the pose that was declared, the odometry's place and
    yaw and the IMU's yaw at its begin, whether a reset began it. Or the arrays of these."""

    begin: Any
    end: Any
    declared: Any
    turned: Any
    place: Any
    theta: Any
    yaw: Any
    is_reset: Any

    @property
    def words(self) -> str:
        return 'after the reset at {:.0f} s '.format(self.begin) if self.is_reset else ''

    @property
    def references(self) -> Dict[str, Tuple[float, float]]:
        """The references at its begin: (as heard, without the declared pose)."""
        theta = self.theta - self.turned
        place = self.place - self.declared * np.exp(1j * theta)
        return {'initial_global_yaw': (self.yaw, self.yaw - self.turned),
                'initial_global_x': (self.place.real, place.real),
                'initial_global_y': (self.place.imag, place.imag),
                'initial_odom_yaw': (self.theta, theta)}


def frames(inside: Inside) -> List[Frame]:
    """The frames of a run, in their order."""
    if not inside.variables:
        return []
    run, times = inside.run, next(iter(inside.variables.values())).time
    begins = [(min(times[min(int(np.searchsorted(times, start)), len(times) - 1)], start + RESTS),
               0j, 0.0, False) for start in run.starts or times[:1]]
    begins = sorted(begins + [(at, complex(x, y), yaw, True) for at, x, y, yaw in zip(
        run.resets.arrival, run.resets.x, run.resets.y, run.resets.yaw) if at > times[0]])
    found = []
    for (begin, place, turned, is_reset), end in zip(
            begins, [each[0] for each in begins[1:]] + [run.duration + 1.0]):
        odometry, imu = (samples.take([min(int(np.searchsorted(
            samples.arrival, begin)), len(samples) - 1)]) for samples in (run.odometry, run.imu))
        found.append(Frame(begin, end, place, turned, complex(
            odometry.x[0], odometry.y[0]), odometry.yaw[0], imu.yaw[0], is_reset))
    if not run.starts:      # the node was started before the recording, perhaps: its own references
        own = {name: inside.find(name) for name in found[0].references}
        yaw, x, y, theta = (np.nan if each is None else each.value[0] for each in own.values())
        found[0] = found[0]._replace(place=complex(x, y), theta=theta, yaw=yaw)
    return found


def of_samples(inside: Inside, time: np.ndarray) -> Tuple[Frame, Frame]:
    """The frame of each sample and the one before, each as a Frame of arrays."""
    known = inside.known(frames)
    this = np.searchsorted([each.begin for each in known], time, 'right').clip(1) - 1
    before = this - np.array([each.is_reset and k > 0 for k, each in enumerate(known)])[this]
    return (Frame(*(np.array(column)[this] for column in zip(*known))),
            Frame(*(np.array(column)[before] for column in zip(*known))))


def places(inside: Inside) -> List[Quantity]:
    """What a node may take for its local place, complex; the first is right."""
    samples = inside.run.odometry
    this, before = of_samples(inside, samples.arrival)
    here, now, theta = samples.x + 1j * samples.y, samples.yaw, this.theta - this.turned
    forms = (('', lambda z: z), ('with x and y swapped, ', lambda z: z.imag + 1j * z.real),
             ('with the other sign, ', lambda z: -z))
    bases = (('the displacement since the reset', here - this.place),
             ('the displacement since the reset before', here - before.place),
             ('the position in the odometry, not displaced', here))
    turns = (('rotated into the local frame', -theta), ('not rotated', 0.0 * theta),
             ('rotated by R in place of its inverse', theta),
             ('rotated by the yaw of the IMU', this.turned - this.yaw),
             ('rotated by the yaw of the IMU, R in place of its inverse', this.yaw - this.turned),
             ('rotated by the present yaw', -now), ('rotated by R with the present yaw', now),
             ('rotated by the present local yaw', theta - now),
             ('rotated by the yaw of the reset before', before.turned - before.theta),
             ('rotated without the declared yaw', -this.theta),
             ('rotated with the angle in degrees', -np.degrees(theta)))
    kept = (('', this.declared), (', without the declared place', 0.0))
    return [Quantity('{}{}, {}{}'.format(form[0], base[0], turn[0], more[0]), samples.arrival,
                     form[1](base[1] * np.exp(1j * turn[1]) + more[1]), APART / SAME)
            for more, form, base, turn in product(kept, forms, bases, turns)]


def yaws(inside: Inside, part: Series) -> Iterator[Quantity]:
    """What a node may take for its local yaw while `part` was read, on the unit circle."""
    run, reference = inside.run, inside.find('initial_global_yaw')
    half, none = run.odometry.yaw / 2.0, 0.0 * run.odometry.yaw
    for of, at, quaternion in (
            ('', run.imu.arrival, (run.imu.w, run.imu.x, run.imu.y, run.imu.z)),
            (' of the odometry', run.odometry.arrival, (np.cos(half), none, none, np.sin(half)))):
        some = slice(*np.searchsorted(at, (part.time[0] - 1.0, part.time[-1] + SOON)))
        this, before = of_samples(inside, at[some])
        first, old = (np.searchsorted(at, each.begin).clip(0, len(at) - 1)
                      for each in (this, before))
        own = 0.0 if reference is None else reference.value[(np.searchsorted(
            reference.time, at[some], 'right') - 1).clip(0)]
        for each in headings(at, quaternion, of):
            if 'its number' in each.words or (
                    'from -180' not in each.words if each.per_degree else of):
                continue        # equal on the circle, or nothing that the odometry has
            unit = 180.0 / np.pi if ' in degrees' in each.words else 1.0
            for (said, base), (more, turned) in product((
                    (' since the reset', each.value[first]), (', not from the reset on', 0.0),
                    (' since the reset before', each.value[old]),
                    (', minus initial_global_yaw', own)),
                    (('', this.turned), (', without the declared yaw', 0.0))):
                words = each.words.replace(', from -180 to 180', '').replace(' in radians', '')
                yield Quantity(words + said + more, at[some], np.exp(
                    1j * (each.value[some] - base + turned * unit)), APART / SAME)


def rights(inside: Inside) -> Dict[str, Quantity]:
    """The right local pose; its yaw on the circle."""
    samples, place = inside.run.imu, inside.known(places)[0]
    this, _ = of_samples(inside, samples.arrival)
    yaw = np.exp(1j * (samples.yaw - this.yaw + this.turned))
    return {'local_yaw': Quantity('the yaw of the IMU since the reset', samples.arrival, yaw,
                                  APART / SAME),
            'local_x': place._replace(value=place.value.real),
            'local_y': place._replace(value=place.value.imag)}


def steered(inside: Inside, series: Series, begin: float, end: float) -> Series:
    """The part of a variable in [begin, end) in which the node has had control for LATE; without
    ctrl_relinq all of it."""
    control, part = inside.run.control, series.between(begin + LATE, end)
    if not len(control):
        return part
    now, before = (np.searchsorted(control.arrival, part.time - late, 'right') - 1
                   for late in (0.0, LATE))
    return part.take((now >= 0) & (now == before) & (control.value[now] == 1.0))


def compared(series: Optional[Series], name: str) -> List[Series]:
    """A variable as it is compared: that of a yaw on the circle, in radians and in degrees."""
    return [] if series is None else [series] if name != 'local_yaw' else [
        Series(series.name, series.time, series.text, np.exp(
            1j * unit * np.where(np.isfinite(series.value), series.value, np.nan)))
        for unit in (1.0, np.pi / 180.0)]


def in_degrees(inside: Inside) -> bool:
    """Is the own local_yaw in degrees?"""
    right = [inside.known(rights)['local_yaw']]
    return [bool(followed(each, right, MOST)) for each in compared(
        inside.find('local_yaw'), 'local_yaw')] == [False, True]


def wrong_pose(inside: Inside) -> Optional[Broken]:
    """Is the local pose that of the sensors, since the reset, in the local frame? If not, is its
    reference that of the reset?"""
    for frame, (name, references) in product(inside.known(frames), USED.items()):
        series = inside.find(name)
        if series is None or not np.isfinite(series.value).any():
            continue
        part, right = steered(inside, series, frame.begin, frame.end), inside.known(rights)[name]
        same = compared(part, name)
        if np.isnan([frame.place, frame.theta, frame.yaw]).any():
            continue        # its references are unknown
        is_wrong = np.isfinite(part.value).sum() >= FEW and not any(
            followed(each, [right], MOST) for each in same)
        found = [each for each in (wrong_reference(inside, frame, each, is_wrong)
                                   for each in references) if each]
        if found or is_wrong:
            wrong = found[0] if found else wrong_belief(inside, frame, part, same[0], right)
            earlier = [each for each in inside.known(frames) if each.is_reset and each.begin <
                       frame.begin and len(steered(inside, series, *each[:2]).time) >= FEW]
            state = inside.find('state')
            then, now = ('' if state is None else state.text_at(each.begin - SOON)
                         for each in ((earlier or [frame])[0], frame))
            if then != now:
                wrong = wrong._replace(
                    words='{}. The state was {} then; after the reset at {:.0f} s, in {}, it was '
                    'right'.format(wrong.words, now, earlier[0].begin, then))
            return wrong
    return None


def wrong_reference(inside: Inside, frame: Frame, name: str, is_used: bool) -> Optional[Broken]:
    """Is a reference set at the begin of a frame, and then kept? `is_used`: the pose is wrong."""
    series = inside.find(name)
    part = series and steered(inside, series, frame.begin, frame.end)
    if series is None or part is None or len(part.time) < FEW:
        return None
    asked, words = frame.references[name], 'became ' + short(part.text[-1])
    before = ([each for each in inside.known(frames) if each.begin < frame.begin]
              or [frame])[-1].references[name]
    if set(part.text) == {'None'}:
        words = 'stayed None'
    elif not is_used or min(np.median(np.abs(
            np.exp(1j * part.value) - np.exp(1j * each) if 'yaw' in name else part.value - each))
            for each in asked) <= APART:
        return None
    elif len(set(part.text)) > 5:
        words = 'went on changing, and ' + words
    elif abs(asked[0] - before[0]) > APART and series.text_at(frame.begin - SOON) == part.text[-1]:
        words = words.replace('became', 'stayed')
    else:
        value = part.value[-1] + asked[0] - asked[1]
        same = [each.words for each in (inside.imu + inside.odometry if 'yaw' in name else [])
                if np.abs(each.value[slice(*np.searchsorted(each.time, (
                    frame.begin - 5.0, frame.begin + LATE)))] - value).min(
                        initial=np.inf) < 1e-6 * each.scale]
        if not same:
            return None
        words += ', as ' + min(same, key=lambda each: ('yaw' not in each) + (
            'order' in each and 'x, y, z, w' not in each))
    return Broken('{}{} {}; it should be {:.3g} ({})'.format(
        frame.words, series.name, words, asked[0], 'IMU' if name == 'initial_global_yaw' else
        'odometry'), float(part.time[0]), series.name)


def wrong_belief(inside: Inside, frame: Frame, part: Series, same: Series,
                 right: Quantity) -> Broken:
    """What a variable of the local pose follows in a frame in which it is not right; `same`: the
    variable as it is compared."""
    samples, is_yaw = np.searchsorted(right.time, part.time).clip(1) - 1, same is not part
    worst = int(np.nanargmax(np.abs(same.value - right.value[samples])))
    should = right.value[samples[worst]]
    whole = steered(inside, inside.variables[part.name], -np.inf, np.inf)
    table = yaws(inside, whole) if is_yaw else (each._replace(
        value=each.value.imag if part.name.endswith('y') else each.value.real)
        for each in inside.known(places))
    some = same.take(np.linspace(0, len(same.time) - 1, 15).astype(int))
    is_kept = any(inside.find(each) is None for each in frame.references)
    found = [each for each in (table if np.ptp(part.value) > 2.0 * APART else ())
             if (is_kept or 'reset before' not in each.words)
             and followed(some, [each], 0.6) and followed(same, [each], MOST) and followed(
                 compared(whole, 'local_yaw')[0] if is_yaw else whole, [each], 0.4)]
    mistakes = [each.words.replace('x, y, z, w', '').count(',') + (
        is_yaw and ('yaw' not in each.words) + ('odometry' in each.words)) for each in found]
    said = [each.words for each, count in zip(found, mistakes) if count == min(mistakes)]
    late = np.sort(ages(same, right._replace(scale=1.0), 60.0))[int(MOST * (len(same.time) - 1))]
    words = 'stayed ' + short(part.text[-1]) if len(set(part.text)) == 1 else \
        'followed ' + ', or '.join(dict.fromkeys(said[:2])) if said else \
        'came up to {:.1f} s late'.format(late) if late < np.inf else 'did not follow it'
    return Broken('{}{} {}; it should be {}: it was {:.3g} when this was {:.3g}'.format(
        frame.words, part.name, words, right.words, part.value[worst],
        np.angle(should) if is_yaw else should), float(part.time[worst]), part.name)
