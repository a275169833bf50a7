"""Writes the files of a report: report.html with all figures and tables, PNG files, and CSV files.

Each column has its unit (metres, degrees or seconds) in its title on the page, and in its name in a
CSV file. The cell of an unknown value is empty.
"""
import base64
import csv
import math
from datetime import datetime
from html import escape
from io import StringIO
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Sequence, Union

import numpy as np

from tb3_labs.command_line import output_folder, write_output
from tb3_labs.geometry.arrays import index_at_or_before, wrap_all
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.recording.run_data import RunData
from tb3_labs.report.motion.drives import TURN_OVERLAP_TIME, DriveReport, drive_reports
from tb3_labs.report.motion.resets_and_goals import frame_intervals
from tb3_labs.report.motion.turns import recorded_requests, turn_reports
from tb3_labs.report.page import printed_figures, timeline
from tb3_labs.report.page.document import document, number_text, safe_cell, table
from tb3_labs.report.page.moments import hints_of_nodes, printed_faults, timeline_events
from tb3_labs.robot.turtlebot3 import RobotModel

MIN_PATH_LENGTH = 0.05      # [m]
CAPTIONS = {
    'paths': 'The same path in the global and in the local frame, with the axes of both.',
    'turns': 'Remaining angle, and rate of turn, from the first command on.'}
NO_DRIVE = 'No drives are listed: neither goal_state nor the commands on cmd_vel show one.'
COMPUTED_NOTE = (
    'Some topics were not recorded, so their values are computed: drives and turns by the commands '
    'on cmd_vel, asked angles of which nothing was recorded as the nearest multiple of 90 degrees, '
    'the local frame by the lines of resets, the odometry and the IMU, and goals by the lab or the '
    'option --goal.')


def _goal_of(drive: DriveReport) -> Pose2:
    return drive.goal or Pose2(math.nan, math.nan, math.nan)


class Column(NamedTuple):
    """A column of a table that has a row for each report."""

    name: str                       # the name in a CSV file
    title: str                      # the title on a page
    value: Callable[[Any], Any]     # returns the value for a report
    form: str                       # the format of the value, or '' if the value is a text

    def text(self, report: Any) -> str:
        value = self.value(report)
        if not self.form:
            return safe_cell(value)
        return number_text(value, self.form, unknown='')


TURN_COLUMNS = (
    Column('begin_s', 'begins at [s]', lambda turn: turn.begin, '{:.2f}'),
    Column('asked_deg', 'asked [deg]', lambda turn: math.degrees(turn.requested), '{:+.0f}'),
    Column('turned_deg', 'turned [deg]', lambda turn: math.degrees(turn.turned), '{:+.2f}'),
    Column('error_deg', 'beyond (+), short (-) [deg]', lambda turn: math.degrees(turn.error),
           '{:+.2f}'),
    Column('time_s', 'time [s]', lambda turn: turn.end - turn.begin, '{:.2f}'),
    Column('true_error_deg', 'truly beyond [deg]', lambda turn: math.degrees(turn.true_error),
           '{:+.2f}'))
DRIVE_COLUMNS = (
    Column('begin_s', 'begins at [s]', lambda drive: drive.begin, '{:.2f}'),
    Column('goal_x_m', 'asked x [m]', lambda drive: _goal_of(drive).x, '{:.2f}'),
    Column('goal_y_m', 'y [m]', lambda drive: _goal_of(drive).y, '{:.2f}'),
    Column('goal_yaw_deg', 'yaw [deg]', lambda drive: math.degrees(_goal_of(drive).yaw), '{:.1f}'),
    Column('outcome', 'outcome', lambda drive: drive.outcome_text, ''),
    Column('time_s', 'time [s]', lambda drive: drive.end - drive.begin, '{:.2f}'),
    Column('distance_error_m', 'off by [m]', lambda drive: drive.error[0], '{:.4f}'),
    Column('angle_error_deg', 'off by [deg]', lambda drive: math.degrees(drive.error[1]),
           '{:+.2f}'),
    Column('true_distance_error_m', 'truly off [m]', lambda drive: drive.true_error[0], '{:.4f}'),
    Column('true_angle_error_deg', 'truly off [deg]',
           lambda drive: math.degrees(drive.true_error[1]), '{:+.2f}'),
    Column('drift_deg', 'heading drift [deg]', lambda drive: math.degrees(drive.drift), '{:+.2f}'))
DRIFT_NOTE = (f'Drift: the heading by the IMU at the end of MOVE_FORWARD, minus the heading '
              f'{TURN_OVERLAP_TIME} s after its start.')


