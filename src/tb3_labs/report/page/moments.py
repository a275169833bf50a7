"""Finds the moments of a run that its page points to.

The marks on the timeline are turns, drives, movements by hand, resets, starts, stops and gaps.
Signs of a mistake in the node are exceptions, open TODOs, and the first broken link.
"""
import re
from html import escape
from typing import Dict, List, Sequence

import numpy as np

from tb3_labs.report.motion.drives import DriveReport
from tb3_labs.report.motion.movements import MovementKind, movements, parts_of, programs
from tb3_labs.report.motion.resets_and_goals import epochs, spans
from tb3_labs.report.motion.turns import TurnReport
from tb3_labs.report.page.document import degrees, hints, number
from tb3_labs.report.page.timeline import Mark, mark
from tb3_labs.report.run_data import MIN_GAP, RunData
from tb3_labs.watch.broken_link import sentence
from tb3_labs.watch.chains import broken_links_of_nodes

#: rospy prints these words before a traceback of a callback.
EXCEPTION_WORDS = 'Traceback (most recent call last)', 'bad callback'
#: A line of a traceback that names a line of a file.
LINE_NUMBER = re.compile(r'^ *File ".*", line (\d+)', re.MULTILINE)
#: A page shows at most this many different exceptions.
MAX_ERRORS = 5
#: A page shows at most this many characters of an exception.
MAX_ERROR_LENGTH = 300
#: A node of the skeletons prints this when it reaches an open TODO.
OPEN_TODO = re.compile(r'TODO \d+ is open')
FAULT_LINE = '<p><b>{}</b> <a href="#t={:.1f}">Watch it</a></p>'


def moments(run: RunData, turned: Sequence[TurnReport],
            driven: Sequence[DriveReport]) -> List[Mark]:
    """Returns the Marks of a run with these turns and drives."""
    found = [mark('turn', turn.begin, 'turn {}: asked {}, turned {} deg'.format(
        k, degrees(turn.requested, '{:+.0f}'), degrees(turn.turned, '{:+.1f}')), turn.end)
        for k, turn in enumerate(turned, 1)]
    found += [mark('drive', drive.begin, 'drive {}: {}, {} m and {} deg off'.format(
        k, drive.outcome, number(drive.measured[0], '{:.3f}'),
        degrees(drive.measured[1], '{:.1f}')), drive.end) for k, drive in enumerate(driven, 1)]
    turns_and_drives = list(found)
    for movement in movements(run):
        if any(movement.begin < other['end'] and other['begin'] < movement.end
               for other in turns_and_drives):
            continue
        is_by_hand = movement.kind is MovementKind.BY_HAND
        parts = parts_of(run, movement) if is_by_hand else [(movement.begin, movement.end)]
        found += [_by_hand(run, begin, end) for begin, end in parts]
    found += [mark('reset', epoch.begin, f'reset {k} of local')
              for k, epoch in enumerate(epochs(run)[1:], 1)]
    found += [mark('stop', span.begin, span.state) for span in spans(run) if ':' in span.state]
    is_given = run.control.value > 0.5
    for k in np.flatnonzero(np.diff(is_given, prepend=~is_given[:1])):
        kind, verb = ('start', 'given to') if is_given[k] else ('stop', 'taken from')
        found.append(mark(kind, run.control.time[k], f'control {verb} the node'))
    for name, samples in (('imu', run.imu), ('odometry', run.odometry)):
        for k in np.flatnonzero(np.diff(samples.time) > MIN_GAP):
            begin, end = samples.time[k:k + 2]
            found.append(mark('lost', begin, f'{name} silent for {end - begin:.1f} s', end))
    return found


def _by_hand(run: RunData, begin: float, end: float) -> Mark:
    before, after = run.imu.yaw_at((begin, end))
    # with a mouse, a person drives, although a node sends the commands
    drivers = [] if 'mouse_info' in run.devices else programs(run, begin, end)
    words = 'driven by ' + ' and '.join(drivers) if drivers else 'by hand'
    return mark('hand', begin, '{}: {:.2f} m, turned {} deg'.format(
        words,
        run.odometry.between(begin, end).length, degrees(after - before, '{:+.1f}')), end)


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
        'once' if len(times) == 1 else f'{len(times)} times', error[:MAX_ERROR_LENGTH])), times[0])
        for error, times in list(errors.items())[:MAX_ERRORS]]
    if todos:
        parts.append(FAULT_LINE.format(f"The node said: {', '.join(todos)}.", min(todos.values())))
    return '\n'.join(parts)


def broken_links(run: RunData) -> List[str]:
    """Returns HTML of the first broken link of each node whose variables were recorded."""
    return [hints((link, broken), f'{node}: {sentence(broken)}')
            for node, link, broken in broken_links_of_nodes(run)]
