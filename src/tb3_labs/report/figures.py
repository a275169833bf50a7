"""The figures of a run over time: errors and turns; and the parts of any figure.

Readable in black and white: lines differ by style and width, states by hatching.

Units on the axes: metres, degrees, seconds since the recording's start, m/s, rad/s; inch for sizes.
"""
import math
from pathlib import Path
from typing import Any, BinaryIO, Dict, List, Optional, Sequence, Union

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from tb3_labs.report import drives
from tb3_labs.report.epochs import epochs
from tb3_labs.report.movements import RESTED
from tb3_labs.report.run_data import RunData
from tb3_labs.report.turns import REST_MEAN, turns as turns_of

DOTS_PER_INCH = 150
WIDTH = 7.2                     # [inch], between the margins of A4
BLUE, ORANGE, GREEN, GREY = '#1f4e9c', '#d1660a', '#2a7a3a', '#555555'
#: (colour, line style) of successive curves.
STYLES = ((BLUE, '-'), (ORANGE, '--'), (GREEN, '-.'), ('#7a3a8a', ':'))
#: A pause in a curve longer than this is left blank [s].
BREAK = 0.5
#: state: (fill, hatching); '' stands for all other states (waiting, stopped, gave up).
STATES = {'ROTATE_TO_GOAL': ('#c9d8ee', '///'), 'MOVE_FORWARD': ('#f7e3c4', ''),
          'ROTATE_TO_FINAL': ('#d3e8d3', '\\\\\\'), 'GOAL_REACHED': ('#ffffff', ''),
          RESTED: ('#ffffff', ''),
          '': ('#dddddd', '...')}
#: The vertical axis of an angle [deg].
WHOLE_CIRCLE = dict(ylim=(-190.0, 190.0), yticks=[-180, -90, 0, 90, 180])
#: Long curves are drawn in parts of this many points: Agg in Noetic limits the length of one part.
matplotlib.rcParams['agg.path.chunksize'] = 20000
#: A turn is drawn from this time before it until this time after it [s].
BEFORE, AFTER = 0.2, 2.0 * REST_MEAN
#: Up to this many turns have names in the legend.
MOST_NAMES = 12


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
    """Draw a line with blanks at the times `breaks` [s] and in pauses.

    `circle`: the values are angles [deg], with blanks also at jumps by half a turn.
    """
    pauses = np.diff(time)
    longest = max(BREAK, 5.0 * float(np.median(pauses))) if len(pauses) else BREAK
    breaks = list(breaks) + list(time[1:][pauses > longest])
    at = {int(index) for index in np.searchsorted(time, breaks)} - {0, len(time)}
    if circle:
        at |= {int(index) + 1 for index in np.flatnonzero(np.abs(np.diff(values)) > 180.0)}
    blanks = np.array(sorted(at), dtype=int)
    axes.plot(np.insert(time, blanks, time[blanks]), np.insert(values, blanks, math.nan),
              **dict(dict(linewidth=1.3), **looks))


def legend_below(figure: Figure, handles: Sequence[Any], labels: Sequence[str]) -> None:
    """Put a legend below the figure; three columns fit its width."""
    figure.legend(handles, labels, loc='upper center', ncol=3, fontsize=8, frameon=False,
                  bbox_to_anchor=(0.5, 0.0))


# A run over time ------------------------------------------------------------------------------

def errors(run: RunData) -> Optional[Figure]:
    """Distance and angle to the goal over time; None without a goal."""
    time, distance, angle = drives.goal_errors(run)
    if not len(time):
        return None
    figure = new_figure(4.3)
    far, turned = figure.subplots(2, 1, sharex=True)
    curve(far, time, distance, _resets(run), color=BLUE)
    curve(turned, time, np.degrees(angle), _resets(run), circle=True, color=BLUE)
    far.set(ylabel='distance error [m]', ylim=(0.0, None))
    turned.set(ylabel='angle error [deg]', **WHOLE_CIRCLE)
    _shade(figure, (far, turned), run)
    return figure


def turns(run: RunData, alone: int = 0) -> Optional[Figure]:
    """Returns a figure of the angle left and the rate of turn, positive in the direction that was
    asked for; None without a turn. `alone`: number (from 1) of the only turn to draw; 0: all."""
    found = turns_of(run)
    if not found:
        return None
    figure = new_figure(4.3)
    left, rate = figure.subplots(2, 1, sharex=True)
    ends = [turn.begin for turn in found[1:]] + [math.inf]
    first, *_ = shown = [alone - 1] if alone else range(len(found))
    for number in shown:
        turn, following = found[number], ends[number]
        until = min(turn.end + AFTER, following)
        sign = math.copysign(1.0, turn.asked)
        imu = run.imu.between(turn.begin - BEFORE, until)
        yaw = np.unwrap(imu.yaw)
        remaining = abs(turn.asked) - sign * (yaw - np.interp(turn.begin, imu.time, yaw))
        colour, style = STYLES[number % len(STYLES)]
        looks: Dict[str, Any] = dict(color=colour, linestyle=style, linewidth=1.1)
        name = '{}: {:+.0f} deg'.format(number + 1, math.degrees(turn.asked))
        curve(left, imu.time - turn.begin, np.degrees(remaining),
              label=name if number < first + MOST_NAMES else None, **looks)
        curve(rate, imu.time - turn.begin, sign * imu.yaw_rate, **looks)
        commands = run.commands.between(turn.begin - BEFORE, until)
        rate.plot(commands.time - turn.begin, sign * commands.angular, '.', color=ORANGE,
                  markersize=2.5, label=None if number > first else 'commanded')
    left.axhline(0.0, color=GREY, linewidth=0.8)
    left.set_ylabel('angle left [deg]')
    rate.set(ylabel='rate of turn [rad/s]\n(gyro)', xlabel='time since the first command [s]')
    rate.legend(fontsize=8, frameon=False)
    for axes in (left, rate):
        axes.grid(True, linewidth=0.3)
    legend_below(figure, *left.get_legend_handles_labels())
    return figure


def _shade(figure: Figure, plots: Sequence[Axes], run: RunData) -> None:
    """Draw states as shades and resets as lines, with a legend for both; the axis of time."""
    used = {}
    for span in drives.spans(run):
        kind = span.state if span.state in STATES else ''
        fill, hatch = STATES[kind]
        used[kind] = Patch(facecolor=fill, hatch=hatch, edgecolor='#aaaaaa',
                           label=kind or 'waiting, stopped or gave up')
        for axes in plots:
            axes.axvspan(max(0.0, span.begin), span.end, facecolor=fill, hatch=hatch,
                         edgecolor='#bbbbbb', linewidth=0.0, zorder=0)
    for number, reset in enumerate(_resets(run)):
        plots[0].annotate('reset {}'.format(number + 1), (reset, 1.0), xytext=(2, -2),
                          xycoords=('data', 'axes fraction'), textcoords='offset points',
                          rotation=90, fontsize=7, ha='left', va='top')
        for axes in plots:
            axes.axvline(reset, color='black', linewidth=1.4, linestyle=(0, (4, 2)),
                         label=None if number else 'reset')
    for axes in plots:
        axes.grid(True, linewidth=0.3)
        axes.set_xlim(0.0, run.duration)
    plots[-1].set_xlabel('time [s]')
    handles: List[Any] = list(used.values()) + [
        line for line in plots[0].get_lines() if line.get_label() == 'reset']
    legend_below(figure, handles, [handle.get_label() for handle in handles])


def _resets(run: RunData) -> List[float]:
    return [epoch.begin for epoch in epochs(run)[1:]]
