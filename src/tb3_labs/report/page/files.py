"""Writes the files of a report: report.html with all figures and tables, PNG files, and CSV files.

The heads and names of the columns name the units: metres, degrees, seconds. An unknown value is a
dash on the page, and an empty cell in a CSV file.
"""
import base64
import csv
import math
from datetime import datetime
from html import escape
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, Callable, Iterable, List, NamedTuple, Sequence, Tuple, Union

import numpy as np

from tb3_labs.command_line import output_folder, write_output
from tb3_labs.geometry.arrays import last_until, wrap_all
from tb3_labs.recording.run_data import RunData
from tb3_labs.report.motion.drives import STRAIGHT_AFTER, DriveReport, drives
from tb3_labs.report.motion.resets_and_goals import frame_intervals
from tb3_labs.report.motion.turns import turn_reports
from tb3_labs.report.page import figures, timeline
from tb3_labs.report.page.document import document, number, safe, table
from tb3_labs.report.page.moments import broken_links, moments, printed_faults
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT, RobotModel

#: A path shorter than this is not drawn [m].
MIN_PATH_LENGTH = 0.05
CAPTIONS = {
    'paths': 'The same path in the global and in the local frame, with the axes of both.',
    'turns': 'Angle left to what was asked, and rate of turn, from the first command on.'}
FIGURE = '<figure><img alt="{0}" src="data:image/png;base64,{1}"><figcaption>{2} File: {0}.png.' \
    '</figcaption></figure>'
NO_DRIVE = 'No drives are listed: neither goal_state nor the commands on cmd_vel show one.'
#: A page has this paragraph if values were computed, since their topics were not recorded.
COMPUTED = (
    'Some topics were not recorded, so their values are computed: drives and turns by the commands '
    'on cmd_vel, asked angles as the nearest multiple of 90 degrees, the local frame by the lines '
    'of resets, the odometry and the IMU, and goals by the lab or the option --goal.')


def _goal(drive: DriveReport) -> Tuple[float, float, float]:
    """Returns (x [m], y [m], yaw [deg]) of the goal."""
    goal = drive.goal
    return (goal.x, goal.y, math.degrees(goal.yaw)) if goal else (math.nan, math.nan, math.nan)


class Column(NamedTuple):
    """A column of a table of reports."""

    name: str                       # in a CSV file
    head: str                       # on a page
    value: Callable[[Any], Any]     # of a report
    form: str                       # the value's format on a page; '' for a text


TURN_COLUMNS = (
    Column('begin_s', 'begins at [s]', lambda turn: turn.begin, '{:.2f}'),
    Column('asked_deg', 'asked [deg]', lambda turn: math.degrees(turn.requested), '{:+.0f}'),
    Column('turned_deg', 'turned [deg]', lambda turn: math.degrees(turn.turned), '{:+.2f}'),
    Column('error_deg', 'beyond (+), short (-) [deg]', lambda turn: math.degrees(turn.error),
           '{:+.2f}'),
    Column('time_s', 'time [s]', lambda turn: turn.duration, '{:.2f}'),
    Column('true_error_deg', 'truly beyond [deg]', lambda turn: math.degrees(turn.true_error),
           '{:+.2f}'))
DRIVE_COLUMNS = (
    Column('begin_s', 'begins at [s]', lambda drive: drive.begin, '{:.2f}'),
    Column('goal_x_m', 'asked x [m]', lambda drive: _goal(drive)[0], '{:.2f}'),
    Column('goal_y_m', 'y [m]', lambda drive: _goal(drive)[1], '{:.2f}'),
    Column('goal_yaw_deg', 'yaw [deg]', lambda drive: _goal(drive)[2], '{:.1f}'),
    Column('outcome', 'outcome', lambda drive: drive.outcome, ''),
    Column('time_s', 'time [s]', lambda drive: drive.duration, '{:.2f}'),
    Column('distance_error_m', 'off by [m]', lambda drive: drive.measured[0], '{:.4f}'),
    Column('angle_error_deg', 'off by [deg]', lambda drive: math.degrees(drive.measured[1]),
           '{:+.2f}'),
    Column('true_distance_error_m', 'truly off [m]', lambda drive: drive.true[0], '{:.4f}'),
    Column('true_angle_error_deg', 'truly off [deg]', lambda drive: math.degrees(drive.true[1]),
           '{:+.2f}'),
    Column('drift_deg', 'heading drift [deg]', lambda drive: math.degrees(drive.drift), '{:+.2f}'))
#: The note below the table of drives.
DRIFT_NOTE = (f'Drift: the heading by the IMU at the end of MOVE_FORWARD, minus the heading '
              f'{STRAIGHT_AFTER} s after its start.')


