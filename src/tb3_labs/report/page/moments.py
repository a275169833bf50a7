"""Finds the moments of a run that its page links to.

The events on the timeline are turns, drives, movements by hand, resets, starts, stops and gaps. The
page also links to exceptions, open TODOs and the first mistake, which show what is wrong in a node.
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
from tb3_labs.report.page.document import degrees_text, hints_section, number_text
from tb3_labs.report.page.timeline import TimelineEvent, changed_rows, timeline_event
from tb3_labs.watch.lab_mistakes import mistakes_of_nodes

EXCEPTION_WORDS = 'Traceback (most recent call last)', 'bad callback'
TRACEBACK_LINE_NUMBER = re.compile(r'^ *File ".*", line (\d+)', re.MULTILINE)
OPEN_TODO = re.compile(r'TODO \d+ is open')      # printed by a node of the skeletons
CONTROL_EVENTS = {True: ('start', 'control given to the node'),
                  False: ('stop', 'control taken from the node')}
FAULT_LINE = '<p><b>{}</b> ({}) <a href="#t={:.1f}">Watch it</a></p>'


def timeline_events(run: RunData, turns: Sequence[TurnReport],
                    drives: Sequence[DriveReport]) -> List[TimelineEvent]:
    events = [_turn_event(number, turn) for number, turn in enumerate(turns, 1)]
    events += [_drive_event(number, drive) for number, drive in enumerate(drives, 1)]
    turns_and_drives = list(events)
    for movement in movements(run):
        is_by_hand = not any(movement.begin < event['end'] and event['begin'] < movement.end
                             for event in turns_and_drives)
        if is_by_hand:
            events.append(_event_by_hand(run, movement.begin, movement.end))
    events += [timeline_event('reset', interval.begin, f'reset {number} of local')
               for number, interval in enumerate(frame_intervals(run)[1:], 1)]
    events += [timeline_event('reset', time, 'reset of the board, which calibrates its gyro')
               for time in run.board_resets.time]
    events += [timeline_event('stop', state.begin, state.name)
               for state in recorded_states(run) if ':' in state.name]
    control = run.control.take(changed_rows(run.control.value[:, np.newaxis]))
    for time, value in zip(control.time, control.value):
        kind, text = CONTROL_EVENTS[bool(value)]
        events.append(timeline_event(kind, time, text))
    for name, samples in (('imu', run.imu), ('odometry', run.odometry)):
        is_gap = np.diff(samples.time) > MIN_GAP
        for begin, end in zip(samples.time[:-1][is_gap], samples.time[1:][is_gap]):
            text = f'{name} silent for {end - begin:.1f} s'
            events.append(timeline_event('lost', begin, text, end))
    return events


def _turn_event(number: int, turn: TurnReport) -> TimelineEvent:
    requested = degrees_text(turn.requested, '{:+.0f}')
    turned = degrees_text(turn.turned, '{:+.1f}')
    text = f'turn {number}: asked {requested}, turned {turned} deg'
    return timeline_event('turn', turn.begin, text, turn.end)


def _drive_event(number: int, drive: DriveReport) -> TimelineEvent:
    distance = number_text(drive.error[0], '{:.3f}')
    angle = degrees_text(drive.error[1], '{:.1f}')
    text = f'drive {number}: {drive.outcome}, {distance} m and {angle} deg off'
    return timeline_event('drive', drive.begin, text, drive.end)


def _event_by_hand(run: RunData, begin: float, end: float) -> TimelineEvent:
    before, after = run.imu.yaw_at((begin, end))
    length = run.odometry.between(begin, end).length
    turned = degrees_text(after - before, '{:+.1f}')
    return timeline_event('hand', begin, f'by hand: {length:.2f} m, turned {turned} deg', end)


def printed_faults(run: RunData) -> str:
    """Returns a paragraph of HTML for each exception and each open TODO that nodes printed."""
    faults: Dict[str, List[float]] = {}         # {sentence: times}
    for time, text in zip(run.log.time.tolist(), run.log.text):
        todo = OPEN_TODO.match(text)
        if todo:
            faults.setdefault(f'The node said: {todo.group()}.', []).append(time)
        if any(words in text for words in EXCEPTION_WORDS):
            error = text.strip().splitlines()[-1]
            numbers = TRACEBACK_LINE_NUMBER.findall(text)
            if numbers:
                error += f', line {numbers[-1]}'
            faults.setdefault(f'An exception was raised: {error}.', []).append(time)
    lines = []
    for text, times in faults.items():
        count = 'once' if len(times) == 1 else f'{len(times)} times'
        lines.append(FAULT_LINE.format(escape(text), count, times[0]))
    return '\n'.join(lines)


def hints_of_nodes(run: RunData) -> List[str]:
    """Returns the HTML of the hints on the first mistake of each node."""
    return [hints_section(mistake, f'{node}: {mistake.as_sentence()}')
            for node, mistake in mistakes_of_nodes(run)]
