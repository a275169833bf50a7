"""Several runs on one page: their drives and turns side by side, with mean and spread.

Units: as in the heads; metres, degrees, seconds.
"""
import math
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any, List, Sequence, Tuple, Union
from urllib.parse import quote

import numpy as np

from tb3_labs.report import compare_figures, csv_files, figures, html, sensors
from tb3_labs.report.analysis import DriveReport, drives, local_poses
from tb3_labs.report.epochs import between, epochs
from tb3_labs.report.run_data import Poses, RunData
from tb3_labs.report.tables import TURNS, Column, number
from tb3_labs.report.turns import TurnReport, turns
from tb3_labs.robot.turtlebot3 import RobotModel

#: As tables.TURNS, of a DriveReport.
DRIVES: Sequence[Column] = (
    ('off by [m]', lambda drive: drive.measured[0], '{:.4f}'),
    ('off by [deg]', lambda drive: math.degrees(drive.measured[1]), '{:+.2f}'),
    ('heading drift [deg]', lambda drive: math.degrees(drive.drift), '{:+.2f}'),
    ('time [s]', lambda drive: drive.time, '{:.2f}'),
    ('time / least', lambda drive: drive.time / drive.least_time if drive.least_time else math.nan,
     '{:.2f}'),
    ('truly off [m]', lambda drive: drive.true[0], '{:.4f}'),
    ('truly off [deg]', lambda drive: math.degrees(drive.true[1]), '{:+.2f}'))
#: Columns of which a mean says nothing: what was asked, and what was turned to either side.
NO_MEAN = 'asked [deg]', 'turned [deg]'

PAGE = Template('''<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Runs compared</title><style>
$style
</style></head><body>
<h1>Runs compared</h1>
<p>$left_out</p>
$runs
$turns
$turn_errors
$drives
$drive_errors
$ways
<p>Spread: standard deviation of the values (divided by n - 1). Largest: by its size. All rows are
in turns.csv and drives.csv too. Rules, figures, and speeds: on each run's own page.</p>
</body></html>
''')


@dataclass(frozen=True)
class RunSummary:
    """The things of one run that are compared."""

    name: str
    page: str                         # its own page, relative to the page of all
    seconds: float
    driven: float                     # [m]
    resets: int
    turns: List[TurnReport]
    drives: List[DriveReport]
    ways: List[Poses]                 # of each drive, in local


def summarize(run: RunData, model: RobotModel, name: str, page: str) -> RunSummary:
    """The RunSummary of a run that `model` made."""
    local, found = local_poses(run), drives(run, model)
    return RunSummary(name, page, run.duration, sensors.path_length(run.odometry),
                      len(epochs(run)) - 1, turns(run), found,
                      [between(local, drive.begin, drive.end) for drive in found])


def write_comparison(runs: Sequence[RunSummary], folder: Union[str, Path],
                     left_out: Sequence[str] = ()) -> Path:
    """Write report.html, its figures, turns.csv and drives.csv into a folder that exists; the path
    of report.html.

    `left_out`: lines on what could not be read. ``OSError`` if nothing can be written.
    """
    folder = Path(str(folder))
    csv_files.write_turns(folder / 'turns.csv', [(run.name, run.turns) for run in runs])
    csv_files.write_drives(folder / 'drives.csv', [(run.name, run.drives) for run in runs])
    parts = dict.fromkeys(('turn_errors', 'drive_errors', 'ways'), '')
    for name, caption, figure in (
            ('turn_errors', 'How far each turn went beyond what was asked. Line: mean; bar: spread.',
             compare_figures.turn_errors(runs)),
            ('drive_errors', 'How far each drive ended from its goal. Line: mean; bar: spread.',
             compare_figures.drive_errors(runs)),
            ('ways', 'All drives in the local frame.', compare_figures.ways(runs))):
        if figure is not None:
            figures.save(figure, folder / (name + '.png'))
            parts[name] = html.image(folder / (name + '.png'), caption)
    page = folder / 'report.html'
    page.write_text(PAGE.substitute(
        parts, style=html.STYLE, left_out=escape(' '.join(left_out)), runs=_runs(runs),
        turns=_compared('Turns', 'turn', TURNS, [(run.name, run.turns) for run in runs]),
        drives=_compared('Drives', 'drive', DRIVES, [(run.name, run.drives) for run in runs])),
        encoding='utf-8')
    return page


def _runs(runs: Sequence[RunSummary]) -> str:
    return html.table(
        ['run', 'turns', 'drives', 'resets', 'driven [m]', 'time [s]'],
        [[html.Markup('<a href="{}">{}</a>'.format(escape(quote(run.page)), escape(run.name))),
          str(len(run.turns)), str(len(run.drives)), str(run.resets), '{:.2f}'.format(run.driven),
          '{:.1f}'.format(run.seconds)] for run in runs])


def _compared(title: str, what: str, columns: Sequence[Column],
              runs: Sequence[Tuple[str, Sequence[Any]]]) -> str:
    """Two tables: mean, spread, largest of each run, and the rows of all; '' if there are none."""
    runs = [(name, reports) for name, reports in runs if reports]
    if not runs:
        return ''
    groups = list(runs)
    if len(runs) > 1:
        groups.append(('all', [report for _, reports in runs for report in reports]))
    meant = [column for column in columns if column[0] not in NO_MEAN]
    means = [[name if not k else '', str(len(reports)) if not k else '', word] + cells
             for name, reports in groups for k, (word, cells) in enumerate(_spread(meant, reports))]
    rows = [[name, str(count)] + [number(value(report), form) for _, value, form in columns]
            for name, reports in runs for count, report in enumerate(reports, 1)]
    return '<h2>{0}</h2>{1}<h2>{0}, one by one</h2>{2}'.format(
        title,
        html.table(['run', what + 's', ''] + [head for head, _, _ in meant], means, words=('',)),
        html.table(['run', what] + [head for head, _, _ in columns], rows))


def _spread(columns: Sequence[Column], reports: Sequence[Any]) -> List[Tuple[str, List[str]]]:
    """(word, cells) of the mean, of the standard deviation, and of the largest value."""
    rows: List[List[str]] = [[], [], []]
    for _, value, form in columns:
        values = np.array([value(report) for report in reports])
        values = values[np.isfinite(values)]
        mean, spread = compare_figures.mean_and_spread(values)
        largest = float(values[np.argmax(np.abs(values))]) if len(values) else math.nan
        rows[0].append(number(mean, form))
        rows[1].append(number(spread, form.replace('+', '')))
        rows[2].append(number(largest, form))
    return list(zip(('mean', 'spread', 'largest'), rows))
