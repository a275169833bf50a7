"""Makes the figures and texts of nodes' variables for the timeline of a run.

If the values of a variable are numbers, the variable is drawn as a line over time, beside the
correct values if they are known. If a variable has only a few texts, such as a state, it is drawn
as steps between these texts. The page also shows the text of each variable at the chosen moment.
Units: seconds since the start; a variable has the unit that its node uses.
"""
import math
from dataclasses import replace
from typing import Any, Callable, List, NamedTuple, Tuple

import numpy as np

from tb3_labs.report.page.curves import NO_LINE, Figure, Line, kept_samples
from tb3_labs.report.run_data import MIN_GAP, Poses, RunData, cached_per_run
from tb3_labs.watch.variables import TRUTH_VALUES, Series, variables_by_node

#: The limits of a page.
MAX_FIGURES = 12
MAX_SHOWN_VARIABLES = 40
MAX_VALUE_LENGTH = 200         # characters of each text
#: A variable with more different texts than this has no figure.
MAX_LEVELS = 8
#: A line differs from each recorded value by at most this share of the line's range.
BOUND_SHARE = 1.0 / 500.0
#: A larger number is not drawn, since the difference of two such numbers could be infinite.
MAX_DRAWN_NUMBER = 1e300
#: An angle above this is in degrees, not in radians.
MAX_RADIANS = 7.0


class Reference(NamedTuple):
    """The correct values of the variables with these `names`. The page calls these values `name`.
    ``of(run)`` returns (times, values)."""

    names: Tuple[str, ...]
    name: str
    of: Callable[[RunData], Tuple[np.ndarray, np.ndarray]]


def _heading(run: RunData) -> Tuple[np.ndarray, np.ndarray]:
    return run.imu.time, np.degrees(run.imu.yaw) % 360.0


def _column_of(part: str, name: str) -> Callable[[RunData], Tuple[np.ndarray, np.ndarray]]:
    def values(run: RunData) -> Tuple[np.ndarray, np.ndarray]:
        poses: Poses = getattr(run, part)
        return poses.time, getattr(poses, name)
    return values


#: The variables of the handouts that share a figure. A figure is drawn if its first variable was
#: recorded.
REFERENCES = (
    Reference(('curr_yaw', 'goal_yaw'), 'heading by the IMU', _heading),
    Reference(('local_x', 'goal_x'), 'x in local', _column_of('local_pose', 'x')),
    Reference(('local_y', 'goal_y'), 'y in local', _column_of('local_pose', 'y')),
    Reference(('local_yaw', 'goal_yaw'), 'yaw in local', _column_of('local_pose', 'yaw')),
    Reference(('initial_global_x',), 'x in odom', _column_of('odometry', 'x')),
    Reference(('initial_global_y',), 'y in odom', _column_of('odometry', 'y')),
    Reference(('initial_global_yaw',), 'yaw by the IMU', _column_of('imu', 'yaw')),
    Reference(('initial_odom_yaw',), 'yaw in odom', _column_of('odometry', 'yaw')))
#: The handouts' other variables. They are drawn before a student's own variables.
HANDOUT_NAMES = ('turning', 'state', 'has_control')


def nodes(run: RunData) -> List[str]:
    """Returns the names of the nodes whose variables were recorded."""
    return list(dict.fromkeys(node[:MAX_VALUE_LENGTH] for node in run.variables.node))


@cached_per_run
def variables(run: RunData) -> List[Series]:
    """Returns the variables of a run. If several nodes have variables, the name of a variable
    begins with the name of its node."""
    found, nodes = [], variables_by_node(run.variables)
    for node, series_of in nodes.items():
        prefix = node.strip('/') + ': ' if len(nodes) > 1 else ''
        for series in series_of.values():
            # here, True and False are texts; a comparison with NaN is False
            is_truth = np.isin(series.text.astype(str), [*TRUTH_VALUES])
            is_drawn = ~is_truth & (np.abs(series.value) < MAX_DRAWN_NUMBER)
            found.append(replace(
                series, name=(prefix + series.name)[:MAX_VALUE_LENGTH],
                text=np.array([text[:MAX_VALUE_LENGTH] for text in series.text], dtype=object),
                value=np.where(is_drawn, series.value, np.nan)))
    return found[:MAX_SHOWN_VARIABLES]


def is_number(variable: Series) -> bool:
    """Are most values of the variable numbers?"""
    return bool(2 * np.isnan(variable.value).sum() < len(variable.value))


