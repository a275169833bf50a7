"""The chain of the Transformation lab: control -> state after a reset -> references -> local pose
-> goal -> command and end of each state -> silence. "Own" numbers are the node's variables.
"""
from itertools import product
from typing import Iterator, List, NamedTuple, Optional, Tuple

import numpy as np

from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.handout import (
    ANGLE_TOLERANCE, DISTANCE_TOLERANCE, DRIVE_SPEED, GAIN_TO_FINAL, GAIN_TO_GOAL, GOAL_X, GOAL_Y,
    GOAL_YAW_DEG, MAX_SPEED, STATES)
from tb3_labs.watch.broken_link import (
    LONGEST_READING_GAP, BrokenLink, NodeRun, other_field_text, slow_rate_text, stays)
from tb3_labs.watch.drive_pose import (
    APART, LATE, MOST, SOON, USED, frames, part_with_control, unit_of)
from tb3_labs.watch.variables import short

#: The tolerance of each state [rad], [m]; the gain of each rotation [1/s]; the goal [m], [rad].
TOLERANCES = dict(zip(STATES, (ANGLE_TOLERANCE, DISTANCE_TOLERANCE, ANGLE_TOLERANCE)))
GAINS = {STATES[0]: GAIN_TO_GOAL, STATES[2]: GAIN_TO_FINAL}
GOAL = {'goal_x': GOAL_X, 'goal_y': GOAL_Y, 'goal_yaw': float(np.radians(GOAL_YAW_DEG))}


def control_intervals(node_run: NodeRun) -> List[Tuple[float, float, float]]:
    """(begin, end, value) of each message on ctrl_relinq."""
    control = node_run.run.control
    return list(zip(control.arrival, np.append(control.arrival[1:], node_run.run.duration),
                    control.value))


def wrong_control(node_run: NodeRun) -> Optional[BrokenLink]:
    """Does has_control follow ctrl_relinq?"""
    series = node_run.find('has_control')
    for begin, end, value in control_intervals(node_run):
        if series is None:
            return None
        # a node that was started later has not heard it
        part = series.between(begin + LATE, end if node_run.run.starts else min(
            end, node_run.end_after(begin)))
        is_heard = node_run.run.starts or node_run.runs_at(begin)
        if is_heard and (np.abs(part.value - value) == 1.0).sum() > max(4, len(part.value) / 2):
            return BrokenLink('{:.1f} s after a {} on ctrl_relinq {} was {}'.format(
                part.time[-1] - begin, bool(value), series.name, part.text[-1]),
                    float(part.time[0]), series.name)
    return None


def state_kept(node_run: NodeRun) -> Optional[BrokenLink]:
    """Is the state set back by a reset?"""
    series = node_run.find('state')
    for frame in node_run.cached(frames):
        if series is None:
            return None
        part = series.between(frame.begin + LATE, frame.end)
        was_set_back = STATES[0] in series.between(frame.begin - SOON, frame.begin + LATE).text
        if frame.is_reset and len(part.text) and not was_set_back and (
                series.text_at(frame.begin - SOON) == part.text[0] in STATES[1:]) and (
                own_pose(node_run, part.time[:1]).left(STATES[0]) > TOLERANCES[STATES[0]] + APART):
            return BrokenLink('{}{} stayed {}; it should be {}'.format(
                frame.words, series.name, part.text[0], STATES[0]), frame.begin, series.name)
    return None


def wrong_goal(node_run: NodeRun) -> Optional[BrokenLink]:
    """Is the own goal the one that was asked for? A yaw may be in degrees."""
    goals = node_run.run.goals      # in a recording they may be another node's
    is_asked = len(goals) and len(node_run.run.starts)
    for name, requested in zip(GOAL, (goals.x, goals.y, goals.yaw)) if is_asked else ():
        series = node_run.find(name)
        rights = [requested[0], np.degrees(requested[0]) if 'yaw' in name else requested[0]]
        if series is not None and stays(series) and np.abs(series.value[-1] - rights).min() > 1e-3:
            return BrokenLink('{} is {}; it should be {:g}'.format(
                series.name, short(series.text[-1]), requested[0]), float(series.time[0]),
                              series.name)
    return None


