"""Writes the files of a report: report.html, which contains all figures and tables, PNG, and CSV.

The headings of the columns name the units: metres, degrees, seconds.
"""
import base64
import math
from datetime import datetime
from html import escape
from io import BytesIO
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Union

import numpy as np

from tb3_labs.command_line import output_folder, write_output
from tb3_labs.geometry.angle_arrays import wrap_all
from tb3_labs.handout import MOUSE_FULL
from tb3_labs.report.motion.drives import drives
from tb3_labs.report.motion.movements import MOVEMENT_PAUSE, moving
from tb3_labs.report.motion.resets_and_goals import epochs, goal_errors, spans
from tb3_labs.report.motion.turns import TurnReport, turn_reports
from tb3_labs.report.page import figures, tables, timeline
from tb3_labs.report.page.document import degrees, document, number
from tb3_labs.report.page.moments import broken_links, moments, printed_faults
from tb3_labs.report.run_data import Poses, RunData, yaw_offset
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT, RobotModel
from tb3_labs.watch.variables import last_until

#: A pose belongs to the row of an odometry message if both times differ by at most this [s].
SAME_INSTANT = 0.02
#: A path shorter than this is not drawn [m].
SHORTEST_PATH = 0.05
CAPTIONS = {
    'paths': 'The same path in the global and in the local frame, with the axes of both.',
    'turns': 'Angle left to what was asked, and rate of turn, from the first command on.'}
FIGURE = '<figure><img alt="{0}" src="data:image/png;base64,{1}"><figcaption>{2} File: {0}.png.' \
    '</figcaption></figure>'
NO_DRIVES_LISTED = 'No drives are listed: {}. The local frame is {}.'
NO_COMMANDS = ('no command came on cmd_vel (does the terminal of a node that should drive show an '
               'exception? Does rosnode info name cmd_vel among its publications?)')
ONLY_ZEROS = 'each command on cmd_vel is a zero, {} in all'
NO_DRIVE = 'neither goal_state nor the commands show one'
#: Sentences of the page on the rule by which turns and drives were found.
BY_CONTROL = ('Drives are found by the commands and ctrl_relinq. A movement while a node had '
              'control is a drive; a turn alone is one only if it followed a reset or control at '
              'once, or was cut off. All other movements are by hand, or by another program.')
PAD_ALONE = ('A gamepad (joy) was recorded, but it never gave control (ctrl_relinq): all movements '
             'count as by hand.')
WITH_MOUSE = ('Turns are found by the commands. A turn begins and ends at rest, without forward '
              'speed, and is faster than any by the mouse ({:g} rad/s). All other movements are '
              'by hand, or by another program.'.format(MOUSE_FULL))
BY_SHAPE = ('Turns and drives are found by the commands. A turn begins and ends at rest, without '
            'forward speed. A drive is a turn, a straight line and a turn, with pauses under '
            '{:g} s. All other movements are by hand, or by another program.'.format(
                MOVEMENT_PAUSE))


def write_report(run: RunData, model: RobotModel, folder: Union[str, Path]) -> List[Path]:
    """Write the report of a run into a folder, which is made if it is missing. Returns the paths of
    the files, first the path of report.html. Raises OSError if the files cannot be written."""
    driven, turned = drives(run), turn_reports(run)
    folder = output_folder(folder)
    name = Path(run.name).name
    *files, turns_png, paths_png = (folder / each for each in (
        'report.html', 'run.csv', 'turns.csv', 'drives.csv', 'turns.png', 'paths.png'))
    write_csv(run, files[1])
    tables.write_reports(folder, name, turned, driven)
    has_path = run.odometry.length >= SHORTEST_PATH
    turns = write_figure(figures.turns_figure(run), turns_png)
    paths = write_figure(figures.paths_figure(run, driven) if has_path else None, paths_png)
    files += [path for path, figure in ((turns_png, turns), (paths_png, paths)) if figure]
    parts = [f'<p>{escape(text)}</p>' for text in [
        *(note[:1].upper() + note[1:] + '.' for note in run.notes), _summary(run, model)]]
    parts += [printed_faults(run), timeline.section(timeline.timeline(
        run, model, moments(run, turned, driven))), *broken_links(run)]
    if turned:
        parts.append(_part('Turns', tables.TURN_COLUMNS, turned, _rule_of_turns(run, turned)))
    parts.append(turns)
    if driven or not turned:
        parts.append(_part('Drives', tables.REACHED_COLUMNS, driven,
                           _rule_of_drives(run) if driven else nothing_driven(run)))
    parts.append(paths)
    if driven:
        parts += ['<div class="next"></div>',
                  _part('Along the way', tables.ALONG_COLUMNS, driven, tables.DRIFT_NOTE)]
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
    offset, resets = yaw_offset(run), len(epochs(run)) - 1
    invalid = ''.join(', {} invalid messages of {} dropped'.format(
        number, run.topics.get(part, part)) for part, number in run.dropped.items() if number)
    return (
        '{} on {}, {:.1f} s, {:.2f} m driven, {} reset{}{}. IMU yaw minus odometry yaw: mean {} '
        'deg, standard deviation {}, change from the first to the last tenth of the run {}.'.format(
            model.name.capitalize(), datetime.fromtimestamp(run.start).strftime('%Y-%m-%d %H:%M'),
            run.duration, run.odometry.length, resets or 'no', '' if resets == 1 else 's',
            invalid,
            degrees(offset.mean, '{:+.2f}'), degrees(offset.spread, '{:.3f}'),
            degrees(offset.drift, '{:+.3f}')))


