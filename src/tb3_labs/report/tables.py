"""The tables of a report: for its page, and as CSV for spreadsheets and scripts.

Units: as in the heads and in the names of the columns; metres, degrees, seconds. An unknown value
is a dash on the page, and an empty cell in a CSV file.
"""
import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, List, Sequence, Tuple, Union

import numpy as np

from tb3_labs.control.goal import DRIVING
from tb3_labs.geometry.angles import wrap_all
from tb3_labs.report.drives import (
    MAX_ANGULAR, STRAIGHT_AFTER, DriveReport, goal_errors, spans)
from tb3_labs.report.html import DASH, degrees, number, table
from tb3_labs.report.run_data import GAP, Poses, RunData, Samples
from tb3_labs.report.turns import TurnReport
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: Fields that are sent on change, and have no rate.
ON_CHANGE = 'frames', 'goals', 'states', 'resets', 'asked', 'control'
#: A pose belongs to an odometry message that is no further from it [s].
SAME_INSTANT = 0.02
#: A spreadsheet would begin a formula here: a cell of commas, or one of semicolons.
FORMULA = re.compile(r'(^|;)(?=["\s]*[=+\-@])|^(?=[\t\r])')
#: Number of rows that are turned into text at a time.
CSV_BLOCK = 5000

#: (head, value of a report, format) of each column.
Column = Tuple[str, Callable[[Any], Any], str]
#: The tables of turns and drives, on a page.
TURNS: Sequence[Column] = (
    ('asked [deg]', lambda turn: math.degrees(turn.asked), '{:+.0f}'),
    ('turned [deg]', lambda turn: math.degrees(turn.turned), '{:+.2f}'),
    ('beyond (+), short (-) [deg]', lambda turn: math.degrees(turn.error), '{:+.2f}'),
    ('time [s]', lambda turn: turn.time, '{:.2f}'),
    ('peak rate [rad/s]', lambda turn: turn.peak_rate, '{:.2f}'),
    ('overshoot [deg]', lambda turn: math.degrees(turn.overshoot), '{:.2f}'),
    ('truly beyond [deg]', lambda turn: math.degrees(turn.true_error), '{:+.2f}'))
DRIVES: Sequence[Column] = (
    ('off by [m]', lambda drive: drive.measured[0], '{:.4f}'),
    ('off by [deg]', lambda drive: math.degrees(drive.measured[1]), '{:+.2f}'),
    ('heading drift [deg]', lambda drive: math.degrees(drive.drift), '{:+.2f}'),
    ('time [s]', lambda drive: drive.time, '{:.2f}'),
    ('time / least', lambda drive: drive.time / drive.least_time if drive.least_time else math.nan,
     '{:.2f}'),
    ('truly off [m]', lambda drive: drive.true[0], '{:.4f}'),
    ('truly off [deg]', lambda drive: math.degrees(drive.true[1]), '{:+.2f}'))
#: turns.csv and drives.csv.
TURNS_CSV: Sequence[Column] = (
    ('begin_s', lambda turn: turn.begin, '{:.2f}'),
    ('asked_deg', lambda turn: math.degrees(turn.asked), '{:.1f}'),
    ('asked_by', lambda turn: 'topic' if turn.was_said else 'nearest', ''),
    ('turned_deg', lambda turn: math.degrees(turn.turned), '{:.2f}'),
    ('error_deg', lambda turn: math.degrees(turn.error), '{:.2f}'),
    ('true_error_deg', lambda turn: math.degrees(turn.true_error), '{:.2f}'),
    ('time_s', lambda turn: turn.time, '{:.2f}'),
    ('peak_rate_rad_s', lambda turn: turn.peak_rate, '{:.3f}'),
    ('overshoot_deg', lambda turn: math.degrees(turn.overshoot), '{:.2f}'))
