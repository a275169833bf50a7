"""The movements of a run, found in its commands alone: for nodes that say nothing of themselves.

A *movement* is a stretch of commands that are not zero, with pauses shorter than `PAUSE`. A reset,
and a change of `ctrl_relinq`, end a movement and begin the next. It is a

* turn, if no command has a forward speed;
* drive, if a turn, a straight line, a turn were commanded, of which one turn may be missing. The
  line is straight if the heading stays within `STRAIGHT` of where it began;
* movement by hand, if it is neither.

The commands do not tell who sent them, so other topics decide where they can:

* With ctrl_relinq, a movement while a node has control is a drive, of whatever shape, and any other
  movement is by hand. With `joy` alone the pad never gave control, and all is by hand.
* With `mouse_info`, nothing is a drive, and a turn is faster than any that the mouse commands.

Otherwise a person who turns, drives straight on and turns, by keys, counts as a drive.

Units: metres, radians, seconds since the recording's start.
Edge cases: a command is in force until the next one, at most for the robot's timeout. A run without
commands has no movements.
"""
from dataclasses import dataclass
from enum import Enum
from typing import List

import numpy as np

from tb3_labs.report.epochs import between
from tb3_labs.report.run_data import RunData
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: A longer time without a command that moves the robot ends a movement [s].
PAUSE = 1.0
#: A command that is slower than this is zero [m/s], [rad/s].
NO_SPEED = 1e-3
#: On a straight line the heading differs from that at its begin by no more than this [rad], counted
#: from this time after its begin, when the turn before is over [s].
STRAIGHT = np.radians(20.0)
TURN_IS_OVER = 0.3
#: A drive moves the robot at least this far [m].
SHORTEST_DRIVE = 0.1
#: The mouse commands no faster turn than this [rad/s], by the handout.
FASTEST_BY_MOUSE = 0.5


class Kind(Enum):
    """The kinds of movements."""

    TURN = 'turn'
    DRIVE = 'drive'
    BY_HAND = 'by hand'


@dataclass(frozen=True)
class Movement:
    """A movement from `begin` to `end`; its commands go forward from `forward` to `turns_again`,
    or never, if both are equal."""

    kind: Kind
    begin: float
    forward: float
    turns_again: float
    end: float


def movements(run: RunData) -> List[Movement]:
    """All movements of a run, in order."""
    time, moves = run.commands.time, _moves(run)
    if not len(moves):
        return []
    ends = np.minimum(np.append(time[1:], np.inf), time + COMMAND_TIMEOUT)
    cuts = _cuts(run)
    is_cut = np.searchsorted(cuts, time[moves[:-1]]) < np.searchsorted(cuts, time[moves[1:]])
    is_pause = time[moves[1:]] - ends[moves[:-1]] >= PAUSE
    return [_movement(run, part, ends)
            for part in np.split(moves, np.flatnonzero(is_cut | is_pause) + 1)]


def _moves(run: RunData) -> np.ndarray:
    """Indices of the commands that are not zero."""
    return np.flatnonzero((np.abs(run.commands.linear) > NO_SPEED)
                          | (np.abs(run.commands.angular) > NO_SPEED))


def _cuts(run: RunData) -> np.ndarray:
    """The times at which a movement ends whatever the commands are."""
    changes = np.flatnonzero(np.diff(run.control.value)) + 1
    return np.sort(np.concatenate([run.resets.time, run.control.time[changes]]))


def _movement(run: RunData, moves: np.ndarray, ends: np.ndarray) -> Movement:
    """The Movement of the commands with the indices `moves`, in force until `ends` [s]."""
    time = run.commands.time
    begin, end = float(time[moves[0]]), float(min(ends[moves[-1]], run.duration))
    ahead = moves[np.abs(run.commands.linear[moves]) > NO_SPEED]
    forward, turns_again = (float(time[ahead[0]]), float(min(ends[ahead[-1]], end))) if (
        len(ahead)) else (end, end)
    if len(run.control) or 'joy' in run.devices:
        kind = Kind.DRIVE if _has_control(run, (begin + end) / 2.0) else Kind.BY_HAND
    elif len(ahead):
        kind = _kind_of_drive(run, forward, turns_again,
                              moves[0] < ahead[0] or moves[-1] > ahead[-1])
    else:
        kind = _kind_of_turn(run, moves)
    return Movement(kind, begin, forward, turns_again, end)


def _kind_of_turn(run: RunData, moves: np.ndarray) -> Kind:
    fastest = float(np.abs(run.commands.angular[moves]).max())
    by_mouse = 'mouse_info' in run.devices and fastest <= FASTEST_BY_MOUSE + NO_SPEED
    return Kind.BY_HAND if by_mouse else Kind.TURN


def _kind_of_drive(run: RunData, forward: float, turns_again: float, has_turn: bool) -> Kind:
    if 'mouse_info' in run.devices or not has_turn:
        return Kind.BY_HAND
    is_drive = _is_straight(run, forward, turns_again) and (
        run.odometry.at(forward).distance_to(run.odometry.at(turns_again)) >= SHORTEST_DRIVE)
    return Kind.DRIVE if is_drive else Kind.BY_HAND


def _has_control(run: RunData, time: float) -> bool:
    """Had a node control at this time? Before the first message it was the other way."""
    if not len(run.control):
        return False
    heard = int(np.searchsorted(run.control.time, time, side='right'))
    return bool(run.control.value[heard - 1]) if heard else not run.control.value[0]


def _is_straight(run: RunData, begin: float, end: float) -> bool:
    """Did the robot keep its heading from `begin` to `end` [s]?"""
    yaw = np.unwrap(between(run.imu, begin + TURN_IS_OVER, end).yaw)
    return not len(yaw) or bool(np.abs(yaw - yaw[0]).max() <= STRAIGHT)
