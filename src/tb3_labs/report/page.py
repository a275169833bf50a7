"""The files of the report: report.html with everything in it, the figures as PNG, run.csv.

Units: as in the headings of the columns; metres and degrees.
"""
import csv
import math
from datetime import datetime
from html import escape
from pathlib import Path
from string import Template
from typing import Callable, List, Sequence, Tuple, Union

import numpy as np

from tb3_labs.control.goal_state import DRIVING
from tb3_labs.geometry.angles import wrap_all
from tb3_labs.report import analysis, figures, html, run_figures, sensors
from tb3_labs.report.analysis import DriveReport
from tb3_labs.report.epochs import epochs
from tb3_labs.report.run_data import Poses, RunData
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT, RobotModel

#: A pose belongs to an odometry message that is no further from it [s].
SAME_INSTANT = 0.02
#: Number of rows that are turned into text at a time.
CSV_BLOCK = 5000
UNKNOWN = '\N{EN DASH}'
NO_DRIVES = ('No drives are listed: the recording holds no goal_state with a drive in it. The '
             'local frame is {}. To get them, record /goal_state, /current_goal, /local_pose and '
             '/tf too.')
CAPTIONS = {
    'paths': 'The same path in the global and in the local frame, with the axes of both.',
    'errors': 'Distance and angle left to the goal, by local_pose. Labels: errors at rest.',
    'heading': 'The IMU\'s heading, and how its difference from the odometry\'s varies.',
    'speeds': 'Commanded and measured speeds.'}