def write_report(run: RunData, model: RobotModel, folder: Union[str, Path]) -> List[Path]:
    """Write the report of a run into a folder, which is made if it is missing. Returns the paths of
    the files, first the path of report.html. Raises OSError if the files cannot be written."""
    driven, turned = drives(run), turn_reports(run)
    folder = output_folder(folder)
    name = Path(run.name).name
    files = [folder / file for file in ('report.html', 'run.csv', 'turns.csv', 'drives.csv')]
    page, run_csv, turns_csv, drives_csv = files
    write_csv(run, run_csv)
    write_reports(turns_csv, name, 'turn', TURN_COLUMNS, turned)
    write_reports(drives_csv, name, 'drive', DRIVE_COLUMNS, driven)
    notes = [note[:1].upper() + note[1:] + '.' for note in run.notes]
    parts = [f'<p>{escape(text)}</p>' for text in [*notes, _summary(run, model)]]
    shown = timeline.timeline(run, model, moments(run, turned, driven))
    parts += [printed_faults(run), timeline.section(shown), *broken_links(run)]
    if turned:
        files.append(folder / 'turns.png')
        parts += ['<h2>Turns</h2>', numbered('turn', TURN_COLUMNS, turned),
                  write_figure(figures.turns_figure(run), files[-1])]
    if driven:
        parts += ['<h2>Drives</h2>', numbered('drive', DRIVE_COLUMNS[1:], driven),
                  f'<p>{DRIFT_NOTE}</p>']
    elif not turned:
        parts.append(f'<p>{NO_DRIVE}</p>')
    if run.odometry.length >= MIN_PATH_LENGTH:
        files.append(folder / 'paths.png')
        parts.append(write_figure(figures.paths_figure(run, driven), files[-1]))
    if run.derived or (turned and not len(run.turn_requests)):
        parts.append(f'<p>{escape(COMPUTED)}</p>')
    parts.append(f"<p>Beside this page: {', '.join(path.name for path in files[1:])}.</p>")
    write_output(page, document('Run report: ' + name, parts))
    return files


def write_figure(figure: figures.Figure, path: Path) -> str:
    """Write a figure as PNG. Returns HTML that contains the picture."""
    png = BytesIO()
    figures.save(figure, png)
    write_output(path, png.getvalue())
    return FIGURE.format(path.stem, base64.b64encode(png.getvalue()).decode('ascii'),
                         CAPTIONS[path.stem])


def _summary(run: RunData, model: RobotModel) -> str:
    date = datetime.fromtimestamp(run.start).strftime('%Y-%m-%d %H:%M')
    invalid = ''.join(f', {number} invalid messages of {run.topics.get(part, part)} dropped'
                      for part, number in run.dropped.items() if number)
    return (f'{model.name.capitalize()} on {date}, {run.duration:.1f} s, '
            f'{run.odometry.length:.2f} m driven, resets: {len(frame_intervals(run)) - 1}'
            f'{invalid}.')


def write_csv(run: RunData, path: Path) -> None:
    """Write one row for each odometry message. A cell without a value at this time is empty."""
    odometry, commands = run.odometry, run.commands
    at = odometry.time
    newest = last_until(commands.time, at)
    is_over = _chosen(commands.time, newest) < at - COMMAND_TIMEOUT
    newest = np.where(is_over, -1, newest)      # before the first command, `newest` is -1, too
    columns = {
        'time_s': at, 'odom_x_m': odometry.x, 'odom_y_m': odometry.y,
        'odom_yaw_deg': np.degrees(odometry.yaw),
        'imu_yaw_deg': np.degrees(wrap_all(run.imu.yaw_at(at))),
        'linear_m_s': odometry.linear,
        'linear_commanded_m_s': _chosen(commands.linear, newest),
        'angular_rad_s': np.interp(at, run.imu.time, run.imu.yaw_rate),
        'angular_commanded_rad_s': _chosen(commands.angular, newest)}
    write_table(path, [list(columns), *zip(*(
        [in_csv(name, value) for value in values] for name, values in columns.items()))])


def _chosen(values: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Returns the value at each index, NaN at index -1."""
    return np.append(values, math.nan)[index]


def numbered(word: str, columns: Sequence[Column], reports: Sequence[Any]) -> str:
    """Returns an HTML table with a numbered row for each report. `word` names a row, 'turn' or
    'drive'."""
    rows = []
    for count, report in enumerate(reports, 1):
        values = [(column.value(report), column.form) for column in columns]
        rows.append([str(count)] + [number(value, form) if form else value
                                    for value, form in values])
    return table([word] + [column.head for column in columns], rows, texts=('outcome',))


def write_reports(path: Path, run_name: str, word: str, columns: Sequence[Column],
                  reports: Sequence[Any]) -> None:
    """Write a CSV file with a numbered row for each report. `word` names a row, 'turn' or 'drive'.
    Each row has the run's name, since a spreadsheet may hold the rows of several runs."""
    rows: List[List[Any]] = [['run', word] + [column.name for column in columns]]
    for count, report in enumerate(reports, 1):
        cells = [in_csv(column.name, column.value(report)) for column in columns]
        rows.append([safe(run_name), count, *cells])
    write_table(path, rows)


def write_table(path: Path, rows: Iterable[Sequence[Any]]) -> None:
    text = StringIO(newline='')
    csv.writer(text, lineterminator='\n').writerows(rows)
    write_output(path, text.getvalue())


def in_csv(name: str, value: Any) -> str:
    """Returns the text of a value in the column `name`; '' if the value is unknown."""
    if isinstance(value, str):
        return safe(value)
    return number(value, '{:.3f}' if name.endswith('_deg') else '{:.4f}', '')
