"""The turns of a recorded run of the IMU lab, compared with those of mistaken robots.

A `Law` is one way in which a node computes the error of a turn; several may be the same mistake. A
bag does not have the letters: for each turn the letter is taken that fits better. A turn ends at a
zero on ``cmd_vel``.

Units: radians, left positive; rad/s; seconds since the recording's start.
"""
import math
from dataclasses import dataclass
from typing import Callable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from tb3_labs.geometry.angle_arrays import difference_degrees
from tb3_labs.geometry.angles import wrap
from tb3_labs.report.cause.diagnosed_drives import CLOSE, SETTLED, swings, turn_apart, was_lost
from tb3_labs.report.cause.mistakes import settled, unwrapped
from tb3_labs.report.motion.movements import FASTEST_BY_MOUSE, NO_SPEED
from tb3_labs.report.run_data import RunData
from tb3_labs.robot.turtlebot3 import COMMAND_TIMEOUT

#: A turn ends within NEAR_TURN of its goal [rad].
NEAR_TURN = math.radians(10.0)
#: A robot goes on after the end of its turn, and may fall short of it a little [rad].
GOES_ON, FALLS_SHORT = math.radians(22.0), math.radians(4.0)
#: A robot that goes left and right does so within SWINGS_AT of where its node holds it [rad].
SWINGS_AT = math.radians(35.0)
#: A shorter turn is a zero of another sender, not the end of a turn [s].
SHORTEST = 0.15
#: A faster command comes from a node without an upper limit: the lab's is 1.5 [rad/s].
TOO_FAST = 1.55
#: A turn that goes round because a clamp is missing begins with a rate below SLOW times its peak,
#: for AT_START [s].
SLOW, AT_START = 0.7, 0.5


class Turn(NamedTuple):
    """A recorded turn. `turned` is NaN if it went left and right; `peak`: of the commands. A
    person may have ended the last one of a node. `is_persons`: one rate, without a letter before it
    and a zero at its end. `sides`: 1.0 for l, -1.0 for r; both if the letter is not known.
    `centre`: the angle about which it went left and right, in its second half."""

    begin: float
    heading: float
    turned: float
    peak: float
    may_be_cut: bool = False
    is_stopped: bool = True
    is_persons: bool = False
    sides: Tuple[float, ...] = (1.0, -1.0)
    centre: float = math.nan


@dataclass(frozen=True)
class Law:
    """The error of a turn by the IMU's heading, in degrees as the handout has it.

    `goal_wraps`, `error_wraps`: does the node wrap a value below the range, and one above it?
    `reading`: the heading that the node reads [deg], by the true one. `quarter`: the angle that it
    adds for a turn to the left. `command`: the error that it turns by, of (error, side). `kept`:
    the goal of all turns, if it never changes [deg]. `leaps`: is it chance when a turn ends that
    goes left and right, since the heading leaps? `ends`: does a turn end at its goal?
    """

    mistake: str = ''
    goal_wraps: Tuple[bool, bool] = (True, True)
    error_wraps: Tuple[bool, bool] = (True, True)
    reading: Callable[[float], float] = unwrapped
    quarter: float = 90.0
    command: Callable[[float, float], float] = lambda error, side: error
    kept: Optional[float] = None
    leaps: bool = False
    ends: bool = True

    def goal(self, heading: float, side: float) -> float:
        """The goal of a turn from `heading`, both [deg]; `side`: 1 left, -1 right."""
        if self.kept is not None:
            return self.kept
        goal = self.reading(heading) + side * self.quarter
        goal += 360.0 * (self.goal_wraps[0] and goal < 0.0)
        return goal - 360.0 * (self.goal_wraps[1] and goal > 360.0)

    def error(self, goal: float, heading: float, side: float) -> float:
        """The error at a heading from 0 to 360, all [deg]."""
        error = goal - self.reading(heading)
        error += 360.0 * (self.error_wraps[0] and error < -180.0)
        error -= 360.0 * (self.error_wraps[1] and error > 180.0)
        return self.command(error, side)

    def turned(self, heading: float, side: float, near: float = NEAR_TURN) -> Tuple[float, bool]:
        """(The angle by which the robot turns from `heading`, both [rad]; does it go left and right
        there without an end?)."""
        goal = self.goal(math.degrees(heading) % 360.0, side)
        angle, swings = settled(lambda yaw: math.radians(self.error(
            goal, math.degrees(yaw) % 360.0, side)), heading, near)
        return angle, swings or not self.ends


