"""The tables of a report: as HTML for its page, and as CSV for spreadsheets and scripts.

Units: metres, degrees, seconds; the heads and names of the columns tell which. An unknown value
is a dash on the page, and an empty cell in a CSV file.
"""
import csv
import math
import re
from html import escape
from io import StringIO
from pathlib import Path
from typing import Any, Callable, Iterable, List, NamedTuple, Sequence, Tuple

from tb3_labs.command_line import write_output
from tb3_labs.control.goal_state import DRIVING
from tb3_labs.report.motion.drives import MAX_ANGULAR, STRAIGHT_AFTER, DriveReport
from tb3_labs.report.motion.turns import TurnReport

#: The style of a page of tables.
STYLE = '''@page { size: A4; margin: 11mm 14mm; }
body { font: 10pt/1.3 sans-serif; max-width: 182mm; margin: 1em auto; color: #111; }
h1 { font-size: 15pt; margin: 0; } h2 { font-size: 11pt; margin: 0.7em 0 0.2em; }
p { margin: 0.3em 0; }
table { border-collapse: collapse; width: 100%; font-size: 8.5pt; }
th, td { border-bottom: 1px solid #999; padding: 1px 5px; text-align: right; }
th { border-bottom: 2px solid #333; vertical-align: bottom; }
th:first-child, td:first-child, .words { text-align: left; }
figure { margin: 0.4em 0; text-align: center; break-inside: avoid; }
figure img { max-width: 100%; } figcaption { font-size: 8.5pt; }
details { margin: 0.3em 0; } details details { margin-left: 1.2em; }
summary { cursor: pointer; font-weight: bold; }
section { break-inside: avoid; } .next { break-before: page; }
@media screen {
  body { padding: 0 12px; max-width: 1156px; } p, details { max-width: 48em; }
  pre { white-space: pre-wrap; overflow-wrap: anywhere; }
  table { max-width: 760px; } figure { text-align: left; }
  figure img { max-width: min(100%, 760px); }
}
@media print { body { margin: 0; } figure img { max-height: 84mm; } }'''
#: On a narrow screen a row is a paragraph, so that no column is cut off.
NARROW = '''
@media screen and (max-width: 760px) {
  table, tbody, tr { display: block; } thead { display: none; }
  tr { border-bottom: 1px solid #999; padding: 3px 0; }
  td { display: inline-block; border: 0; padding: 0 10px 0 0; text-align: left; }
  td.words { display: block; } td::before { content: attr(data-head) ' '; color: #666; }
  td:empty { display: none; }
  figure { overflow-x: auto; } figure img { max-width: none; width: 760px; }
}'''
PAGE = '''<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{0}</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><style>
{1}
</style></head><body>
<h1>{0}</h1>
{2}
</body></html>
'''
#: A table on a page has at most this many rows.
MOST_ROWS = 200
#: An unknown number on a page.
DASH = '\N{EN DASH}'
TAG = re.compile('<[^>]*>')
#: A spreadsheet would begin a formula here, in cells separated by commas or by semicolons.
FORMULA = re.compile(r'(^|;)(?=["\s]*[=+\-@])|^(?=[\t\r])')


class Markup(str):
    """Text that already is HTML."""


def number(value: float, form: str, unknown: str = DASH) -> str:
    """The value in this format, but never -0.00; `unknown` if it is not finite."""
    if not math.isfinite(value):
        return unknown
    text = form.format(value)
    return text if float(text) else form.format(0.0)


def degrees(angle: float, form: str) -> str:
    """The angle [rad] in degrees, in this format, or a dash."""
    return number(math.degrees(angle), form)


def document(title: str, parts: Sequence[str], style: str = '') -> str:
    """Returns an HTML page of these parts, which are HTML too; `style`: more CSS."""
    return PAGE.format(escape(title), STYLE + style + NARROW, '\n'.join(parts))


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[str] = ()) -> str:
    """Returns an HTML table. Plain texts are escaped; Markup stays as it is.

    The first column, and each column with its head in `words`, are aligned left. On a narrow screen
    each cell has its head beside it.
    """
    def row(cells: Sequence[str], tag: str) -> str:
        return '<tr>{}</tr>'.format(''.join('<{0}{2}{3}>{1}</{0}>'.format(
            tag, html(cell), ' class="words"' if heads[k] in words else '',
            ' data-head="{}"'.format(TAG.sub('', html(heads[k]))) if tag == 'td' else '')
            for k, cell in enumerate(cells)))

    def html(text: str) -> str:
        return text if isinstance(text, Markup) else escape(text)
    return '<table>\n<thead>{}</thead>\n<tbody>\n{}\n</tbody></table>'.format(
        row(heads, 'th'), '\n'.join(row(cells, 'td') for cells in rows))


def safe(text: str) -> str:
    """Returns the text of a cell, with a "'" in front of each formula that a spreadsheet would see.

    Source: "CSV Injection", https://owasp.org/www-community/attacks/CSV_Injection.
    """
    return FORMULA.sub(lambda found: found.group() + "'", text)


def _goal(drive: DriveReport) -> Tuple[float, float, float]:
    """(x [m], y [m], yaw [deg]) of the goal."""
    goal = drive.goal
    return (goal.x, goal.y, math.degrees(goal.yaw)) if goal else (math.nan, math.nan, math.nan)


class Column(NamedTuple):
    """A column of reports: its `name` in a CSV file, its `head` on a page, the value of a report,
    the value's format on a page ('' for a text)."""

    name: str
    head: str
    value: Callable[[Any], Any]
    form: str


