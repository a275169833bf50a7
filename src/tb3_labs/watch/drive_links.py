"""The chain of the Transformation lab: control -> state after a reset -> references -> local pose
-> goal -> command and end of each state -> silence.

A local frame begins at each start of the node and at each reset. Places are complex numbers here,
x + iy: a rotation is a product. "Own" numbers are those of the node's variables.
"""
import itertools
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.watch.chain import Broken, Inside, stays
from tb3_labs.watch.quantities import SAME, Quantity, ages, followed, headings
from tb3_labs.watch.turn_links import other_fields, short
from tb3_labs.watch.variables import Series

#: The handout's law: the states and their tolerances [rad], [m], the gain of each rotation [1/s],
#: the speed and the robot's limit [m/s].
STATES = ('ROTATE_TO_GOAL', 'MOVE_FORWARD', 'ROTATE_TO_FINAL', 'GOAL_REACHED')
TOLERANCES = {STATES[0]: 0.05, STATES[1]: 0.15, STATES[2]: 0.05}
GAINS, SPEED, FASTEST = {STATES[0]: 0.3, STATES[2]: 0.5}, 0.15, 0.22
#: A pose is right within APART [m], [rad], in the part MOST of at least FEW values.
APART, MOST, FEW = 0.03, 0.9, 10
#: A variable is read LATE after its cause, a change SOON after it; a longer pause between commands
#: is a mistake [s].
LATE, SOON, PAUSE = 0.4, 0.1, 0.45


class Frame(NamedTuple):
    """A local frame: when it begins and ends [s], the pose that was declared, the odometry's place
    and yaw and the IMU's yaw at its begin, whether a reset began it."""

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
        """The references at its begin: (as heard, with the declared pose taken off)."""
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
    begins = [(times[min(np.searchsorted(times, start), len(times) - 1)], 0j, 0.0, False)
              for start in run.starts or times[:1]]
    begins = sorted(begins + [(at, complex(x, y), yaw, True) for at, x, y, yaw in zip(
        run.resets.arrival, run.resets.x, run.resets.y, run.resets.yaw) if at > times[0]])
    found = []
    for (begin, *declared, is_reset), after in zip(begins, begins[1:] + [(run.duration + 1.0,)]):
        odometry, imu = (samples.take([min(np.searchsorted(samples.arrival, begin),
                                           len(samples) - 1)]) for samples in (run.odometry, run.imu))
        found.append(Frame(begin, after[0], *declared, complex(odometry.x[0], odometry.y[0]),
                           odometry.yaw[0], imu.yaw[0], is_reset))
    return found


def of_samples(inside: Inside, time: np.ndarray) -> Tuple[Frame, Frame]:
    """The frame of each sample and the one before, each as a Frame of arrays."""
    known = inside.known(frames)
    this = np.searchsorted([each.begin for each in known], time, 'right').clip(1) - 1
    before = this - np.array([each.is_reset and k > 0 for k, each in enumerate(known)])[this]
    return tuple(Frame(*(np.array(column)[index] for column in zip(*known)))   # type: ignore
                 for index in (this, before))


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
            for more, form, base, turn in itertools.product(kept, forms, bases, turns)]


def yaws(inside: Inside, part: Series) -> Iterator[Quantity]:
    """What a node may take for its local yaw while `part` was read, on the unit circle."""
    run, reference = inside.run, inside.find('initial_global_yaw')
    half, none = run.odometry.yaw / 2.0, 0.0 * run.odometry.yaw
    for of, at, quaternion in (
            ('', run.imu.arrival, (run.imu.w, run.imu.x, run.imu.y, run.imu.z)),
            (' of the odometry', run.odometry.arrival, (np.cos(half), none, none, np.sin(half)))):
        some = slice(*np.searchsorted(at, (part.time[0] - 1.0, part.time[-1] + SOON)))
        this, before = of_samples(inside, at[some])
        first, old = (np.searchsorted(at, each.begin).clip(0, len(at) - 1) for each in (this, before))
        own = 0.0 if reference is None else reference.value[(np.searchsorted(
            reference.time, at[some], 'right') - 1).clip(0)]
        for each in headings(at, quaternion, of):
            if 'its number' in each.words or each.per_degree and (
                    ', from -180 to 180' not in each.words):
                continue        # the same on the circle
            unit = 180.0 / np.pi if ' in degrees' in each.words else 1.0
            for said, base in ((' since the reset', each.value[first]),
                               (' since the reset before', each.value[old]),
                               (', not from the reset on', 0.0), (', minus initial_global_yaw', own)):
                for more, turned in (('', this.turned), (', without the declared yaw', 0.0)):
                    words = each.words.replace(', from -180 to 180', '').replace(' in radians', '')
                    yield Quantity(words + said + more, at[some], np.exp(
                        1j * (each.value[some] - base + turned * unit)), APART / SAME)


