"""The local pose of the Transformation lab: what local_x, local_y, local_yaw and their references
should be, and what they follow instead.

A local frame begins at each start of the node and at each reset. Places are complex numbers here,
x + iy: a rotation is a product. Angles are compared on the unit circle, so in any range.
"""
import re
from itertools import islice, product
from typing import Any, Iterator, List, NamedTuple, Optional, Set, Tuple

import numpy as np

from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.watch.broken_link import LONGEST_READING_GAP, BrokenLink, NodeRun
from tb3_labs.watch.quantities import RECENT, SAME, Quantity, ages, matching_quantities
from tb3_labs.watch.variables import Series, short

#: A pose is right within APART [m], [rad], in the part MOST of at least FEW values.
APART, MOST, FEW = 0.03, 0.9, 10
#: A variable is read LATE after its cause, a change SOON after it [s].
LATE, SOON = 0.4, 0.1
#: A robot rests for this time after a node was started [s].
RESTS = 1.5
#: A reset is one of at most three in this time [s] before and after it.
STAYS = 1.0
#: The variables of the pose, and the references that each of them uses.
USED = {'local_yaw': ('initial_global_yaw',), 'local_x': ('initial_global_x', 'initial_odom_yaw'),
        'local_y': ('initial_global_y', 'initial_odom_yaw')}
REFERENCES = 'initial_global_x', 'initial_global_y', 'initial_odom_yaw', 'initial_global_yaw'


class Frame(NamedTuple):
    """A local frame: its begin and end [s], the pose that was declared, whether a reset began it,
    the odometry's place and yaw and the IMU's yaw at its begin. Or the arrays of these."""

    begin: Any
    end: Any
    declared: Any
    turned: Any
    is_reset: Any
    place: Any
    theta: Any
    yaw: Any

    @property
    def words(self) -> str:
        return f'after the reset at {self.begin:.0f} s ' if self.is_reset else ''


def frames(node_run: NodeRun) -> List[Frame]:
    """The frames of a run, in their order."""
    run = node_run.run
    if not node_run.variables or not len(run.odometry) or not len(run.imu):
        return []
    times = next(iter(node_run.variables.values())).time
    begins = [(min(times[min(int(np.searchsorted(times, start)), len(times) - 1)], start + RESTS),
               0j, 0.0, False) for start in run.starts or times[:1]]
    begins = sorted(begins + [(at, complex(x, y), yaw, True) for at, x, y, yaw in zip(
        run.resets.arrival, run.resets.x, run.resets.y, run.resets.yaw) if at > times[0]])
    unknown = [] if run.starts else unknown_begins(node_run, [each[0] for each in begins])
    begins = sorted(begins + [(at, 0j, 0.0, False) for at in unknown])
    found = []
    for begin, end in zip(begins, [each[0] for each in begins[1:]] + [run.duration + 1.0]):
        odometry, imu = (samples.take(min(np.searchsorted(
            samples.arrival, begin[0]), len(samples) - 1)) for samples in (run.odometry, run.imu))
        found.append(Frame(begin[0], end, *begin[1:], complex(odometry.x, odometry.y),
                           odometry.yaw, imu.yaw))
    if not run.starts:      # the node was started before the recording, perhaps: its own references
        for k in [0, *(k for k, each in enumerate(found) if each.begin in unknown)]:
            x, y, theta, yaw = (
                np.nan if each is None else each.value[0] if not k else each.at(
                    found[k].begin + LATE) for each in map(node_run.find, REFERENCES))
            found[k] = found[k]._replace(place=complex(x, y), theta=theta, yaw=yaw)
    return found


def unknown_begins(node_run: NodeRun, known: List[float]) -> List[float]:
    """The times at which a frame began for a reason that is not recorded: the node was started
    again, or a reset was not in the log. Then its references or its pose jumped."""
    begins = list(node_run.readings[1:][np.diff(node_run.readings) > LONGEST_READING_GAP])
    for name in REFERENCES:
        series = node_run.find(name)
        if series is not None:      # one that changes again and again is a mistake
            begins += list(rare(series.changes))
            is_none = series.text == 'None'
            begins += list(series.time[1:][is_none[1:] != is_none[:-1]])
    for name in USED:
        series = node_run.find(name)
        if series is not None:
            begins += list(rare(jumps_of(node_run, series)))
    found: List[float] = []
    for at in sorted(begins):
        if (np.abs(np.subtract(known, at)) > 2.0 * LATE).all() and at - SOON > max(
                found, default=-np.inf):
            found.append(float(at) - SOON)
    return found


