"""The chain of the Transformation lab: control -> state after a reset -> references -> local pose
-> goal -> command and end of each state -> silence. "Own" numbers are the node's variables.
"""
from itertools import product
from typing import Iterator, List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.watch.chain import Broken, Inside, stays
from tb3_labs.watch.drive_pose import (
    APART, LATE, MOST, SOON, USED, frames, unit_of)
from tb3_labs.watch.turn_links import other_fields, short

#: The handout's law: the states and their tolerances [rad], [m], the gain of each rotation [1/s],
#: the speed and the robot's limit [m/s], the goal [m], [rad].
STATES = ('ROTATE_TO_GOAL', 'MOVE_FORWARD', 'ROTATE_TO_FINAL', 'GOAL_REACHED')
TOLERANCES = {STATES[0]: 0.05, STATES[1]: 0.15, STATES[2]: 0.05}
GAINS, SPEED, FASTEST = {STATES[0]: 0.3, STATES[2]: 0.5}, 0.15, 0.22
GOAL = {'goal_x': -0.61, 'goal_y': 0.61, 'goal_yaw': 0.0}
#: A longer pause between commands is a mistake [s].
PAUSE = 0.45


def given(inside: Inside) -> List[Tuple[float, float, float]]:
    """(begin, end, value) of each message on ctrl_relinq."""
    control = inside.run.control
    return list(zip(control.arrival, np.append(control.arrival[1:], inside.run.duration),
                    control.value))


def wrong_control(inside: Inside) -> Optional[Broken]:
    """Does has_control follow ctrl_relinq?"""
    series = inside.find('has_control')
    for begin, end, value in given(inside):
        if series is None:
            return None
        part = series.between(begin + LATE, end)
        if np.mean(np.append(np.abs(part.value - value) == 1.0, [0.0] * 4)) > 0.5:
            return Broken('{:.1f} s after a {} on ctrl_relinq {} was {}'.format(
                part.time[-1] - begin, bool(value), series.name, part.text[-1]),
                float(part.time[0]), series.name)
    return None


def state_kept(inside: Inside) -> Optional[Broken]:
    """Is the state set back by a reset?"""
    series = inside.find('state')
    for frame in inside.known(frames):
        if series is None:
            return None
        part = series.between(frame.begin + LATE, frame.end)
        if frame.is_reset and len(part.text) and (
                series.text_at(frame.begin - SOON) == part.text[0] in STATES[1:]) and (
                not has_pose(inside) or left_of(inside, STATES[0], *own_pose(
                    inside, part.time[:1])) > TOLERANCES[STATES[0]] + APART):
            return Broken('{}{} stayed {}; it should be {}'.format(
                frame.words, series.name, part.text[0], STATES[0]), frame.begin, series.name)
    return None


def goals(inside: Inside) -> List[Tuple[str, float, float]]:
    """(name, own number, asked number) of x, y [m] and yaw of the goal."""
    asked = dict(GOAL)
    for each in inside.run.goals.take(slice(0, 1)).points:
        asked.update(zip(GOAL, [*each, inside.run.goals.yaw[0]]))
    own = {name: inside.find(name) for name in GOAL}
    return [(name, asked[name] if each is None or not np.isfinite(each.value[-1])
             else float(each.value[-1]), asked[name]) for name, each in own.items()]


def wrong_goal(inside: Inside) -> Optional[Broken]:
    """Is the own goal the one that was asked for? A yaw may be in degrees."""
    for name, own, asked in goals(inside) if len(inside.run.goals) else []:
        series = inside.find(name)
        if series is not None and stays(series) and min(abs(own - asked), abs(
                own - (np.degrees(asked) if 'yaw' in name else asked))) > 1e-3:
            return Broken('{} is {}; it should be {:g}'.format(
                series.name, short(series.text[-1]), asked), float(series.time[0]), series.name)
    return None


class Part(NamedTuple):
    """The time in one state: its begin and end [s], the state after it, '' if control or the frame
    ended. Of each command its time, linear.x, angular.z, the own vector to the goal (complex), the
    own yaw."""

    state: str
    begin: float
    end: float
    after: str
    time: np.ndarray
    linear: np.ndarray
    angular: np.ndarray
    away: np.ndarray
    yaw: np.ndarray


def has_pose(inside: Inside) -> bool:
    """Does the node have the handout's variables for its pose?"""
    return all(each is not None and bool(np.isfinite(each.value).any())
               for each in map(inside.find, USED))


