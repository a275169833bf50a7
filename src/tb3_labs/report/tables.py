"""The tables of a report: for its page, and as CSV for spreadsheets and scripts.

Units: as in the heads and in the names of the columns; metres, degrees, seconds. An unknown value
is a dash on the page, and an empty cell in a CSV file.
"""
import csv
import math
import re
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Sequence, Tuple

import numpy as np

from tb3_labs.control.goal import DRIVING
from tb3_labs.geometry.angles import wrap_all
from tb3_labs.report.drives import (
    MAX_ANGULAR, STRAIGHT_AFTER, DriveReport, goal_errors, spans)
from tb3_labs.report.html import DASH, number, table
from tb3_labs.report.movements import Movement
from tb3_labs.report.run_data import GAP, Poses, RunData, Samples
from tb3_labs.report.turns import TurnReport
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: Fields that are sent on change, and have no rate.
ON_CHANGE = 'frames', 'goals', 'states', 'resets', 'asked', 'control'
#: A pose belongs to an odometry message that is no further from it [s].
SAME_INSTANT = 0.02
#: A spreadsheet would begin a formula here: a cell of commas, or one of semicolons.
FORMULA = re.compile(r'(^|;)(?=["\s]*[=+\-@])|^(?=[\t\r])')


def safe(text: str) -> str:
    """Text in a cell, of which no spreadsheet makes a formula: "'" stands before it.

    Source: "CSV Injection", https://owasp.org/www-community/attacks/CSV_Injection.
    """
    return FORMULA.sub(lambda found: found.group() + "'", text)


def _goal(drive: DriveReport) -> Tuple[float, float, float]:
    """(x [m], y [m], yaw [deg]) of the goal."""
    goal = drive.goal
    return (goal.x, goal.y, math.degrees(goal.yaw)) if goal else (math.nan, math.nan, math.nan)


#: (head, value of a report, format; '' for a text) of each column.
Column = Tuple[str, Callable[[Any], Any], str]
#: The turns, on a page.
TURNS: Sequence[Column] = (
    ('asked [deg]', lambda turn: math.degrees(turn.asked), '{:+.0f}'),
    ('turned [deg]', lambda turn: math.degrees(turn.turned), '{:+.2f}'),
    ('beyond (+), short (-) [deg]', lambda turn: math.degrees(turn.error), '{:+.2f}'),
    ('time [s]', lambda turn: turn.time, '{:.2f}'),
    ('peak rate [rad/s]', lambda turn: turn.peak_rate, '{:.2f}'),
    ('overshoot [deg]', lambda turn: math.degrees(turn.overshoot), '{:.2f}'),
    ('truly beyond [deg]', lambda turn: math.degrees(turn.true_error), '{:+.2f}'))
#: The drives, on a page of several runs.
DRIVES: Sequence[Column] = (
    ('off by [m]', lambda drive: drive.measured[0], '{:.4f}'),
    ('off by [deg]', lambda drive: math.degrees(drive.measured[1]), '{:+.2f}'),
    ('heading drift [deg]', lambda drive: math.degrees(drive.drift), '{:+.2f}'),
    ('time [s]', lambda drive: drive.time, '{:.2f}'),
    ('time / least', lambda drive: drive.time_to_least, '{:.2f}'),
    ('truly off [m]', lambda drive: drive.true[0], '{:.4f}'),
    ('truly off [deg]', lambda drive: math.degrees(drive.true[1]), '{:+.2f}'))
#: The drives, on the page of their run: asked and reached; and along the way.
REACHED: Sequence[Column] = (
    ('asked x [m]', lambda drive: _goal(drive)[0], '{:.2f}'),
    ('y [m]', lambda drive: _goal(drive)[1], '{:.2f}'),
    ('yaw [deg]', lambda drive: _goal(drive)[2], '{:.1f}'),
    ('outcome', lambda drive: drive.outcome, ''),
    ('time [s]', lambda drive: drive.time, '{:.2f}'),
    ('least possible [s]', lambda drive: drive.least_time, '{:.2f}'),
    ('off by [m]', lambda drive: drive.measured[0], '{:.4f}'),
    ('off by [deg]', lambda drive: abs(math.degrees(drive.measured[1])), '{:.2f}'),
    ('truly off [m]', lambda drive: drive.true[0], '{:.4f}'),
    ('truly off [deg]', lambda drive: abs(math.degrees(drive.true[1])), '{:.2f}'))