def rare(times: np.ndarray) -> np.ndarray:
    """Those of these times that have at most two others within STAYS."""
    return times[np.searchsorted(times, times + STAYS) - np.searchsorted(times, times - STAYS) <= 3]


def jumps_of(node_run: NodeRun, series: Series) -> np.ndarray:
    """The times at which a variable of the pose had changed by more than its sensor just before."""
    is_yaw = 'yaw' in series.name
    samples = node_run.run.imu if is_yaw else node_run.run.odometry
    step = np.diff(series.value) * (unit_of(series) if is_yaw else 1.0)
    went = wrap_all(np.diff(samples.yaw)) if is_yaw else np.hypot(
        np.diff(samples.x), np.diff(samples.y))
    way = np.interp(series.time, samples.arrival, np.append(0.0, np.cumsum(np.abs(went))))
    before = np.interp(series.time - LATE, series.time, way) if len(way) else way
    return series.time[1:][np.abs(wrap_all(step) if is_yaw else step) > 2.0 * APART + (
        way[1:] - before[:-1])]


def around(node_run: NodeRun, time: np.ndarray) -> Tuple[Frame, Frame]:
    """Two Frames of arrays: the frame at each time, and the frame before that frame."""
    known = node_run.cached(frames)
    this = np.searchsorted([each.begin for each in known], time, 'right').clip(1) - 1
    columns = [np.array(column) for column in zip(*known)]
    return (Frame(*(column[this] for column in columns)),
            Frame(*(column[(this - 1).clip(0)] for column in columns)))


#: A quantity, and how many mistakes it has.
Wrong = Tuple[int, Quantity]


def mistake_combinations(*options: Any) -> Iterator[Tuple[Any, ...]]:
    """(how many are not the first option, one of each) of all combinations."""
    for chosen in product(*options):
        yield (sum(one is not each[0] for one, each in zip(chosen, options)), *chosen)


def during(frame: Frame, time: np.ndarray, near: Optional[np.ndarray] = None) -> np.ndarray:
    """The indices of the samples whose numbers a variable may have in a frame, or only at the
    readings `near` [s]; `time`: of all samples."""
    part = np.arange(*np.searchsorted(time, (frame.begin - LATE, frame.end)))
    if near is None:
        return part
    # the sample before the recent ones is the first one that is too old
    edges = np.zeros(len(time) + 1, int)
    np.add.at(edges, (np.searchsorted(time, near - RECENT) - 2).clip(0), 1)
    np.add.at(edges, (np.searchsorted(time, near + SOON) + 1).clip(max=len(time)), -1)
    return part[np.cumsum(edges)[part] > 0]


def places(node_run: NodeRun, frame: Frame, near: Optional[np.ndarray] = None) -> Iterator[Wrong]:
    """The quantities that a node may take for its local place in a frame; the first two are
    right."""
    samples = node_run.run.odometry
    samples = samples.take(during(frame, samples.arrival, near))
    this, before = around(node_run, samples.arrival)
    here, now, theta = samples.x + 1j * samples.y, samples.yaw, this.theta - this.turned
    forms = (('', lambda z: z), ('with x and y swapped, ', lambda z: z.imag + 1j * z.real),
             ('with the other sign, ', lambda z: -z))
    bases = (('the displacement since the reset', here - this.place),
             ('the displacement since the reset before', here - before.place),
             ('the place in the odometry, not displaced', here))
    turns = (('rotated by {} the yaw at the reset', theta), ('not rotated', 0.0 * theta),
             ('rotated by {} the yaw of the IMU', this.yaw - this.turned),
             ('rotated by {} the present yaw', now),
             ('rotated by {} the present local yaw', now - theta),
             ('rotated by {} the yaw at the reset before', before.theta - before.turned),
             ('rotated by {} the yaw without the declared one', this.theta),
             ('rotated by {} degrees', np.degrees(theta)))
    kept = (('', this.declared), (', without the declared place', 0.0))
    for wrong, more, form, base, (words, turn), (side, sign) in mistake_combinations(
            kept, forms, bases, turns, (('minus', -1.0), ('plus', 1.0))):
        yield wrong, Quantity(
            f'{form[0]}{base[0]}, {words.format(side)}{more[0]}', samples.arrival,
            form[1](base[1] * np.exp(sign * 1j * turn) + more[1]), APART / SAME)
        if not wrong:
            yield 1, Quantity(
                base[0] + ', without the declared pose', samples.arrival,
                base[1] * np.exp(-1j * this.theta), APART / SAME)


