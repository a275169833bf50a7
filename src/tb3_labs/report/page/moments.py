"""Finds the moments of a run that its page points to.

The events on the timeline are turns, drives, movements by hand, resets, starts, stops and gaps.
Signs of a mistake in the node are exceptions, open TODOs, and the first broken link.
"""
import re
from html import escape
from typing import Dict, List, Sequence

import numpy as np

from tb3_labs.recording.run_data import MIN_GAP, RunData
from tb3_labs.report.motion.drives import DriveReport
from tb3_labs.report.motion.movements import movements
from tb3_labs.report.motion.resets_and_goals import frame_intervals, recorded_states
from tb3_labs.report.motion.turns import TurnReport
from tb3_labs.report.page.document import degrees, hints, number
from tb3_labs.report.page.timeline import TimelineEvent, timeline_event
from tb3_labs.watch.broken_link import sentence
from tb3_labs.watch.chains import broken_links_of_nodes

#: rospy prints these words before a traceback of a callback.
EXCEPTION_WORDS = 'Traceback (most recent call last)', 'bad callback'
#: A line of a traceback that names a line of a file.
LINE_NUMBER = re.compile(r'^ *File ".*", line (\d+)', re.MULTILINE)
#: A node of the skeletons prints this when it reaches an open TODO.
OPEN_TODO = re.compile(r'TODO \d+ is open')
FAULT_LINE = '<p><b>{}</b> <a href="#t={:.1f}">Watch it</a></p>'


def moments(run: RunData, turned: Sequence[TurnReport],
            driven: Sequence[DriveReport]) -> List[TimelineEvent]:
    """Returns the TimelineEvents of a run with these turns and drives."""
    found = [_turn_event(k, turn) for k, turn in enumerate(turned, 1)]
    found += [_drive_event(k, drive) for k, drive in enumerate(driven, 1)]
    turns_and_drives = list(found)
    for movement in movements(run):
        is_known = any(movement.begin < known['end'] and known['begin'] < movement.end
                       for known in turns_and_drives)
        if not is_known:
            found.append(_by_hand(run, movement.begin, movement.end))
    found += [timeline_event('reset', interval.begin, f'reset {k} of local')
              for k, interval in enumerate(frame_intervals(run)[1:], 1)]
    found += [timeline_event('stop', interval.begin, interval.state)
              for interval in recorded_states(run) if ':' in interval.state]
    was_given = None
    for time, value in zip(run.control.time, run.control.value):
        is_given = value > 0.5
        if is_given and not was_given:
            found.append(timeline_event('start', time, 'control given to the node'))
        elif not is_given and was_given is not False:
            found.append(timeline_event('stop', time, 'control taken from the node'))
        was_given = is_given
    for name, samples in (('imu', run.imu), ('odometry', run.odometry)):
        for k in np.flatnonzero(np.diff(samples.time) > MIN_GAP):
            begin, end = samples.time[k:k + 2]
            text = f'{name} silent for {end - begin:.1f} s'
            found.append(timeline_event('lost', begin, text, end))
    return found


def _turn_event(k: int, turn: TurnReport) -> TimelineEvent:
    requested, turned = degrees(turn.requested, '{:+.0f}'), degrees(turn.turned, '{:+.1f}')
    text = f'turn {k}: asked {requested}, turned {turned} deg'
    return timeline_event('turn', turn.begin, text, turn.end)


def _drive_event(k: int, drive: DriveReport) -> TimelineEvent:
    distance, angle = drive.measured
    off = f"{number(distance, '{:.3f}')} m and {degrees(angle, '{:.1f}')} deg off"
    return timeline_event('drive', drive.begin, f'drive {k}: {drive.outcome}, {off}', drive.end)


def _by_hand(run: RunData, begin: float, end: float) -> TimelineEvent:
    before, after = run.imu.yaw_at((begin, end))
    length = run.odometry.between(begin, end).length
    turned = degrees(after - before, '{:+.1f}')
    return timeline_event('hand', begin, f'by hand: {length:.2f} m, turned {turned} deg', end)


def printed_faults(run: RunData) -> str:
    """Returns HTML on the different exceptions and the open TODOs that nodes printed."""
    log = run.log
    errors: Dict[str, List[float]] = {}
    todos: Dict[str, float] = {}
    for time, text in zip(log.time.tolist(), log.texts):
        if any(word in text for word in EXCEPTION_WORDS):
            error = text.strip().splitlines()[-1]
            numbers = LINE_NUMBER.findall(text)
            if numbers:
                error += f' (line {numbers[-1]})'
            errors.setdefault(error, []).append(time)
        todo = OPEN_TODO.match(text)
        if todo:
            todos.setdefault(todo.group(), time)
    parts = [FAULT_LINE.format(escape('An exception came {}: {}.'.format(
        'once' if len(times) == 1 else f'{len(times)} times', error)), times[0])
        for error, times in errors.items()]
    if todos:
        parts.append(FAULT_LINE.format(f"The node said: {', '.join(todos)}.", min(todos.values())))
    return '\n'.join(parts)


def broken_links(run: RunData) -> List[str]:
    """Returns HTML of the first broken link of each node whose variables were recorded."""
    return [hints((link, broken), f'{node}: {sentence(broken)}')
            for node, link, broken in broken_links_of_nodes(run)]
