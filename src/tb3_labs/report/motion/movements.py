"""Finds the movements of a run by its commands, for nodes that do not publish their state.

A *movement* is a stretch of commands that are not zero. Its pauses are shorter than
`MOVEMENT_PAUSE`. A reset, or a change of `ctrl_relinq`, divides a movement in two. A movement is a

* turn, if no command has a forward speed;
* drive, if a turn, a straight line and a turn were commanded; one of the two turns may be missing.
  The line is straight if the heading stays within `MAX_BEND` of the heading at the line's start;
* movement by hand, if it is not a turn and not a drive.

The commands do not name their sender. Other topics help to find it if they were recorded:

* With `ctrl_relinq`, a movement while a node has control is a drive, and any other movement is by
  hand. But a turn without a line is a drive only if it follows a reset or a change of control, or
  if a reset, a change of control or the end of the recording cut it off. Otherwise a person turned
  the robot while the node was silent at its goal, so that the turn is by hand.
* With `joy` and without `ctrl_relinq`, the pad never gave control, and all movements are by hand.
* With `mouse_info`, no movement is a drive, and a turn must be faster than the mouse can command.

Without these topics, a person's drive by keys looks like a node's drive.

Units: metres, radians, seconds since the recording's start.
Edge cases: a command is in force until the next command, at most for the robot's timeout. A run
without commands has no movements.
"""
import math
import re
from dataclasses import dataclass
from enum import Enum
from typing import List, Tuple

import numpy as np

from tb3_labs.geometry.arrays import last_before
from tb3_labs.handout import MOUSE_FULL
from tb3_labs.report.run_data import Commands, RunData, cached_per_run
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: A movement ends if no command moves the robot for this time [s].
MOVEMENT_PAUSE = 1.0
#: The names of programs by which a person drives.
PERSONS_PROGRAM = re.compile('teleop|joy|pad|mouse|key|rqt_|rviz|panel')
#: The program that sends commands which a person types in a terminal.
TERMINAL = 'rostopic pub'
#: A part of a movement by hand is joined to the part before it if it is shorter than this [s].
MIN_PART_TIME = 0.4
#: At most this many movements of a run are found.
MAX_MOVEMENTS = 1000
#: A speed below this counts as zero [m/s], [rad/s].
NO_SPEED = 1e-3
#: On a straight line the heading differs by at most this from the heading at its start [rad].
MAX_BEND = math.radians(20.0)
#: The turn before a straight line may go on for this time after the line's first command [s].
STRAIGHT_AFTER = 0.3
#: A drive moves the robot at least this far [m].
MIN_DRIVE_LENGTH = 0.1


class MovementKind(Enum):
    TURN = 'turn'
    DRIVE = 'drive'
    BY_HAND = 'by hand'


@dataclass(frozen=True)
class Movement:
    """A movement from `begin` to `end`. Its commands have a forward speed from `forward` to
    `turns_again`; if these times are equal, no command has a forward speed."""

    kind: MovementKind
    begin: float
    forward: float
    turns_again: float
    end: float


def moving(commands: Commands) -> np.ndarray:
    """Returns for each command whether it moves the robot."""
    return (np.abs(commands.linear) > NO_SPEED) | (np.abs(commands.angular) > NO_SPEED)


def programs(run: RunData, begin: float, end: float) -> List[str]:
    """Returns the names of the programs that commanded the robot from `begin` to `end` [s]. Unknown
    programs, and programs by which a person drives, are left out."""
    names = {run.senders[int(k)] for k in run.sender_index.between(begin, end).value}
    return sorted(TERMINAL if '/rostopic_' in name else name for name in names
                  if name != '?' and not PERSONS_PROGRAM.search(name))


def parts_of(run: RunData, movement: Movement) -> List[Tuple[float, float]]:
    """Returns (begin, end) of the parts of a movement by hand [s]. In each part the robot either
    drives, or turns on the spot."""
    commands = run.commands.between(movement.begin, movement.end)
    commands = commands.take(moving(commands))
    is_ahead = np.abs(commands.linear) > NO_SPEED
    begins = [movement.begin]
    for k in np.flatnonzero(is_ahead[1:] != is_ahead[:-1]) + 1:
        changes = np.flatnonzero(is_ahead[k:] != is_ahead[k])
        until = commands.time[k + changes[0]] if len(changes) else movement.end
        begin = float(commands.time[k])
        if min(until - begin, begin - begins[-1]) > MIN_PART_TIME:
            begins.append(begin)
    return list(zip(begins, begins[1:] + [movement.end]))[:MAX_MOVEMENTS]