#: The formulas of a local yaw, and of a reference: (words, the factors of the present reading, of
#: the reading at the reset, of the reading at the reset before).
SINCE = ((' since the reset', 1, 1, 0), (' since the reset before', 1, 0, 1),
         (', not from the reset on', 1, 0, 0),
         (', minus the radians at the reset', 1, np.pi / 180.0, 0))
AT = ((' at the reset', 0, -1, 0), (' at the reset before', 0, 0, -1), ('', 1, 0, 0))


def readings(node_run: NodeRun, frame: Frame, name: str,
             near: Optional[np.ndarray] = None) -> Iterator[Tuple[int, Frame, Quantity, Any, Any]]:
    """(number of mistakes, frame of each sample, a quantity that a node may read for a yaw or a
    reference in a frame, its value at the begin of the frame and of the frame before). The first is
    right."""
    run, of = node_run.run, ('IMU', 'yaw') if name in ('local_yaw', 'initial_global_yaw') else (
        'odometry', 'theta' if 'yaw' in name else 'place')
    samples = run.imu if of[0] == 'IMU' else run.odometry
    samples = samples.take(during(frame, samples.arrival, near))
    this, before = around(node_run, samples.arrival)
    yield 0, this, Quantity(
        f"the {'yaw' if 'yaw' in name else 'place'} of the {of[0]}", samples.arrival,
        samples.yaw if 'yaw' in name else samples.x + 1j * samples.y, 0.0), getattr(
            this, of[1]), getattr(before, of[1])
    for table in (node_run.imu, node_run.odometry) if 'yaw' in name else ():
        time = table[0].time
        part = during(frame, time, near)
        chosen = time[part]
        this, before = around(node_run, chosen)
        first, old = (np.searchsorted(time, each.begin).clip(0, len(time) - 1)
                      for each in (this, before))
        for each in table:
            # the other ranges are equal on the circle
            if 'from -180' in each.words or not each.per_degree:
                words = re.sub(',? in radians|, from -180 to 180', '', each.words)
                yield (1 + ('yaw' not in words) + ('odometry' in words)
                       + words.replace('x, y, z, w', '').count(','),
                       this, each._replace(words=words, time=chosen, value=each.value[part]),
                       each.value[first], each.value[old])


def table(node_run: NodeRun, frame: Frame, name: str, near: Optional[np.ndarray] = None,
          wanted: Optional[Set[str]] = None) -> Iterator[Wrong]:
    """The quantities that a variable of the pose or a reference may follow in a frame, as they are
    compared. The first two are right: the handout does not ask for a declared pose. `near`: only at
    these readings [s]; `wanted`: only those with these words. To compute all takes most of the
    time."""
    if name in ('local_x', 'local_y'):
        for wrong, each in places(node_run, frame, near):
            yield wrong, each._replace(value=comparable(name, each.value))
        return
    is_local = name in USED
    for wrong, this, each, first, old in readings(node_run, frame, name, near):
        declared = this.turned * (180.0 / np.pi if ' in degrees' in each.words else 1.0)
        if 'yaw' not in name:
            declared = this.declared * np.exp(1j * (this.theta - this.turned))
        for more, (words, now, of_this, of_before), (kept, share) in mistake_combinations(
                SINCE if is_local else AT,
                (('', is_local), (', without the declared pose', is_local - 1))):
            text = each.words + words + kept
            if wanted is None or text in wanted:
                value = now * each.value - of_this * first + share * declared
                value = value - of_before * old if of_before else value
                yield wrong + more, Quantity(
                    text, each.time, comparable(name, value), APART / SAME)


def comparable(name: str, value: np.ndarray) -> np.ndarray:
    """Numbers as they are compared: of a yaw on the unit circle, of a place its x or y."""
    if 'yaw' in name:
        return np.cos(value) + 1j * np.sin(value)       # faster than exp
    return np.imag(value) if name.endswith('y') and np.iscomplexobj(value) else np.real(value)


