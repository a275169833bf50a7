"""The files of the report: report.html with everything in it, the figures as PNG, and CSV files.

Units: as in the headings of the columns; metres and degrees.
"""
import math
from datetime import datetime
from html import escape
from pathlib import Path
from string import Template
from typing import Callable, Dict, Sequence, Union

from tb3_labs.report import (
    analysis, csv_files, figures, html, notes, path_figures, run_figures, sensors, tables,
    turn_figures)
from tb3_labs.report.analysis import DriveReport
from tb3_labs.report.epochs import epochs
from tb3_labs.report.run_data import RunData
from tb3_labs.report.turns import TurnReport, turns
from tb3_labs.robot.turtlebot3 import RobotModel

#: A path that is shorter is not drawn [m].
SHORTEST_PATH = 0.05
CAPTIONS = {
    'paths': 'The same path in the global and in the local frame, with the axes of both.',
    'turns': 'Angle left to what was asked, and rate of turn, from the first command on.',
    'errors': 'Distance to the goal, and angle off its heading, in local. Labels: errors at rest.',
    'heading': 'The IMU\'s heading, and how its difference from the odometry\'s varies.',
    'speeds': 'Commanded and measured speeds.'}

PAGE = Template('''<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Run report: $name</title><style>
$style
</style></head><body>
<h1>Run report: $name</h1>
<p>$summary</p>
$turn_table
$turns
$drives
$paths
$errors
$next
$along
$heading
$speeds
<section><h2>Sensor rates and gaps</h2>
$rates
<p>Intervals by the senders' stamps; cmd_vel has none, and is silent while nobody drives.</p>
</section>
</body></html>
''')


def write_report(run: RunData, model: RobotModel, folder: Union[str, Path],
                 progress: Callable[[float], None] = lambda fraction: None) -> Path:
    """Write the report of a run into a folder, which is made if it is missing; the path of
    report.html.

    `progress` is called with the share that is done, 0 to 1. ``OSError`` if nothing can be written.
    """
    folder = Path(str(folder))
    folder.mkdir(parents=True, exist_ok=True)
    drives, turned = analysis.drives(run, model), turns(run)
    parts = _figures(run, model, folder, progress)
    name = Path(run.name).name
    csv_files.write_csv(run, folder / 'run.csv')
    csv_files.write_turns(folder / 'turns.csv', [(name, turned)])
    csv_files.write_drives(folder / 'drives.csv', [(name, drives)])
    page = folder / 'report.html'
    page.write_text(PAGE.substitute(
        parts, style=html.STYLE, name=escape(name), summary=_summary(run, model),
        turn_table=_turns(run, turned), drives=_drives(run, drives, turned),
        along=_along(drives), rates=tables.rates(run),
        next='<div class="next"></div>' if drives else ''), encoding='utf-8')
    progress(1.0)
    return page


def _figures(run: RunData, model: RobotModel, folder: Path,
             progress: Callable[[float], None]) -> Dict[str, str]:
    """{name: HTML} of each figure; '' for one that would show nothing."""
    parts = dict.fromkeys(CAPTIONS, '')
    drawings = [('turns', turn_figures.turns), ('errors', run_figures.errors),
                ('heading', run_figures.heading), ('speeds', run_figures.speeds)]
    if sensors.path_length(run.odometry) >= SHORTEST_PATH:
        drawings.append(('paths', path_figures.paths))
    for number, (name, draw) in enumerate(drawings):
        progress(number / (len(drawings) + 1))
        figure = draw(run, model)
        if figure is not None:
            path = folder / (name + '.png')
            figures.save(figure, path)
            parts[name] = html.image(path, CAPTIONS[name])
    progress(len(drawings) / (len(drawings) + 1))
    return parts


def _summary(run: RunData, model: RobotModel) -> str:
    offset, resets = sensors.yaw_offset(run), len(epochs(run)) - 1
    words = '{} on {}, {:.1f} s, {:.2f} m driven, {} reset{}. '.format(
        model.name.capitalize(), datetime.fromtimestamp(run.start).strftime('%Y-%m-%d %H:%M'),
        run.duration, sensors.path_length(run.odometry), resets or 'no',
        '' if resets == 1 else 's')
    words += 'IMU yaw minus odometry yaw: mean {} deg, standard deviation {}, change from the ' \
        'first to the last tenth of the run {}.'.format(
            *(tables.degrees(value, form) for value, form in
              ((offset.mean, '{:+.2f}'), (offset.spread, '{:.3f}'), (offset.drift, '{:+.3f}'))))
    return escape(words)


def _turns(run: RunData, turned: Sequence[TurnReport]) -> str:
    if not turned:
        return ''
    return '<h2>Turns</h2>{}<p>{}</p>'.format(
        tables.turns(turned),
        escape(' '.join([notes.of_turns(run, turned), notes.unlisted(run, turned)])))


def _drives(run: RunData, drives: Sequence[DriveReport], turned: Sequence[TurnReport]) -> str:
    if not drives and turned:
        return ''
    words = notes.of_drives(run) if drives else notes.nothing(run)
    if not turned:
        words += ' ' + notes.unlisted(run, turned)
    return '<h2>Drives</h2>{}<p>{}</p>'.format(
        tables.drives(drives) if drives else '', escape(words))


def _along(drives: Sequence[DriveReport]) -> str:
    if not drives:
        return ''
    return '<h2>Along the way</h2>{}<p>{}</p>'.format(tables.along(drives), escape(tables.ALONG))