def signed(heading: float) -> float:
    """The heading from -180 to 180 [deg]."""
    return difference_degrees(heading, 0.0)


def by_letter(error: float, side: float) -> float:
    """The error of a node that turns to the letter's side, whatever the error's sign."""
    return abs(error) * side


LAWS = (
    Law(),
    Law(quarter=180.0),    # the lab is also given with half turns
    Law('error_not_wrapped', error_wraps=(False, False)),
    Law('error_not_wrapped', error_wraps=(False, True)),
    Law('error_not_wrapped', error_wraps=(True, False)),
    Law('goal_not_wrapped', (False, False), (False, False)),
    Law('goal_not_wrapped', (False, False), (False, False), reading=signed),
    Law('goal_not_wrapped', (False, True), (False, False), command=by_letter),
    Law('goal_not_wrapped', (True, False), (False, False), command=by_letter),
    Law('no_negative_clamp', command=lambda error, side: abs(error)),
    # a heading that stays; in radians it hardly changes; numbers in another order may mirror it
    Law('heading_kept', reading=lambda heading: 0.0),
    Law('radians', reading=lambda heading: math.radians(signed(heading)) % 360.0),
    Law('radians', quarter=math.pi / 2.0),
    Law('quaternion_order', reading=lambda heading: 180.0),
    Law('swapped', quarter=-90.0),
    Law('sign', command=lambda error, side: -error), Law('goal_kept', kept=0.0),
    Law('never_ends', ends=False),
    Law('degrees_twice', reading=lambda heading: math.degrees(signed(heading)), leaps=True),
    Law('quaternion_order', reading=lambda heading: (180.0 - heading) % 360.0))


def apart(law: Law, turn: Turn) -> float:
    """The distance of a turn from that of a law, for the letter that fits better [rad]."""
    far = []
    for side in turn.sides:
        for near in (NEAR_TURN, CLOSE * NEAR_TURN):
            ideal, swings = law.turned(turn.heading, side, near)
            if swings and (math.isnan(turn.turned) or law.leaps or turn.may_be_cut):
                at = turn.centre if math.isnan(turn.turned) else turn.turned
                far.append(max(0.0, abs(at - ideal) - SWINGS_AT))
                continue
            off = turn_apart(turn.turned, math.nan if swings else ideal, turn.may_be_cut)
            if math.isinf(ideal) and law.goal_wraps != (True, True) and (
                    abs(turn.turned) > 2.0 * math.pi):      # it met its goal by chance
                off = min(off, abs(wrap(turn.turned - math.radians(side * law.quarter))))
            far.append(max(0.0, off - (
                GOES_ON if abs(turn.turned) > abs(ideal) else FALLS_SHORT)))
    return min(far)


def begin_slowly(run: RunData, seen: Sequence[Turn]) -> bool:
    """Does each turn the long way round begin at the least speed? It does if a negative command is
    taken for too small a positive one."""
    return all(np.abs(run.commands.between(turn.begin, turn.begin + AT_START).angular).max()
               < SLOW * abs(turn.peak) for turn in seen if abs(turn.turned) > math.pi)


def turns_of(run: RunData) -> List[Turn]:
    """The turns of a run, in order; those by the mouse, those in which the IMU was lost, and, if
    the letters are known, those without one are left out. One that goes on when the next letter is
    typed was cut; without letters the last one may have been."""
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
        centre = float(run.imu.yaw_at(np.linspace((begin + end) / 2.0, end)).mean() - before)
        typed = int(np.searchsorted(run.letters.time, begin, side='right'))
        sides = tuple(run.letters.value[:typed][-1:])
        if len(run.letters) and not any(sides):
            continue
        found.append(Turn(begin, wrap(float(before)), angle, peak,
                          bool((run.letters.time[typed:] < following).any()), is_stopped,
                          not (sides or is_stopped or np.ptp(rates)), sides or (1.0, -1.0),
                          centre))
    if found and not len(run.letters):
        found[-1] = found[-1]._replace(may_be_cut=True)
    return found


def stretches(moves: np.ndarray, time: np.ndarray) -> List[Tuple[int, int]]:
    """Returns (first, after the last) of each stretch of commands that move, without a pause."""
    indices = np.flatnonzero(moves)
    pauses = (np.diff(indices) > 1) | (np.diff(time[indices]) > COMMAND_TIMEOUT)
    return [(int(part[0]), int(part[-1]) + 1)
            for part in np.split(indices, np.flatnonzero(pauses) + 1) if len(part)]