def steered(inside: Inside, series: Series, begin: float, end: float) -> Series:
    """The part of a variable in [begin, end) in which the node has had control for LATE; without
    ctrl_relinq all of it."""
    control, part = inside.run.control, series.between(begin + LATE, end)
    if not len(control):
        return part
    now, before = (np.searchsorted(control.arrival, part.time - late, 'right') - 1
                   for late in (0.0, LATE))
    chosen = (now >= 0) & (now == before) & (control.value[now] == 1.0)
    return part.take(chosen)


def rights(inside: Inside) -> Dict[str, Quantity]:
    """The right local pose; on the circle that of local_yaw."""
    samples, place = inside.run.imu, inside.known(places)[0]
    this, _ = of_samples(inside, samples.arrival)
    return {'local_yaw': Quantity('', samples.arrival, np.exp(1j * (
        samples.yaw - this.yaw + this.turned)), APART / SAME),
        'local_x': place._replace(value=place.value.real),
        'local_y': place._replace(value=place.value.imag)}


def in_degrees(inside: Inside) -> bool:
    """Is the own local_yaw in degrees?"""
    series = inside.find('local_yaw')
    return bool(followed(on_circle(series, np.pi / 180.0), [inside.known(rights)['local_yaw']],
                         MOST)) and not followed(
        on_circle(series, 1.0), [inside.known(rights)['local_yaw']], MOST)


def on_circle(series: Series, unit: float) -> Series:
    """A variable for an angle as numbers on the unit circle."""
    return Series(series.name, series.time, series.text, np.exp(1j * unit * series.value))


def wrong_pose(inside: Inside) -> Optional[Broken]:
    """Is the local pose that of the sensors, since the reset, in the local frame? If not, is its
    reference that of the moment of the reset?"""
    for frame, (name, references) in itertools.product(inside.known(frames), (
            ('local_yaw', ('initial_global_yaw',)),
            ('local_x', ('initial_global_x', 'initial_odom_yaw')),
            ('local_y', ('initial_global_y', 'initial_odom_yaw')))):
        series = inside.find(name)
        if series is None or not np.isfinite(series.value).any():
            continue
        part, right = steered(inside, series, frame.begin, frame.end), inside.known(rights)[name]
        same = [on_circle(part, unit) for unit in (1.0, np.pi / 180.0)] if name == 'local_yaw' \
            else [part]
        is_wrong = len(part.time) >= FEW and not any(followed(each, [right], MOST) for each in same)
        kept = [wrong_reference(inside, frame, each, is_wrong) for each in references]
        found = next(filter(None, kept), None)
        if found or is_wrong:
            return found or wrong_belief(inside, frame, part, same[0], right)
    return None


def wrong_reference(inside: Inside, frame: Frame, name: str, is_used: bool) -> Optional[Broken]:
    """Is a reference set at the begin of a frame, and then kept? `is_used`: the pose is wrong."""
    series = inside.find(name)
    part = series and steered(inside, series, frame.begin, frame.end)
    if series is None or len(part.time) < FEW:
        return None
    asked, of = frame.references[name], 'IMU' if name == 'initial_global_yaw' else 'odometry'
    before = max((each for each in inside.known(frames) if each.begin < frame.begin),
                 default=frame).references[name]
    apart = [np.abs(np.exp(1j * part.value) - np.exp(1j * each)) if 'yaw' in name
             else np.abs(part.value - each) for each in asked]
    value = part.value[-1]
    words = 'became ' + short(part.text[-1])
    if set(part.text) == {'None'}:
        words = 'stayed None'
    elif not is_used or min(map(np.median, apart)) <= APART:
        return None
    elif len(set(part.text)) > 5:
        words = 'went on changing, and ' + words
    elif abs(asked[0] - before[0]) > APART and series.text_at(frame.begin - SOON) == part.text[-1]:
        words = 'stayed ' + short(part.text[-1])
    else:
        same = [each.words for each in (inside.imu + inside.odometry if 'yaw' in name else [])
                if abs(each.value[np.searchsorted(each.time, frame.begin).clip(
                    0, len(each.time) - 1)] - value) < 10.0 * SAME * each.scale]
        if not same:
            return None
        words += ', as ' + min(same, key=lambda each: ('yaw' not in each) + (
            'order' in each and 'x, y, z, w' not in each))
    return Broken('{}{} {}; it should be {:.3g} ({})'.format(
        frame.words, series.name, words, asked[0], of), float(part.time[0]), series.name)