TURN_COLUMNS = (
    Column('begin_s', 'begins at [s]', lambda turn: turn.begin, '{:.2f}'),
    Column('asked_deg', 'asked [deg]', lambda turn: math.degrees(turn.asked), '{:+.0f}'),
    Column('turned_deg', 'turned [deg]', lambda turn: math.degrees(turn.turned), '{:+.2f}'),
    Column('error_deg', 'beyond (+), short (-) [deg]', lambda turn: math.degrees(turn.error),
           '{:+.2f}'),
    Column('time_s', 'time [s]', lambda turn: turn.time, '{:.2f}'),
    Column('peak_rate_rad_s', 'peak rate [rad/s]', lambda turn: turn.peak_rate, '{:.2f}'),
    Column('overshoot_deg', 'overshoot [deg]', lambda turn: math.degrees(turn.overshoot),
           '{:.2f}'),
    Column('true_error_deg', 'truly beyond [deg]', lambda turn: math.degrees(turn.true_error),
           '{:+.2f}'))
ASKED_BY = Column('asked_by', '', lambda turn: 'topic' if turn.was_said else 'nearest', '')
DRIVE_COLUMNS = (
    Column('begin_s', 'begins at [s]', lambda drive: drive.begin, '{:.2f}'),
    Column('goal_x_m', 'asked x [m]', lambda drive: _goal(drive)[0], '{:.2f}'),
    Column('goal_y_m', 'y [m]', lambda drive: _goal(drive)[1], '{:.2f}'),
    Column('goal_yaw_deg', 'yaw [deg]', lambda drive: _goal(drive)[2], '{:.1f}'),
    Column('outcome', 'outcome', lambda drive: drive.outcome, ''),
    Column('time_s', 'time [s]', lambda drive: drive.time, '{:.2f}'),
    Column('least_time_s', 'least possible [s]', lambda drive: drive.least_time, '{:.2f}'),
    Column('distance_error_m', 'off by [m]', lambda drive: drive.measured[0], '{:.4f}'),
    Column('angle_error_deg', 'off by [deg]', lambda drive: math.degrees(drive.measured[1]),
           '{:+.2f}'),
    Column('true_distance_error_m', 'truly off [m]', lambda drive: drive.true[0], '{:.4f}'),
    Column('true_angle_error_deg', 'truly off [deg]', lambda drive: math.degrees(drive.true[1]),
           '{:+.2f}'),
    Column('rotate_to_goal_s', DRIVING[0] + ' [s]', lambda drive: drive.seconds[0], '{:.2f}'),
    Column('move_forward_s', DRIVING[1] + ' [s]', lambda drive: drive.seconds[1], '{:.2f}'),
    Column('rotate_to_final_s', DRIVING[2] + ' [s]', lambda drive: drive.seconds[2], '{:.2f}'),
    Column('stopped_s', 'stopped [s]', lambda drive: drive.time - sum(drive.seconds), '{:.2f}'),
    Column('time_to_least', 'time / least', lambda drive: drive.time_to_least, '{:.2f}'),
    Column('drift_deg', 'heading drift [deg]', lambda drive: math.degrees(drive.drift), '{:+.2f}'),
    Column('largest_deviation_deg', 'largest deviation [deg]',
           lambda drive: math.degrees(drive.deviation), '{:.2f}'))
#: The columns on the page of one run: what was asked and reached, and the way there.
REACHED_COLUMNS, ALONG = DRIVE_COLUMNS[1:11], DRIVE_COLUMNS[11:]

#: A note below the table of the times.
NOTE = ('Drift: heading at the end of MOVE_FORWARD minus {} s after its start, by the IMU. Least '
        'possible: turn, line, turn at the limits of the robot and {} rad/s.'.format(
            STRAIGHT_AFTER, MAX_ANGULAR))


def cells(columns: Sequence[Column], report: Any) -> List[str]:
    """Returns the texts of a report on a page, one for each column."""
    return [number(column.value(report), column.form) if column.form else column.value(report)
            for column in columns]


# Tables of a page -----------------------------------------------------------------------------


def numbered(word: str, columns: Sequence[Column], reports: Sequence[Any]) -> str:
    """Returns a table with a numbered row for each report; `word`: what a row is, such as
    'turn'."""
    more = len(reports) - MOST_ROWS
    return table([word] + [column.head for column in columns], [
        [str(count)] + cells(columns, report)
        for count, report in enumerate(reports[:MOST_ROWS], 1)], words=('outcome',)) + (
            '<p>{}s.csv has {} more.</p>'.format(word, more) if more > 0 else '')


# CSV ------------------------------------------------------------------------------------------


def write_reports(folder: Path, name: str, turns: Sequence[TurnReport],
                  drives: Sequence[DriveReport]) -> None:
    """Write turns.csv and drives.csv, a row for each report. `name`: of the run, in each row, since
    a spreadsheet may hold the rows of several runs."""
    for word, columns, reports in (('turn', (*TURN_COLUMNS, ASKED_BY), turns),
                                   ('drive', DRIVE_COLUMNS, drives)):
        write_table(folder / (word + 's.csv'), [
            ['run', word] + [column.name for column in columns],
            *([safe(name), count] + [in_csv(column.name, column.value(report))
                                     for column in columns]
              for count, report in enumerate(reports, 1))])


def write_table(path: Path, rows: Iterable[Sequence[Any]]) -> None:
    """Write a CSV file."""
    text = StringIO(newline='')
    csv.writer(text, lineterminator='\n').writerows(rows)
    write_output(path, text.getvalue())


def in_csv(name: str, value: Any) -> str:
    """Returns the cell of a value in the column `name`; empty if the value is unknown."""
    if isinstance(value, str):
        return safe(value)
    return number(value, '{:.3f}' if name.endswith('_deg') else '{:.4f}', '')
