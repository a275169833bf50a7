"""The behaviour of a node that is tried again in a recorded run, compared with the recorded node.

Units: seconds since the recording's start, m/s, rad/s.
"""
import re
from html import escape
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.report.drives import drives
from tb3_labs.report.movements import NO_SPEED, moving
from tb3_labs.report.page import document
from tb3_labs.report.run_data import Commands, LogLines, Poses, RunData
from tb3_labs.report.tables import number
from tb3_labs.report.timeline import (
    commands_of, in_order, lines_of, mark, marks, poses_of, section, timeline)
from tb3_labs.report.turns import TurnReport
from tb3_labs.robot.turtlebot3 import RobotModel

#: A command differs if it is farther than APART [m/s], [rad/s] from all commands of the other node
#: within SHIFT [s], since nodes react sooner or later. It also differs if it moves
#: the robot (faster than NO_SPEED [m/s], [rad/s]) and none of those commands does.
APART, SHIFT = (0.03, 0.1), 0.2
#: Commands part if they differ for at least this long [s]. They are compared in steps of STEP [s].
LONG, STEP = 0.3, 0.02
#: A recorder hears a new sender up to HEARD_LATE [s] later than the node does. A node begins to
#: move the robot REACTION [s] after it may. A robot stands if no command moves it for STILL [s].
HEARD_LATE, REACTION, STILL = 1.0, 0.1, 0.5
#: Codes for the colours of a terminal, in the text that a node prints.
COLOUR = re.compile(r'\x1b\[[0-9;]*m')


class Again(NamedTuple):
    """The behaviour of a node to which the recorded sensors and inputs were played."""

    commands: Commands
    local_pose: Poses            # if the node publishes it
    log: LogLines
    printed: str


class Parting(NamedTuple):
    """The first time at which the commands of two nodes differ, and both commands (m/s, rad/s)."""

    time: float
    recorded: np.ndarray
    now: np.ndarray


def parting(run: RunData, now: Commands) -> Optional[Parting]:
    """Returns the first Parting of the recorded commands from another node's; None without one.

    Times at which no node may drive are left out: a person gave the recorded commands then.
    """
    times = np.arange(0.0, run.duration, STEP)
    one, other = in_force_at(run.commands, times), in_force_at(now, times)
    apart = (_is_outside(one, other) | _is_outside(other, one)) & _may_drive(run, times)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], apart.astype(int), [0]])))
    for begin, end in zip(ends[::2], ends[1::2]):
        if (end - begin) * STEP >= LONG:
            return Parting(float(times[begin]), one[begin], other[begin])
    return None


def _is_outside(speeds: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Does each of the `speeds`, shape (n, 2), differ from all `others` within SHIFT?"""
    reach = round(SHIFT / STEP)
    padded = np.pad(others, ((reach, reach), (0, 0)), mode='edge')
    near = np.array([padded[k:k + len(others)] for k in range(2 * reach + 1)])
    far = (speeds < near.min(axis=0) - APART) | (speeds > near.max(axis=0) + APART)
    moves, move = ((np.abs(each) > NO_SPEED).any(axis=-1) for each in (speeds, near))
    return far.any(axis=1) | (moves & ~move.any(axis=0))


def _may_drive(run: RunData, times: np.ndarray) -> np.ndarray:
    """May a node drive at each of the times? Always, if ctrl_relinq was not recorded."""
    given = run.control.value > 0.5
    if not len(given):
        return np.ones(len(times), dtype=bool)
    moments = [control_moment(float(at), bool(value), run.commands)
               for at, value in zip(run.control.time, given)]
    # before the first message, its opposite holds
    return np.append(~given[0], given)[np.searchsorted(moments, times, side='right')]


def control_moment(at: float, is_given: bool, commands: Commands) -> float:
    """Returns the time at which the recorded node heard that it may drive, or may not [s].

    `at`: the time at which the recorder heard it. This is late if the sender was new to the
    recorder, as ``rostopic pub -1`` always is.
    """
    times = commands.time[moving(commands)]
    before = times[(at - HEARD_LATE < times) & (times <= at)]
    if not len(before):
        return at
    if is_given:
        drove = ((before[0] - STILL <= times) & (times < before[0])).any()
        return at if drove else float(before[0]) - REACTION
    goes_on = ((at < times) & (times <= at + STILL)).any()
    return at if goes_on else float(before[-1])


def in_force_at(commands: Commands, times: np.ndarray) -> np.ndarray:
    """The speeds in force at each of the times, shape (n, 2): 0 if there is no command."""
    speeds = [np.append(part, 0.0) for part in (commands.linear, commands.angular)]
    return np.column_stack(speeds)[commands.newest(times)]


def sentences(found: Optional[Parting]) -> List[str]:
    """Returns the result in sentences."""
    words = ['Open loop: the recorded robot drove as the recorded node told it, not as this one.']
    if found is None:
        return words + ['This node commands what the recorded one did.']
    return words + ['From {:.1f} s on this node commands something else: {}; recorded: {}.'.format(
        found.time, *map(_speeds, (found.now, found.recorded)))]


def _speeds(speeds: np.ndarray) -> str:
    return '{} m/s, {} rad/s'.format(*(number(speed, '{:.2f}') for speed in speeds))


def with_again(data: Dict[str, Any], again: Again, found: Optional[Parting]) -> Dict[str, Any]:
    """Returns the timeline's `data`, with the behaviour of the node that was tried again."""
    parts = [] if found is None else [mark('apart', found.time, 'the commands part')]
    return dict(data, marks=in_order(data['marks'] + parts),
                log=sorted(data['log'] + lines_of(again.log, 'now, ')),
                again={'commands': commands_of(again.commands),
                       'local': poses_of(again.local_pose)})


def write_replay(run: RunData, model: RobotModel, turned: Sequence[TurnReport], again: Again,
                 folder: Path) -> Tuple[Path, List[str]]:
    """Write the page of a node that was tried again. Returns its path and the result in words."""
    found = parting(run, again.commands)
    words = sentences(found)
    data = with_again(timeline(run, model, marks(run, turned, drives(run, model))),
                      again, found)
    folder.mkdir(parents=True, exist_ok=True)
    page = folder / 'replay.html'
    page.write_text(document('Tried again: ' + Path(run.name).name, [
        '<p>{}</p>'.format(escape(' '.join(words))), section(data),
        '<h2>What the node printed</h2><pre>{}</pre>'.format(
            escape(COLOUR.sub('', again.printed)))]),
        encoding='utf-8')
    return page, words
