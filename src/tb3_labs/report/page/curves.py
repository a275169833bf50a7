"""Draws the curves of a timeline, and the line of its events, as HTML.

Each curve is an SVG picture. Its x is the time in seconds, and its y is the negated value in the
unit of the data. To show another stretch of time, the timeline's program only changes the picture's
view.
"""
import math
from html import escape
from typing import Any, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

#: The kinds of events. Each kind has its own row, in this order from the top.
EVENT_KINDS = ('drive', 'turn', 'hand', 'reset', 'start', 'stop', 'lost')
#: The height of a row [px].
EVENT_HEIGHT = 8
#: The distance between two grid lines is the smallest of these steps with which a curve has at most
#: GRID_LINES intervals.
GRID_STEPS = tuple(digit * 10.0 ** power for power in range(-3, 6) for digit in (1, 2, 5))
ANGLE_STEPS = (1.0, 2.0, 5.0, 10.0, 30.0, 45.0, 90.0, 180.0, 360.0, 720.0, 1440.0, 3600.0, 7200.0)
GRID_LINES = 4
#: The points (time, value) of a line, and the indices of the points that are not joined to the
#: previous point.
Line = Tuple[List[Tuple[float, float]], List[int]]
BOTH_LINES = ': <b class="measured">measured</b>, <b class="commanded">commanded</b>'
CURVE = '''<figure><figcaption>{caption}</figcaption><div class="plot" id="curve-{name}">
<svg viewBox="0 {top:.4f} {duration} {height:.4f}" preserveAspectRatio="none">
<path class="grid" d="{grid}"/>{lines}</svg>{labels}<div class="now"></div></div></figure>'''
EVENT = ('<a class="{kind}" href="#t={begin}" title="{title}" tabindex="-1"'
         ' style="top:{top}px;--x:{x:.4f};--w:{width:.4f}"></a>')


class Command(NamedTuple):
    """A command of the timeline. It is in force until the next command. Both speeds are None where
    the robot's timeout ended the previous command."""

    time: float
    linear: Optional[float]
    angular: Optional[float]


class Figure(NamedTuple):
    """A figure of a variable of a node. `levels` are the texts at the heights 0, 1, 2, ...; [] if
    the variable has numbers."""

    name: str
    line: Line
    levels: List[str]


def kept_samples(time: np.ndarray, values: np.ndarray, bounds: np.ndarray,
                 breaks: Iterable[int] = ()) -> np.ndarray:
    """Returns the indices of the samples that a curve keeps. The straight lines between these
    samples differ from all `values`, shape (n, k), by at most `bounds`, shape (k,). `breaks` are
    the indices at which a new stretch begins, in order. Both ends of a stretch are kept.

    Source: Douglas and Peucker (1973), with the distance along the axis of the values.
    """
    is_kept = np.zeros(len(time), dtype=bool)
    begins = [0, *breaks]
    stretches = [(begin, end - 1) for begin, end in zip(begins, [*begins[1:], len(time)])]
    while stretches:
        first, last = stretches.pop()
        is_kept[[first, last]] = True
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        share = (time[inner] - time[first]) / max(time[last] - time[first], 1e-9)
        on_line = values[first] + share[:, None] * (values[last] - values[first])
        distances = (np.abs(values[inner] - on_line) / bounds).max(axis=1)
        farthest = int(np.argmax(distances))
        if distances[farthest] > 1.0:
            middle = first + 1 + farthest
            stretches += [(first, middle), (middle, last)]
    return np.flatnonzero(is_kept)


def event_line(data: Dict[str, Any]) -> Iterator[str]:
    """Yields the HTML of each event, then an empty box as high as all rows of events."""
    duration = data['duration']
    kinds = {event['kind'] for event in data['marks']}
    rows = [kind for kind in EVENT_KINDS if kind in kinds]
    for event in data['marks']:
        begin, end = event['begin'], event['end']
        yield EVENT.format(kind=event['kind'], title=escape(event['text']), begin=begin,
                           top=EVENT_HEIGHT * rows.index(event['kind']), x=begin / duration,
                           width=(end - begin) / duration)
    yield f'<div style="height:{EVENT_HEIGHT * len(rows)}px"></div>'