ALONG: Sequence[Column] = (
    (DRIVING[0] + ' [s]', lambda drive: drive.seconds[0], '{:.2f}'),
    (DRIVING[1] + ' [s]', lambda drive: drive.seconds[1], '{:.2f}'),
    (DRIVING[2] + ' [s]', lambda drive: drive.seconds[2], '{:.2f}'),
    ('stopped [s]', lambda drive: drive.time - sum(drive.seconds), '{:.2f}'),
    ('time / least', lambda drive: drive.time_to_least, '{:.2f}'),
    ('heading drift [deg]', lambda drive: math.degrees(drive.drift), '{:+.2f}'),
    ('largest deviation [deg]', lambda drive: math.degrees(drive.deviation), '{:.2f}'))
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
    ('goal_x_m', lambda drive: _goal(drive)[0], '{:.3f}'),
    ('goal_y_m', lambda drive: _goal(drive)[1], '{:.3f}'),
    ('goal_yaw_deg', lambda drive: _goal(drive)[2], '{:.2f}'),
    ('outcome', lambda drive: safe(drive.outcome), ''),
    ('distance_error_m', lambda drive: drive.measured[0], '{:.4f}'),
    ('angle_error_deg', lambda drive: math.degrees(drive.measured[1]), '{:.2f}'),
    ('true_distance_error_m', lambda drive: drive.true[0], '{:.4f}'),
    ('true_angle_error_deg', lambda drive: math.degrees(drive.true[1]), '{:.2f}'),
    ('drift_deg', lambda drive: math.degrees(drive.drift), '{:.2f}'),
    ('largest_deviation_deg', lambda drive: math.degrees(drive.deviation), '{:.2f}'),
    ('time_s', lambda drive: drive.time, '{:.2f}'),
    ('least_time_s', lambda drive: drive.least_time, '{:.2f}'),
    ('rotate_to_goal_s', lambda drive: drive.seconds[0], '{:.2f}'),
    ('move_forward_s', lambda drive: drive.seconds[1], '{:.2f}'),
    ('rotate_to_final_s', lambda drive: drive.seconds[2], '{:.2f}'))

#: A note below the table of the times.
NOTE = ('Drift: heading at the end of MOVE_FORWARD minus {} s after its begin, by the IMU. Least '
        'possible: turn, line, turn at the limits of the robot and {} rad/s.'.format(
            STRAIGHT_AFTER, MAX_ANGULAR))


def cells(columns: Sequence[Column], report: Any, unknown: str = DASH) -> List[str]:
    """The texts of a report in these columns."""
    return [number(value(report), form, unknown) if form else value(report)
            for _, value, form in columns]


def heads(columns: Sequence[Column]) -> List[str]:
    """The heads of the columns."""
    return [head for head, _, _ in columns]


# Tables of a page -----------------------------------------------------------------------------


def drives(columns: Sequence[Column], reports: Sequence[DriveReport]) -> str:
    """A row for each drive."""
    return table(['drive'] + heads(columns), [
        [str(count)] + cells(columns, drive) for count, drive in enumerate(reports, 1)],
        words=('outcome',))


def turns(reports: Sequence[TurnReport]) -> str:
    """Asked, reached, and the time of each turn."""
    return table(['turn', 'begins at [s]'] + heads(TURNS), [
        [str(count), '{:.2f}'.format(turn.begin)] + cells(TURNS, turn)
        for count, turn in enumerate(reports, 1)])


def by_hand(run: RunData, found: Sequence[Movement]) -> str:
    """A row for each movement by hand, below a heading; '' without one."""
    if not found:
        return ''
    rows = []
    for count, movement in enumerate(found, 1):
        before, after = np.degrees(run.imu.yaw_at((movement.begin, movement.end)))
        way = run.odometry.between(movement.begin, movement.end).length
        rows.append([str(count), '{:.2f}'.format(movement.begin),
                     '{:.2f}'.format(movement.end - movement.begin), number(way, '{:.2f}'),
                     number(after - before, '{:+.1f}')])
    return '<h2>By hand</h2>' + table(
        ['by hand', 'begins at [s]', 'time [s]', 'way [m]', 'turned [deg]'], rows)


