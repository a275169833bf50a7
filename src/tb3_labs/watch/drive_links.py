"""The chain of the Transformation lab: references -> local pose -> control -> goal -> command and
state -> silence.

Places are complex numbers here, x + iy; a rotation is a product.
"""
import itertools
from typing import Iterator, List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.watch.chain import Broken, Inside, stays
from tb3_labs.watch.quantities import SAME, Quantity, ages, followed, thinned
from tb3_labs.watch.turn_links import other_fields, short
from tb3_labs.watch.variables import Series

#: The handout's law: the states and the gain of each rotation [1/s], speed and the robot's limits
#: [m/s], [rad/s], tolerances [m], [rad], the goal.
STATES = ('ROTATE_TO_GOAL', 'MOVE_FORWARD', 'ROTATE_TO_FINAL', 'GOAL_REACHED')
GAINS, SPEED, FASTEST, FASTEST_TURN = {STATES[0]: 0.3, STATES[2]: 0.5}, 0.15, 0.22, 2.84
DISTANCE, ANGLE, GOAL = 0.15, 0.05, (-0.61, 0.61, 0.0)
#: A pose is right within APART [m], [rad], in the part MOST of its values.
APART, MOST = 0.03, 0.9
#: A variable may be read LATE after its cause [s], a change SOON after it; commands come at least every PAUSE [s].
LATE, SOON, PAUSE = 0.4, 0.1, 0.45


class Frame(NamedTuple):
    """A local frame: when it begins and ends [s], the pose that was declared, the odometry's place
    and yaw and the IMU's yaw at its begin."""

    begin: float
    end: float
    declared: complex
    turned: float
    place: complex
    theta: float
    yaw: float
    is_reset: bool

    @property
    def words(self) -> str:
        return 'after the reset at {:.0f} s '.format(self.begin) if self.is_reset else ''


def frames(inside: Inside) -> List[Frame]:
    """The frames that begin at each start of the node and at each reset."""
    run, times = inside.run, next(iter(inside.variables.values())).time
    begins = [(float(times[min(np.searchsorted(times, start), len(times) - 1)]), 0j, 0.0, False)
              for start in run.starts or times[:1]]
    begins = sorted(begins + [(float(at), complex(x, y), float(yaw), True) for at, x, y, yaw in zip(
        run.resets.arrival, run.resets.x, run.resets.y, run.resets.yaw) if at > times[0]])
    found = []
    for (begin, declared, turned, is_reset), end in zip(
            begins, [each[0] for each in begins[1:]] + [run.duration + 1.0]):
        here, now = (min(int(np.searchsorted(samples.arrival, begin)), len(samples) - 1)
                     for samples in (run.odometry, run.imu))
        found.append(Frame(begin, end, declared, turned, complex(
            run.odometry.x[here], run.odometry.y[here]), float(run.odometry.yaw[here]),
            float(run.imu.yaw[now]), is_reset))
    return found


def of_samples(inside: Inside, time: np.ndarray) -> Tuple[Frame, Frame]:
    """The frame of each sample, and the frame before it, as a Frame of arrays."""
    known = inside.known(frames)
    this = np.searchsorted([each.begin for each in known], time, 'right').clip(1) - 1
    before = np.where(np.array([each.is_reset for each in known])[this], (this - 1).clip(0), this)
    return (Frame(*np.array(known, dtype=object)[this].T),
            Frame(*np.array(known, dtype=object)[before].T))