@cached_per_run
def movements(run: RunData) -> List[Movement]:
    time = run.commands.time
    moves = np.flatnonzero(moving(run.commands))
    if not len(moves):
        return []
    ends = np.minimum(np.append(time[1:], np.inf), time + COMMAND_TIMEOUT)
    cut = cuts(run)
    is_cut = np.diff(np.searchsorted(cut, time[moves])) > 0
    is_pause = time[moves[1:]] - ends[moves[:-1]] >= MOVEMENT_PAUSE
    parts = np.split(moves, np.flatnonzero(is_cut | is_pause) + 1)
    return [_movement(run, part, ends, cut) for part in parts[:MAX_MOVEMENTS]]


def cuts(run: RunData) -> np.ndarray:
    """Returns the times at which a reset or a change of control cuts off a movement [s].

    A movement is not cut off if a node gets control within MOVEMENT_PAUSE after it began: the node
    itself began this movement, because it received ctrl_relinq before the recorder did.
    """
    changes = np.flatnonzero(np.diff(run.control.value)) + 1
    times = run.control.time[changes]
    is_given = run.control.value[changes] == 1.0
    moves = run.commands.time[moving(run.commands)]
    begins = moves[np.diff(moves, prepend=-np.inf) >= MOVEMENT_PAUSE]
    last_begin = np.append(begins, -math.inf)[last_before(begins, times)]
    is_nodes_begin = is_given & (times - last_begin < MOVEMENT_PAUSE)
    return np.sort(np.concatenate([run.resets.time, times[~is_nodes_begin]]))


def _movement(run: RunData, moves: np.ndarray, ends: np.ndarray, cut: np.ndarray) -> Movement:
    """Returns the Movement of the commands with the indices `moves`. `ends` has the time at which
    each command of the run ends [s]. `cut` has the times of :func:`cuts`."""
    time = run.commands.time
    begin, end = float(time[moves[0]]), float(min(ends[moves[-1]], run.duration))
    forward = turns_again = end
    ahead = moves[np.abs(run.commands.linear[moves]) > NO_SPEED]
    if len(ahead):
        forward, turns_again = float(time[ahead[0]]), float(min(ends[ahead[-1]], end))
    if len(run.control) or 'joy' in run.devices:
        kind = _kind_by_control(run, begin, end, len(ahead) > 0, cut)
    elif len(ahead):
        has_turn = moves[0] < ahead[0] or moves[-1] > ahead[-1]
        may_be_drive = has_turn and 'mouse_info' not in run.devices
        is_drive = may_be_drive and _is_line(run, forward, turns_again)
        kind = MovementKind.DRIVE if is_drive else MovementKind.BY_HAND
    else:
        is_fast = np.abs(run.commands.angular[moves]).max() > MOUSE_FULL + NO_SPEED
        is_turn = is_fast or 'mouse_info' not in run.devices
        kind = MovementKind.TURN if is_turn else MovementKind.BY_HAND
    return Movement(kind, begin, forward, turns_again, end)


def _kind_by_control(run: RunData, begin: float, end: float, goes_ahead: bool,
                     cut: np.ndarray) -> MovementKind:
    """Returns the kind of a movement in a run with ctrl_relinq or with a pad."""
    if not has_control(run, (begin + end) / 2.0):
        return MovementKind.BY_HAND
    was_cut_off = end == run.duration or (np.abs(cut - end) <= COMMAND_TIMEOUT).any()
    follows_cut = ((cut <= begin) & (begin - cut < MOVEMENT_PAUSE)).any()
    is_drive = goes_ahead or was_cut_off or follows_cut
    return MovementKind.DRIVE if is_drive else MovementKind.BY_HAND


def has_control(run: RunData, time: float) -> bool:
    """Did a node have control at this time [s]? The first message on ctrl_relinq changed who has
    control, so the answer before this message is its opposite."""
    if not len(run.control):
        return False
    before = run.control.value[run.control.time <= time]
    return bool(before[-1]) if len(before) else not run.control.value[0]


def _is_line(run: RunData, begin: float, end: float) -> bool:
    """Was the way from `begin` to `end` [s] straight, and long enough for a drive?"""
    yaw = np.unwrap(run.imu.between(begin + STRAIGHT_AFTER, end).yaw)
    if len(yaw) and np.abs(yaw - yaw[0]).max() > MAX_BEND:
        return False
    return run.odometry.at(begin).distance_to(run.odometry.at(end)) >= MIN_DRIVE_LENGTH
