"""The variables of nodes on a run's timeline: lines beside what they should be, states, texts.

A variable whose values are numbers is a line over time, thinned. Any other one (a state, a truth
value) is a line of steps between its few texts. At the moment that the timeline shows, each
variable has its text, the constant ones too. Units: seconds since the start; the node's.
"""
import math
from dataclasses import replace
from typing import Any, Callable, List, NamedTuple, Tuple

import numpy as np

from tb3_labs.report.page.curves import NO_LINE, Figure, Line, thinned
from tb3_labs.report.run_data import GAP, Poses, RunData, cached_per_run
from tb3_labs.watch.variables import Series, variables_by_node

#: A page has at most this many figures of variables, variables, points or changes of one,
#: different texts of a figure, and characters of a name or a text.
MOST_FIGURES, MOST_VARIABLES, MOST_POINTS, MOST_LEVELS, LONGEST = 12, 40, 2000, 8, 200
#: A line is within this part of its range of each recorded value.
BOUND = 1.0 / 500.0
#: An angle above this is in degrees, not in radians.
MOST_RADIANS = 7.0


class Reference(NamedTuple):
    """The right values of variables with these names: a text, and times and values of a run."""

    names: Tuple[str, ...]
    words: str
    of: Callable[[RunData], Tuple[np.ndarray, np.ndarray]]


def _heading(run: RunData) -> Tuple[np.ndarray, np.ndarray]:
    return run.imu.time, np.degrees(run.imu.yaw) % 360.0


def _of(part: str, name: str) -> Callable[[RunData], Tuple[np.ndarray, np.ndarray]]:
    def values(run: RunData) -> Tuple[np.ndarray, np.ndarray]:
        poses: Poses = getattr(run, part)
        return poses.time, getattr(poses, name)
    return values


#: The handouts' variables that share a figure, the first of which is there, in their order.
REFERENCES = (
    Reference(('curr_yaw', 'goal_yaw'), 'heading by the IMU', _heading),
    Reference(('local_x', 'goal_x'), 'x in local', _of('local_pose', 'x')),
    Reference(('local_y', 'goal_y'), 'y in local', _of('local_pose', 'y')),
    Reference(('local_yaw', 'goal_yaw'), 'yaw in local', _of('local_pose', 'yaw')),
    Reference(('initial_global_x',), 'x in odom', _of('odometry', 'x')),
    Reference(('initial_global_y',), 'y in odom', _of('odometry', 'y')),
    Reference(('initial_global_yaw',), 'yaw by the IMU', _of('imu', 'yaw')),
    Reference(('initial_odom_yaw',), 'yaw in odom', _of('odometry', 'yaw')))
TRUTH = ('False', 'True')
#: The handouts' other variables, which are drawn before the student's own names.
HANDOUT = ('turning', 'state', 'has_control')


def nodes(run: RunData) -> List[str]:
    """The names of the nodes of the variables."""
    return list(dict.fromkeys(node[:LONGEST] for node in run.variables.node))


@cached_per_run
def variables(run: RunData) -> List[Series]:
    """The variables of a run, in their order; with two nodes the names have the node's."""
    found, nodes = [], variables_by_node(run.variables)
    for node, series_of in nodes.items():
        name = '{1}' if len(nodes) == 1 else '{}: {}'
        found += [replace(
            series, name=name.format(node.strip('/'), series.name)[:LONGEST],
            text=np.array([text[:LONGEST] for text in series.text], dtype=object),
            # a truth value is a text here
            value=np.where(np.isin(series.text.astype(str), TRUTH) | ~np.isfinite(series.value),
                           np.nan, series.value)) for series in series_of.values()]
    return found[:MOST_VARIABLES]


def is_number(variable: Series) -> bool:
    """Are most of its values numbers?"""
    return bool(2 * np.isnan(variable.value).sum() < len(variable.value))


def changes(variable: Series) -> np.ndarray:
    """The indices of the first value, and of each one that differs from the one before."""
    values = np.where(np.isnan(variable.value), variable.text, variable.value)
    return np.flatnonzero(np.append(True, values[1:] != values[:-1]))