def unit_of(series: Series) -> float:
    """The unit of a yaw's numbers [rad]: numbers beyond a turn are degrees."""
    return np.pi / 180.0 if np.nan_to_num(np.abs(series.value)).max(initial=0.0) > 7.0 else 1.0


def part_with_control(node_run: NodeRun, part: Series, late: float = LATE) -> Series:
    """The part of a variable in which the node has had control for this time [s], by its own
    has_control, else by ctrl_relinq, which it may not have heard; without both all of it."""
    control, own = node_run.run.control, node_run.flag('has_control')
    time, value = (control.arrival, control.value) if own is None else (own.time, own.value)
    if not len(time):
        return part
    now, before = (np.searchsorted(time, part.time - each, 'right') - 1 for each in (0.0, late))
    return part.take((before >= 0) & (value[now] == 1.0) & (value[before] == 1.0))


def wrong_pose(node_run: NodeRun) -> Optional[BrokenLink]:
    """Is the local pose that of the sensors, since the reset, in the local frame? If not, is its
    reference that of the reset?"""
    for frame, name in product(node_run.cached(frames), USED):
        wrong = wrong_variable(node_run, frame, name)
        if wrong is not None:
            return next(filter(None, (wrong_variable(node_run, frame, each)
                                      for each in USED[name])), wrong)
    return None


def wrong_variable(node_run: NodeRun, frame: Frame, name: str) -> Optional[BrokenLink]:
    """The BrokenLink of a variable that does not follow the right quantity in a frame."""
    series, is_local = node_run.find(name), name in USED
    if series is None or np.isnan([frame.place, frame.theta, frame.yaw]).any():
        return None         # it is unknown
    value = comparable(name, series.value * (unit_of(series) if is_local else 1.0))
    rights = [each for _, each in islice(table(node_run, frame, name), 2)]
    # a node knows nothing of the frame before its first message in it
    first = rights[0].time[rights[0].time >= frame.begin][:1]
    part = part_with_control(node_run, Series(name, series.time, series.text, value).between(
        max(frame.begin, *first) + LATE, frame.end) if len(first) else series.take(slice(0, 0)))
    if np.isfinite(part.value).sum() < FEW or not len(rights[0].time) or matching_quantities(
            part, rights, MOST):
        return None
    right, moved = rights[0], np.nan_to_num(np.abs(
        part.value - part.value[0])).max(initial=0.0)
    words = ''
    if moved > 2.0 * APART or not is_local:
        words = followed_text(node_run, frame, name, part)
    words = words or late_text(part, right)
    if len(set(part.text)) == 1 and (is_local or frame.is_reset and (
            series.text_at(frame.begin - SOON) == part.text[0])):
        words = 'stayed ' + short(part.text[0])
    elif not is_local and 'followed' not in words:
        return None         # it has another meaning here
    should = right.value[np.searchsorted(right.time, part.time).clip(1) - 1]
    worst = int(np.argmax(np.nan_to_num(np.abs(part.value - should), nan=-1.0)))
    return BrokenLink('{}{} {}; it should be {}: it was {} when this was {:.3g}'.format(
        frame.words, series.name, words, right.words, short(part.text[worst]),
        np.angle(should[worst]) if 'yaw' in name else should[worst]),
            float(part.time[worst]), series.name)


def followed_text(node_run: NodeRun, frame: Frame, name: str, part: Series) -> str:
    """Words on the quantities with the fewest mistakes that a variable follows; '' if there is
    none."""
    some = part.take(np.linspace(0, len(part.time) - 1, 15).astype(int))
    likely = {each.words for each in matching_quantities(
        some, (each for _, each in table(node_run, frame, name, some.time)), 0.6)}
    mistakes = {id(each): (wrong, each) for wrong, each in table(
        node_run, frame, name, wanted=likely)}
    found = matching_quantities(part, [each for _, each in mistakes.values()], MOST)
    fewest = min((mistakes[id(each)][0] for each in found), default=0)
    texts = dict.fromkeys(each.words for each in found if mistakes[id(each)][0] == fewest)
    return 'followed ' + ', or '.join(list(texts)[:2]) if texts else ''


def late_text(part: Series, right: Quantity) -> str:
    """Words on a variable that follows the right quantity late, or not at all."""
    late = np.sort(ages(part, right._replace(scale=1.0), 60.0))[int(MOST * (len(part.time) - 1))]
    return f'came up to {late:.1f} s late' if late < np.inf else 'did not follow it'