class Pose(NamedTuple):
    """By the node's own variables at some times: the vector to the goal (complex), the yaw and the
    yaw of the goal [rad]; NaN without the handout's variables."""

    away: np.ndarray
    yaw: np.ndarray
    goal: np.ndarray

    def left(self, state: str) -> np.ndarray:
        """The rest of a state: a heading error [rad], or a distance [m]."""
        if state == STATES[1]:
            return np.abs(self.away)
        target = np.angle(self.away) if state == STATES[0] else self.goal
        return np.abs(wrap_all(target - self.yaw))


def own_pose(node_run: NodeRun, time: np.ndarray) -> Pose:
    """The Pose at each time. A goal that is not shown is that of the lab, if a marker started the
    node."""
    known = GOAL if node_run.run.starts else {}
    yaw, x, y, goal_x, goal_y, goal = (
        np.full(len(time), known.get(name, np.nan)) if series is None else
        np.interp(time, series.time, series.value)
        for name in (*USED, *GOAL) for series in [node_run.find(name)])
    unit, goal_unit = (1.0 if series is None else unit_of(series)
                       for series in map(node_run.find, ('local_yaw', 'goal_yaw')))
    return Pose(goal_x - x + 1j * (goal_y - y), yaw * unit, goal * min(unit, goal_unit))


class Part(NamedTuple):
    """The time in one state with control: the first and the last reading in it [s], the state after
    it, '' if it is not known. Of each command its time, linear.x, angular.z, the own Pose."""

    state: str
    begin: float
    end: float
    after: str
    time: np.ndarray
    linear: np.ndarray
    angular: np.ndarray
    pose: Pose


def parts(node_run: NodeRun) -> List[Part]:
    """The Parts of a run, in their order; [] without the handout's variables."""
    series, found, sent = node_run.find('state'), [], node_run.commands
    if series is None or not set(series.text) & set(STATES):
        return []
    cuts = [*(each.begin for each in node_run.cached(frames)), *node_run.run.control.arrival]
    gaps = series.time[1:][np.diff(series.time) > LONGEST_READING_GAP]
    edges = np.unique([*series.changes, *cuts, *gaps, node_run.run.duration])
    for begin, end in zip(edges[:-1], edges[1:]):
        part = part_with_control(node_run, series.between(begin, end), 0.0)
        pose = own_pose(node_run, part.time)
        if not len(part.time) or np.isnan(pose.left(STATES[0])).all():
            continue
        is_change = end in series.changes and end not in gaps and (
            np.abs(np.subtract(cuts, end)) > SOON).all()
        at = (sent.arrival > part.time[0] - SOON / 2.0) & (sent.arrival <= part.time[-1])
        found.append(Part(
            str(part.text[-1]), part.time[0], part.time[-1],
            series.text_at(end) if is_change else '',
            sent.arrival[at], sent.linear[at], sent.angular[at],
            own_pose(node_run, sent.arrival[at])))
    return found


def forms(part: Part, node_run: NodeRun) -> Iterator[Tuple[str, np.ndarray]]:
    """(words, angle) of what a node may take for the heading error; the first is right."""
    dx, dy = part.pose.away.real, part.pose.away.imag
    targets = [('atan2(dy, dx)', np.arctan2(dy, dx)), ('goal_yaw', part.pose.goal)]
    targets = targets[::1 if part.state == STATES[0] else -1] + [
        ('atan2(dx, dy)', np.arctan2(dx, dy)), ('atan2(-dy, -dx)', np.arctan2(-dy, -dx)),
        ('atan(dy / dx)', np.arctan(dy / dx)), ('0', 0.0 * dx)]
    heard = [('the yaw of the ' + name, samples.yaw[(np.searchsorted(
        samples.arrival, part.time) - 1).clip(0)]) for name, samples in (
            ('IMU', node_run.run.imu), ('odometry', node_run.run.odometry))]
    yaw = part.pose.yaw
    own = [('local_yaw', yaw), *heard, ('0', 0.0 * yaw), ('-local_yaw', -yaw),
           ('local_yaw in degrees', np.degrees(yaw))]
    for (target, angle), (heading, turned) in product(targets, own):
        for more, value in (('', wrap_all(angle - turned)), (', not normalized', angle - turned)):
            yield f'{target} - {heading}{more}', value


