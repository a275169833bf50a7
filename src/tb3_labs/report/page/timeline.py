"""Makes the data of the timeline of a run, and from these data the timeline's HTML.

A *track* is a list of points over time, joined by straight lines. The track has fewer points than
the recording, but differs from each recorded value by at most its bound (`BOUNDS`). A track is
interrupted at a time without samples.

Units in the data: seconds since the recording's start, metres, degrees, m/s, rad/s. The poses of
`local` and of the goals are in ``local``, all other poses are in ``odom``. A variable of a node has
the unit that its node uses.
"""
import json
import math
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

import numpy as np

from tb3_labs import drawing
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.recording.run_data import (
    MIN_GAP, Commands, LogLines, Poses, RunData, cached_per_run)
from tb3_labs.report.motion.resets_and_goals import (
    FrameInterval, frame_intervals, goal_errors, local_in_odom, recorded_states)
from tb3_labs.report.page.curves import (
    Command, Figure, Line, curves, event_line, kept_samples, variable_curves)
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT, RobotModel
from tb3_labs.watch.variables import TRUTH_VALUES, Series, variables_by_node

#: The HTML of the timeline. Its program and its style are in files with the same stem.
TIMELINE_PAGE = Path(__file__).with_name('timeline.html')
#: Only these data are read by the timeline's program. Python draws all other data into the page.
FOR_PROGRAM = ('duration', 'radius', 'odom', 'local', 'truth', 'frame', 'heading', 'distance',
               'angle', 'commands', 'goals', 'marks', 'variables')
#: The largest difference between a recorded value and its track, for each unit, without rounding.
BOUNDS = {'m': 0.002, 'deg': 0.2, 'm/s': 0.005, 'rad/s': 0.03}
#: Times and values are rounded to this many digits after the point.
ROUNDED_DIGITS = 3
#: The most characters of a text.
MAX_TEXT_LENGTH = 1000
#: The name of rosbag's node. Its log lines are not shown.
RECORDER = 'record'
#: The limits of a page.
MAX_FIGURES = 12
MAX_SHOWN_VARIABLES = 40
#: A variable with more different texts than this has no figure.
MAX_LEVELS = 8
#: A figure differs from each recorded value by at most this share of the variable's range.
BOUND_SHARE = 1.0 / 500.0
#: A larger number is not drawn, since the difference of two such numbers could be infinite.
MAX_DRAWN_NUMBER = 1e300
#: The handouts' variables. They are drawn first, in this order.
HANDOUT_NAMES = ('curr_yaw', 'goal_yaw', 'local_x', 'local_y', 'local_yaw', 'turning', 'state',
                 'has_control')
#: A moment or a stretch of time on the timeline, with kind, begin, end and text.
TimelineEvent = Dict[str, Any]


def track(time: np.ndarray, columns: Sequence[np.ndarray], units: Sequence[str],
          breaks: Sequence[int] = ()) -> Dict[str, Any]:
    """Returns the track of `columns`, which have these units. No line is drawn across a gap of
    time, or into a sample whose index is in `breaks`. In the result, 'breaks' are the indices of
    the points into which no line is drawn."""
    if not len(time):
        return {'time': [], 'columns': [[] for _ in units], 'breaks': []}
    values = np.column_stack(columns)
    bounds = np.array([BOUNDS[unit] for unit in units])
    begins = sorted({*breaks, *(np.flatnonzero(np.diff(time) > MIN_GAP) + 1)})
    shown = kept_samples(time, values, bounds, begins)
    return {'time': np.round(time[shown], ROUNDED_DIGITS).tolist(),
            'columns': np.round(values[shown], ROUNDED_DIGITS).T.tolist(),
            'breaks': np.unique(np.searchsorted(shown, begins)).tolist()}