PAGE = Template('''<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Run report: $name</title><style>
$style
</style></head><body>
<h1>Run report: $name</h1>
<p>$summary</p>
<h2>Drives</h2>
$drives
$paths
$errors
<div class="next"></div>
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
    parts = dict.fromkeys(CAPTIONS, '')
    drawings = ('paths', run_figures.paths), ('errors', run_figures.errors), (
        'heading', run_figures.heading), ('speeds', run_figures.speeds)
    for number, (name, draw) in enumerate(drawings):
        progress(number / (len(drawings) + 1))
        figure = draw(run, model)
        if figure is not None:
            path = folder / (name + '.png')
            figures.save(figure, path)
            parts[name] = html.image(path, CAPTIONS[name])
    progress(len(drawings) / (len(drawings) + 1))
    write_csv(run, folder / 'run.csv')
    drives = analysis.drives(run, model)
    page = folder / 'report.html'
    page.write_text(PAGE.substitute(
        parts, style=html.STYLE, name=escape(Path(run.name).name), summary=_summary(run, model),
        drives=_drives(run, drives), along=_along(drives), rates=_rates(run)), encoding='utf-8')
    progress(1.0)
    return page


def _summary(run: RunData, model: RobotModel) -> str:
    offset, resets = sensors.yaw_offset(run), len(epochs(run)) - 1
    words = '{} on {}, {:.1f} s, {:.2f} m driven, {} reset{}. '.format(
        model.name.capitalize(), datetime.fromtimestamp(run.start).strftime('%Y-%m-%d %H:%M'),
        run.duration, sensors.path_length(run.odometry), resets or 'no',
        '' if resets == 1 else 's')
    words += 'IMU yaw minus odometry yaw: mean {} deg, standard deviation {}, change from the ' \
        'first to the last tenth of the run {}.'.format(
            *(_number(math.degrees(value), form) for value, form in
              ((offset.mean, '{:+.2f}'), (offset.spread, '{:.3f}'), (offset.drift, '{:+.3f}'))))
    return escape(words)


def _drives(run: RunData, drives: Sequence[DriveReport]) -> str:
    if not drives:
        frame = ('the recorded one' if len(run.local_pose) else
                 'taken as declared (0, 0, 0) at the first sample')
        return '<p>{}</p>'.format(escape(NO_DRIVES.format(frame)))
    rows = []
    for number, drive in enumerate(drives, 1):
        goal = drive.goal
        rows.append([str(number)] + (
            ['{:.2f}'.format(goal.x), '{:.2f}'.format(goal.y),
             '{:.1f}'.format(round(math.degrees(goal.yaw), 1) + 0.0)] if goal else [UNKNOWN] * 3)
            + [drive.outcome, _number(drive.time, '{:.2f}'), _number(drive.least_time, '{:.2f}')]
            + _error(drive.measured) + _error(drive.true))
    return html.table(['drive', 'asked x [m]', 'y [m]', 'yaw [deg]', 'outcome', 'time [s]',
                       'least possible [s]', 'off by [m]', 'off by [deg]', 'truly off [m]',
                       'truly off [deg]'], rows, words=('outcome',))


def _along(drives: Sequence[DriveReport]) -> str:
    if not drives:
        return ''
    rows = []
    for number, drive in enumerate(drives, 1):
        other = sum(seconds for state, seconds in drive.in_state.items()
                    if state not in DRIVING)
        rows.append([str(number)] + [
            _number(drive.in_state.get(state, 0.0), '{:.2f}') for state in DRIVING] + [
            _number(other, '{:.2f}'), _number(drive.time / drive.least_time
                                              if drive.least_time else math.nan, '{:.2f}'),
            _number(math.degrees(drive.drift), '{:+.2f}'),
            _number(math.degrees(drive.deviation), '{:.2f}')])
    return '<h2>Along the way</h2>' + html.table(
        ['drive'] + [state + ' [s]' for state in DRIVING]
        + ['stopped [s]', 'time / least', 'heading drift [deg]', 'largest deviation [deg]'],
        rows) + ('<p>Drift: heading at the end of MOVE_FORWARD minus {} s after its begin, by the '
                 'IMU. Least possible: turn, line, turn at the limits of the robot and {} rad/s.'
                 '</p>'.format(analysis.STRAIGHT_AFTER, analysis.MAX_ANGULAR))


def _rates(run: RunData) -> str:
    rows = []
    for part in run.recorded():
        if part in ('frames', 'goals', 'states'):
            continue                          # sent on change: no rate
        rate = sensors.rate(getattr(run, part))
        rows.append([run.topics.get(part, part), str(rate.messages), _number(rate.mean, '{:.1f}'),
                     _number(rate.longest, '{:.3f}'), str(rate.gaps),
                     _number(rate.longest_arrival, '{:.3f}'), str(run.dropped.get(part, 0))])
    return html.table(['topic', 'messages', 'mean rate [1/s]', 'longest gap [s]',
                       'gaps > {} s'.format(sensors.GAP), 'longest gap on arrival [s]',
                       'invalid messages'], rows)


def _error(miss: Tuple[float, float]) -> List[str]:
    return [_number(miss[0], '{:.4f}'), _number(abs(math.degrees(miss[1])), '{:.2f}')]


def _number(value: float, form: str) -> str:
    return form.format(value) if math.isfinite(value) else UNKNOWN


def write_csv(run: RunData, path: Union[str, Path]) -> None:
    """Write one row for each odometry message; a cell is empty if nothing was recorded then."""
    odometry, local, at = run.odometry, analysis.local_poses(run), run.odometry.time
    error_time, distance, angle = analysis.goal_errors(run)
    spans = analysis.spans(run)
    words = np.array([''] + [span.state for span in spans], dtype=object)
    states = words[np.searchsorted([span.begin for span in spans], at, side='right')]
    columns = [('time_s', at, 4)] + _pose_columns('odom', odometry, np.arange(len(at)))
    columns += _pose_columns('local', local, _nearest(local.time, at, SAME_INSTANT))
    columns += _pose_columns('truth', run.ground_truth,
                             _nearest(run.ground_truth.time, at, SAME_INSTANT))
    near = _nearest(error_time, at, SAME_INSTANT)
    newest = np.searchsorted(run.commands.time, at, side='right') - 1
    newest[_chosen(run.commands.time, newest) < at - COMMAND_TIMEOUT] = -1
    columns += [
        ('imu_yaw_deg', np.degrees(wrap_all(sensors.imu_yaw_at(run, at))), 3),
        ('distance_error_m', _chosen(distance, near), 4),
        ('angle_error_deg', np.degrees(_chosen(angle, near)), 3),
        ('linear_m_s', odometry.linear, 4),
        ('linear_commanded_m_s', _chosen(run.commands.linear, newest), 4),
        ('angular_rad_s', np.interp(at, run.imu.time, run.imu.yaw_rate), 4),
        ('angular_commanded_rad_s', _chosen(run.commands.angular, newest), 4)]
    with open(str(path), 'w', newline='') as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow([name for name, _, _ in columns] + ['state'])
        for begin in range(0, len(at), CSV_BLOCK):
            block = slice(begin, begin + CSV_BLOCK)
            writer.writerows(zip(*(_texts(values[block], digits) for _, values, digits in columns),
                                 states[block]))


def _texts(values: np.ndarray, digits: int) -> List[str]:
    return ['' if text == 'nan' else text
            for text in np.char.mod('%.{}f'.format(digits), values).tolist()]


def _pose_columns(name: str, poses: Poses,
                  index: np.ndarray) -> List[Tuple[str, np.ndarray, int]]:
    return [(name + '_x_m', _chosen(poses.x, index), 4),
            (name + '_y_m', _chosen(poses.y, index), 4),
            (name + '_yaw_deg', np.degrees(_chosen(poses.yaw, index)), 3)]


def _nearest(times: np.ndarray, at: np.ndarray, within: float) -> np.ndarray:
    """Index of the time nearest to each of `at`; -1 if none is near enough."""
    if not len(times):
        return np.full(len(at), -1)
    after = np.minimum(np.searchsorted(times, at), len(times) - 1)
    before = np.maximum(after - 1, 0)
    index = np.where(np.abs(times[after] - at) < np.abs(times[before] - at), after, before)
    return np.where(np.abs(times[index] - at) <= within, index, -1)


def _chosen(values: np.ndarray, index: np.ndarray) -> np.ndarray:
    """`values` at each index, NaN for index -1."""
    return np.append(values, math.nan)[index]
