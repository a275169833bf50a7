"""The tables of a report: as HTML for its page, and as CSV for spreadsheets and scripts.

Units: metres, degrees, seconds; the heads and names of the columns tell which. An unknown value
is a dash on the page, and an empty cell in a CSV file.
"""
import csv
import math
import re
from html import escape
from pathlib import Path
from typing import Any, Callable, List, Sequence, Tuple

import numpy as np

from tb3_labs.control.goal import DRIVING
from tb3_labs.report.drives import MAX_ANGULAR, STRAIGHT_AFTER, DriveReport
from tb3_labs.report.movements import Movement
from tb3_labs.report.run_data import GAP, RunData, Samples
from tb3_labs.report.turns import TurnReport

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
@media screen { body { padding: 0 8px; } pre { white-space: pre-wrap; overflow-wrap: anywhere; } }
@media screen and (max-width: 760px) { table { display: block; overflow-x: auto; } }
@media print { body { margin: 0; } figure img { max-height: 84mm; } }'''
#: An unknown number on a page.
DASH = '\N{EN DASH}'
#: Fields that are sent only on a change, so that they have no rate.
ON_CHANGE = 'frames', 'goals', 'states', 'resets', 'asked', 'control', 'presses', 'log'
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


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[str] = ()) -> str:
    """Returns an HTML table. Plain texts are escaped; Markup stays as it is.

    The first column, and each column with its head in `words`, are aligned left.
    """
    def row(cells: Sequence[str], tag: str) -> str:
        return '<tr>{}</tr>'.format(''.join('<{0}{2}>{1}</{0}>'.format(
            tag, cell if isinstance(cell, Markup) else escape(cell),
            ' class="words"' if heads[k] in words else '') for k, cell in enumerate(cells)))
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


#: A column: its head, the function from a report to its value, its format ('' for a text).
Column = Tuple[str, Callable[[Any], Any], str]
#: Columns for turns: on a page of several runs, and on the page of one run.
TURNS: Sequence[Column] = (
    ('asked [deg]', lambda turn: math.degrees(turn.asked), '{:+.0f}'),
    ('turned [deg]', lambda turn: math.degrees(turn.turned), '{:+.2f}'),
    ('beyond (+), short (-) [deg]', lambda turn: math.degrees(turn.error), '{:+.2f}'),
    ('time [s]', lambda turn: turn.time, '{:.2f}'),
    ('peak rate [rad/s]', lambda turn: turn.peak_rate, '{:.2f}'),
    ('overshoot [deg]', lambda turn: math.degrees(turn.overshoot), '{:.2f}'),
    ('truly beyond [deg]', lambda turn: math.degrees(turn.true_error), '{:+.2f}'))
TURNS_OF_RUN: Sequence[Column] = (
    ('begins at [s]', lambda turn: turn.begin, '{:.2f}'), *TURNS)
#: Columns for drives on a page of several runs.
DRIVES: Sequence[Column] = (
    ('off by [m]', lambda drive: drive.measured[0], '{:.4f}'),
    ('off by [deg]', lambda drive: math.degrees(drive.measured[1]), '{:+.2f}'),
    ('heading drift [deg]', lambda drive: math.degrees(drive.drift), '{:+.2f}'),
    ('time [s]', lambda drive: drive.time, '{:.2f}'),
    ('time / least', lambda drive: drive.time_to_least, '{:.2f}'),
    ('truly off [m]', lambda drive: drive.true[0], '{:.4f}'),
    ('truly off [deg]', lambda drive: math.degrees(drive.true[1]), '{:+.2f}'))
#: Columns for drives on the page of one run: asked and reached; and along the way.
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
#: Columns of turns.csv and drives.csv.
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
    """Returns the texts of a report, one for each column."""
    return [number(value(report), form, unknown) if form else value(report)
            for _, value, form in columns]


def heads(columns: Sequence[Column]) -> List[str]:
    """The heads of the columns."""
    return [head for head, _, _ in columns]


# Tables of a page -----------------------------------------------------------------------------


def numbered(word: str, columns: Sequence[Column], reports: Sequence[Any]) -> str:
    """Returns a table with a numbered row for each report; `word`: what a row is, such as
    'turn'."""
    return table([word] + heads(columns), [
        [str(count)] + cells(columns, report) for count, report in enumerate(reports, 1)],
        words=('outcome',))


def by_hand(run: RunData, found: Sequence[Movement]) -> str:
    """Returns a heading and a table of the movements by hand; '' if there are none."""
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
    """Returns a table of the rates and gaps of the topics that are sent all the time."""
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
    """Returns (mean rate [1/s], longest interval [s], number of intervals longer than GAP, longest
    interval between arrivals [s]). The first three are by the stamps, if there are stamps."""
    sent, arrived = np.diff(samples.time), np.diff(samples.arrival)
    if not len(sent):
        return math.nan, math.nan, 0, math.nan
    span = sent.sum()
    return (len(sent) / span if span > 0.0 else math.nan, float(sent.max()),
            int(np.count_nonzero(sent > GAP)), float(arrived.max()))


# CSV ------------------------------------------------------------------------------------------


def write_reports(folder: Path,
                  runs: Sequence[Tuple[str, Sequence[TurnReport], Sequence[DriveReport]]]) -> None:
    """Write turns.csv and drives.csv, a row for each report. A run is (name, turns, drives)."""
    for word, columns, of in (('turn', TURNS_CSV, 1), ('drive', DRIVES_CSV, 2)):
        with open(str(folder / (word + 's.csv')), 'w', newline='', encoding='utf-8') as file:
            writer = csv.writer(file, lineterminator='\n')
            writer.writerow(['run', word] + heads(columns))
            for run in runs:
                for count, report in enumerate(run[of], 1):
                    writer.writerow([safe(run[0]), count] + cells(columns, report, ''))
