"""Makes the figures and texts of nodes' variables for the timeline of a run.

If the values of a variable are numbers, the variable is drawn as a line over time, beside the
correct values if they are known. If a variable has only a few texts, such as a state, it is drawn
as steps between these texts. The page also shows the text of each variable at the chosen moment.
Units: seconds since the start; a variable has the unit that its node uses.
"""
import math
from dataclasses import replace
from typing import Any, List, NamedTuple, Tuple

import numpy as np

from tb3_labs.geometry.angles import WHOLE_TURN
from tb3_labs.report.page.curves import NO_LINE, Figure, Line, kept_samples
from tb3_labs.report.run_data import MIN_GAP, RunData, cached_per_run
from tb3_labs.watch.variables import TRUTH_VALUES, Series, variables_by_node

#: The limits of a page.
MAX_FIGURES = 12
MAX_SHOWN_VARIABLES = 40
#: A variable with more different texts than this has no figure.
MAX_LEVELS = 8
#: A line differs from each recorded value by at most this share of the line's range.
BOUND_SHARE = 1.0 / 500.0
#: A larger number is not drawn, since the difference of two such numbers could be infinite.
MAX_DRAWN_NUMBER = 1e300
#: An angle above this is in degrees, not in radians.
MAX_RADIANS = 7.0
#: The handouts' variables. They are drawn first, in this order.
HANDOUT_NAMES = ('curr_yaw', 'goal_yaw', 'local_x', 'local_y', 'local_yaw', 'turning', 'state',
                 'has_control')


class Reference(NamedTuple):
    """The correct values of a variable. The page calls these values `name`."""

    name: str
    time: np.ndarray
    values: np.ndarray
    whole_turn: float = math.inf     # if the values are angles, a whole turn in their unit


def _reference(run: RunData, variable: Series) -> Reference:
    """Returns the Reference of a variable. Most variables have none: their Reference is empty."""
    local = run.local_pose
    if variable.name == 'curr_yaw':
        heading = np.degrees(run.imu.yaw) % 360.0
        return Reference('heading by the IMU', run.imu.time, heading, 360.0)
    if variable.name == 'local_x':
        return Reference('x in local', local.time, local.x)
    if variable.name == 'local_y':
        return Reference('y in local', local.time, local.y)
    if variable.name == 'local_yaw' and np.nanmax(np.abs(variable.value)) > MAX_RADIANS:
        return Reference('yaw in local', local.time, np.degrees(local.yaw), 360.0)
    if variable.name == 'local_yaw':
        return Reference('yaw in local', local.time, local.yaw, WHOLE_TURN)
    return Reference('', np.empty(0), np.empty(0))


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
                series, name=prefix + series.name,
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
    known = {each.name: each for each in variables(run)}
    first = [known.pop(name) for name in HANDOUT_NAMES if name in known]
    found = [_figure(run, each) for each in [*first, *known.values()] if len(changes(each)) > 1]
    return [figure for figure in found if len(figure.levels) <= MAX_LEVELS][:MAX_FIGURES]


def _figure(run: RunData, variable: Series) -> Figure:
    if not is_number(variable):
        levels = _levels(variable)
        return Figure(variable.name, _level_steps(variable, levels), '', NO_LINE, levels)
    beside = _reference(run, variable)
    return Figure(variable.name, line(variable.time, variable.value, beside.whole_turn),
                  beside.name if len(beside.time) else '',
                  line(beside.time, beside.values, beside.whole_turn), [])


def _levels(variable: Series) -> List[str]:
    """Returns the different texts of a variable, from the lowest to the highest in the figure.
    False is below True. A state is below all states that the variable had earlier in the run."""
    texts = list(dict.fromkeys(variable.text))
    return sorted(texts) if texts[0] in TRUTH_VALUES else texts[::-1]


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