def rates(run: RunData) -> str:
    """The rates and gaps of the topics that are sent all the time."""
    rows = []
    for part in run.recorded():
        if part not in ON_CHANGE:
            samples = getattr(run, part)
            mean, longest, gaps, longest_arrival = rate(samples)
            rows.append([
                run.topics.get(part, part), str(len(samples)), number(mean, '{:.1f}'),
                number(longest, '{:.3f}'), str(gaps), number(longest_arrival, '{:.3f}'),
                str(run.dropped.get(part, 0))])
    return table(['topic', 'messages', 'mean rate [1/s]', 'longest gap [s]',
                  'gaps > {} s'.format(GAP), 'longest gap on arrival [s]', 'invalid messages'],
                 rows)


def rate(samples: Samples) -> Tuple[float, float, int, float]:
    """(mean rate [1/s], longest interval [s], number of those longer than GAP) at the sender, if
    the messages have stamps, and the longest interval at the recorder [s]."""
    sent, arrived = np.diff(samples.time), np.diff(samples.arrival)
    if not len(sent):
        return math.nan, math.nan, 0, math.nan
    span = sent.sum()
    return (len(sent) / span if span > 0.0 else math.nan, float(sent.max()),
            int(np.count_nonzero(sent > GAP)), float(arrived.max()))


# CSV ------------------------------------------------------------------------------------------


def write_reports(folder: Path,
                  runs: Sequence[Tuple[str, Sequence[TurnReport], Sequence[DriveReport]]]) -> None:
    """Write turns.csv and drives.csv: a row for each report of each run, (name, turns, drives)."""
    for word, columns, of in (('turn', TURNS_CSV, 1), ('drive', DRIVES_CSV, 2)):
        with open(str(folder / (word + 's.csv')), 'w', newline='', encoding='utf-8') as file:
            writer = csv.writer(file, lineterminator='\n')
            writer.writerow(['run', word] + heads(columns))
            for run in runs:
                for count, report in enumerate(run[of], 1):
                    writer.writerow([safe(run[0]), count] + cells(columns, report, ''))


def write_csv(run: RunData, path: Path) -> None:
    """Write one row for each odometry message; a cell is empty if nothing was recorded then."""
    odometry, local, truth, at = run.odometry, run.local_pose, run.ground_truth, run.odometry.time
    error_time, distance, angle = goal_errors(run)
    in_order = spans(run)
    words = np.array([''] + [safe(span.state) for span in in_order], dtype=object)
    states = words[np.searchsorted([span.begin for span in in_order], at, side='right')]
    near = _nearest(error_time, at)
    newest = np.searchsorted(run.commands.time, at, side='right') - 1
    newest[np.append(run.commands.time, -math.inf)[newest] < at - COMMAND_TIMEOUT] = -1
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
        'angular_commanded_rad_s': _chosen(run.commands.angular, newest)}
    with open(str(path), 'w', newline='') as file:
        writer = csv.writer(file, lineterminator='\n')
        writer.writerow([*columns, 'state'])
        writer.writerows(zip(*(_texts(*column) for column in columns.items()), states))


def _texts(name: str, values: np.ndarray) -> Iterator[str]:
    form = '{:.3f}' if name.endswith('_deg') else '{:.4f}'
    return (number(value, form, '') for value in values)


def _pose_columns(name: str, poses: Poses, index: np.ndarray) -> Dict[str, np.ndarray]:
    return {name + '_x_m': _chosen(poses.x, index), name + '_y_m': _chosen(poses.y, index),
            name + '_yaw_deg': np.degrees(_chosen(poses.yaw, index))}


def _nearest(times: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Index of the time nearest to each of `at`; -1 if none is of the same instant."""
    if not len(times):
        return np.full(len(at), -1)
    after = np.minimum(np.searchsorted(times, at), len(times) - 1)
    before = np.maximum(after - 1, 0)
    index = np.where(np.abs(times[after] - at) < np.abs(times[before] - at), after, before)
    return np.where(np.abs(times[index] - at) <= SAME_INSTANT, index, -1)


def _chosen(values: np.ndarray, index: np.ndarray) -> np.ndarray:
    """`values` at each index, NaN for index -1."""
    return np.append(values, math.nan)[index]
