"""Makes the data of a run's timeline, and the HTML that contains these data.

A *track* is a list of points over time, joined by straight lines. The track has fewer points than
the recording, and differs from each recorded value by at most the track's bound.

Units in the data: seconds since the recording's start, metres, degrees, m/s, rad/s. The tracks
`local` and `goals` are in the frame ``local``. All other poses are in ``odom``. A variable is in
the unit that the node uses.
"""
import json
import math
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from tb3_labs import drawing
from tb3_labs.geometry.se2 import Pose2
from tb3_labs.recording.run_data import MIN_GAP, Commands, LogLines, Poses, RunData
from tb3_labs.report.motion.resets_and_goals import (
    FrameInterval, frame_intervals, goal_errors, local_in_odom, recorded_states, true_poses)
from tb3_labs.robot.turtlebot3 import RobotModel
from tb3_labs.watch.variables import Series, variables_by_node

TIMELINE_FILE = Path(__file__).with_name('timeline.html')
# the bounds of tracks; rounding adds a small error
PLACE_BOUND = 0.002     # [m]
ANGLE_BOUND = 0.2       # [deg]
SPEED_BOUND = 0.005     # [m/s]
RATE_BOUND = 0.03       # [rad/s]
MAX_TEXT_LENGTH = 1000
RECORDER_NODE = 'record'        # rosbag's node, whose log lines are not shown
MAX_SHOWN_VARIABLES = 40
#: A page shows these variables first.
HANDOUT_NAMES = ('curr_yaw', 'goal_yaw', 'local_x', 'local_y', 'local_yaw', 'turning', 'state',
                 'has_control')
#: A moment or a stretch of time on the timeline, with kind, begin, end and text.
TimelineEvent = Dict[str, Any]


def kept_samples(time: np.ndarray, values: np.ndarray, bounds: np.ndarray,
                 breaks: Sequence[int]) -> np.ndarray:
    """Returns the indices of the samples that suffice to draw curves. Each column of `values` is a
    curve with a bound in `bounds`. The straight lines between the kept samples differ from the
    `values` by at most the bound. At each index in `breaks`, a new stretch of the curves begins.

    Source: Douglas and Peucker (1973), but distances are measured along the axis of the values.
    """
    is_kept = np.zeros(len(time), dtype=bool)
    ends = [*breaks, len(time)]
    stretches = [(begin, end - 1) for begin, end in zip([0, *breaks], ends)]
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


def track_data(time: np.ndarray, columns: Sequence[np.ndarray], bounds: Sequence[float],
               breaks: Sequence[int] = ()) -> Dict[str, Any]:
    """Returns the track of `columns`, with a bound for each column. No line is drawn across a gap
    of time, or to a sample whose index is in `breaks`. Its 'breaks' are indices of track points."""
    if not len(time):
        return {'time': [], 'columns': [[] for _ in bounds], 'breaks': []}
    values = np.column_stack(columns)
    begins = sorted({*breaks, *(np.flatnonzero(np.diff(time) > MIN_GAP) + 1)})
    kept = kept_samples(time, values, np.array(bounds), begins)
    # numbers with a bound of 0.002 get four digits
    digits = [1 - math.floor(math.log10(bound)) for bound in bounds]
    return {'time': np.round(time[kept], 3),
            'columns': [np.round(column, count) for column, count in zip(values[kept].T, digits)],
            'breaks': np.unique(np.searchsorted(kept, begins))}


def timeline_data(run: RunData, model: RobotModel,
                  events: Sequence[TimelineEvent]) -> Dict[str, Any]:
    """Returns all data of a run's timeline in a form for JSON."""
    imu, odometry, local = run.imu, run.odometry, run.local_pose
    time, distance, angle = goal_errors(run)
    frames = frame_intervals(run)
    local_resets = _reset_indices(frames, local.time)
    goal_resets = _reset_indices(frames, time)
    wraps = np.flatnonzero(np.abs(np.diff(angle)) > math.pi) + 1
    # at the beginning of each interval, local_pose is assumed to be exact
    truth = [true_poses(run, interval, interval.odom_T_local) for interval in frames]
    return {
        'duration': max(round(run.duration, 3), 0.001), 'radius': model.body_radius,
        'odom': _pose_track(odometry), 'local': _pose_track(local, local_resets),
        'truth': _pose_track(Poses.joined(truth)),
        'frame': _pose_track(local_in_odom(run, local.time), local_resets),
        'heading': track_data(imu.time, [np.degrees(np.unwrap(imu.yaw))], [ANGLE_BOUND]),
        'rate': track_data(imu.time, [imu.yaw_rate], [RATE_BOUND]),
        'speed': track_data(odometry.time, [odometry.linear], [SPEED_BOUND]),
        'distance': track_data(time, [distance], [PLACE_BOUND], goal_resets),
        'angle': track_data(time, [np.degrees(angle)], [ANGLE_BOUND], [*goal_resets, *wraps]),
        'commands': _command_rows(run.commands),
        'goals': [[round(state.begin, 3), state.name, _rounded(state.goal)]
                  for state in recorded_states(run)],
        'marks': sorted(events, key=lambda event: event['begin']),
        'log': _log_rows(run.log),
        'nodes': [*dict.fromkeys(run.variables.node)], 'variables': variable_rows(run)}