def places(inside: Inside) -> List[Tuple[int, str, np.ndarray]]:
    """(number of mistakes, words, places) that a node may take for its local place."""
    samples = inside.run.odometry
    this, before = of_samples(inside, samples.arrival)
    here = samples.x + 1j * samples.y
    real = lambda values: np.array(values, dtype=float)     # noqa: E731
    theta = real(this.theta) - real(this.turned)
    imu = real(this.yaw) - real(this.turned)
    now = samples.yaw
    bases = (('since the reset', here - this.place), ('since the reset before', here - before.place),
             ('of the odometry, not displaced', here))
    turns = (('rotated into the local frame', -theta), ('rotated by R in place of its inverse', theta),
             ('not rotated into the local frame', 0.0 * theta),
             ('rotated by the inverse with the yaw of the IMU', -imu),
             ('rotated by R with the yaw of the IMU', imu),
             ('rotated by the present yaw', -now), ('rotated by R with the present yaw', now),
             ('rotated by the present local yaw', theta - now),
             ('rotated by the yaw of the reset before', real(before.turned) - real(before.theta)),
             ('rotated without the declared yaw', -real(this.theta)),
             ('rotated with the angle in degrees', -np.degrees(theta)))
    kept = (('', this.declared), (', without the declared place', 0j))
    forms = (('', lambda z: z), ('x and y swapped: ', lambda z: z.imag + 1j * z.real),
             ('with the other sign: ', lambda z: -z))
    return sorted(((sum(map(bool, which)), '{}{} {}, {}{}'.format(
        forms[which[0]][0], 'the position' if which[1] == 2 else 'the displacement',
        bases[which[1]][0], turns[which[2]][0], kept[which[3]][0]),
        forms[which[0]][1]((bases[which[1]][1] * np.exp(1j * turns[which[2]][1])
                            + kept[which[3]][1]).astype(complex)))
        for which in itertools.product(*(range(len(each)) for each in (forms, bases, turns, kept)))),
        key=lambda each: each[0])


def yaws(inside: Inside) -> List[Quantity]:
    """What a node may take for its local yaw, as numbers on the unit circle; the first is right."""
    found = []
    for quantities in (inside.imu, inside.odometry):
        at = quantities[0].time
        this, before = of_samples(inside, at)
        first, old = (np.searchsorted(at, each.begin.astype(float)).clip(0, len(at) - 1)
                      for each in (this, before))
        turned = this.turned.astype(float)
        for each, (mistakes, said, base), lost in itertools.product(quantities, (
                (0, ' since the reset', first), (1, ' since the reset before', old),
                (1, ', not from the reset on', None)), (0, 1)):
            value = each.value - (0.0 if base is None else each.value[base])
            unit = each.per_degree * 180.0 / np.pi if each.per_degree > 0.0 else 1.0
            found.append((
                mistakes + lost + (quantities[0] is not each) + 2 * ('odometry' in each.words),
                Quantity(each.words + said + ', without the declared yaw' * lost, at,
                         np.exp(1j * (value + (0.0 if lost else turned * unit))), 1.0)))
    return [each for _, each in sorted(found, key=lambda each: each[0])]


def right_yaws(inside: Inside) -> List[Quantity]:
    """The local yaw that the IMU has, in radians and in degrees."""
    samples = inside.run.imu
    this, _ = of_samples(inside, samples.arrival)
    yaw = wrap_all((samples.yaw - this.yaw + this.turned).astype(float))
    return [Quantity('the yaw since the reset', samples.arrival, yaw, 1.0),
            Quantity('the yaw since the reset in degrees', samples.arrival, np.degrees(yaw), 1.0)]


def steered(inside: Inside, series: Series, begin: float, end: float) -> Series:
    """The part of a variable in [begin, end) in which the node has had control for LATE, all of it
    if control was not recorded."""
    control, part = inside.run.control, series.between(begin + LATE, end)
    if not len(control):
        return part
    now, before = (np.searchsorted(control.arrival, part.time - late, 'right') - 1
                   for late in (0.0, LATE))
    chosen = (now >= 0) & (now == before) & (control.value[now] == 1.0)
    return Series(series.name, part.time[chosen], part.text[chosen], part.value[chosen])


def follows(part: Series, quantities: List[Quantity]) -> List[Quantity]:
    """The quantities that a part follows within APART."""
    return followed(part, [each._replace(scale=APART / SAME) for each in quantities], MOST)