def fitted_formula(node_run: NodeRun, part: Part) -> Tuple[str, float]:
    """(words, gain) of the heading error that the commands of a rotation follow, if possible
    with the handout's gain; '': of none."""
    requested, found = GAINS[part.state], [('', GAINS[part.state])]
    for words, value in forms(part, node_run):
        inner = (part.angular != 0.0) & ((np.abs(value) < 3.0) | ('not' in words)) & (value != 0.0)
        command, value = part.angular[inner], value[inner]      # where it jumps, both are right
        if len(value) < 5:
            continue
        gain = float(np.median(command / value))
        gain = np.copysign(requested, gain) if abs(abs(gain) / requested - 1.0) < 0.05 else gain
        if np.ptp(command) < 0.1 and abs(gain) != requested:
            continue        # any angle is a constant times a constant
        if np.mean(np.abs(command - gain * value) < 0.01 + 0.03 * np.abs(gain * value)) >= MOST:
            found.append((words, gain))
    return min(found[1:] or found, key=lambda each: abs(each[1]) != requested)


def wrong_law(node_run: NodeRun) -> Optional[BrokenLink]:
    """In each state: have the commands the side and the size of the law, and does it end at its
    tolerance, with the next one?"""
    return next(filter(None, (check(node_run, part) for part in node_run.cached(parts)
                              for check in (wrong_command, wrong_end))), None)


def wrong_command(node_run: NodeRun, part: Part) -> Optional[BrokenLink]:
    """Is a command of a state wrong?"""
    if part.state not in TOLERANCES or part.end - part.begin < 1.0:
        return None
    name = 'linear.x' if part.state == STATES[1] else 'angular.z'
    text = 'in {} {} was '.format(part.state, name)
    if not len(part.time):
        # a node waits for both sensors after a reset
        first = [min(samples.between(part.begin, part.end).arrival, default=np.inf)
                 for samples in (node_run.run.imu, node_run.run.odometry)]
        return None if part.end - max(first) < 1.0 else BrokenLink(
            'in {} no command came for {:.1f} s'.format(part.state, part.end - part.begin),
            part.begin)
    if part.state == STATES[1]:
        speed = float(np.median(part.linear))
        return None if 0.0 < speed <= MAX_SPEED + 0.01 else BrokenLink(
            text + '{:.2f}, by the handout it is {:g}{}'.format(
                speed, DRIVE_SPEED, '' if speed else node_run.cached(other_field_text)), part.begin,
            name)
    (words, gain), (right, left) = fitted_formula(node_run, part), next(forms(part, node_run))
    if words and (words != right or gain < 0.0):
        return BrokenLink(text + '{:.2g} x ({}); by the handout it is {:g} x ({})'.format(
            gain, words, GAINS[part.state], right), part.begin, name)
    wrong = np.flatnonzero((np.abs(left) > 2.0 * TOLERANCES[part.state]) & (np.abs(left) < 3.0) & (
        part.angular * left < (0.0 if part.angular.any() else 1e-9)))
    if len(wrong) < 3:
        return None
    k = wrong[0]
    more = '' if part.angular.any() else node_run.cached(other_field_text)
    return BrokenLink(text + '{:+.2f} for an error of {:+.2f} rad{}'.format(
        part.angular[k], left[k], more), part.time[k], name)


