"""Several runs on one page: their drives and turns side by side, with mean and spread.

Units: as in the heads; metres, degrees, seconds.
"""
import math
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, List, Optional, Sequence, Tuple, Union
from urllib.parse import quote

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tb3_labs.report.drives import DriveReport, drives
from tb3_labs.report.epochs import epochs
from tb3_labs.report.figures import GREY, STYLES, new_figure
from tb3_labs.report.page import document, write_figure
from tb3_labs.report.path_figures import ways
from tb3_labs.report.run_data import Poses, RunData
from tb3_labs.report.tables import (
    DRIVES, TURNS, Column, Markup, cells, number, table, write_reports)
from tb3_labs.report.turns import TurnReport, turns
from tb3_labs.robot.turtlebot3 import RobotModel

#: A run's row in a figure: its height [inch], and the part of it that its points are spread over.
ROW, SPREAD_OVER = 0.5, 0.5
#: The columns of drives that are compared.
COMPARED = tuple(column for column in DRIVES if column.name in (
    'time_s', 'distance_error_m', 'angle_error_deg', 'true_distance_error_m',
    'true_angle_error_deg', 'time_to_least', 'drift_deg'))
#: Columns without a mean: in it, turns to the left and to the right would cancel.
NO_MEAN = 'asked_deg', 'turned_deg'

NOTE = '''<p>Spread: standard deviation of the values (divided by n - 1). Largest: by its size.
All rows are in turns.csv and drives.csv too. Rules, figures, and speeds: on each run's own page.
</p>'''


@dataclass(frozen=True)
class RunSummary:
    """The results of one run that are compared."""

    name: str
    page: str                         # the run's own page, relative to the page of all runs
    seconds: float
    driven: float                     # [m]
    resets: int
    turns: List[TurnReport]
    drives: List[DriveReport]
    ways: List[Poses]                 # the path of each drive, in local


def summarize(run: RunData, model: RobotModel, name: str, page: str) -> RunSummary:
    """Returns the RunSummary of a run; `model` is the robot that drove."""
    found = drives(run, model)
    return RunSummary(name, page, run.duration, run.odometry.length,
                      len(epochs(run)) - 1, turns(run), found,
                      [run.local_pose.between(drive.begin, drive.end) for drive in found])


def write_comparison(runs: Sequence[RunSummary], folder: Union[str, Path],
                     left_out: Sequence[str] = ()) -> Path:
    """Write report.html, its figures, turns.csv and drives.csv into a folder that exists.

    Returns the path of report.html. `left_out`: lines on the bags that could not be read.
    ``OSError`` if nothing can be written.
    """
    folder = Path(str(folder))
    write_reports(folder, [(run.name, run.turns, run.drives) for run in runs])
    page = folder / 'report.html'
    page.write_text(document('Runs compared', [
        '<p>{}</p>'.format(escape(' '.join(left_out))), _runs(runs),
        _compared('Turns', 'turn', TURNS[1:], [(run.name, run.turns) for run in runs]),
        write_figure(turn_errors(runs), folder / 'turn_errors.png',
                     'How far each turn went beyond what was asked. Line: mean; bar: spread.'),
        _compared('Drives', 'drive', COMPARED, [(run.name, run.drives) for run in runs]),
        write_figure(drive_errors(runs), folder / 'drive_errors.png',
                     'How far each drive ended from its goal. Line: mean; bar: spread.'),
        write_figure(ways(runs), folder / 'ways.png', 'All drives in the local frame.'), NOTE]),
        encoding='utf-8')
    return page


def _runs(runs: Sequence[RunSummary]) -> str:
    return table(
        ['run', 'turns', 'drives', 'resets', 'driven [m]', 'time [s]'],
        [[Markup('<a href="{}">{}</a>'.format(escape(quote(run.page)), escape(run.name))),
          str(len(run.turns)), str(len(run.drives)), str(run.resets), '{:.2f}'.format(run.driven),
          '{:.1f}'.format(run.seconds)] for run in runs])