class Belief(NamedTuple):
    """A variable for a part of the local pose; its number in radians or metres is `factor` times
    the variable. `wrong`: the frame in which it is not right, and what is wrong."""

    series: Series
    factor: float
    wrong: Optional[Tuple[Frame, Broken]]


def pose(inside: Inside) -> Optional[List[Belief]]:
    """Beliefs of local_yaw, local_x and local_y; None if one is missing."""
    rights, found = inside.known(right_yaws), []
    xy = inside.known(places)[0][2]
    at = inside.run.odometry.arrival
    asked = {'local_yaw': rights, 'local_x': [Quantity('', at, xy.real, 1.0)],
             'local_y': [Quantity('', at, xy.imag, 1.0)]}
    for name, quantities in asked.items():
        series = inside.find(name)
        if series is None or not np.isfinite(series.value).any():
            return None
        factor, wrong = 1.0, None
        for frame in inside.known(frames):
            part = steered(inside, series, frame.begin, frame.end)
            if len(thinned(part).time) < 10:
                continue
            fits = [on_circle(part, each) if name == 'local_yaw' else follows(part, [each])
                    for each in quantities]
            if not any(fits):
                wrong = frame, wrong_belief(inside, part, quantities[0], frame)
                break
            factor = 1.0 if fits[0] else np.pi / 180.0
        found.append(Belief(series, factor, wrong))
    return found


def on_circle(part: Series, right: Quantity) -> List[Quantity]:
    """Does a part follow an angle, in any range?"""
    unit = np.pi / 180.0 if 'degrees' in right.words else 1.0
    return follows(Series(part.name, part.time, part.text, np.exp(1j * unit * part.value)),
                   [right._replace(value=np.exp(1j * unit * right.value))])


def wrong_belief(inside: Inside, part: Series, right: Quantity, frame: Frame) -> Broken:
    """What a variable for a part of the local pose follows in a frame in which it is not right."""
    name, is_yaw = part.name, bool(right.words)
    samples = np.searchsorted(right.time, part.time).clip(1, len(right.time)) - 1
    apart = np.abs(part.value - right.value[samples])
    worst = int(np.nanargmax(apart))
    numbers = 'it was {:.3g} when it should be {:.3g}'.format(
        part.value[worst], right.value[samples[worst]])
    asked = 'it should be {}, {}'.format(
        'the yaw of the IMU' if is_yaw else 'the displacement in the odometry',
        'counted from the reset' if is_yaw else 'rotated into the local frame')
    late = np.sort(ages(thinned(part), right._replace(scale=APART / SAME), 60.0))
    late = late[int(MOST * (len(late) - 1))]
    if is_yaw:
        table = inside.known(yaws)
        part = Series(name, part.time, part.text, np.exp(1j * part.value))
    else:
        axis = 'x' if name.lower().endswith('x') else 'y'
        table = [Quantity(words, right.time, z.real if axis == 'x' else z.imag, 1.0)
                 for _, words, z in inside.known(places)]
    found = follows(part, table)
    if stays(part):
        words = 'stayed {}'.format(short(part.text[-1]))
    elif found:
        words = 'followed {}'.format(found[0].words)
    elif late < np.inf:
        words = 'came up to {:.1f} s late'.format(late)
    else:
        words = 'did not follow it'
    return Broken('{}{} {}; {}: {}'.format(frame.words, name, words, asked, numbers),
                  float(part.time[worst]), name)