def curves(data: Dict[str, Any]) -> Iterator[str]:
    """Yields the HTML of each curve; '' for a curve without data."""
    for name, caption, track, least, steps in (
            ('heading', 'heading by the IMU [&deg;]', data['heading'], 10.0, ANGLE_STEPS),
            ('distance', 'distance to the goal [m]', data['distance'], 0.1, GRID_STEPS),
            ('angle', "angle off the goal's heading [&deg;]", data['angle'], 10.0, ANGLE_STEPS)):
        yield _curve(data, name, caption, [('measured', _line_of(track))], least, (), steps)
    for name, caption, track, least in (
            ('linear', 'forward [m/s]', data['speed'], 0.1),
            ('angular', 'turning [rad/s]', data['rate'], 0.4)):
        yield _curve(data, name, caption + BOTH_LINES, [
            ('measured', _line_of(track)), ('commanded', _command_steps(data, name))], least)


def variable_curves(data: Dict[str, Any]) -> Iterator[str]:
    """Yields the HTML of each figure of the node's variables."""
    for number, figure in enumerate(data['figures']):
        yield _curve(data, f'variable-{number}', f'<b class="variable">{escape(figure.name)}</b>',
                     [('variable', figure.line)], 0.0, figure.levels)


def _line_of(track: Dict[str, Any]) -> Line:
    return [*zip(track['time'], track['columns'][0])], track['breaks']


def _command_steps(data: Dict[str, Any], name: str) -> Line:
    """Returns the line of a speed of the commands, which are constant between two commands. `name`
    is a field of Command."""
    commands: List[Command] = data['commands']
    ends = [command.time for command in commands[1:]] + [data['duration']]
    points: List[Tuple[float, float]] = []
    breaks: List[int] = []
    for command, end in zip(commands, ends):
        speed = getattr(command, name)
        if speed is None:
            breaks.append(len(points))
        else:
            points += [(command.time, speed), (end, speed)]
    return points, breaks


def _curve(data: Dict[str, Any], name: str, caption: str, lines: Sequence[Tuple[str, Line]],
           least: float, levels: Sequence[str] = (),
           steps: Sequence[float] = GRID_STEPS) -> str:
    """Returns the HTML of a curve, or '' if it has no value. `lines` are (CSS class, line). The
    scale has at least the range `least`, and a scale of distances includes 0. `levels` are the
    texts to show in place of the values 0, 1, 2, ..."""
    values = [value for _, (points, _) in lines for _, value in points]
    if not values:
        return ''
    low, high = min(values), max(values)
    if name == 'distance':
        low = min(low, 0.0)
    span = high - low
    margin = max(0.06 * span, (least - span) / 2.0)
    if margin == 0.0:       # a constant curve
        margin = 1.0
    low, high = low - margin, high + margin
    step = next((step for step in steps if high - low <= GRID_LINES * step), high - low)
    if levels:
        step = 1.0
    grid = [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
    labels = []
    for value in grid:
        kind, text = '', f'{round(value, 3) + 0.0:g}'
        if levels:
            kind, text = ' class="level"', escape(levels[round(value)])
        top = 100.0 * (high - value) / (high - low)
        labels.append(f'<i style="top:{top:.1f}%"{kind}>{text}</i>')
    return CURVE.format(
        name=name, caption=caption, top=-high, height=high - low, duration=data['duration'],
        lines=''.join(f'\n<path class="{kind}" d="{_path(*line)}"/>' for kind, line in lines),
        grid=''.join(f"M0 {-value:.4f}H{data['duration']}" for value in grid),
        labels=''.join(labels))


def _path(points: Sequence[Tuple[float, float]], breaks: Sequence[int]) -> str:
    begins = {0, *breaks}
    return ''.join(f"{'M' if k in begins else 'L'}{at} {-value:g}"
                   for k, (at, value) in enumerate(points))