def wrong_belief(inside: Inside, frame: Frame, part: Series, same: Series,
                 right: Quantity) -> Broken:
    """What a variable of the local pose follows in a frame in which it is not right; `same`: the
    variable as it is compared."""
    samples = np.searchsorted(right.time, part.time).clip(1, len(right.time)) - 1
    worst = int(np.nanargmax(np.abs(same.value - right.value[samples])))
    should, is_yaw = right.value[samples[worst]], same is not part
    table = yaws(inside, part) if is_yaw else (each._replace(
        value=each.value.imag if part.name.endswith('y') else each.value.real)
        for each in inside.known(places))
    some = same.take(np.linspace(0, len(same.time) - 1, 15).astype(int))
    is_kept = any(inside.find(each) is None for each in frame.references)
    found = [each for each in table if (is_kept or 'reset before' not in each.words) and followed(
        some, [each], 0.6) and followed(same, [each], MOST)] if np.ptp(part.value) > 2 * APART else []
    marks = [each.words.replace('x, y, z, w', '').count(',') + (
        is_yaw and ('yaw' not in each.words) + ('odometry' in each.words)) for each in found]
    found = [each for each, mark in zip(found, marks) if mark == min(marks)]
    late = np.sort(ages(same, right._replace(scale=1.0), 60.0))[int(MOST * (len(same.time) - 1))]
    if len(set(part.text)) == 1:
        words = 'stayed ' + short(part.text[-1])
    elif found:
        words = 'followed ' + ', or '.join(dict.fromkeys(each.words for each in found[:2]))
    else:
        words = 'came up to {:.1f} s late'.format(late) if late < np.inf else 'did not follow it'
    return Broken('{}{} {}; it should be {}: it was {:.3g} when this was {:.3g}'.format(
        frame.words, part.name, words, 'the yaw of the IMU since the reset' if is_yaw else
        inside.known(places)[0].words, part.value[worst], np.angle(should) if is_yaw else should),
        float(part.time[worst]), part.name)


def wrong_control(inside: Inside) -> Optional[Broken]:
    """Does has_control follow ctrl_relinq?"""
    series = inside.find('has_control')
    for begin, end, value in given(inside) if series is not None else []:
        part = series.between(begin + LATE, end)
        if np.mean(np.append(np.abs(part.value - value) == 1.0, [0.0] * 4)) > 0.5:
            return Broken('{:.1f} s after a {} on ctrl_relinq {} was {}'.format(
                part.time[-1] - begin, bool(value), series.name, part.text[-1]),
                float(part.time[0]), series.name)
    return None


def given(inside: Inside) -> Iterator[Tuple[float, float, float]]:
    """(from, until, value) of each message on ctrl_relinq."""
    control = inside.run.control
    return zip(control.arrival, np.append(control.arrival[1:], inside.run.duration), control.value)


def drives_without(inside: Inside) -> Optional[Broken]:
    """Does a node without control command anything but a zero?"""
    sent = inside.run.commands
    moving = (sent.linear != 0.0) | (sent.angular != 0.0)
    for begin, end, value in given(inside):
        near = (sent.arrival > begin - SOON / 5.0) & (sent.arrival < begin + LATE)
        if value or end < begin + LATE:
            continue
        late = np.flatnonzero((sent.arrival > begin + LATE) & (sent.arrival < end) & moving)
        last = np.flatnonzero((sent.arrival < begin + LATE) & (sent.arrival > begin - 1.0))[-1:]
        for k in [*late[2:3], *([] if (near & ~moving).any() else last[moving[last]])]:
            return Broken('ctrl_relinq became False, and {} linear.x {:.2f}, angular.z {:.2f}'.format(
                'the last command was' if len(late) < 3 else '{:.1f} s later a command was'.format(
                    sent.arrival[k] - begin), sent.linear[k], sent.angular[k]),
                float(sent.arrival[k]))
    return None


