"""The figures of several runs: the error of each turn and drive, and the ways of all drives.

Each takes objects with `name`, `turns`, `drives`, `ways` (compare.RunSummary).
Units on the axes: degrees, millimetres, metres.
"""
import math
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tb3_labs.report.figures import GREY, STYLES, map_of_local, new_figure
from tb3_labs.report.path_figures import draw_path

#: The points of one run are spread over this part of its column.
COLUMN = 0.5
#: A name that is longer is written aslant.
LONG_NAME = 12


def turn_errors(runs: Sequence[Any]) -> Optional[Figure]:
    """The error of each turn, a column for each run; None without turns."""
    return _errors(runs, [('beyond (+), short (-) [deg]', [
        [math.degrees(turn.error) for turn in run.turns] for run in runs])])


def drive_errors(runs: Sequence[Any]) -> Optional[Figure]:
    """The errors of each drive, a column for each run; None without drives."""
    return _errors(runs, [
        ('off by [mm]', [[1000.0 * drive.measured[0] for drive in run.drives] for run in runs]),
        ('off by [deg]', [[math.degrees(drive.measured[1]) for drive in run.drives]
                          for run in runs])])


def ways(runs: Sequence[Any]) -> Optional[Figure]:
    """All drives in the local frame, with their goals; None without drives."""
    if not any(run.drives for run in runs):
        return None
    figure = new_figure(4.6)
    axes = figure.subplots()
    for number, run in enumerate(runs):
        colour, style = STYLES[number % len(STYLES)]
        label = run.name
        for way in run.ways:
            draw_path(axes, way, color=colour, linestyle=style, linewidth=1.2, label=label)
            axes.plot(way.x[-1:], way.y[-1:], 's', color=colour, markersize=4)
            label = None
    goals = sorted({(drive.goal.x, drive.goal.y) for run in runs for drive in run.drives
                    if drive.goal})
    for number, (x, y) in enumerate(goals):
        axes.plot(x, y, '*', markerfacecolor='none', markeredgecolor='black', markersize=13,
                  linestyle='', label=None if number else 'goal')
    axes.plot(0.0, 0.0, 'o', color='black', markersize=5, linestyle='', label='origin of local')
    map_of_local(figure, axes, 0.1)
    return figure


def mean_and_spread(values: np.ndarray) -> Tuple[float, float]:
    """The mean, and the standard deviation of a sample; NaN where there are too few values."""
    return (float(values.mean()) if len(values) else math.nan,
            float(values.std(ddof=1)) if len(values) > 1 else math.nan)


def _errors(runs: Sequence[Any],
            panels: Sequence[Tuple[str, List[List[float]]]]) -> Optional[Figure]:
    """A panel for each (label, values of each run)."""
    shown = [k for k, values in enumerate(panels[0][1]) if values]
    if not shown:
        return None
    figure = new_figure(3.2)
    plots = figure.subplots(1, len(panels), squeeze=False)[0]
    names = [runs[k].name for k in shown]
    aslant = max(map(len, names)) > LONG_NAME or len(names) > 4
    for axes, (label, columns) in zip(plots, panels):
        for place, k in enumerate(shown):
            _points(axes, place, np.array(columns[k]), STYLES[k % len(STYLES)][0])
        axes.axhline(0.0, color=GREY, linewidth=0.8)
        axes.set_ylabel(label)
        axes.set_xlim(-0.6, len(shown) - 0.4)
        axes.set_xticks(range(len(shown)))
        axes.set_xticklabels(names, fontsize=8, rotation=20 if aslant else 0,
                             ha='right' if aslant else 'center')
        axes.grid(True, axis='y', linewidth=0.3)
    return figure


def _points(axes: Axes, place: int, values: np.ndarray, colour: str) -> None:
    """The finite values as points around `place`, in their order, with mean and spread."""
    values = values[np.isfinite(values)]
    if not len(values):
        return
    across = place + COLUMN * (np.arange(1, len(values) + 1) / (len(values) + 1.0) - 0.5)
    axes.plot(across, values, 'o', color=colour, markersize=4, markerfacecolor='none')
    mean, spread = mean_and_spread(values)
    axes.plot([place - COLUMN / 2.0, place + COLUMN / 2.0], [mean, mean], color=colour,
              linewidth=1.6)
    if len(values) > 1:
        axes.errorbar(place, mean, spread, color=colour, capsize=4,
                      linewidth=1.0)
