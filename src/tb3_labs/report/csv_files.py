"""The tables of a report as CSV, for spreadsheets and scripts: the run, its drives, its turns.

Units: as in the names of the columns; metres, degrees, seconds. An unknown value is an empty cell.
"""
import csv
import math
import re
from pathlib import Path
from typing import Any, Callable, Dict, List, Sequence, Tuple, Union

import numpy as np

from tb3_labs.geometry.angles import wrap_all
from tb3_labs.report import analysis, sensors
from tb3_labs.report.analysis import DRIVING, DriveReport
from tb3_labs.report.run_data import Poses, RunData
from tb3_labs.report.turns import TurnReport
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: A pose belongs to an odometry message that is no further from it [s].
SAME_INSTANT = 0.02
#: Where a spreadsheet would begin a formula: a cell of commas, or one of semicolons.
FORMULA = re.compile(r'(^|;)(?=["\s]*[=+\-@])|^(?=[\t\r])')
#: Number of rows that are turned into text at a time.
CSV_BLOCK = 5000

#: turns.csv: {column: (value of a TurnReport, digits)}; without digits the value is text.
TURN_COLUMNS: Dict[str, Tuple[Callable[[TurnReport], Any], int]] = {
    'begin_s': (lambda turn: turn.begin, 2),
    'asked_deg': (lambda turn: math.degrees(turn.asked), 1),
    'asked_by': (lambda turn: 'topic' if turn.was_said else 'nearest', -1),
    'turned_deg': (lambda turn: math.degrees(turn.turned), 2),
    'error_deg': (lambda turn: math.degrees(turn.error), 2),
    'true_error_deg': (lambda turn: math.degrees(turn.true_error), 2),
    'time_s': (lambda turn: turn.time, 2),
    'peak_rate_rad_s': (lambda turn: turn.peak_rate, 3),
    'overshoot_deg': (lambda turn: math.degrees(turn.overshoot), 2)}

#: drives.csv: the same of a DriveReport.
DRIVE_COLUMNS: Dict[str, Tuple[Callable[[DriveReport], Any], int]] = {
    'begin_s': (lambda drive: drive.begin, 2),
    'goal_x_m': (lambda drive: drive.goal.x if drive.goal else math.nan, 3),
    'goal_y_m': (lambda drive: drive.goal.y if drive.goal else math.nan, 3),
    'goal_yaw_deg': (lambda drive: math.degrees(drive.goal.yaw) if drive.goal else math.nan, 2),
    'outcome': (lambda drive: drive.outcome, -1),
    'distance_error_m': (lambda drive: drive.measured[0], 4),
    'angle_error_deg': (lambda drive: math.degrees(drive.measured[1]), 2),
    'true_distance_error_m': (lambda drive: drive.true[0], 4),
    'true_angle_error_deg': (lambda drive: math.degrees(drive.true[1]), 2),
    'drift_deg': (lambda drive: math.degrees(drive.drift), 2),
    'largest_deviation_deg': (lambda drive: math.degrees(drive.deviation), 2),
    'time_s': (lambda drive: drive.time, 2),
    'least_time_s': (lambda drive: drive.least_time, 2),
    'rotate_to_goal_s': (lambda drive: drive.in_state.get(DRIVING[0], 0.0), 2),
    'move_forward_s': (lambda drive: drive.in_state.get(DRIVING[1], 0.0), 2),
    'rotate_to_final_s': (lambda drive: drive.in_state.get(DRIVING[2], 0.0), 2)}


def safe(text: str) -> str:
    """Text in a cell, of which no spreadsheet makes a formula: "'" stands before it.

    Source: "CSV Injection", https://owasp.org/www-community/attacks/CSV_Injection.
    """
    return FORMULA.sub(lambda found: found.group() + "'", text)


def write_turns(path: Union[str, Path], runs: Sequence[Tuple[str, Sequence[TurnReport]]]) -> None:
    """Write turns.csv: a row for each turn of each run, (its name, its turns)."""
    _write_reports(path, 'turn', TURN_COLUMNS, runs)


def write_drives(path: Union[str, Path], runs: Sequence[Tuple[str, Sequence[DriveReport]]]) -> None:
    """Write drives.csv: a row for each drive of each run, (its name, its drives)."""
    _write_reports(path, 'drive', DRIVE_COLUMNS, runs)


def _write_reports(path: Union[str, Path], what: str, columns: Dict[str, Tuple[Any, int]],
                   runs: Sequence[Tuple[str, Sequence[Any]]]) -> None:
    with open(str(path), 'w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow(['run', what] + list(columns))
        for name, reports in runs:
            for number, report in enumerate(reports, 1):
                writer.writerow([safe(name), number] + [
                    _cell(value(report), digits) for value, digits in columns.values()])


def _cell(value: Any, digits: int) -> str:
    if digits < 0:
        return safe(str(value))
    return '{:.{}f}'.format(round(value, digits) + 0.0, digits) if math.isfinite(value) else ''


def write_csv(run: RunData, path: Union[str, Path]) -> None:
    """Write one row for each odometry message; a cell is empty if nothing was recorded then."""
    odometry, local, at = run.odometry, analysis.local_poses(run), run.odometry.time
    error_time, distance, angle = analysis.goal_errors(run)
    spans = analysis.spans(run)
    words = np.array([''] + [safe(span.state) for span in spans], dtype=object)
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
    texts: Any = np.char.mod('%.{}f'.format(digits), values).tolist()
    return ['' if text == 'nan' else text for text in texts]


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
