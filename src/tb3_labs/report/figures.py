"""The parts of every figure of a report: its size, colours, curves and legend.

Curves are thinned to the resolution of paper; extremes are kept.
Units: inch for sizes; a curve's are its caller's, its times seconds.
"""
import math
from pathlib import Path
from typing import Any, BinaryIO, Sequence, Union

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

DOTS_PER_INCH = 150
WIDTH = 7.2                     # [inch], what fits between the margins of A4
BLUE, ORANGE, GREEN, GREY = '#1f4e9c', '#d1660a', '#2a7a3a', '#555555'
#: (colour, line style) of successive curves.
STYLES = ((BLUE, '-'), (ORANGE, '--'), (GREEN, '-.'), ('#7a3a8a', ':'))
#: Number of stretches of a curve; two extremes of each are drawn.
STRETCHES = 700
#: A pause in a curve longer than this is left blank [s].
BREAK = 0.5


def thin(*columns: np.ndarray) -> np.ndarray:
    """Sorted indices that keep the least and the greatest of each column in each stretch, and both
    ends; all indices where there are few. The columns are of one length."""
    count = len(columns[0])
    if count <= 2 * STRETCHES:
        return np.arange(count)
    size = -(-count // STRETCHES)
    begins = np.arange(0, count, size)
    kept = [begins, np.array([count - 1])]
    for column in columns:
        padded = np.concatenate([column, np.full(-count % size, column[-1])]).reshape(-1, size)
        kept += [begins + padded.argmin(axis=1), begins + padded.argmax(axis=1)]
    return np.unique(np.concatenate(kept))     # none beyond the end: padding equals the last value


def save(figure: Figure, path: Union[str, Path, BinaryIO]) -> None:
    """Write a figure as PNG, to a path or an open file."""
    figure.savefig(path, format='png', dpi=DOTS_PER_INCH, bbox_inches='tight',
                   metadata={'Software': None})


def new_figure(height: float) -> Figure:
    """An empty figure of the page's width; `height` [inch]."""
    figure = Figure(figsize=(WIDTH, height), constrained_layout=True)
    FigureCanvasAgg(figure)
    return figure


def curve(axes: Axes, time: np.ndarray, values: np.ndarray, breaks: Sequence[float] = (),
          circle: bool = False, **looks: Any) -> None:
    """A line with blanks at the times `breaks` [s] and in pauses.

    `circle`: the values are angles [deg], with blanks also where they jump by half a turn.
    """
    pauses = np.diff(time)
    longest = max(BREAK, 5.0 * float(np.median(pauses))) if len(pauses) else BREAK
    breaks = list(breaks) + list(time[1:][pauses > longest])
    kept = thin(values)
    time, values = time[kept], values[kept]
    at = {int(index) for index in np.searchsorted(time, breaks)} - {0, len(time)}
    if circle:
        at |= {int(index) + 1 for index in np.flatnonzero(np.abs(np.diff(values)) > 180.0)}
    blanks = np.array(sorted(at), dtype=int)
    axes.plot(np.insert(time, blanks, time[blanks]), np.insert(values, blanks, math.nan),
              **dict(dict(linewidth=1.3), **looks))


def map_of_local(figure: Figure, axes: Axes, margin: float) -> None:
    """Finish a map of the local frame: one scale, the axes' names, a grid, the legend below.

    `margin`: around what is drawn, as a part of it.
    """
    axes.set_aspect('equal', adjustable='datalim')
    axes.margins(margin)
    axes.set_xlabel('x in local [m]')
    axes.set_ylabel('y in local [m]')
    axes.grid(True, linewidth=0.3)
    legend_below(figure, axes)


def legend_below(figure: Figure, axes: Axes) -> None:
    """Put the legend of `axes` below the figure."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc='upper center', ncol=7, fontsize=8, frameon=False,
                  bbox_to_anchor=(0.5, 0.0))