def wrong_reference(inside: Inside) -> Optional[Broken]:
    """Are the references those of the moment of the start or of the reset, if the pose is wrong?"""
    beliefs = inside.known(pose)
    for frame in inside.known(frames):
        wrong = [beliefs is not None and belief.wrong is not None and belief.wrong[0] is frame
                 for belief in beliefs or [None] * 3]
        offset = frame.theta - frame.turned
        folded = frame.place - frame.declared * np.exp(1j * offset)
        for name, is_wrong, rights in (
                ('initial_global_yaw', wrong[0], (frame.yaw, frame.yaw - frame.turned)),
                ('initial_odom_yaw', wrong[1] or wrong[2], (frame.theta, offset)),
                ('initial_global_x', wrong[1], (frame.place.real, folded.real)),
                ('initial_global_y', wrong[2], (frame.place.imag, folded.imag))):
            series = inside.find(name)
            part = series and steered(inside, series, frame.begin, frame.end)
            if series is None or len(part.time) < 10:
                continue
            of = 'IMU' if name == 'initial_global_yaw' else 'odometry'
            asked = '{:.3g} ({})'.format(rights[0], of)
            if set(part.text) == {'None'}:
                return Broken('{}{} stayed None; it should be {}'.format(
                    frame.words, name, asked), float(part.time[0]), name)
            apart = np.min([np.abs(wrap_all(part.value - each) if 'yaw' in name
                                   else part.value - each) for each in rights], axis=0)
            if is_wrong and np.nanmedian(apart) > APART:
                before = series.text_at(frame.begin - 0.1)
                words = 'went on changing, and became' if len(set(part.text)) > 5 else \
                    'stayed' if before == part.text[-1] else 'became'
                return Broken('{}{} {} {}; it should be {}'.format(
                    frame.words, name, words, short(part.text[-1]), asked),
                    float(part.time[0]), name)
    return None


def wrong_pose(inside: Inside) -> Optional[Broken]:
    """Is the local pose that of the sensors, since the reset, in the local frame?"""
    wrong = [each.wrong for each in inside.known(pose) or [] if each.wrong]
    if not wrong:
        return None
    frame, first = min(wrong, key=lambda each: each[0].begin)
    return first


def wrong_control(inside: Inside) -> Optional[Broken]:
    """Does has_control follow ctrl_relinq, and does nothing drive without it?"""
    control, series = inside.run.control, inside.find('has_control')
    sent = inside.run.commands
    ends = np.append(control.arrival[1:], inside.run.duration)
    for begin, end, value in zip(control.arrival, ends, control.value):
        part = series and series.between(begin + LATE, end)
        if part is not None and (np.abs(part.value - value) == 1.0).sum() > 4 and (
                np.abs(part.value - value) == 1.0).mean() > 0.5:
            return Broken('{:.1f} s after a {} on ctrl_relinq {} was {}'.format(
                float(part.time[-1]) - begin, bool(value), series.name, part.text[-1]),
                float(part.time[0]), series.name)
        late = (sent.arrival > begin + LATE) & (sent.arrival < end)
        moving = late & ((sent.linear != 0.0) | (sent.angular != 0.0))
        if not value and moving.sum() > 2:
            k = int(np.flatnonzero(moving)[0])
            return Broken('{:.1f} s after a False on ctrl_relinq linear.x {:.2f}, angular.z {:.2f} '
                          'were commanded'.format(sent.arrival[k] - begin, sent.linear[k],
                                                  sent.angular[k]), float(sent.arrival[k]))
        last = np.flatnonzero(sent.arrival < begin + LATE)[-1:]
        if not value and end > begin + LATE and len(last) and begin - sent.arrival[last[0]] < 1.0 and (
                sent.linear[last[0]] or sent.angular[last[0]]):
            return Broken('no zero followed the last command, linear.x {:.2f}, angular.z {:.2f}, '
                          'when ctrl_relinq became False'.format(
                              sent.linear[last[0]], sent.angular[last[0]]), float(begin))
    return None


def goal_of(inside: Inside) -> List[float]:
    """The node's own goal, else the handout's: x, y [m], yaw [rad]."""
    own = [inside.find(name) for name in ('goal_x', 'goal_y', 'goal_yaw')]
    return [GOAL[k] if each is None or not np.isfinite(each.value[-1]) else float(each.value[-1])
            for k, each in enumerate(own)]


