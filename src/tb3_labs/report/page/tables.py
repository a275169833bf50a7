"""Makes the tables of a report, as HTML for its page, and as CSV for spreadsheets and scripts.

The heads and names of the columns name the units: metres, degrees, seconds. An unknown value is a
dash on the page, and an empty cell in a CSV file.
"""
import csv
import math
from io import StringIO
from pathlib import Path
from typing import Any, Callable, Iterable, List, NamedTuple, Sequence, Tuple

from tb3_labs.command_line import write_output
from tb3_labs.control.goal_state import DRIVING
from tb3_labs.report.motion.drives import STRAIGHT_AFTER, DriveReport
from tb3_labs.report.motion.turns import TurnReport
from tb3_labs.report.page.document import number, safe, table


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
    Column('drift_deg', 'heading drift [deg]', lambda drive: math.degrees(drive.drift), '{:+.2f}'),
    Column('largest_deviation_deg', 'largest deviation [deg]',
           lambda drive: math.degrees(drive.deviation), '{:.2f}'))
#: The page has two tables of drives: a table of goals and outcomes, and a table of the ways.
REACHED_COLUMNS, ALONG_COLUMNS = DRIVE_COLUMNS[1:10], DRIVE_COLUMNS[10:]

#: The note below the table of the ways.
DRIFT_NOTE = (f'Drift: the heading by the IMU at the end of MOVE_FORWARD, minus the heading '
              f'{STRAIGHT_AFTER} s after its start.')


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
