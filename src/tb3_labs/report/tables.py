"""The tables of a page: drives, turns, rates of the topics.

Units: as in the heads; metres, degrees, seconds. An unknown value is a dash.
"""
import math
from typing import Any, Callable, List, Sequence, Tuple

from tb3_labs.report import analysis, html, sensors
from tb3_labs.report.analysis import DRIVING, DriveReport
from tb3_labs.report.run_data import RunData
from tb3_labs.report.turns import TurnReport

UNKNOWN = '\N{EN DASH}'
#: Fields that are sent on change, and have no rate.
ON_CHANGE = 'frames', 'goals', 'states', 'resets', 'asked', 'control'


#: (head, value of a report, format) of each column.
Column = Tuple[str, Callable[[Any], float], str]
TURNS: Sequence[Column] = (
    ('asked [deg]', lambda turn: math.degrees(turn.asked), '{:+.0f}'),
    ('turned [deg]', lambda turn: math.degrees(turn.turned), '{:+.2f}'),
    ('beyond (+), short (-) [deg]', lambda turn: math.degrees(turn.error), '{:+.2f}'),
    ('time [s]', lambda turn: turn.time, '{:.2f}'),
    ('peak rate [rad/s]', lambda turn: turn.peak_rate, '{:.2f}'),
    ('overshoot [deg]', lambda turn: math.degrees(turn.overshoot), '{:.2f}'),
    ('truly beyond [deg]', lambda turn: math.degrees(turn.true_error), '{:+.2f}'))


def number(value: float, form: str) -> str:
    """The value in this format, or a dash."""
    return form.format(value) if math.isfinite(value) else UNKNOWN


def degrees(angle: float, form: str) -> str:
    """The angle [rad] in degrees, in this format, or a dash."""
    return number(math.degrees(angle), form)


def drives(reports: Sequence[DriveReport]) -> str:
    """Asked, reached, and the time of each drive."""
    rows = []
    for count, drive in enumerate(reports, 1):
        goal = drive.goal
        rows.append([str(count)] + (
            ['{:.2f}'.format(goal.x), '{:.2f}'.format(goal.y),
             '{:.1f}'.format(round(math.degrees(goal.yaw), 1) + 0.0)] if goal else [UNKNOWN] * 3)
            + [drive.outcome, number(drive.time, '{:.2f}'), number(drive.least_time, '{:.2f}')]
            + _error(drive.measured) + _error(drive.true))
    return html.table(['drive', 'asked x [m]', 'y [m]', 'yaw [deg]', 'outcome', 'time [s]',
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
    return html.table(
        ['drive'] + [state + ' [s]' for state in DRIVING]
        + ['stopped [s]', 'time / least', 'heading drift [deg]', 'largest deviation [deg]'], rows)


def turns(reports: Sequence[TurnReport]) -> str:
    """Asked, reached, and the time of each turn."""
    return html.table(
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
        rate = sensors.rate(getattr(run, part))
        rows.append([run.topics.get(part, part), str(rate.messages), number(rate.mean, '{:.1f}'),
                     number(rate.longest, '{:.3f}'), str(rate.gaps),
                     number(rate.longest_arrival, '{:.3f}'), str(run.dropped.get(part, 0))])
    return html.table(['topic', 'messages', 'mean rate [1/s]', 'longest gap [s]',
                       'gaps > {} s'.format(sensors.GAP), 'longest gap on arrival [s]',
                       'invalid messages'], rows)


#: What the table of the times says no head can.
ALONG = ('Drift: heading at the end of MOVE_FORWARD minus {} s after its begin, by the IMU. Least '
         'possible: turn, line, turn at the limits of the robot and {} rad/s.'.format(
             analysis.STRAIGHT_AFTER, analysis.MAX_ANGULAR))


def _error(miss: Tuple[float, float]) -> List[str]:
    return [number(miss[0], '{:.4f}'), degrees(abs(miss[1]), '{:.2f}')]
