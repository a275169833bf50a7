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
from typing import Any, Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from tb3_labs.command_line import output_folder, write_output
from tb3_labs.control.goal_state import DRIVING
from tb3_labs.geometry.arrays import last_until, wrap_all
from tb3_labs.report.motion.drives import STRAIGHT_AFTER, DriveReport, drives, yaw_offset
from tb3_labs.report.motion.resets_and_goals import epochs, goal_errors, spans
from tb3_labs.report.motion.turns import TurnReport, turn_reports
from tb3_labs.report.page import figures, timeline
from tb3_labs.report.page.document import degrees, document, number, safe, table
from tb3_labs.report.page.moments import broken_links, moments, printed_faults
from tb3_labs.report.run_data import Poses, RunData
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT, RobotModel

#: A pose belongs to the row of an odometry message if their times differ by at most this [s].
SAME_INSTANT = 0.02
#: A path shorter than this is not drawn [m].
MIN_PATH_LENGTH = 0.05
CAPTIONS = {
    'paths': 'The same path in the global and in the local frame, with the axes of both.',
    'turns': 'Angle left to what was asked, and rate of turn, from the first command on.'}
FIGURE = '<figure><img alt="{0}" src="data:image/png;base64,{1}"><figcaption>{2} File: {0}.png.' \
    '</figcaption></figure>'
NO_DRIVE = 'No drives are listed: neither goal_state nor the commands on cmd_vel show one.'
#: The paragraph of a page on the values that were not recorded.
COMPUTED = (
    'Some values are computed, because their topics were not recorded. Without goal_state, drives '
    'are found by the commands on cmd_vel; a movement that is neither a turn nor a drive counts as '
    'by hand. Without the topic turn, the asked angle is the nearest multiple of 90 degrees. '
    'Without tf, the local frame is declared (0, 0, 0) at the first sample, and again at each '
    'reset; a place in it is by the odometry, a heading by the IMU. Without current_goal, each '
    'goal is the goal of the lab, or the goal of the option --goal.')


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
    Column('peak_rate_rad_s', 'peak rate [rad/s]', lambda turn: turn.peak_rate, '{:.2f}'),
    Column('overshoot_deg', 'overshoot [deg]', lambda turn: math.degrees(turn.overshoot),
           '{:.2f}'),
    Column('true_error_deg', 'truly beyond [deg]', lambda turn: math.degrees(turn.true_error),
           '{:+.2f}'))
ASKED_BY = Column('asked_by', '', lambda turn: 'topic' if turn.was_sent else 'nearest', '')
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
    Column('rotate_to_goal_s', DRIVING[0] + ' [s]', lambda drive: drive.seconds[0], '{:.2f}'),
    Column('move_forward_s', DRIVING[1] + ' [s]', lambda drive: drive.seconds[1], '{:.2f}'),
    Column('rotate_to_final_s', DRIVING[2] + ' [s]', lambda drive: drive.seconds[2], '{:.2f}'),
    Column('stopped_s', 'stopped [s]', lambda drive: drive.duration - sum(drive.seconds), '{:.2f}'),
    Column('drift_deg', 'heading drift [deg]', lambda drive: math.degrees(drive.drift), '{:+.2f}'))
#: The page has two tables of drives: a table of goals and outcomes, and a table of the ways.
REACHED_COLUMNS, ALONG_COLUMNS = DRIVE_COLUMNS[1:10], DRIVE_COLUMNS[10:]

#: The note below the table of the ways.
DRIFT_NOTE = (f'Drift: the heading by the IMU at the end of MOVE_FORWARD, minus the heading '
              f'{STRAIGHT_AFTER} s after its start.')


def write_report(run: RunData, model: RobotModel, folder: Union[str, Path]) -> List[Path]:
    """Write the report of a run into a folder, which is made if it is missing. Returns the paths of
    the files, first the path of report.html. Raises OSError if the files cannot be written."""
    driven, turned = drives(run), turn_reports(run)
    folder = output_folder(folder)
    name = Path(run.name).name
    *files, turns_png, paths_png = (folder / file for file in (
        'report.html', 'run.csv', 'turns.csv', 'drives.csv', 'turns.png', 'paths.png'))
    write_csv(run, files[1])
    write_reports(folder, name, turned, driven)
    has_path = run.odometry.length >= MIN_PATH_LENGTH
    turns = write_figure(figures.turns_figure(run), turns_png)
    paths = write_figure(figures.paths_figure(run, driven) if has_path else None, paths_png)
    files += [path for path, figure in ((turns_png, turns), (paths_png, paths)) if figure]
    parts = [f'<p>{escape(text)}</p>' for text in [
        *(note[:1].upper() + note[1:] + '.' for note in run.notes), _summary(run, model)]]
    parts += [printed_faults(run), timeline.section(timeline.timeline(
        run, model, moments(run, turned, driven))), *broken_links(run)]
    if turned:
        parts += ['<h2>Turns</h2>', numbered('turn', TURN_COLUMNS, turned)]
    parts.append(turns)
    if driven:
        parts += ['<h2>Drives</h2>', numbered('drive', REACHED_COLUMNS, driven)]
    elif not turned:
        parts.append(f'<p>{NO_DRIVE}</p>')
    parts.append(paths)
    if driven:
        parts += ['<div class="next"></div>', '<h2>Along the way</h2>',
                  numbered('drive', ALONG_COLUMNS, driven),
                  f'<p>{DRIFT_NOTE}</p>']
    if run.derived or not all(turn.was_sent for turn in turned):
        parts.append(f'<p>{escape(COMPUTED)}</p>')
    parts.append(f"<p>Beside this page: {', '.join((path.name for path in files[1:]))}.</p>")
    write_output(files[0], document('Run report: ' + name, parts))
    return files