def changes(variable: Series) -> np.ndarray:
    """Returns the index of the first value, and of each value that differs from the previous value.
    """
    values = np.where(np.isnan(variable.value), variable.text, variable.value)
    return np.flatnonzero(np.append(True, values[1:] != values[:-1]))


def texts(run: RunData) -> List[List[Any]]:
    """Returns [name, times of the changes, texts after the changes] of each variable."""
    rows = []
    for each in variables(run):
        shown = changes(each)
        rows.append([each.name, np.round(each.time[shown], 3).tolist(), [
            f'{number:.5g}' if '.' in text and not math.isnan(number) else text
            for text, number in zip(each.text[shown], each.value[shown])]])
    return rows


def figures(run: RunData) -> List[Figure]:
    """Returns the figures of the variables that change, at most MAX_FIGURES."""
    remaining = {each.name: each for each in variables(run)}
    found = []
    for reference in REFERENCES:
        group = [remaining[name] for name in reference.names
                 if name in remaining and is_number(remaining[name])]
        is_shown = group and group[0].name == reference.names[0]
        if is_shown and any(len(changes(each)) > 1 for each in group):
            for each in group:
                del remaining[each.name]
            found.append(_beside(run, reference, group))
    handouts = [remaining.pop(name) for name in HANDOUT_NAMES if name in remaining]
    for each in [*handouts, *remaining.values()]:
        levels = [] if is_number(each) else _levels(each)
        if len(changes(each)) > 1 and len(levels) <= MAX_LEVELS:
            shown = _level_steps(each, levels) if levels else line(each.time, each.value)
            found.append(Figure([each.name], '', NO_LINE, [shown], levels))
    return found[:MAX_FIGURES]


def _levels(variable: Series) -> List[str]:
    """Returns the different texts of a variable, from the lowest to the highest in the figure.
    False is below True. A state is below all states that the variable had earlier in the run."""
    texts = list(dict.fromkeys(variable.text))
    return sorted(texts) if texts[0] in TRUTH_VALUES else texts[::-1]


def _beside(run: RunData, reference: Reference, group: List[Series]) -> Figure:
    """Returns the figure of the variables `group` beside their reference."""
    time, values = reference.of(run)
    whole_turn = math.inf
    if reference.name.startswith('heading'):
        whole_turn = 360.0
    elif reference.name.startswith('yaw'):
        whole_turn = 2.0 * math.pi
        if any(np.nanmax(np.abs(each.value)) > MAX_RADIANS for each in group):
            whole_turn, values = 360.0, np.degrees(values)
    return Figure([each.name for each in group], reference.name if len(time) else '',
                  line(time, values, whole_turn),
                  [line(each.time, each.value, whole_turn) for each in group], [])


def line(time: np.ndarray, values: np.ndarray, whole_turn: float = math.inf) -> Line:
    """Returns the line of the values that are not NaN. The line is interrupted at gaps of time, and
    where an angle jumps by about `whole_turn`."""
    known = ~np.isnan(values)
    if not known.any():
        return NO_LINE
    index, time, values = np.flatnonzero(known), time[known], values[known]
    is_gap = (np.diff(time) > MIN_GAP) | (np.diff(index) > 1)
    is_jump = np.abs(np.diff(values)) > whole_turn / 2.0
    breaks = np.flatnonzero(is_gap | is_jump) + 1
    bound = np.array([max(BOUND_SHARE * np.ptp(values), 1e-6)])
    kept = kept_samples(time, values[:, None], bound, breaks)
    points = [(round(float(time[k]), 3), float(f'{values[k]:.6g}')) for k in kept]
    return points, [int(np.searchsorted(kept, k)) for k in breaks]


def _level_steps(variable: Series, levels: List[str]) -> Line:
    """Returns the line of a variable that steps between its levels."""
    heights = np.array([float(levels.index(text)) for text in variable.text])
    begins = np.union1d(changes(variable), np.flatnonzero(np.diff(variable.time) > MIN_GAP) + 1)
    points: List[Tuple[float, float]] = []
    breaks = []
    for begin, end in zip(begins, [*begins[1:], len(heights) - 1]):
        if begin and variable.time[begin] - variable.time[begin - 1] > MIN_GAP:
            breaks.append(len(points))
        is_silent = variable.time[end] - variable.time[end - 1] > MIN_GAP
        last = end - 1 if is_silent else end
        points += [(round(float(variable.time[at]), 3), heights[begin]) for at in (begin, last)]
    return points, breaks