def state_kept(inside: Inside) -> Optional[Broken]:
    """Is the state set back by a reset?"""
    series = inside.find('state')
    for frame in inside.known(frames):
        part = series and series.between(frame.begin + LATE, frame.end)
        if frame.is_reset and series is not None and len(part.text) and (
                series.text_at(frame.begin - SOON) == part.text[0] in STATES[1:]) and (
                not has_pose(inside) or left_of(inside, STATES[0], *own_pose(
                    inside, part.time[:1])) > TOLERANCES[STATES[0]] + APART):
            return Broken('{}{} stayed {}; it should be {}'.format(
                frame.words, series.name, part.text[0], STATES[0]), frame.begin, series.name)
    return None


def goal_of(inside: Inside) -> List[float]:
    """The own goal, else the one that was asked for: x, y [m], yaw."""
    asked = inside.run.goals
    return [column[0] if series is None or not np.isfinite(series.value[-1]) else series.value[-1]
            for series, column in zip(map(inside.find, ('goal_x', 'goal_y', 'goal_yaw')), (
                (asked.x, asked.y, asked.yaw) if len(asked) else ([-0.61], [0.61], [0.0])))]


def wrong_goal(inside: Inside) -> Optional[Broken]:
    """Is the own goal the one that was asked for? A yaw may be in degrees."""
    for name, own, asked in zip(('goal_x', 'goal_y', 'goal_yaw'), goal_of(inside), (
            inside.run.goals.x, inside.run.goals.y, inside.run.goals.yaw)):
        series = inside.find(name)
        if series is not None and stays(series) and len(asked) and abs(own - asked[0]) > 1e-3 and (
                'yaw' not in name or abs(own - np.degrees(asked[0])) > 0.1):
            return Broken('{} is {}; it should be {:g}'.format(
                series.name, short(series.text[-1]), asked[0]), float(series.time[0]), series.name)
    return None


class Part(NamedTuple):
    """The time in one state: from `begin` to `end` [s], the state after it, '' if control or the
    frame ended. Of each command its time, linear.x, angular.z, the own vector to the goal
    (complex), the own yaw."""

    state: str
    begin: float
    end: float
    after: str
    time: np.ndarray
    linear: np.ndarray
    angular: np.ndarray
    away: np.ndarray
    yaw: np.ndarray