def wrong_goal(inside: Inside) -> Optional[Broken]:
    """Is the node's goal the one that was asked for? A yaw may be in degrees."""
    goals = inside.run.goals
    for name, own, asked in zip(('goal_x', 'goal_y', 'goal_yaw'), goal_of(inside), (
            goals.x, goals.y, goals.yaw)):
        series = inside.find(name)
        if series is not None and stays(series) and len(asked) and np.abs(
                [own - asked[0], own - np.degrees(asked[0]) * (name == 'goal_yaw')]).min() > 1e-3:
            return Broken('{} is {}, it should be {:g}'.format(series.name, short(series.text[-1]),
                          asked[0]), float(series.time[0]), series.name)
    return None


class Part(NamedTuple):
    """A node's time in one state: from `begin` to `end` [s], the state after it, '' if control or
    the frame ended. Of each command: its time, linear.x, angular.z, the vector to the goal
    (complex) and the yaw by the node's own variables. `left`: what is left of the way at the end,
    a heading error [rad] or a distance [m]."""

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
    """(vector to the goal, yaw) by the node's own variables at each time."""
    yaw, x, y = (np.interp(time, each.series.time, np.unwrap(each.series.value * each.factor)
                           if k == 0 else each.series.value)
                 for k, each in enumerate(inside.known(pose)))
    return complex(*goal_of(inside)[:2]) - x - 1j * y, wrap_all(yaw)


def parts(inside: Inside) -> List[Part]:
    """The Parts of a run, in their order."""
    series = inside.find('state') or next((each for each in inside.variables.values()
                                           if set(each.text) & set(STATES)), None)
    if series is None or inside.known(pose) is None or not set(series.text) & set(STATES):
        return []
    sent, control, found = inside.run.commands, inside.run.control, []
    cuts = [each.begin for each in inside.known(frames)] + list(control.arrival)
    edges = np.unique([*series.changes, *cuts, inside.run.duration])
    for begin, end in zip(edges[:-1], edges[1:]):
        part = series.between(begin, end)
        before = np.searchsorted(control.arrival, begin + 0.01) - 1
        if len(part.text) < 3 or len(control) and (before < 0 or not control.value[before]):
            continue
        at = (sent.arrival > begin) & (sent.arrival < end - SOON)
        found.append(Part(
            str(part.text[-1]), float(begin), float(part.time[-1]),
            series.text_at(end) if end in series.changes and np.abs(
                np.subtract(cuts, end)).min() > SOON else '',
            sent.arrival[at], sent.linear[at], sent.angular[at],
            *own_pose(inside, sent.arrival[at])))
    return found