def texts(run: RunData) -> List[List[Any]]:
    """[name, times, texts] of each variable: the moments at which its text changes, and the text
    from then on. If it changes too often, some are left out."""
    rows = []
    for each in variables(run):
        some = changes(each)
        some = some[::1 + len(some) // MOST_POINTS]
        rows.append([each.name, np.round(each.time[some], 3).tolist(), [
            f'{number:.5g}' if '.' in text and not math.isnan(number) else text
            for text, number in zip(each.text[some], each.value[some])]])
    return rows


def figures(run: RunData) -> List[Figure]:
    """The figures of the variables that change, at most MOST_FIGURES."""
    left = {each.name: each for each in variables(run)}
    found = []
    for reference in REFERENCES:
        group = [left[name] for name in reference.names if name in left and is_number(left[name])]
        if group and group[0].name == reference.names[0] and any(
                len(changes(each)) > 1 for each in group):
            for each in group:
                del left[each.name]
            found.append(_beside(run, reference, group))
    for each in sorted(left.values(), key=lambda each: (
            HANDOUT.index(each.name) if each.name in HANDOUT else len(HANDOUT))):
        words = list(dict.fromkeys(each.text))
        levels = [] if is_number(each) else sorted(words) if words[0] in TRUTH else words[::-1]
        if len(changes(each)) > 1 and len(levels) <= MOST_LEVELS:
            found.append(Figure([each.name], '', NO_LINE, [
                _steps(each, levels) if levels else line(each.time, each.value)], levels))
    return found[:MOST_FIGURES]


def _beside(run: RunData, reference: Reference, group: List[Series]) -> Figure:
    time, values = reference.of(run)
    is_angle, turn = reference.words.startswith(('heading', 'yaw')), 360.0
    if reference.words.startswith('yaw'):       # as a node in Python has it
        if any(np.nanmax(np.abs(each.value)) > MOST_RADIANS for each in group):
            values = np.degrees(values)
        else:
            turn = 2.0 * math.pi
    turn = turn if is_angle else math.inf
    return Figure([each.name for each in group], reference.words if len(time) else '',
                  line(time, values, turn),
                  [line(each.time, each.value, turn) for each in group], [])


def line(time: np.ndarray, values: np.ndarray, turn: float = math.inf) -> Line:
    """The line of these values, without those that are NaN, broken at gaps of time and where an
    angle begins again, with `turn` a whole turn."""
    known = ~np.isnan(values)
    if not known.any():
        return NO_LINE
    index, time, values = np.flatnonzero(known), time[known], values[known]
    breaks = np.flatnonzero((np.diff(time) > GAP) | (np.diff(index) > 1)
                            | (np.abs(np.diff(values)) > turn / 2.0)) + 1
    bound = max(BOUND * np.ptp(values), 1e-6)
    while True:
        kept = thinned(time, values[:, None], np.array([bound]), breaks)
        if len(kept) <= MOST_POINTS or len(kept) <= 2 * len(breaks) + 2:
            break
        bound *= 2.0
    points = [(round(float(time[k]), 3), float(f'{values[k]:.6g}'))
              for k in kept][:MOST_POINTS]
    return points, [int(np.searchsorted(kept, k)) for k in breaks]


def _steps(variable: Series, levels: List[str]) -> Line:
    """The line of a variable between its texts, each of which is a level."""
    heights = np.array([float(levels.index(text)) for text in variable.text])
    begins = np.union1d(changes(variable), np.flatnonzero(np.diff(variable.time) > GAP) + 1)
    points: List[Tuple[float, float]] = []
    breaks = []
    for begin, end in list(zip(begins, [*begins[1:], len(heights) - 1]))[:MOST_POINTS]:
        is_silent = variable.time[end] - variable.time[end - 1] > GAP
        if begin and variable.time[begin] - variable.time[begin - 1] > GAP:
            breaks.append(len(points))
        points += [(round(float(variable.time[at]), 3), heights[begin])
                   for at in (begin, end - 1 if is_silent else end)]
    return points, breaks