def own_pose(inside: Inside, time: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """(vector to the goal, yaw [rad]) by the node's own variables at each time."""
    x, y, yaw = (np.interp(time, each.time, each.value)
                 for each in map(inside.find, ('local_x', 'local_y', 'local_yaw')))
    return (complex(*goal_of(inside)[:2]) - x - 1j * y,
            np.radians(yaw) if inside.known(in_degrees) else yaw)


def has_pose(inside: Inside) -> bool:
    """Does the node have the handout's variables for its pose?"""
    return all(each is not None and bool(np.isfinite(each.value).any())
               for each in map(inside.find, ('local_x', 'local_y', 'local_yaw')))


def parts(inside: Inside) -> List[Part]:
    """The Parts of a run, in their order; [] if the node does not have the handout's variables."""
    series, found = inside.find('state'), []
    if series is None or not set(series.text) & set(STATES) or not has_pose(inside):
        return []
    sent, control = inside.run.commands, inside.run.control
    cuts = [each.begin for each in inside.known(frames)] + list(control.arrival)
    edges = np.unique([*series.changes, *cuts, inside.run.duration])
    for begin, end in zip(edges[:-1], edges[1:]):
        part = series.between(begin, end)
        before = np.searchsorted(control.arrival, begin + 0.01) - 1
        if len(part.text) and (not len(control) or before >= 0 and control.value[before]):
            at = (sent.arrival > begin) & (sent.arrival < end - SOON)
            is_change = end in series.changes and np.abs(np.subtract(cuts, end)).min() > SOON
            found.append(Part(
                str(part.text[-1]), begin, part.time[-1], series.text_at(end) if is_change else '',
                sent.arrival[at], sent.linear[at], sent.angular[at],
                *own_pose(inside, sent.arrival[at])))
    return found


def left_of(inside: Inside, state: str, away: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """The heading error of a rotation [rad], or the distance to the goal [m], by own numbers."""
    goal = goal_of(inside)[2] * (np.pi / 180.0 if inside.known(in_degrees) else 1.0)
    return np.abs(away) if state == STATES[1] else np.abs(wrap_all(
        (np.angle(away) if state == STATES[0] else goal) - yaw))


def forms(inside: Inside, part: Part) -> Iterator[Tuple[str, np.ndarray]]:
    """(words, angle) of what a node may take for the heading error; the first is right."""
    run, goal, (dx, dy) = inside.run, goal_of(inside), (part.away.real, part.away.imag)
    none = 0.0 * dx
    targets = [('atan2(dy, dx)', np.arctan2(dy, dx)), ('goal_yaw', none + goal[2])]
    targets = targets[::1 if part.state == STATES[0] else -1] + [
        ('atan2(dx, dy)', np.arctan2(dx, dy)), ('atan2(-dy, -dx)', np.arctan2(-dy, -dx)),
        ('atan2(goal_y, goal_x)', none + np.arctan2(goal[1], goal[0])),
        ('atan(dy / dx)', np.arctan(dy / dx)), ('0', none)]
    own = [('local_yaw', part.yaw)] + [('the yaw of the ' + name, samples.yaw[(np.searchsorted(
        samples.arrival, part.time) - 1).clip(0)]) for name, samples in (
            ('IMU', run.imu), ('odometry', run.odometry))] + [
                ('0', none), ('-local_yaw', -part.yaw), ('local_yaw in degrees', np.degrees(part.yaw))]
    for (target, angle), (heading, yaw) in itertools.product(targets, own):
        for more, value in (('', wrap_all(angle - yaw)), (', not normalized', angle - yaw)):
            yield '{} - {}{}'.format(target, heading, more), value


def law(inside: Inside, part: Part) -> Optional[Tuple[str, float]]:
    """(words, gain) of the heading error that the commands of a rotation follow; None: of none."""
    for is_own, (words, value) in itertools.product((False, True), list(forms(inside, part))):
        inner = (np.abs(value) < 3.0) | ('not' in words)     # where it jumps, both are right
        command, value = part.angular[inner], value[inner]
        moves = command != 0.0
        if moves.sum() < 5 or is_own and np.ptp(command[moves]) < 0.1:
            continue
        gain = GAINS[part.state]
        free = [np.median(command[moves] / np.where(value == 0.0, np.inf, value)[moves])]
        for factor in free if is_own else (gain, -gain):
            if np.mean(np.abs(command - factor * value)[moves] < 0.01 + 0.03 * np.abs(
                    factor * value[moves])) >= MOST:
                return words, float(factor)
    return None


def wrong_law(inside: Inside) -> Optional[Broken]:
    """In each state: have the commands the side and the size of the law, and does it end at its
    tolerance, with the next one?"""
    return next(filter(None, (check(inside, part) for part in inside.known(parts)
                              for check in (wrong_command, wrong_end))), None)


def wrong_command(inside: Inside, part: Part) -> Optional[Broken]:
    """Is a command of a state wrong?"""
    if part.state not in TOLERANCES or part.end - part.begin < 1.0:
        return None
    if not len(part.time):
        return Broken('in {} no command came for {:.1f} s'.format(
            part.state, part.end - part.begin), part.begin)
    if part.state == STATES[1]:
        speed = float(np.median(part.linear))
        return None if 0.0 < speed <= FASTEST + 0.01 else Broken(
            'in {} linear.x was {:.2f}, by the handout it is {:g}{}'.format(
                part.state, speed, SPEED, '' if speed else inside.known(other_fields)),
            part.begin, 'linear.x')
    found, (right, left) = law(inside, part), next(forms(inside, part))
    clear = (np.abs(left) > 2.0 * TOLERANCES[part.state]) & (np.abs(left) < 3.0)
    wrong = np.flatnonzero(clear & (part.angular * left < 0.0))
    if clear.sum() > 3 and not part.angular.any():
        return Broken('in {} angular.z stayed 0 for an error of {:+.2f} rad{}'.format(
            part.state, left[-1], inside.known(other_fields)), part.begin, 'angular.z')
    if found and (found[0] != right or found[1] < 0.0):
        return Broken('in {} angular.z was {:.2g} x ({}); by the handout it is {:g} x ({})'.format(
            part.state, found[1], found[0], GAINS[part.state], right), part.begin, 'angular.z')
    return None if len(wrong) < 3 else Broken(
        'in {} for an error of {:+.2f} rad angular.z was {:+.2f}'.format(
            part.state, left[wrong[0]], part.angular[wrong[0]]), part.time[wrong[0]], 'angular.z')


def wrong_end(inside: Inside, part: Part) -> Optional[Broken]:
    """Does a state end at its tolerance, and is the next one the handout's?"""
    if part.state not in TOLERANCES:
        return None if part.state in STATES else Broken('state became {}, which is none of {}'.format(
            part.state, ', '.join(STATES)), part.begin, 'state')
    at = np.append(np.arange(part.begin, part.end, 0.05), part.end)
    pose = own_pose(inside, at)
    left = left_of(inside, part.state, *pose)
    tolerance, after = TOLERANCES[part.state], STATES[STATES.index(part.state) + 1]
    said = 'a distance of {:.2f} m; {:g}' if part.state == STATES[1] else \
        'a heading error of {:.2f} rad; {:g}'
    said += ' is the tolerance'
    near = np.flatnonzero(left < tolerance)
    if part.after in STATES[STATES.index(after) + 1:]:      # else it was read too seldom
        skipped = left_of(inside, after, *pose)[-1]
        if after != STATES[3] and skipped > TOLERANCES[after] + APART:
            return Broken('state went from {} to {} at {:.2f} from the end of {}, which was '
                          'skipped'.format(part.state, part.after, skipped, after), part.end, 'state')
    if part.after and left[-1] > tolerance + APART:
        return Broken('state went from {} to {} at {}'.format(
            part.state, after, said.format(left[-1], tolerance)), part.end, 'state')
    if not part.after and len(near) and part.end - at[near[0]] > 1.0 and (
            left[near[0]:].max() > tolerance + APART
            or not part.angular[part.time > at[near[0]] + LATE].any()):
        return Broken('state stayed {} at {}'.format(part.state, said.format(
            left[near[-1]], tolerance)), float(at[near[-1]]), 'state')
    return None


def wrong_silence(inside: Inside) -> Optional[Broken]:
    """At the goal: is the last command a zero, and does none follow?"""
    sent = inside.run.commands
    for part in inside.known(parts):
        last = np.flatnonzero(sent.arrival < part.begin + LATE)[-1:]
        later = ((sent.arrival > part.begin + LATE) & (sent.arrival < part.end)).sum()
        if part.state == STATES[3] and (later > 3 or (sent.linear[last] != 0.0).any()
                                        or (sent.angular[last] != 0.0).any()):
            return Broken('state became {}, and {}'.format(
                part.state, '{} commands came after that'.format(later) if later > 3 else
                'the last command was linear.x {:.2f}, angular.z {:.2f}: no zero followed'.format(
                    sent.linear[last[0]], sent.angular[last[0]])), part.begin)
    return None


def slow_law(inside: Inside) -> Optional[Broken]:
    """Are gains and speed those of the handout, ten times a second?"""
    for part in inside.known(parts):
        if len(part.time) < 4 or part.state not in TOLERANCES:
            continue
        pause, found = float(np.median(np.diff(part.time))), None
        if pause > PAUSE:
            return Broken('commands came every {:.1f} s; the handout has ten a second'.format(
                pause), part.begin)
        asked = GAINS.get(part.state, SPEED)
        if part.state in GAINS:
            found = law(inside, part)
        own = float(np.median(part.linear)) if part.state == STATES[1] else \
            found[1] if found else asked
        if abs(own - asked) > 0.05 * asked:
            return Broken('in {} {} {:.2g}, by the handout it is {:g}'.format(
                part.state, 'linear.x was' if part.state == STATES[1] else
                'angular.z was the error times', own, asked), part.begin, is_weak=True)
    return None