def _part(title: str, columns: Sequence[tables.Column], reports: Sequence[Any], note: str) -> str:
    """Returns the HTML of a heading, the table of the reports, and the note below the table."""
    row = 'turn' if columns is tables.TURN_COLUMNS else 'drive'
    return '<h2>{}</h2>{}<p>{}</p>'.format(
        title, tables.numbered(row, columns, reports) if reports else '', escape(note))


def nothing_driven(run: RunData) -> str:
    reason = NO_COMMANDS
    if len(run.states) or moving(run.commands).any():
        reason = NO_DRIVE
    elif len(run.commands):
        reason = ONLY_ZEROS.format(len(run.commands))
    text = NO_DRIVES_LISTED.format(
        reason, _declared(run) if 'frames' in run.derived else 'the recorded one')
    return text if len(run.states) or not len(run.commands) else text + ' ' + _rule(run)


def _declared(run: RunData) -> str:
    """Returns in words when and where ``local`` was declared in a run without tf."""
    parts = ['taken as declared (0, 0, 0) at the first sample']
    for k, time in enumerate(run.resets.time):
        pose = run.resets.pose(k)
        parts.append('({} m, {} m, {} deg) at {:.1f} s'.format(
            number(pose.x, '{:.2f}'), number(pose.y, '{:.2f}'), degrees(pose.yaw, '{:.1f}'), time))
    return ', then '.join(parts)


def _rule_of_drives(run: RunData) -> str:
    """Returns the rule by which the drives of a run were found; '' if the states were recorded."""
    parts = []
    if 'states' in run.derived:
        parts.append(_rule(run))
    if 'goals' in run.derived:
        goal = run.goals.pose(0)
        parts.append('Goal: taken as ({:g} m, {:g} m, {:g} deg), see --goal.'.format(
            goal.x, goal.y, round(math.degrees(goal.yaw), 3) + 0.0))
    if 'frames' in run.derived:
        parts.append('The local frame is {}; the place in it is that of the odometry, the heading '
                     'that of the IMU.'.format(_declared(run)))
    return ' '.join(parts)


def _rule_of_turns(run: RunData, reports: Sequence[TurnReport]) -> str:
    parts = [_rule(run)] if 'states' not in run.derived else []
    if not all(turn.was_sent for turn in reports):
        parts.append('Asked: taken as the nearest multiple of 90 degrees{}.'.format(
            ' where topic turn said nothing' if len(run.turn_requests) else ''))
    return ' '.join(parts)


def _rule(run: RunData) -> str:
    if len(run.control):
        return BY_CONTROL
    if 'joy' in run.devices:
        return PAD_ALONE
    return WITH_MOUSE if 'mouse_info' in run.devices else BY_SHAPE


def write_csv(run: RunData, path: Path) -> None:
    """Write one row for each odometry message. A cell without a value at this time is empty."""
    odometry, local, truth, at = run.odometry, run.local_pose, run.ground_truth, run.odometry.time
    error_time, distance, angle = goal_errors(run)
    in_order = spans(run)
    names = np.array([''] + [span.state for span in in_order], dtype=object)
    states = names[last_until([span.begin for span in in_order], at) + 1]
    near = _nearest(error_time, at)
    newest = last_until(run.commands.time, at)
    is_over = np.append(run.commands.time, -math.inf)[newest] < at - COMMAND_TIMEOUT
    newest = np.where(is_over, -1, newest)      # it is also -1 before the first command
    columns = {
        'time_s': at, **_pose_columns('odom', odometry, np.arange(len(at))),
        **_pose_columns('local', local, _nearest(local.time, at)),
        **_pose_columns('truth', truth, _nearest(truth.time, at)),
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


def _nearest(times: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Returns for each time in `at` the index of the nearest of `times`; -1 if they differ by more
    than SAME_INSTANT."""
    if not len(times):
        return np.full(len(at), -1)
    after = np.minimum(np.searchsorted(times, at), len(times) - 1)
    before = np.maximum(after - 1, 0)
    index = np.where(np.abs(times[after] - at) < np.abs(times[before] - at), after, before)
    return np.where(np.abs(times[index] - at) <= SAME_INSTANT, index, -1)


def _chosen(values: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Returns the value at each index, NaN at index -1."""
    return np.append(values, math.nan)[index]