def own_pose(inside: Inside, time: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """(vector to the goal, yaw [rad]) by the node's own variables at each time."""
    yaw, x, y = (np.interp(time, each.time, each.value) for each in map(
        inside.find, USED) if each is not None)
    (_, goal_x, _), (_, goal_y, _), _ = goals(inside)
    return (complex(goal_x, goal_y) - x - 1j * y,
            yaw * unit_of(inside.find('local_yaw')))


def parts(inside: Inside) -> List[Part]:
    """The Parts of a run with control, in their order; [] without the handout's variables."""
    series, found, sent = inside.find('state'), [], inside.run.commands
    if series is None or not set(series.text) & set(STATES) or not has_pose(inside):
        return []
    control = inside.run.control
    cuts = [each.begin for each in inside.known(frames)] + list(control.arrival)
    edges = np.unique([*series.changes, *cuts, inside.run.duration])
    for begin, end in zip(edges[:-1], edges[1:]):
        part = series.between(begin, end)
        before = np.searchsorted(control.arrival, begin + 0.01) - 1
        if len(part.text) and (not len(control) or before >= 0 and control.value[before]):
            read = part.time[np.searchsorted(part.time, sent.arrival).clip(0, len(part.time) - 1)]
            at = (sent.arrival > begin) & (sent.arrival < end - SOON) & (
                np.abs(read - sent.arrival) < 2.0 * SOON)
            begin = max(begin, part.time[0] - SOON)
            is_change = end in series.changes and end - part.time[-1] < 2.0 * SOON and np.abs(
                np.subtract(cuts, end)).min() > SOON
            found.append(Part(
                str(part.text[-1]), begin, part.time[-1], series.text_at(end) if is_change else '',
                sent.arrival[at], sent.linear[at], sent.angular[at],
                *own_pose(inside, sent.arrival[at])))
    return found


def left_of(inside: Inside, state: str, away: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """What is left of a state by own numbers: a heading error [rad], or a distance [m]."""
    goal = goals(inside)[2][1] * unit_of(inside.find('local_yaw'))
    return np.abs(away) if state == STATES[1] else np.abs(wrap_all(
        (np.angle(away) if state == STATES[0] else goal) - yaw))


def forms(inside: Inside, part: Part) -> Iterator[Tuple[str, np.ndarray]]:
    """(words, angle) of what a node may take for the heading error; the first is right."""
    dx, dy = part.away.real, part.away.imag
    none, (goal_x, goal_y, goal_yaw) = 0.0 * dx, (own for _, own, _ in goals(inside))
    targets = [('atan2(dy, dx)', np.arctan2(dy, dx)), ('goal_yaw', none + goal_yaw)]
    targets = targets[::1 if part.state == STATES[0] else -1] + [
        ('atan2(dx, dy)', np.arctan2(dx, dy)), ('atan2(-dy, -dx)', np.arctan2(-dy, -dx)),
        ('atan2(goal_y, goal_x)', none + np.arctan2(goal_y, goal_x)),
        ('atan(dy / dx)', np.arctan(dy / dx)), ('0', none)]
    heard = [('the yaw of the ' + name, samples.yaw[(np.searchsorted(
        samples.arrival, part.time) - 1).clip(0)]) for name, samples in (
            ('IMU', inside.run.imu), ('odometry', inside.run.odometry))]
    own = [('local_yaw', part.yaw), *heard, ('0', none), ('-local_yaw', -part.yaw),
           ('local_yaw in degrees', np.degrees(part.yaw))]
    for (target, angle), (heading, yaw) in product(targets, own):
        for more, value in (('', wrap_all(angle - yaw)), (', not normalized', angle - yaw)):
            yield '{} - {}{}'.format(target, heading, more), value


def law(inside: Inside, part: Part) -> Tuple[str, float]:
    """(words, gain) of the heading error that the commands of a rotation follow; '': of none."""
    gain = GAINS[part.state]
    for is_own, (words, value) in product((False, True), list(forms(inside, part))):
        inner = (part.angular != 0.0) & ((np.abs(value) < 3.0) | ('not' in words))
        command, value = part.angular[inner], value[inner]      # where it jumps, both are right
        if len(value) < 5 or is_own and np.ptp(command) < 0.1:
            continue
        free = float(np.median(command / np.where(value == 0.0, np.inf, value)))
        for factor in [free] if is_own else [gain, -gain]:
            if np.mean(np.abs(command - factor * value) < 0.01 + 0.03 * np.abs(
                    factor * value)) >= MOST:
                return words, factor
    return '', gain


def wrong_law(inside: Inside) -> Optional[Broken]:
    """In each state: have the commands the side and the size of the law, and does it end at its
    tolerance, with the next one?"""
    return next(filter(None, (check(inside, part) for part in inside.known(parts)
                              for check in (wrong_command, wrong_end))), None)


def wrong_command(inside: Inside, part: Part) -> Optional[Broken]:
    """Is a command of a state wrong?"""
    if part.state not in TOLERANCES or part.end - part.begin < 1.0:
        return None
    said, moment, name = 'in {} angular.z '.format(part.state), part.begin, 'angular.z'
    if not len(part.time):
        sent = inside.run.commands.arrival
        return None if ((sent > moment) & (sent < part.end)).any() else Broken(
            'in {} no command came for {:.1f} s'.format(part.state, part.end - moment), moment)
    if part.state == STATES[1]:
        speed = float(np.median(part.linear))
        return None if 0.0 < speed <= FASTEST + 0.01 else Broken(
            'in {} linear.x was {:.2f}, by the handout it is {:g}{}'.format(
                part.state, speed, SPEED, '' if speed else inside.known(other_fields)),
            moment, 'linear.x')
    (words, gain), (right, left) = law(inside, part), next(forms(inside, part))
    clear = (np.abs(left) > 2.0 * TOLERANCES[part.state]) & (np.abs(left) < 3.0)
    wrong = np.flatnonzero(clear & (part.angular * left < 0.0))
    if clear.sum() > 3 and not part.angular.any():
        return Broken(said + 'stayed 0 for an error of {:+.2f} rad{}'.format(
            left[-1], inside.known(other_fields)), moment, name)
    if words and (words != right or gain < 0.0):
        return Broken(said + 'was {:.2g} x ({}); by the handout it is {:g} x ({})'.format(
            gain, words, GAINS[part.state], right), moment, name)
    return None if len(wrong) < 3 else Broken(
        said + 'was {:+.2f} for an error of {:+.2f} rad'.format(
            part.angular[wrong[0]], left[wrong[0]]), part.time[wrong[0]], name)


def wrong_end(inside: Inside, part: Part) -> Optional[Broken]:
    """Does a state end at its tolerance, and is the next one the handout's?"""
    if part.state not in TOLERANCES:
        return None if part.state in STATES else Broken(
            'state became {}, which is none of {}'.format(part.state, ', '.join(STATES)),
            part.begin, 'state')
    at = np.append(np.arange(part.begin + SOON, part.end, 0.05), part.end)
    pose = own_pose(inside, at)
    left, tolerance = left_of(inside, part.state, *pose), TOLERANCES[part.state]
    after = STATES[STATES.index(part.state) + 1]
    what = 'a {} of {{:.2f}} {}; {:g} is the tolerance'.format(*(
        ('distance', 'm') if part.state == STATES[1] else ('heading error', 'rad')), tolerance)
    near = np.flatnonzero(left < tolerance)
    skipped = left_of(inside, after, *pose)[-1] if after in TOLERANCES else 0.0
    if part.after == STATES[3] and skipped > TOLERANCES.get(after, 0.0) + APART:
        return Broken(
            'state went from {} to {} at {:.2f} from the end of {}, which was skipped'.format(
                part.state, part.after, skipped, after), part.end, 'state')
    if part.after and left[-1] > tolerance + APART:
        return Broken('state went from {} to {} at {}'.format(
            part.state, part.after, what.format(left[-1])), part.end, 'state')
    if not part.after and len(near) and part.end - at[near[0]] > 1.0 and (
            left[near[0]:].max() > tolerance + APART
            or not part.angular[part.time > at[near[0]] + LATE].any()):
        return Broken('state stayed {} at {}'.format(part.state, what.format(left[near[-1]])),
                      float(at[near[-1]]), 'state')
    return None


def not_silent(inside: Inside) -> Optional[Broken]:
    """At the goal, and as soon as control is taken: is a zero the last command?"""
    sent = inside.run.commands
    moving = (sent.linear != 0.0) | (sent.angular != 0.0)
    ends = [(part.begin, part.end, 'state became ' + STATES[3], moving | True)
            for part in inside.known(parts) if part.state == STATES[3]]
    ends += [(begin, end, 'ctrl_relinq became False', moving)
             for begin, end, value in given(inside) if not value and end > begin + LATE]
    for begin, end, words, counted in sorted(ends, key=lambda each: each[0]):
        last = np.flatnonzero((sent.arrival > begin - 1.0) & (sent.arrival < begin + LATE))
        late = np.flatnonzero((sent.arrival > begin + LATE) & (sent.arrival < end) & counted)
        if len(late) > 3:
            return Broken(
                '{}, and {} commands came later: linear.x {:.2f}, angular.z {:.2f}'.format(
                    words, len(late), sent.linear[late[0]], sent.angular[late[0]]),
                float(sent.arrival[late[0]]))
        if len(last) and moving[last][sent.arrival[last] > begin - SOON].all() and moving[last[-1]]:
            return Broken('{}, and the last command was linear.x {:.2f}, angular.z {:.2f}: no zero '
                          'followed'.format(words, sent.linear[last[-1]], sent.angular[last[-1]]),
                          begin)
    return None


def slow_law(inside: Inside) -> Optional[Broken]:
    """Are gains and speed those of the handout, ten times a second?"""
    for part in inside.known(parts):
        if len(part.time) < 4 or part.state not in TOLERANCES:
            continue
        pause = float(np.median(np.diff(part.time)))
        if pause > PAUSE:
            return Broken('commands came every {:.1f} s; the handout has ten a second'.format(
                pause), part.begin)
        asked = GAINS.get(part.state, SPEED)
        own = law(inside, part)[1] if part.state in GAINS else float(np.median(part.linear))
        if abs(own - asked) > 0.05 * asked:
            return Broken('in {} {} {:.2g}, by the handout it is {:g}'.format(
                part.state, 'linear.x was' if part.state == STATES[1] else
                'angular.z was the error times', own, asked), part.begin, is_weak=True)
    return None