def wrong_end(node_run: NodeRun, part: Part) -> Optional[BrokenLink]:
    """Does a state end at its tolerance, and is the next one the handout's?"""
    if part.state not in TOLERANCES:
        # a state more, which the node leaves by itself, is no mistake
        is_left = part.after in STATES or part.end - part.begin < 1.0
        return None if part.state in STATES or is_left else BrokenLink(
            f"state became {part.state}, which is none of {', '.join(STATES)}",
            part.begin, 'state')
    # between two readings the pose may have jumped
    read = node_run.readings
    at = read[(read >= part.begin) & (read <= part.end)]
    pose = own_pose(node_run, at)
    passed = STATES[STATES.index(part.state):STATES.index(part.after)] \
        if part.after in STATES else ()
    for state in passed:
        if pose.left(state)[-1] > TOLERANCES[state] + APART:
            return BrokenLink('state went from {} to {} at {}'.format(
                part.state, part.after, left_text(state, pose.left(state)[-1])), part.end, 'state')
    left, tolerance = pose.left(part.state), TOLERANCES[part.state]
    near = np.flatnonzero(left < tolerance)
    if not part.after and len(near) and part.end - at[near[0]] > 1.0 and (
            left[near[0]:].max() > tolerance + APART
            or not part.angular[part.time > at[near[0]] + LATE].any()):
        return BrokenLink('state stayed {} at {}'.format(
            part.state, left_text(part.state, left[near[-1]])), float(at[near[-1]]), 'state')
    return None


def left_text(state: str, left: float) -> str:
    """Words on what is left of a state."""
    return 'a {} of {:.2f} {}; {:g} is the tolerance'.format(*(
        ('distance', left, 'm') if state == STATES[1] else ('heading error', left, 'rad')),
        TOLERANCES[state])


def not_silent(node_run: NodeRun) -> Optional[BrokenLink]:
    """At the goal, and as soon as control is taken: is a zero the last command?"""
    sent = node_run.commands
    moving = (sent.linear != 0.0) | (sent.angular != 0.0)
    ends = [(part.begin, part.end, 'state became ' + STATES[3], moving | True)
            for part in node_run.cached(parts)
            if part.state == STATES[3] and part.end > part.begin + LATE]
    ends += [(begin, end, 'ctrl_relinq became False', moving)
             for begin, end, value in control_intervals(node_run)
             if not value and end > begin + LATE and node_run.runs_at(begin)]
    for begin, end, words, counted in sorted(ends, key=lambda each: each[0]):
        last = np.flatnonzero((sent.arrival > begin - 1.0) & (sent.arrival < begin + LATE))
        late = np.flatnonzero((sent.arrival > begin + LATE) & (sent.arrival < end) & counted)
        if len(late) > 3:
            return BrokenLink(
                '{}, and {} commands came later: linear.x {:.2f}, angular.z {:.2f}'.format(
                    words, len(late), sent.linear[late[0]], sent.angular[late[0]]),
                float(sent.arrival[late[0]]))
        if len(last) and moving[last][sent.arrival[last] > begin - SOON].all() and moving[last[-1]]:
            return BrokenLink(
                '{}, and the last command was linear.x {:.2f}, angular.z {:.2f}: no zero '
                'followed'.format(words, sent.linear[last[-1]], sent.angular[last[-1]]), begin)
    return None


def slow_law(node_run: NodeRun) -> Optional[BrokenLink]:
    """Are gains and speed those of the handout, ten times a second?"""
    for part in node_run.cached(parts):
        if len(part.time) < 4 or part.state not in TOLERANCES:
            continue
        slow_rate = slow_rate_text(part.time)
        if slow_rate:
            return BrokenLink(slow_rate, part.begin)
        requested = GAINS.get(part.state, DRIVE_SPEED)
        own = fitted_formula(node_run, part)[1] if part.state in GAINS else float(
            np.median(part.linear))
        if abs(own - requested) > 0.05 * requested:
            return BrokenLink('in {} {} {:.2g}, by the handout it is {:g}'.format(
                part.state, 'linear.x was' if part.state == STATES[1] else
                'angular.z was the error times', own, requested), part.begin, is_weak=True)
    return None
