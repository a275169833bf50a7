"""Writes the files of a report: report.html with all figures and tables, PNG files, and CSV files.

The heads of the columns name the units: metres, degrees, seconds.
"""
import base64
import math
from datetime import datetime
from html import escape
from io import BytesIO
from pathlib import Path
from typing import Dict, List, Optional, Union

import numpy as np

from tb3_labs.command_line import output_folder, write_output
from tb3_labs.geometry.arrays import last_until, wrap_all
from tb3_labs.report.motion.drives import drives, yaw_offset
from tb3_labs.report.motion.resets_and_goals import epochs, goal_errors, spans
from tb3_labs.report.motion.turns import turn_reports
from tb3_labs.report.page import figures, tables, timeline
from tb3_labs.report.page.document import degrees, document
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


def write_report(run: RunData, model: RobotModel, folder: Union[str, Path]) -> List[Path]:
    """Write the report of a run into a folder, which is made if it is missing. Returns the paths of
    the files, first the path of report.html. Raises OSError if the files cannot be written."""
    driven, turned = drives(run), turn_reports(run)
    folder = output_folder(folder)
    name = Path(run.name).name
    *files, turns_png, paths_png = (folder / file for file in (
        'report.html', 'run.csv', 'turns.csv', 'drives.csv', 'turns.png', 'paths.png'))
    write_csv(run, files[1])
    tables.write_reports(folder, name, turned, driven)
    has_path = run.odometry.length >= MIN_PATH_LENGTH
    turns = write_figure(figures.turns_figure(run), turns_png)
    paths = write_figure(figures.paths_figure(run, driven) if has_path else None, paths_png)
    files += [path for path, figure in ((turns_png, turns), (paths_png, paths)) if figure]
    parts = [f'<p>{escape(text)}</p>' for text in [
        *(note[:1].upper() + note[1:] + '.' for note in run.notes), _summary(run, model)]]
    parts += [printed_faults(run), timeline.section(timeline.timeline(
        run, model, moments(run, turned, driven))), *broken_links(run)]
    if turned:
        parts += ['<h2>Turns</h2>', tables.numbered('turn', tables.TURN_COLUMNS, turned)]
    parts.append(turns)
    if driven:
        parts += ['<h2>Drives</h2>', tables.numbered('drive', tables.REACHED_COLUMNS, driven)]
    elif not turned:
        parts.append(f'<p>{NO_DRIVE}</p>')
    parts.append(paths)
    if driven:
        parts += ['<div class="next"></div>', '<h2>Along the way</h2>',
                  tables.numbered('drive', tables.ALONG_COLUMNS, driven),
                  f'<p>{tables.DRIFT_NOTE}</p>']
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
    tables.write_table(path, [list(columns), *zip(*(
        [tables.in_csv(name, value) for value in values] for name, values in columns.items()))])


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
