"""The turns of a recorded run of the IMU lab, compared with those of mistaken robots.

A bag does not have the letters: for each turn the letter is taken that fits better. A turn ends at a
zero on ``cmd_vel``.

Units: radians, left positive; rad/s; seconds since the recording's start.
"""
import math
from typing import List, NamedTuple, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.angles import wrap
from tb3_labs.report.diagnosed_drives import CLOSE, SETTLED, Fit, swings, turn_apart, was_lost
from tb3_labs.report.mistakes import NEAR_TURN, Law
from tb3_labs.report.movements import FASTEST_BY_MOUSE, NO_SPEED
from tb3_labs.report.run_data import RunData
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: A robot goes on after the end of its turn, and may fall short of it a little [rad].
GOES_ON, FALLS_SHORT = math.radians(22.0), math.radians(4.0)
#: A shorter turn is a zero of another sender, not the end of a turn [s].
SHORTEST = 0.15
#: A faster command comes from a node without an upper limit: the lab's is 1.5 [rad/s].
TOO_FAST = 1.55
#: A turn that goes round because a clamp is missing begins with a rate below SLOW times its peak,
#: for START [s].
SLOW, START = 0.7, 0.5


class Turn(NamedTuple):
    """A recorded turn. `turned` is NaN if it went left and right; `peak`: of the commands. A
    person may have ended the last one. `is_persons`: one rate, without a zero at its end. `sides`:
    1.0 for l, -1.0 for r; both if the letter is not known."""

    begin: float
    heading: float
    turned: float
    peak: float
    may_be_cut: bool = False
    is_stopped: bool = True
    is_persons: bool = False
    sides: Tuple[float, ...] = (1.0, -1.0)


def compared(seen: Sequence[Turn], law: Law) -> Fit:
    """Returns the Fit of the turns and a `law`, in radians."""
    return Fit(law.mistake, [_apart(law, turn) for turn in seen])


def _apart(law: Law, turn: Turn) -> float:
    """The distance of a turn from that of a law, for the letter that fits better [rad]."""
    far = []
    for side in turn.sides:
        for near in (NEAR_TURN, CLOSE * NEAR_TURN):
            ideal = law.turned(turn.heading, side, near)
            off = turn_apart(turn.turned, ideal, turn.may_be_cut)
            far.append(max(0.0, off - (
                GOES_ON if abs(turn.turned) > abs(ideal) else FALLS_SHORT)))
    return min(far)


def begin_slowly(run: RunData, seen: Sequence[Turn]) -> bool:
    """Does each turn the long way round begin at the least speed? It does if a negative command is
    taken for too small a positive one."""
    return all(np.abs(run.commands.between(turn.begin, turn.begin + START).angular).max()
               < SLOW * abs(turn.peak) for turn in seen if abs(turn.turned) > math.pi)


def turns_of(run: RunData) -> List[Turn]:
    """The turns of a run, in order; those by the mouse, and those in which the IMU was lost, are
    left out."""
    commands = run.commands
    turning = (np.abs(commands.angular) > NO_SPEED) & (np.abs(commands.linear) <= NO_SPEED)
    found = []
    for first, after in stretches(turning, commands.time):
        rates = commands.angular[first:after]
        peak = float(rates[np.argmax(np.abs(rates))])
        if 'mouse_info' in run.devices and abs(peak) <= FASTEST_BY_MOUSE + NO_SPEED:
            continue
        begin = float(commands.time[first])
        last = float(commands.time[after - 1])
        following = min([*commands.time[after:after + 1], run.duration])
        is_stopped = following - last < COMMAND_TIMEOUT
        end = min(last + COMMAND_TIMEOUT + SETTLED, run.duration) if is_stopped else last
        later = np.flatnonzero(turning[after:])
        if len(later):
            end = min(end, float(commands.time[after + later[0]]))
        if following - begin < SHORTEST or was_lost(run.imu, begin, end):
            continue
        before, then = run.imu.yaw_at((begin, end))
        angle = math.nan if swings(run, begin, end) else float(then - before)
        found.append(Turn(begin, wrap(float(before)), angle, peak, False, is_stopped,
                          not is_stopped and np.ptp(rates) == 0.0))
    return found[:-1] + [found[-1]._replace(may_be_cut=True)] if found else []


def stretches(moves: np.ndarray, time: np.ndarray) -> List[Tuple[int, int]]:
    """Returns (first, after the last) of each stretch of commands that move, without a pause."""
    indices = np.flatnonzero(moves)
    pauses = (np.diff(indices) > 1) | (np.diff(time[indices]) > COMMAND_TIMEOUT)
    return [(int(part[0]), int(part[-1]) + 1)
            for part in np.split(indices, np.flatnonzero(pauses) + 1) if len(part)]