def write_report(run: RunData, model: RobotModel, folder: Union[str, Path]) -> List[Path]:
    """Write the report of a run into a folder, which is made if it is missing. Returns the paths of
    the files, report.html first. Raises OSError if a file cannot be written."""
    folder = output_folder(folder)
    name = Path(run.name).name
    turns = turn_reports(run)
    drives = drive_reports(run)
    files: Dict[str, Any] = {
        'run.csv': samples_csv(run), 'turns.csv': _csv(name, 'turn', TURN_COLUMNS, turns),
        'drives.csv': _csv(name, 'drive', DRIVE_COLUMNS, drives)}
    notes = [note[:1].upper() + note[1:] + '.' for note in run.notes]
    parts = [f'<p>{escape(text)}</p>' for text in [*notes, _summary(run, model)]]
    timeline_data = timeline.timeline_data(run, model, timeline_events(run, turns, drives))
    parts += [printed_faults(run), timeline.timeline_html(timeline_data), *hints_of_nodes(run)]
    if turns:
        files['turns.png'] = printed_figures.png(printed_figures.turns_figure(run))
        parts += ['<h2>Turns</h2>', _table('turn', TURN_COLUMNS, turns),
                  _figure('turns', files['turns.png'])]
    if drives:
        parts += ['<h2>Drives</h2>', _table('drive', DRIVE_COLUMNS, drives),
                  f'<p>{DRIFT_NOTE}</p>']
    elif not turns:
        parts.append(f'<p>{NO_DRIVE}</p>')
    if run.odometry.length >= MIN_PATH_LENGTH:
        files['paths.png'] = printed_figures.png(printed_figures.paths_figure(run, drives))
        parts.append(_figure('paths', files['paths.png']))
    if run.derived or (turns and not len(recorded_requests(run))):
        parts.append(f'<p>{escape(COMPUTED_NOTE)}</p>')
    parts.append(f"<p>Beside this page: {', '.join(files)}.</p>")
    files = {'report.html': document('Run report: ' + name, parts), **files}
    for file, content in files.items():
        write_output(folder / file, content)
    return [folder / file for file in files]


def _figure(name: str, image: bytes) -> str:
    data = base64.b64encode(image).decode('ascii')
    return (f'<figure><img alt="{name}" src="data:image/png;base64,{data}"><figcaption>'
            f'{CAPTIONS[name]} File: {name}.png.</figcaption></figure>')


def _summary(run: RunData, model: RobotModel) -> str:
    date = datetime.fromtimestamp(run.start).strftime('%Y-%m-%d %H:%M')
    return (f'{model.name.capitalize()} on {date}, {run.duration:.1f} s, '
            f'{run.odometry.length:.2f} m driven, resets: {len(frame_intervals(run)) - 1}.')


def samples_csv(run: RunData) -> str:
    """Returns a CSV file with a row for each odometry message."""
    times = run.odometry.time
    commands = run.commands.with_timeouts()
    # before the first command the index is -1, which selects the appended NaN
    newest_indices = index_at_or_before(commands.time, times)
    columns = {
        'time_s': times, 'odom_x_m': run.odometry.x, 'odom_y_m': run.odometry.y,
        'odom_yaw_deg': np.degrees(run.odometry.yaw),
        'imu_yaw_deg': np.degrees(wrap_all(run.imu.yaw_at(times))),
        'linear_m_s': run.odometry.linear,
        'linear_commanded_m_s': np.append(commands.linear, np.nan)[newest_indices],
        'angular_rad_s': np.interp(times, run.imu.time, run.imu.yaw_rate),
        'angular_commanded_rad_s': np.append(commands.angular, np.nan)[newest_indices]}
    text = StringIO()
    np.savetxt(text, np.column_stack([*columns.values()]), fmt='%.4f', delimiter=',',
               header=','.join(columns), comments='')
    return text.getvalue().replace('nan', '')


def _rows(columns: Sequence[Column], reports: Sequence[Any]) -> List[List[str]]:
    return [[str(number), *(column.text(report) for column in columns)]
            for number, report in enumerate(reports, 1)]


def _table(word: str, columns: Sequence[Column], reports: Sequence[Any]) -> str:
    """Returns an HTML table. `word` is the title of the first column, 'turn' or 'drive'."""
    titles = [word] + [column.title for column in columns]
    return table(titles, _rows(columns, reports), text_columns=('outcome',))


def _csv(run_name: str, word: str, columns: Sequence[Column], reports: Sequence[Any]) -> str:
    """Returns a CSV file. `word` is the name of the second column, 'turn' or 'drive'. Each row
    begins with the run's name, so that a spreadsheet can contain the rows of several runs."""
    text = StringIO(newline='')
    writer = csv.writer(text, lineterminator='\n')
    writer.writerow(['run', word] + [column.name for column in columns])
    writer.writerows([safe_cell(run_name), *row] for row in _rows(columns, reports))
    return text.getvalue()