def _pose_track(poses: Poses, breaks: Sequence[int] = ()) -> Dict[str, Any]:
    return track_data(poses.time, [poses.x, poses.y, np.degrees(np.unwrap(poses.yaw))],
                      [PLACE_BOUND, PLACE_BOUND, ANGLE_BOUND], [*breaks, *poses.leap_indices])


def _rounded(goal: Optional[Pose2]) -> Optional[List[float]]:
    return None if goal is None else [round(number, 4) for number in (goal.x, goal.y, goal.yaw)]


def _reset_indices(frames: Sequence[FrameInterval], time: np.ndarray) -> List[int]:
    """Returns the index of the first sample after each reset. `time` has the samples' times [s]."""
    indices = np.searchsorted(time, [interval.begin for interval in frames[1:]])
    return [int(index) for index in indices if 0 < index < len(time)]


def _command_rows(commands: Commands) -> List[List[Optional[float]]]:
    """Returns [time, linear, angular] of each command that differs from the previous command. When
    the robot's timeout ends a command, both speeds become None."""
    sent = commands.with_timeouts()
    rows = np.round(np.column_stack([sent.time, sent.linear, sent.angular]), 3)
    speeds = rows[:, 1:]
    changes = rows[changed_rows(speeds)]
    numbers = changes.astype(object)
    numbers[np.isnan(changes)] = None
    return numbers.tolist()


def changed_rows(rows: np.ndarray) -> np.ndarray:
    """Returns a mask of the rows that differ from the previous row, and of the first row."""
    is_changed = np.ones(len(rows), dtype=bool)
    is_changed[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    return is_changed


def timeline_event(kind: str, begin: float, text: str, end: float = 0.0) -> TimelineEvent:
    """Returns a TimelineEvent from `begin` to `end` [s]. An event without an `end` is a moment."""
    return {'kind': kind, 'begin': round(float(begin), 3), 'end': round(float(max(begin, end)), 3),
            'text': text[:MAX_TEXT_LENGTH]}


def _log_rows(log: LogLines) -> List[List[Any]]:
    return [[round(float(time), 3), level, f"{node.lstrip('/')}: {text}"[:MAX_TEXT_LENGTH]]
            for time, level, node, text in zip(log.time, log.level, log.node, log.text)
            if node.rpartition('/')[2] != RECORDER_NODE]


def variable_rows(run: RunData) -> List[List[Any]]:
    """Returns [name, times, texts] of each variable. Each text is valid until the next time. In a
    gap of the readings the text is None. A name begins with its node if there are several nodes."""
    rows: List[List[Any]] = []
    nodes = variables_by_node(run.variables)
    for node, series_of in nodes.items():
        prefix = node.strip('/') + ': ' if len(nodes) > 1 else ''
        rows += [[prefix + name, *_text_changes(series)] for name, series in series_of.items()]
    rank_of = {name: rank for rank, name in enumerate(HANDOUT_NAMES)}
    rows.sort(key=lambda row: rank_of.get(row[0], len(rank_of)))
    return rows[:MAX_SHOWN_VARIABLES]


def _text_changes(variable: Series) -> List[List[Any]]:
    """Returns [times, texts] of a variable. The text None begins each gap, and is last."""
    values = np.where(np.isnan(variable.value), variable.text, variable.value)
    is_last = np.diff(variable.time, append=np.inf) > MIN_GAP       # a gap or the end follows
    is_after_gap = np.append(False, is_last[:-1])
    is_new = is_after_gap | changed_rows(values[:, np.newaxis])
    changes: List[Tuple[float, Optional[str]]] = []
    for index in np.flatnonzero(is_new | is_last):
        time = round(float(variable.time[index]), 3)
        if is_new[index]:
            changes.append((time, _shown_text(variable.text[index], variable.value[index])))
        if is_last[index]:
            changes.append((time, None))
    times, texts = zip(*changes)
    return [list(times), list(texts)]


def _shown_text(text: str, number: float) -> str:
    if '.' in text and not math.isnan(number):
        return f'{number:.5g}'
    return text


def timeline_html(data: Dict[str, Any]) -> str:
    """Returns the HTML of a timeline with these data. A page with this HTML needs no other file."""
    text = json.dumps(data, default=np.ndarray.tolist, separators=(',', ':'), allow_nan=False)
    styles = drawing.FOLDER / 'colours.css', TIMELINE_FILE.with_suffix('.css')
    style = ''.join(path.read_text(encoding='utf-8') for path in styles)
    page = TIMELINE_FILE.read_text(encoding='utf-8').format(
        data=text.replace('<', '\\u003c'),      # a </script> in a text must not end the data
        script=drawing.one_script(TIMELINE_FILE.with_suffix('.js')))
    return f'<style>\n{style}</style>\n{page}'