def write_figure(figure: Optional[figures.Figure], path: Path) -> str:
    """Write a figure as PNG. Returns HTML that contains the picture; '' if there is no figure."""
    if figure is None:
        return ''
    png = BytesIO()
    figures.save(figure, png)
    write_output(path, png.getvalue())
    return FIGURE.format(path.stem, base64.b64encode(png.getvalue()).decode('ascii'),
                         CAPTIONS[path.stem])


def _summary(run: RunData, model: RobotModel) -> str:
    date = datetime.fromtimestamp(run.start).strftime('%Y-%m-%d %H:%M')
    invalid = ''.join(f', {number} invalid messages of {run.topics.get(part, part)} dropped'
                      for part, number in run.dropped.items() if number)
    mean, drift = yaw_offset(run)
    return (f'{model.name.capitalize()} on {date}, {run.duration:.1f} s, '
            f'{run.odometry.length:.2f} m driven, resets: {len(epochs(run)) - 1}{invalid}. '
            f"IMU yaw minus odometry yaw: mean {degrees(mean, '{:+.2f}')} deg, change from the "
            f"first to the last tenth of the run {degrees(drift, '{:+.3f}')}.")


def write_csv(run: RunData, path: Path) -> None:
    """Write one row for each odometry message. A cell without a value at this time is empty."""
    odometry, local, truth = run.odometry, run.local_pose, run.ground_truth
    at = odometry.time
    error_time, distance, angle = goal_errors(run)
    in_order = spans(run)
    names = np.array([''] + [span.state for span in in_order], dtype=object)
    states = names[last_until([span.begin for span in in_order], at) + 1]
    near = _same_instant(error_time, at)
    newest = last_until(run.commands.time, at)
    is_over = np.append(run.commands.time, -math.inf)[newest] < at - COMMAND_TIMEOUT
    newest = np.where(is_over, -1, newest)      # before the first command, `newest` is -1, too
    columns = {
        'time_s': at, **_pose_columns('odom', odometry, np.arange(len(at))),
        **_pose_columns('local', local, _same_instant(local.time, at)),
        **_pose_columns('truth', truth, _same_instant(truth.time, at)),
        'imu_yaw_deg': np.degrees(wrap_all(run.imu.yaw_at(at))),
        'distance_error_m': _chosen(distance, near),
        'angle_error_deg': np.degrees(_chosen(angle, near)),
        'linear_m_s': odometry.linear,
        'linear_commanded_m_s': _chosen(run.commands.linear, newest),
        'angular_rad_s': np.interp(at, run.imu.time, run.imu.yaw_rate),
        'angular_commanded_rad_s': _chosen(run.commands.angular, newest), 'state': states}
    write_table(path, [list(columns), *zip(*(
        [in_csv(name, value) for value in values] for name, values in columns.items()))])


def _pose_columns(name: str, poses: Poses, index: np.ndarray) -> Dict[str, np.ndarray]:
    return {name + '_x_m': _chosen(poses.x, index), name + '_y_m': _chosen(poses.y, index),
            name + '_yaw_deg': np.degrees(_chosen(poses.yaw, index))}


def _same_instant(times: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Returns for each time in `at` the index of the last of `times` that differs from it by at
    most SAME_INSTANT; -1 if there is none."""
    index = last_until(times, at + SAME_INSTANT)
    is_older = np.append(times, -math.inf)[index] < at - SAME_INSTANT
    return np.where(is_older, -1, index)


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


def write_reports(folder: Path, name: str, turns: Sequence[TurnReport],
                  drives: Sequence[DriveReport]) -> None:
    """Write turns.csv and drives.csv with a row for each report. Each row has the run's `name`,
    since a spreadsheet may hold the rows of several runs."""
    for word, columns, reports in (('turn', (*TURN_COLUMNS, ASKED_BY), turns),
                                   ('drive', DRIVE_COLUMNS, drives)):
        rows: List[List[Any]] = [['run', word] + [column.name for column in columns]]
        for count, report in enumerate(reports, 1):
            cells = [in_csv(column.name, column.value(report)) for column in columns]
            rows.append([safe(name), count, *cells])
        write_table(folder / (word + 's.csv'), rows)


def write_table(path: Path, rows: Iterable[Sequence[Any]]) -> None:
    text = StringIO(newline='')
    csv.writer(text, lineterminator='\n').writerows(rows)
    write_output(path, text.getvalue())


def in_csv(name: str, value: Any) -> str:
    """Returns the text of a value in the column `name`; '' if the value is unknown."""
    if isinstance(value, str):
        return safe(value)
    return number(value, '{:.3f}' if name.endswith('_deg') else '{:.4f}', '')