def error_of(inside: Inside, state: str, away: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """The heading error of a rotation, or the distance to the goal, by the node's own numbers."""
    if state == STATES[1]:
        return np.abs(away)
    factor = inside.known(pose)[0].factor
    asked = np.angle(away) if state == STATES[0] else goal_of(inside)[2] * factor
    return wrap_all(np.asarray(asked - yaw))


def forms(inside: Inside, part: Part) -> Iterator[Tuple[str, np.ndarray]]:
    """(words, angle) that a node may take for the heading error; the first is right."""
    run, goal = inside.run, goal_of(inside)
    dx, dy = part.away.real, part.away.imag
    targets = [('atan2(dy, dx)', np.angle(part.away)), ('goal_yaw', 0.0 * dx + goal[2])]
    others = [('atan2(dx, dy)', np.arctan2(dx, dy)), ('atan2(-dy, -dx)', np.angle(-part.away)),
              ('atan2(goal_y, goal_x)', 0.0 * dx + np.arctan2(goal[1], goal[0])),
              ('atan2(dy, -dx)', np.arctan2(dy, -dx)), ('atan(dy / dx)', np.arctan(dy / dx)),
              ('0', 0.0 * dx)]
    headings = [('local_yaw', part.yaw)] + [
        ('the yaw of the ' + name, samples.yaw[(np.searchsorted(
            samples.arrival, part.time) - 1).clip(0)])
        for name, samples in (('IMU', run.imu), ('odometry', run.odometry))] + [
        ('0', 0.0 * dx), ('(-local_yaw)', -part.yaw)]
    for (said, target), (other, heading) in itertools.product(
            targets[::1 if part.state == STATES[0] else -1] + others, headings):
        words = '{} - {}'.format(said, other).replace(' - 0', ', without the heading')
        for more, value in ((', from -pi to pi', wrap_all(target - heading)),
                            (', not normalized', target - heading)):
            yield words + more, value


def law(inside: Inside, part: Part) -> Optional[Tuple[str, float]]:
    """(words of the heading error, gain) that the commands of a rotation follow; None: none."""
    gain, moves = GAINS[part.state], np.flatnonzero(part.angular)
    if len(moves) < 5:
        return None
    command = part.angular[moves]
    for k, is_own in itertools.product((gain, -gain, None), (False, True)):
        for words, value in forms(inside, part):
            value = value[moves]
            free = np.median(command / np.where(value == 0.0, np.inf, value))
            factor = free if k is None else k
            if (k is None) == is_own and (not is_own or np.ptp(command) > 0.1) and np.mean(np.abs(
                    command - factor * value) < 0.01 + 0.03 * np.abs(factor * value)) >= MOST:
                return words, float(factor)
    return None


def wrong_law(inside: Inside) -> Optional[Broken]:
    """In each state: has the command the side and the size of the law, and does the state change
    at its tolerance, to the next one?"""
    return next(filter(None, (check(inside, part) for part in inside.known(parts)
                              for check in (wrong_command, wrong_end))), None)


def wrong_command(inside: Inside, part: Part) -> Optional[Broken]:
    """Is a command of a state wrong? A law of another size is not: see slow_law."""
    if part.state not in STATES[:3] or part.end - part.begin < 1.0:
        return None
    error, moment = error_of(inside, part.state, part.away, part.yaw), part.begin
    said = 'in {} '.format(part.state)
    if not len(part.time):
        return Broken(said + 'no command came for {:.1f} s'.format(part.end - part.begin), moment)
    if part.state == STATES[1]:
        speed = float(np.median(part.linear))
        return None if 0.0 < speed <= FASTEST + 0.01 else Broken(
            said + 'linear.x was {:.2f}, by the handout it is {:g}{}'.format(
                speed, SPEED, '' if speed else inside.known(other_fields)), moment, 'linear.x')
    clear = (np.abs(error) > 2.0 * ANGLE) & (np.abs(error) < np.pi - 2.0 * ANGLE)
    wrong = np.flatnonzero(clear & (part.angular * error < 0.0))
    if clear.sum() > 3 and not part.angular.any():
        return Broken(said + 'angular.z stayed 0 for an error of {:+.2f} rad{}'.format(
            error[-1], inside.known(other_fields)), moment, 'angular.z')
    found = law(inside, part)
    right = next(forms(inside, part))[0]
    if found and (found[0] != right or found[1] < 0.0):
        return Broken(said + 'angular.z was {:.2g} x ({}); by the handout it is {:g} x ({})'.format(
            found[1], found[0], GAINS[part.state], right), moment, 'angular.z')
    if len(wrong) > 2:
        return Broken(said + 'for an error of {:+.2f} rad angular.z was {:+.2f}'.format(
            error[wrong[0]], part.angular[wrong[0]]), float(part.time[wrong[0]]), 'angular.z')
    return None


def wrong_end(inside: Inside, part: Part) -> Optional[Broken]:
    """Does a state end at its tolerance, and is the next one the handout's?"""
    if part.state not in STATES[:3]:
        return None if part.state in STATES else Broken(
            'state became {}, none of {}'.format(part.state, ', '.join(STATES)), part.begin,
            'state')
    at = np.arange(part.begin, part.end, 0.05) if part.end > part.begin else np.array([part.end])
    left = error_of(inside, part.state, *own_pose(inside, at))
    what, unit, tolerance = ('distance', 'm', DISTANCE) if part.state == STATES[1] else (
        'heading error', 'rad', ANGLE)
    sign = '{:.2f}' if part.state == STATES[1] else '{:+.2f}'
    after = STATES[STATES.index(part.state) + 1]
    if part.after and part.after != after:
        return Broken('state went from {} to {}; {} comes next'.format(
            part.state, part.after, after), part.end, 'state')
    if part.after and abs(left[-1]) > tolerance + APART:
        return Broken('state went from {} to {} at a {} of {} {}; {:g} is the tolerance'.format(
            part.state, after, what, sign.format(left[-1]), unit, tolerance), part.end, 'state')
    near = np.flatnonzero(np.abs(left) < 0.8 * tolerance)
    if not part.after and len(near) and part.end - at[near[0]] > 3.0:
        return Broken('at a {} of {} {} state stayed {}; {:g} is the tolerance'.format(
            what, sign.format(left[near[0]]), unit, part.state, tolerance),
            float(at[near[0]]), 'state')
    return None


def state_kept(inside: Inside) -> Optional[Broken]:
    """Is the state set back by a reset?"""
    series = inside.find('state')
    for frame in inside.known(frames):
        part = series and series.between(frame.begin + LATE, frame.end)
        if frame.is_reset and part is not None and len(part.text) and part.text[0] in STATES[1:] \
                and series.text_at(frame.begin - 0.1) == part.text[0]:
            return Broken('{}{} stayed {}; it should be {}'.format(
                frame.words, series.name, part.text[0], STATES[0]), frame.begin, series.name)
    return None


def wrong_silence(inside: Inside) -> Optional[Broken]:
    """At the goal: is the last command a zero, and does none follow?"""
    sent = inside.run.commands
    for part in inside.known(parts):
        last = np.flatnonzero(sent.arrival < part.begin + LATE)[-1:]
        later = ((sent.arrival > part.begin + LATE) & (sent.arrival < part.end)).sum()
        if part.state != STATES[3] or not len(last):
            continue
        if later > 3:
            return Broken('{} commands came after state had become {}'.format(
                later, part.state), part.begin + LATE)
        if sent.linear[last[0]] or sent.angular[last[0]]:
            return Broken('state became {}, and the last command was linear.x {:.2f}, angular.z '
                          '{:.2f}: no zero followed'.format(
                              part.state, sent.linear[last[0]], sent.angular[last[0]]), part.begin)
    return None


def slow_law(inside: Inside) -> Optional[Broken]:
    """Are gains and speed those of the handout, ten times a second?"""
    for part in inside.known(parts):
        if len(part.time) > 3 and part.state in STATES[:3]:
            pause = float(np.median(np.diff(part.time)))
            if pause > PAUSE:
                return Broken('commands came every {:.1f} s; the handout has ten a second'.format(
                    pause), part.begin)
            speed = float(np.median(part.linear))
            if part.state == STATES[1] and abs(speed - SPEED) > 0.005:
                return Broken('in {} linear.x was {:.2f}, by the handout it is {:g}'.format(
                    part.state, speed, SPEED), part.begin, 'linear.x', is_weak=True)
            found = law(inside, part) if part.state in GAINS else None
            if found and abs(found[1] - GAINS[part.state]) > 0.01:
                return Broken('in {} angular.z was {:.2g} x the error, by the handout it is {:g} '
                              'x'.format(part.state, found[1], GAINS[part.state]), part.begin,
                              'angular.z', is_weak=True)
    return None


LINKS = (wrong_reference, wrong_pose, wrong_control, state_kept, wrong_goal, wrong_law,
         wrong_silence, slow_law)