DRIVES_CSV: Sequence[Column] = (
    ('begin_s', lambda drive: drive.begin, '{:.2f}'),
    ('goal_x_m', lambda drive: drive.goal.x if drive.goal else math.nan, '{:.3f}'),
    ('goal_y_m', lambda drive: drive.goal.y if drive.goal else math.nan, '{:.3f}'),
    ('goal_yaw_deg', lambda drive: math.degrees(drive.goal.yaw) if drive.goal else math.nan,
     '{:.2f}'),
    ('outcome', lambda drive: drive.outcome, ''),
    ('distance_error_m', lambda drive: drive.measured[0], '{:.4f}'),
    ('angle_error_deg', lambda drive: math.degrees(drive.measured[1]), '{:.2f}'),
    ('true_distance_error_m', lambda drive: drive.true[0], '{:.4f}'),
    ('true_angle_error_deg', lambda drive: math.degrees(drive.true[1]), '{:.2f}'),
    ('drift_deg', lambda drive: math.degrees(drive.drift), '{:.2f}'),
    ('largest_deviation_deg', lambda drive: math.degrees(drive.deviation), '{:.2f}'),
    ('time_s', lambda drive: drive.time, '{:.2f}'),
    ('least_time_s', lambda drive: drive.least_time, '{:.2f}'),
    ('rotate_to_goal_s', lambda drive: drive.in_state.get(DRIVING[0], 0.0), '{:.2f}'),
    ('move_forward_s', lambda drive: drive.in_state.get(DRIVING[1], 0.0), '{:.2f}'),
    ('rotate_to_final_s', lambda drive: drive.in_state.get(DRIVING[2], 0.0), '{:.2f}'))

#: A note below the table of the times.
ALONG = ('Drift: heading at the end of MOVE_FORWARD minus {} s after its begin, by the IMU. Least '
         'possible: turn, line, turn at the limits of the robot and {} rad/s.'.format(
             STRAIGHT_AFTER, MAX_ANGULAR))


# Tables of a page -----------------------------------------------------------------------------


def drives(reports: Sequence[DriveReport]) -> str:
    """Asked, reached, and the time of each drive."""
    rows = []
    for count, drive in enumerate(reports, 1):
        goal = drive.goal
        rows.append([str(count)] + (
            ['{:.2f}'.format(goal.x), '{:.2f}'.format(goal.y),
             '{:.1f}'.format(round(math.degrees(goal.yaw), 1) + 0.0)] if goal else [DASH] * 3)
            + [drive.outcome, number(drive.time, '{:.2f}'), number(drive.least_time, '{:.2f}')]
            + _error(drive.measured) + _error(drive.true))
    return table(['drive', 'asked x [m]', 'y [m]', 'yaw [deg]', 'outcome', 'time [s]',
                       'least possible [s]', 'off by [m]', 'off by [deg]', 'truly off [m]',
                       'truly off [deg]'], rows, words=('outcome',))


def along(reports: Sequence[DriveReport]) -> str:
    """The time in each state, and the drift of each drive."""
    rows = []
    for count, drive in enumerate(reports, 1):
        other = sum(seconds for state, seconds in drive.in_state.items()
                    if state not in DRIVING)
        rows.append([str(count)] + [
            number(drive.in_state.get(state, 0.0), '{:.2f}') for state in DRIVING] + [
            number(other, '{:.2f}'), number(drive.time / drive.least_time
                                            if drive.least_time else math.nan, '{:.2f}'),
            degrees(drive.drift, '{:+.2f}'), degrees(drive.deviation, '{:.2f}')])
    return table(
        ['drive'] + [state + ' [s]' for state in DRIVING]
        + ['stopped [s]', 'time / least', 'heading drift [deg]', 'largest deviation [deg]'], rows)


def turns(reports: Sequence[TurnReport]) -> str:
    """Asked, reached, and the time of each turn."""
    return table(
        ['turn', 'begins at [s]'] + [head for head, _, _ in TURNS],
        [[str(count), number(turn.begin, '{:.2f}')]
         + [number(value(turn), form) for _, value, form in TURNS]
         for count, turn in enumerate(reports, 1)])