def timeline(run: RunData, model: RobotModel, events: Sequence[TimelineEvent]) -> Dict[str, Any]:
    """Returns all data of the timeline of a run, for JSON."""
    imu, odometry, local = run.imu, run.odometry, run.local_pose
    time, distance, angle = goal_errors(run)
    frames = frame_intervals(run)
    local_resets, goal_resets = _resets(frames, local.time), _resets(frames, time)
    turned_over = np.flatnonzero(np.abs(np.diff(angle)) > math.pi) + 1
    # at the begin of each interval, the pose in ``local`` is taken for the true pose
    truth = [run.ground_truth.between(interval.begin, interval.end).seen_from(
        interval.odom_T_local @ interval.local_T_world)
        for interval in frames if interval.local_T_world is not None]
    return {
        'duration': max(round(run.duration, 3), 0.001), 'radius': model.body_radius,
        'odom': _poses(odometry), 'local': _poses(local, local_resets),
        'truth': _poses(Poses.joined(truth)),
        'frame': _poses(local_in_odom(run, local.time), local_resets),
        'heading': track(imu.time, [np.degrees(np.unwrap(imu.yaw))], ['deg']),
        'rate': track(imu.time, [imu.yaw_rate], ['rad/s']),
        'speed': track(odometry.time, [odometry.linear], ['m/s']),
        'distance': track(time, [distance], ['m'], goal_resets),
        'angle': track(time, [np.degrees(angle)], ['deg'], [*goal_resets, *turned_over]),
        'commands': _commands(run.commands),
        'goals': [[round(interval.begin, 3), interval.state, _rounded(interval.goal)]
                  for interval in recorded_states(run)],
        'marks': sorted(events, key=lambda event: event['begin']),
        'log': _lines(run.log),
        'nodes': [*dict.fromkeys(run.variables.node)], 'variables': texts(run),
        'figures': figures(run)}


def _poses(poses: Poses, breaks: Sequence[int] = ()) -> Dict[str, Any]:
    yaw = np.degrees(np.unwrap(poses.yaw)) if len(poses) else poses.yaw
    return track(poses.time, [poses.x, poses.y, yaw], ['m', 'm', 'deg'], [*breaks, *poses.leaps])


def _rounded(goal: Optional[Pose2]) -> Optional[List[float]]:
    return None if goal is None else [round(part, 4) for part in (goal.x, goal.y, goal.yaw)]


def _resets(frames: Sequence[FrameInterval], time: np.ndarray) -> List[int]:
    """Returns the index of the first sample after each reset. `time`: the times of samples [s]."""
    found = np.searchsorted(time, [interval.begin for interval in frames[1:]])
    return [int(index) for index in found if 0 < index < len(time)]


def _commands(commands: Commands) -> List[Command]:
    """Returns the commands that differ from their previous command, and a Command without speeds
    where the robot's timeout ended a command."""
    times = commands.time.tolist()
    rows: List[Command] = []
    for time, following, linear, angular in zip(
            times, [*times[1:], math.inf], commands.linear.tolist(), commands.angular.tolist()):
        command = Command(round(time, 3), round(linear, 3), round(angular, 3))
        if not rows or rows[-1][1:] != command[1:]:
            rows.append(command)
        if following - time > COMMAND_TIMEOUT:
            rows.append(Command(round(time + COMMAND_TIMEOUT, 3), None, None))
    return rows


def timeline_event(kind: str, begin: float, text: str,
                   end: Optional[float] = None) -> TimelineEvent:
    """Returns the TimelineEvent of a moment; with an `end` [s], of a stretch of time."""
    if end is None:
        end = begin
    return {'kind': kind, 'begin': round(float(begin), 3), 'end': round(float(end), 3),
            'text': text[:MAX_TEXT_LENGTH]}


def _lines(log: LogLines) -> List[List[Any]]:
    """Returns [time, level, text] of each log line. The text begins with the node's name."""
    return [[round(float(at), 3), level, f"{node.lstrip('/')}: {text}"[:MAX_TEXT_LENGTH]]
            for at, level, node, text in zip(log.time, log.levels, log.nodes, log.texts)
            if node.rpartition('/')[2] != RECORDER]


# -- the variables of nodes

@cached_per_run
def variables(run: RunData) -> List[Series]:
    """Returns the variables of a run. If several nodes have variables, the name of a variable
    begins with the name of its node."""
    found, nodes = [], variables_by_node(run.variables)
    for node, series_of in nodes.items():
        prefix = node.strip('/') + ': ' if len(nodes) > 1 else ''
        for series in series_of.values():
            # here, True and False are texts; a comparison with NaN is False
            is_truth = np.isin(series.text.astype(str), [*TRUTH_VALUES])
            is_drawn = ~is_truth & (np.abs(series.value) < MAX_DRAWN_NUMBER)
            found.append(replace(
                series, name=prefix + series.name,
                value=np.where(is_drawn, series.value, np.nan)))
    return found[:MAX_SHOWN_VARIABLES]