def _compared(title: str, what: str, columns: Sequence[Column],
              runs: Sequence[Tuple[str, Sequence[Any]]]) -> str:
    """Returns two tables: mean, spread, largest value of each run; all rows. '' without rows."""
    runs = [(name, reports) for name, reports in runs if reports]
    if not runs:
        return ''
    groups = list(runs)
    if len(runs) > 1:
        groups.append(('all', [report for _, reports in runs for report in reports]))
    meant = [column for column in columns if column.name not in NO_MEAN]
    means: List[List[str]] = []
    for name, reports in groups:
        mean, spread, largest = _spread(meant, reports)
        means += [[name, str(len(reports)), 'mean'] + mean, ['', '', 'spread'] + spread,
                  ['', '', 'largest'] + largest]
    rows = [[name, str(count)] + cells(columns, report)
            for name, reports in runs for count, report in enumerate(reports, 1)]
    return '<h2>{0}</h2>{1}<h2>{0}, one by one</h2>{2}'.format(
        title,
        table(['run', what + 's', ''] + [column.head for column in meant], means, words=('',)),
        table(['run', what] + [column.head for column in columns], rows))


def _spread(columns: Sequence[Column], reports: Sequence[Any]) -> List[List[str]]:
    """Returns three rows of cells: means, standard deviations, largest values."""
    rows: List[List[str]] = [[], [], []]
    for _, _, value, form in columns:
        values = np.array([value(report) for report in reports])
        values = values[np.isfinite(values)]
        mean, spread = _mean_and_spread(values)
        largest = float(values[np.argmax(np.abs(values))]) if len(values) else math.nan
        rows[0].append(number(mean, form))
        rows[1].append(number(spread, form.replace('+', '')))
        rows[2].append(number(largest, form))
    return rows


# Figures --------------------------------------------------------------------------------------


def turn_errors(runs: Sequence[RunSummary]) -> Optional[Figure]:
    """Returns a figure of the errors of all turns, a row for each run; None without turns."""
    return _errors(runs, [('beyond (+), short (-) [deg]', [
        [math.degrees(turn.error) for turn in run.turns] for run in runs])])


def drive_errors(runs: Sequence[RunSummary]) -> Optional[Figure]:
    """Returns a figure of the errors of all drives, a row for each run; None without drives."""
    return _errors(runs, [
        ('off by [mm]', [[1000.0 * drive.measured[0] for drive in run.drives] for run in runs]),
        ('off by [deg]', [[math.degrees(drive.measured[1]) for drive in run.drives]
                          for run in runs])])


def _errors(runs: Sequence[RunSummary],
            panels: Sequence[Tuple[str, List[List[float]]]]) -> Optional[Figure]:
    """Returns a figure with a panel for each (label, values of each run). Each run is a row beside
    its name, since a name may be long."""
    shown = [k for k, values in enumerate(panels[0][1]) if values]
    if not shown:
        return None
    figure = new_figure(0.8 + ROW * max(3, len(shown)))
    plots = figure.subplots(1, len(panels), squeeze=False, sharey=True)[0]
    for axes, (label, rows) in zip(plots, panels):
        for place, k in enumerate(shown):
            _points(axes, place, np.array(rows[k]), STYLES[k % len(STYLES)][0])
        axes.axvline(0.0, color=GREY, linewidth=0.8)
        axes.set(xlabel=label, ylim=(len(shown) - 0.4, -0.6), yticks=range(len(shown)))
        axes.set_yticklabels([runs[k].name for k in shown], fontsize=8)
        axes.grid(True, axis='x', linewidth=0.3)
    return figure


def _points(axes: Axes, place: int, values: np.ndarray, colour: str) -> None:
    """Draw the finite values as points around `place`, in order, with mean and spread."""
    values = values[np.isfinite(values)]
    across = place + SPREAD_OVER * (np.arange(1, len(values) + 1) / (len(values) + 1.0) - 0.5)
    axes.plot(values, across, 'o', color=colour, markersize=4, markerfacecolor='none')
    mean, spread = _mean_and_spread(values)
    axes.errorbar(mean, place, xerr=np.nan_to_num(spread), fmt='|', markersize=18, color=colour,
                  capsize=4, linewidth=1.0)


def _mean_and_spread(values: np.ndarray) -> Tuple[float, float]:
    """The mean, and the standard deviation of a sample; NaN for too few values."""
    return (float(values.mean()) if len(values) else math.nan,
            float(values.std(ddof=1)) if len(values) > 1 else math.nan)