def rates(run: RunData) -> str:
    """The rates and gaps of the topics that are sent all the time."""
    rows = []
    for part in run.recorded():
        if part in ON_CHANGE:
            continue
        told = rate(getattr(run, part))
        rows.append([run.topics.get(part, part), str(told.messages), number(told.mean, '{:.1f}'),
                     number(told.longest, '{:.3f}'), str(told.gaps),
                     number(told.longest_arrival, '{:.3f}'), str(run.dropped.get(part, 0))])
    return table(['topic', 'messages', 'mean rate [1/s]', 'longest gap [s]',
                       'gaps > {} s'.format(GAP), 'longest gap on arrival [s]',
                       'invalid messages'], rows)


@dataclass(frozen=True)
class Rate:
    """The rate of a topic, by the intervals at the sender if its messages have stamps."""

    messages: int
    mean: float                       # [1/s]
    longest: float                    # interval [s]
    gaps: int                         # intervals longer than GAP
    longest_arrival: float            # interval at the recorder [s]


def rate(samples: Samples) -> Rate:
    """The rate of one topic."""
    sent, arrived = np.diff(samples.time), np.diff(samples.arrival)
    if not len(sent):
        return Rate(len(samples), math.nan, math.nan, 0, math.nan)
    span = sent.sum()
    return Rate(len(samples), len(sent) / span if span > 0.0 else math.nan, float(sent.max()),
                int(np.count_nonzero(sent > GAP)), float(arrived.max()))


def _error(miss: Tuple[float, float]) -> List[str]:
    return [number(miss[0], '{:.4f}'), degrees(abs(miss[1]), '{:.2f}')]


# CSV ------------------------------------------------------------------------------------------


def safe(text: str) -> str:
    """Text in a cell, of which no spreadsheet makes a formula: "'" stands before it.

    Source: "CSV Injection", https://owasp.org/www-community/attacks/CSV_Injection.
    """
    return FORMULA.sub(lambda found: found.group() + "'", text)


def write_reports(path: Union[str, Path], columns: Sequence[Column],
                  runs: Sequence[Tuple[str, Sequence[Any]]]) -> None:
    """Write turns.csv or drives.csv: a row for each report of each run, (its name, its reports)."""
    with open(str(path), 'w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow(['run', 'turn' if columns is TURNS_CSV else 'drive']
                        + [name for name, _, _ in columns])
        for run, reports in runs:
            for count, report in enumerate(reports, 1):
                writer.writerow([safe(run), count] + [
                    number(value(report), form, '') if form else safe(str(value(report)))
                    for _, value, form in columns])


def write_csv(run: RunData, path: Union[str, Path]) -> None:
    """Write one row for each odometry message; a cell is empty if nothing was recorded then."""
    odometry, local, at = run.odometry, run.local_pose, run.odometry.time
    error_time, distance, angle = goal_errors(run)
    in_order = spans(run)
    words = np.array([''] + [safe(span.state) for span in in_order], dtype=object)
    states = words[np.searchsorted([span.begin for span in in_order], at, side='right')]
    columns = [('time_s', at, 4)] + _pose_columns('odom', odometry, np.arange(len(at)))
    columns += _pose_columns('local', local, _nearest(local.time, at, SAME_INSTANT))
    columns += _pose_columns('truth', run.ground_truth,
                             _nearest(run.ground_truth.time, at, SAME_INSTANT))
    near = _nearest(error_time, at, SAME_INSTANT)
    newest = np.searchsorted(run.commands.time, at, side='right') - 1
    newest[_chosen(run.commands.time, newest) < at - COMMAND_TIMEOUT] = -1
    columns += [
        ('imu_yaw_deg', np.degrees(wrap_all(run.imu.yaw_at(at))), 3),
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
    values = np.where(np.abs(values) < 0.5 * 10.0 ** -digits, 0.0, values)    # never -0.00
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