def changes(variable: Series) -> np.ndarray:
    """Returns the index of the first value, and of each value that differs from the previous value.
    """
    values = np.where(np.isnan(variable.value), variable.text, variable.value)
    return np.flatnonzero(np.append(True, values[1:] != values[:-1]))


def texts(run: RunData) -> List[List[Any]]:
    """Returns [name, times of the changes, texts after the changes] of each variable."""
    rows = []
    for each in variables(run):
        shown = changes(each)
        shown_texts = list(map(_shown_text, each.text[shown], each.value[shown]))
        rows.append([each.name, np.round(each.time[shown], 3).tolist(), shown_texts])
    return rows


def _shown_text(text: str, number: float) -> str:
    if '.' in text and not math.isnan(number):
        return f'{number:.5g}'
    return text


def figures(run: RunData) -> List[Figure]:
    """Returns the figures of the variables that change, at most MAX_FIGURES. A variable whose
    values are mostly texts is drawn as steps between these texts."""
    known = {each.name: each for each in variables(run)}
    first = [known.pop(name) for name in HANDOUT_NAMES if name in known]
    found = [_figure(each) for each in [*first, *known.values()] if len(changes(each)) > 1]
    return [figure for figure in found if len(figure.levels) <= MAX_LEVELS][:MAX_FIGURES]


def _figure(variable: Series) -> Figure:
    if 2 * np.isnan(variable.value).sum() < len(variable.value):
        return Figure(variable.name, line(variable.time, variable.value), [])
    levels = _levels(variable)
    height = {text: float(k) for k, text in enumerate(levels)}
    values = np.array([height[text] for text in variable.text])
    return Figure(variable.name, line(variable.time, values), levels)


def _levels(variable: Series) -> List[str]:
    """Returns the different texts of a variable, from the lowest to the highest in the figure.
    False is below True. A state is below all states that the variable had earlier in the run."""
    found = list(dict.fromkeys(variable.text))
    return sorted(found) if found[0] in TRUTH_VALUES else found[::-1]


def line(time: np.ndarray, values: np.ndarray) -> Line:
    """Returns the line of the values that are not NaN. The line is interrupted at gaps of time, and
    at values that are NaN."""
    index = np.flatnonzero(~np.isnan(values))
    time, values = time[index], values[index]
    breaks = np.flatnonzero((np.diff(time) > MIN_GAP) | (np.diff(index) > 1)) + 1
    bound = np.array([max(BOUND_SHARE * np.ptp(values), 1e-6)])
    kept = kept_samples(time, values[:, None], bound, breaks)
    points = [(round(float(time[k]), 3), float(f'{values[k]:.6g}')) for k in kept]
    return points, [int(np.searchsorted(kept, k)) for k in breaks]


def section(data: Dict[str, Any]) -> str:
    """Returns the HTML of a timeline with these data. A page with it needs no other file."""
    text = json.dumps({name: data[name] for name in FOR_PROGRAM}, separators=(',', ':'),
                      allow_nan=False).replace('<', '\\u003c')
    styles = drawing.FOLDER / 'colours.css', TIMELINE_PAGE.with_suffix('.css')
    style = ''.join(path.read_text(encoding='utf-8') for path in styles)
    event_list = ''.join('<a href="#t={}">{:.1f} s&ensp;{}</a>'.format(
        each['begin'], each['begin'], escape(each['text'])) for each in data['marks'])
    log = ''.join('<li data-level="{}"><a href="#t={}">{:.2f} s&ensp;{}</a></li>'.format(
        level, at, at, escape(text)) for at, level, text in data['log'])
    page = TIMELINE_PAGE.read_text(encoding='utf-8').format(
        curves='\n'.join(curves(data)), variables='\n'.join(variable_curves(data)),
        nodes=escape(', '.join(data['nodes'])), marks=''.join(event_line(data)),
        event_list=event_list, log=log, data=text,
        script=drawing.one_script(TIMELINE_PAGE.with_suffix('.js')))
    return f'<style>\n{style}</style>\n{page}'
